// SPDX-License-Identifier: GPL-3.0-or-later
// Innermost loops over one axis of one level of a CompositeGrid, in vectors of 8 nodes along x.
//
// Arrays are those of a level: one float a node, rows along x padded to a multiple of 8. Rows beside a
// level's rows, and nodes beside a row's nodes, may be read: their links have weight 0. Smoothing and
// residual are in row_kernels.cpp, bounds and multipliers in constraint_kernels.cpp, line searches in
// line_search_kernels.cpp.
#pragma once

#include <array>
#include <cstddef>
#include <cstring>

#include "voxel/lattice/simd8.h"
#include "voxel/lattice/simd_dispatch.h"

namespace voxel::composite {

inline constexpr float kNoBound = -1e30F;  // value of a bound array where there is no bound
inline constexpr int kMaxVectors = 80;     // vectors of a row, at most

// By lane of a row: 0 for the lanes first … last, which a finer patch covers, else 1. None is covered if last
// < first.
using RowMask = std::array<float, static_cast<std::size_t>(kMaxVectors* kLanes)>;
[[nodiscard]] inline RowMask uncovered_lanes(int first, int last, int vectors) {
  RowMask mask;
  for (int i = 0; i < vectors * kLanes; ++i)
    mask[static_cast<std::size_t>(i)] = i >= first && i <= last ? 0.0F : 1.0F;
  return mask;
}

// One axis of one level, from its first row on.
struct LevelView {
  float* u;
  const float* f;                      // load (N); null: 0
  const float *lower, *negated_upper;  // least u, least −u; null: no such bounds
  // Written by residual_of_level(). A node is active if it is at its bound and pulled against the bound. It
  // is free if it may move and is not active. is_free and is_active hold 1 or 0.
  float *residual, *is_free, *is_active;
  // active_stiffness: of the spring that active nodes of finer levels add to a node. inverse_with_active: 1 /
  // (diagonal + active_stiffness); null: there are no such springs.
  float *active_stiffness, *inverse_with_active;
  std::array<const float*, 3> weight;  // [d] of the link to the next node along d (unit: link between voxels)
  const float *inverse_diagonal, *diagonal;  // of the stiffness matrix; inverse 0: the node does not move
  std::array<float, 3> spring;               // [d] of a link between voxels (N/m)
  std::array<int, 3> first, last;            // unknowns
  std::size_t stride, plane;                 // to the next node along y, along z
};

// ---- row_kernels.cpp ----

// One projected Gauss-Seidel sweep: each node moves to the minimum of its energy within its bounds. Rows are
// swept in two colours of (j + k), the nodes of a row in two colours of i.
void smooth_level(const LevelView& view) noexcept;
// residual = f − K u. Also sets is_free and is_active. The residual is 0 for fixed and for active nodes.
// Active nodes take no correction from coarser levels either.
void residual_of_level(const LevelView& view) noexcept;
// Sets active_stiffness. To a free node's value it adds a share of the stiffness of the node's links to
// active nodes. Other nodes get 0.
void find_active_stiffness(const LevelView& view) noexcept;
// Adds a spring of active_stiffness that holds each node at its present u. Updates f and sets
// inverse_with_active.
void add_active_stiffness(const LevelView& view, float* f) noexcept;
// residual = −K u on the nodes first … last, both included; without f and bounds.
void link_forces_of_level(const LevelView& view, const std::array<int, 3>& first,
                          const std::array<int, 3>& last) noexcept;

// ---- constraint_kernels.cpp ----

// A limit of the links along one direction.
struct LimitOfLinks {
  float all_m;           // of all links, unless `at_node` is set (m)
  const float* at_node;  // limit of the tissue at each node, as a share of the spacing. A link has the mean
                         // of its two ends. Null: all links are alike.
  float half_length_m;   // half of the length of a link
};
// Limit of the link from node n to the node `by` floats further on (m). by = 0: of a link in the tissue round
// n.
[[nodiscard]] inline float limit_at(const LimitOfLinks& limit, std::size_t n, std::size_t by) {
  if (limit.at_node == nullptr) return limit.all_m;
  return limit.half_length_m * (limit.at_node[n] + limit.at_node[n + by]);
}
// Multipliers of the links along one direction. The limit ratio of a link is its change of length divided by
// its limit. At the limit the ratio is 1.
struct LinkMultiplier {
  LimitOfLinks longer, shorter;
  float tolerance;   // links with a ratio of 1 ± this are at the limit
  float max_factor;  // upper bound of limited weight / weight
};
// Largest limit ratio of the links from nodes to the nodes `by` floats further on.
[[nodiscard]] float largest_limit_ratio(const float* u, const float* weight, std::size_t by,
                                        const LinkMultiplier& limit, std::size_t count) noexcept;
// Updates `limited`, the weights of links with their multipliers. Returns the largest limited / weight, >= 1.
float update_row_weights(const float* u, const float* weight, std::size_t by, const LinkMultiplier& limit,
                         float* limited, std::size_t count) noexcept;
// The same update of a single link.
[[nodiscard]] float updated_weight(float limited, float weight, float limit_ratio,
                                   const LinkMultiplier& limit) noexcept;

// Lower bounds of one axis of one level, from its first row on, and a box of its nodes. For a link from a
// node up to the next one along d: bound(next) >= bound − fall_up[d] and bound >= bound(next) − fall_down[d].
struct BoundSweep {
  float* bound;
  std::array<const float*, 3> weight;  // [d] as in LevelView; 0: no link
  std::array<LimitOfLinks, 3> fall_up, fall_down;
  std::array<int, 3> low, high;  // nodes of the box, both included
  std::size_t stride, plane;
};
// Raises each bound in the box as far as its links require: along x in both directions, then y, then z.
void sweep_bounds(const BoundSweep& sweep) noexcept;
// The largest |u|.
[[nodiscard]] float largest_size(const float* u, std::size_t count) noexcept;
// Moves a node onto its bound if it lies beyond the bound, or if `at_bound` marks it as at that bound and the
// bound has receded by at most `recedes_m`.
void follow_bounds(float* u, const float* at_bound, const float* lower, const float* negated_upper,
                   float recedes_m, std::size_t count) noexcept;
// at_bound: 1 at the lower bound, −1 at the upper bound, else 0.
void note_at_bound(float* at_bound, const float* u, const float* lower, const float* negated_upper,
                   std::size_t count) noexcept;

// Sum of the forces (N) of the bounds that hold nodes, over the unknowns that are not strictly within the
// finer patch (as for mode_response()). view.residual must hold −K u.
[[nodiscard]] double force_of_bounds(const LevelView& view, const std::array<int, 3>& finer_first,
                                     const std::array<int, 3>& finer_last) noexcept;

// ---- line_search_kernels.cpp ----

// The part of u that its bounds do not prescribe. For u > 0 it is u − max(lower bound, 0), at most upper
// bound − u, and at least 0. So it is 0 at either bound. u < 0 is the mirror image.
void beyond_bounds(const float* u, const float* lower, const float* negated_upper, float* beyond,
                   std::size_t count) noexcept;
// Force of links and loads along `mode` (J per unit of the mode) and stiffness along it, summed over the
// unknowns that are not strictly within the finer patch, finer_first … finer_last (last < first: there is no
// finer patch).
struct ModeResponse {
  double force = 0.0, stiffness = 0.0;
};
ModeResponse mode_response(const LevelView& view, const float* mode, const std::array<int, 3>& finer_first,
                           const std::array<int, 3>& finer_last) noexcept;
// u += by · mode, within the bounds.
void step_along_mode(float* u, const float* mode, float by, const float* lower, const float* negated_upper,
                     std::size_t count) noexcept;
// u is `before` plus a correction. If more than half of the correction lies beyond the energy minimum along
// it, the correction is shortened towards that minimum. `before` becomes scratch.
void shorten_correction(const LevelView& view, float* before) noexcept;

}  // namespace voxel::composite
