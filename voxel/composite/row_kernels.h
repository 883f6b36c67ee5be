// SPDX-License-Identifier: GPL-3.0-or-later
// Innermost loops of a composite grid, in octets of nodes along x.
#pragma once

#include <array>
#include <cstddef>
#include <cstring>

#include "voxel/lattice/simd8.h"
#include "voxel/lattice/simd_dispatch.h"

namespace voxel::composite {

inline constexpr float kNoBound = -1e30F;  // no bound
inline constexpr int kMaxOctets = 80;  // of a row

// One axis of one level. Rows beside a box's, and nodes beside a row's, may be read: links there are worth 0.
struct LevelView {
  float* u;
  const float* f;                      // null: 0
  const float *least, *most_negative;  // bounds; null: none
  // 1 or 0: a node does what coarser levels say; it does not, because it is pulled against its bound.
  float *residual, *is_free, *is_active;
  float *active_stiffness, *inverse_with_active;           // a spring to where it was, and 1 / Σ springs with that; null: none
  std::array<const float*, 3> link;  // [d] of the link up, without springs
  const float *inverse, *all;
  std::array<float, 3> spring;
  std::array<int, 3> first, last;
  std::size_t stride, plane;
};

// Each node to the minimum of its energy given all others, within its bounds; every second row first, and in
// a row every second node.
void smooth_level(const LevelView& view) noexcept;
// What is left of f; 0 for what does not move, and for what is pulled against the bound that holds it: that
// does not follow coarser levels either.
void residual_of_level(const LevelView& view) noexcept;
// What nodes that follow are tied with to those that are stuck, and what they are dragged by: into drag.
void find_active_stiffness(const LevelView& view) noexcept;
// From now on a node's drag holds it where it is.
void add_active_stiffness(const LevelView& view, float* f) noexcept;
// Of these rows, without f and bounds: what links pull with.
void link_forces_of_level(const LevelView& view, const std::array<int, 3>& first,
                    const std::array<int, 3>& last) noexcept;

// Links up to a node `by` further on, and how far they are to their limits: 1 at one.
struct LinkMultiplier {
  float per_longer, per_shorter;  // (1/m)
  float tolerance, max_factor;
};
[[nodiscard]] float largest_limit_ratio(const float* u, const float* link, std::size_t by, const LinkMultiplier& limit,
                                  std::size_t count) noexcept;
// What each link is worth, `link` without limits and `held` at them; and how much stiffer the stiffest is.
float update_row_weights(const float* u, const float* link, std::size_t by, const LinkMultiplier& limit, float* held,
                    std::size_t count) noexcept;
[[nodiscard]] float updated_weight(float held, float link, float of_limit, const LinkMultiplier& limit) noexcept;

// What a bound held, or goes beyond, goes along with it.
void follow_bounds(float* u, const float* held, const float* least, const float* most_negative,
                   std::size_t count) noexcept;
// 1: at its least, −1: at its most.
void note_at_bound(float* held, const float* u, const float* least, const float* most_negative,
               std::size_t count) noexcept;

// How far nodes are beyond what their bounds ask of them, towards where they have gone: 0 for what is held.
void beyond_bounds(const float* u, const float* least, const float* most_negative, float* beyond,
                   std::size_t count) noexcept;
// Of a level's own nodes, without those strictly within the finer box (`finer` first … last, where it has
// any): how hard links pull them along `mode` (J per unit of it), and how stiff they are there.
struct ModeResponse {
  double pull = 0.0, stiffness = 0.0;
};
ModeResponse mode_response(const LevelView& view, const float* mode, const std::array<int, 3>& finer_first,
                 const std::array<int, 3>& finer_last) noexcept;
// … and there they go, within their bounds.
void step_along_mode(float* u, const float* mode, float by, const float* least, const float* most_negative,
              std::size_t count) noexcept;
// A level has just gone from `before` to u. Where that is so far that its energy grew, back to where it is
// least on the way. `before` becomes scratch.
void shorten_correction(const LevelView& view, float* before) noexcept;

}  // namespace voxel::composite
