// SPDX-License-Identifier: GPL-3.0-or-later
// One level of a CompositeGrid (grid.h): its nodes, their links and displacements.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "voxel/composite/brick_forces.h"

namespace voxel::composite {

using Index3 = std::array<int, 3>;  // voxel (i, j, k), node or cube
using Floats = std::vector<float>;
inline constexpr std::size_t kPad = 8;  // floats before the first row

inline constexpr int kOutside = -2;  // value in AxisNodes::fine
// Nodes of a level along one axis, and the one-dimensional transfer to the next coarser level.
struct AxisNodes {
  int count = 0, begin = 0;                  // nodes; coordinate of the first
  int first = 0, last = -1;                  // first and last unknown
  bool open_low = false, open_high = false;  // the patch ends within the object
  // By node: the coarse node at or before it; the weight of the next coarse node (0 or 0.5).
  std::vector<int> coarse;
  std::vector<float> weight_after;
  // `coarse` and `weight_after` for whole rows along x: lane i lies at or after the coarse lane base + (i +
  // odd) / 2.
  int base = 0;
  bool odd = false;
  std::vector<float> lane_weight;
  // By coarse node: index of this level's node at the same place. −1 or `count`: that place is one node
  // beyond an end of this patch. kOutside: it is further away.
  std::vector<int> fine;
  int coarse_first = 0, coarse_last = -1;  // coarse nodes strictly within this patch
  // By coarse node: restriction weights of the nodes before, at and after it.
  std::vector<float> restrict_low, restrict_own, restrict_high;
};
// The anchor faces (CoarseMaterial::AnchorFace) that hold each node from one side. By node: their number; the
// number of those that lie within a link, not in the plane of the node; the sum over all of them of the
// distance from anchored voxel to node (voxels); the sum of constriction_of_face(); the sum of
// the stiffness of their cells, relative to the reference.
struct AnchorFaces {
  Floats count, in_link, distance, constriction, stiffness;
};
// Springs that hold a node at its present displacement, beside the springs of its links. Without these
// springs corrections would move the node too far. weight [d]: stiffness relative to a link between two
// voxels.
struct CorrectionSpring {
  std::uint32_t node;
  std::array<float, 3> weight;
};
// A node outside the tissue, with nodes of the tissue beside it: ghost_neighbours[first … first + count −
// 1]. It takes the mean of their values, weighted by their stiffness.
struct Ghost {
  std::uint32_t at, first, count;
};
// A node beside a rigid surface, and the surface voxel whose obstacle applies to it.
struct ObstacleNode {
  Index3 node;
  std::size_t number;
  Index3 voxel;
  std::uint32_t surface;
};
// A level of nodes. Arrays have one float a node. Rows along x are padded to a multiple of 8 and begin at
// row().
struct GridLevel {
  int step = 1;  // voxels between two nodes
  int log2_step = 0;
  bool is_built = false;  // built with the present offset of coordinates
  bool moved = false;     // nodes may have moved since put_to_rest()
  std::array<AxisNodes, 3> nodes;
  std::size_t stride = 8, plane = 0;
  // [axis] u: displacement (m). at_bound: 1 at the lower bound, −1 at the upper bound, else 0.
  std::array<Floats, 3> u, at_bound;
  // [d] Stiffness of the link to the next node, and of links to anchors, relative to a link between two
  // voxels.
  std::array<Floats, 3> weight, anchor_weight;
  // Only where tissues differ. shape_weight [d]: the weight if all tissue had the reference stiffness.
  // anchor_distance [d]: voxels to the anchor, negative if the anchor is behind the node. limited_…[axis][d]:
  // the weights with the multipliers of links at their limits (link_limits.cpp).
  std::array<Floats, 3> shape_weight, anchor_distance;
  std::array<std::array<Floats, 3>, 3> limited_weight, limited_anchor_weight;
  // Only where limits differ. Mean of the limits of the tissue round each node
  // (CoarseMaterial::TissueLimits).
  std::array<Floats, 3> limit;
  // Only with the accurate energy (brick_loads.cpp). brick_modulus: of the cell above a node on all axes,
  // relative to the reference. brick_strain: mean strains that follow those of the cell (DeferredBrick).
  // [axis] brick_load: force of bricks beyond that of links (N).
  Floats brick_modulus;
  std::array<Floats, DeferredBrick::kStrains> brick_strain;
  std::array<Floats, 3> brick_load;
  std::array<Floats, 3> inverse_diagonal, diagonal;  // [axis] of the stiffness matrix; inverse 0: fixed
  // Of the axis that the cycle is solving (LevelView). restricted_u: u before the level was smoothed.
  Floats f, restricted_u, residual, is_free, is_active, active_stiffness, inverse_with_active;
  std::array<Floats, 2> bound;  // of the same axis; 0: least u, 1: least −u
  std::array<bool, 2> bounded{};
  bool has_active_stiffness = false;  // from active nodes of finer levels; of the same axis
  bool has_anchors = false;           // some node has an anchor weight
  bool has_gaps = false;              // some link within the patch is missing
  std::vector<Ghost> ghosts;
  struct GhostNeighbour {
    std::uint32_t node;
    float weight;  // those of a ghost sum to 1
  };
  std::vector<GhostNeighbour> ghost_neighbours;
  std::vector<CorrectionSpring> correction_springs;
  std::vector<ObstacleNode> obstacle_nodes;
  std::vector<std::uint32_t> obstacle_of;  // [node] 1 + index into obstacle_nodes; 0: none
  [[nodiscard]] std::size_t row(int j, int k) const {
    return plane + stride + kPad + static_cast<std::size_t>(k) * plane + static_cast<std::size_t>(j) * stride;
  }
  [[nodiscard]] std::size_t first_row() const { return row(0, 0); }
  [[nodiscard]] std::size_t floats() const { return static_cast<std::size_t>(nodes[2].count) * plane; }
  [[nodiscard]] std::size_t node(int i, int j, int k) const {
    return row(j, k) + static_cast<std::size_t>(i);
  }
  [[nodiscard]] std::array<int, 3> node_of(std::size_t number) const {  // number: from first_row() on
    return {static_cast<int>(number % stride), static_cast<int>(number % plane / stride),
            static_cast<int>(number / plane)};
  }
  // Distance in memory from a node to the next one along d (values).
  [[nodiscard]] std::size_t stride_along(std::size_t d) const { return d == 0 ? 1 : d == 1 ? stride : plane; }
  [[nodiscard]] int at(std::size_t d, int i) const { return nodes[d].begin + step * i; }
};

}  // namespace voxel::composite
