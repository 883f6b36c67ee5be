// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/composite/grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace voxel {
namespace {

using composite::index;

constexpr int kCoarsest = 5;               // nodes along the longest edge of the coarsest level, at most
constexpr std::size_t kMaxPressed = 2048;  // voxels in pressed_ at most; press() ignores further ones
// By how much a bound recedes in one cycle if it is still that of the same contact. A surface that moves by 1
// recedes by at most kSteepest along the largest component of its normal. A bound on an oblique surface also
// moves as its node settles on it, by kSettles spacings at most.
constexpr double kSteepest = std::numbers::sqrt3, kSettles = 0.02;

}  // namespace

// Does the whole object fit in a patch of this level, or does it have no more nodes than a patch of the usual
// width?
bool CompositeGrid::can_cover(std::size_t l) const {
  const auto patch = index(2 * half_width_of(l) + 1), usual = index(2 * coarse_half_width_ + 1);
  bool fits = true;
  std::size_t nodes = 1;
  for (std::size_t d = 0; d < 3; ++d) {
    const auto across = index(whole_range(1 << l, d).count(1 << l));
    fits = fits && across <= patch;
    nodes *= across;
  }
  return fits || nodes <= usual * usual * usual;
}

CompositeGrid::CompositeGrid(const Lattice& lattice, int half_width, int coarse_half_width)
    : lattice_(lattice),
      material_(lattice),
      half_width_(half_width == kRefineAll ? kRefineAll : std::max((half_width + 1) / 2 * 2, kHalfWidth)),
      coarse_half_width_(std::max((coarse_half_width + 1) / 2 * 2, kHalfWidth)) {
  const auto& dims = lattice.grid().dims;
  const std::uint8_t reference = lattice.label(lattice.surface().front());
  for (int d = 0; d < 3; ++d) {
    const Spring& spring = lattice.spring_within(reference, d);
    for (int axis = 0; axis < 3; ++axis) {
      spring_N_per_m_[index(d)][index(axis)] = spring.on(axis, d);
      auto& limits = limit_m_[index(d)][index(axis)];
      limits.fill({std::numeric_limits<float>::max(), 0.0F});
      for (std::size_t label = 1; label < 256; ++label) {
        const auto of = static_cast<std::uint8_t>(label);
        if (lattice.material_of(of) == 0) continue;
        const LinkLimit& limit = lattice.limit_between(of, of, d);
        const std::array<float, 2> sides = axis == d
                                               ? std::array<float, 2>{-limit.along_low, limit.along_high}
                                               : std::array<float, 2>{limit.across, limit.across};
        for (std::size_t side = 0; side < 2; ++side) {
          limits[side].tightest = std::min(limits[side].tightest, sides[side]);
          limits[side].widest = std::max(limits[side].widest, sides[side]);
        }
      }
    }
  }
  pressed_.reserve(kMaxPressed);
  while (half_width_ != kRefineAll && !can_cover(covering_level_)) ++covering_level_;
  const int largest = *std::max_element(dims.begin(), dims.end());
  std::size_t count = covering_level_ + 1;
  while (((largest - 2) >> (count - 1)) + 2 > kCoarsest) ++count;
  levels_.resize(count);
  for (std::size_t l = 0; l < count; ++l) allocate(levels_[l], l);
  if (covering_level_ > 0) allocate_for_moves();
  // Scratch of weigh(): one plane of half cells. Along each axis there are two half cells for each node, and
  // one more at each end.
  std::size_t most = 0, most_nodes = 0, most_floats = 0;
  for (const Level& level : levels_) {
    for (const AxisNodes& axis : level.nodes) most = std::max(most, axis.coarse.size());
    most_floats = std::max(most_floats, level.u[0].size());
    most_nodes =
        std::max(most_nodes, (level.nodes[0].coarse.size() + 2) * (level.nodes[1].coarse.size() + 2) *
                                 (level.nodes[2].coarse.size() + 2));
  }
  for (HalfCells& plane : half_cells_) {
    plane.cells.reserve((2 * most + 2) * (2 * most + 2));
    for (Floats& axis : plane.stiffness)
      axis.reserve(material_.is_heterogeneous() ? plane.cells.capacity() : 0);
  }
  material_.reserve_planes(2 * most + 2);
  use_bricks();
  for (Floats& array : bricks_.forces) array.resize(has_bricks_ ? most_floats : 0);
  is_tissue_node_.resize(most_nodes);
  faces_of_cell_.resize(material_.has_scattered_anchors() ? most_floats : 0);
  for (auto& sides : anchor_faces_) {
    for (AnchorFaces& faces : sides) {
      for (Floats* const array :
           {&faces.count, &faces.in_link, &faces.distance, &faces.constriction, &faces.stiffness})
        array->resize(material_.has_scattered_anchors() ? most_floats : 0);
    }
  }
  begin({dims[0] / 2, dims[1] / 2, dims[2] / 2});
}

void CompositeGrid::fine_patch(Index3& low, Index3& high) const noexcept {
  const auto& nodes = levels_[0].nodes;
  for (std::size_t d = 0; d < 3; ++d) {
    low[d] = std::max(nodes[d].begin + nodes[d].first - material_.offset()[d], 0);
    high[d] = std::min(nodes[d].begin + nodes[d].last - material_.offset()[d], lattice_.grid().dims[d] - 1);
  }
}

bool CompositeGrid::in_fine_patch(const Index3& voxel) const noexcept {
  const Index3 p = shifted(voxel);
  const Level& level = levels_[0];
  for (std::size_t d = 0; d < 3; ++d) {
    const int i = p[d] - level.nodes[d].begin;
    if (i < level.nodes[d].first || i > level.nodes[d].last) return false;
  }
  return level.inverse_diagonal[0][fine_node(voxel)] != 0.0F;
}

std::size_t CompositeGrid::fine_node(const Index3& voxel) const {
  const Index3 p = shifted(voxel);
  const Level& level = levels_[0];
  return level.node(p[0] - level.nodes[0].begin, p[1] - level.nodes[1].begin, p[2] - level.nodes[2].begin);
}

glm::dvec3 CompositeGrid::fine_at(const Index3& voxel) const noexcept {
  const std::size_t n = fine_node(voxel);
  return {levels_[0].u[0][n], levels_[0].u[1][n], levels_[0].u[2][n]};
}

void CompositeGrid::set_fine(const Index3& voxel, const glm::dvec3& u) noexcept {
  const std::size_t n = fine_node(voxel);
  for (std::size_t a = 0; a < 3; ++a) levels_[0].u[a][n] = static_cast<float>(u[static_cast<int>(a)]);
}

glm::dvec3 CompositeGrid::minimum_at(const Level& level, std::size_t n) const noexcept {
  glm::dvec3 place(0.0);
  for (std::size_t a = 0; a < 3; ++a) {
    const auto& weight = weights_on(level, a);
    double sum = 0.0;
    for (std::size_t d = 0; d < 3; ++d) {
      const std::size_t by = level.stride_along(d);
      sum += static_cast<double>(spring_N_per_m_[d][a] * (weight[d][n] * level.u[a][n + by] +
                                                          weight[d][n - by] * level.u[a][n - by]));
    }
    if (has_bricks_) sum += static_cast<double>(level.brick_load[a][n]);
    place[static_cast<int>(a)] = sum * static_cast<double>(level.inverse_diagonal[a][n]);
  }
  return place;
}

glm::dvec3 CompositeGrid::unconstrained_minimum(const Index3& voxel) const noexcept {
  return minimum_at(levels_[0], fine_node(voxel));
}

glm::dvec3 CompositeGrid::compliance(const Index3& voxel) const noexcept {
  const std::size_t n = fine_node(voxel);
  return {levels_[0].inverse_diagonal[0][n], levels_[0].inverse_diagonal[1][n],
          levels_[0].inverse_diagonal[2][n]};
}

glm::dvec3 CompositeGrid::clamp_to_anchors(const Index3& voxel, const glm::dvec3& u) const noexcept {
  if (!chains_.empty()) return clamp_to_chains(voxel, u);
  glm::dvec3 result = u;
  const auto& dims = lattice_.grid().dims;
  for (std::size_t d = 0; d < 3; ++d) {
    for (const std::size_t end : {std::size_t{0}, std::size_t{1}}) {
      if (material_.anchored_share(d, end) < 1.0) continue;
      const int links = end == 1 ? dims[d] - 1 - voxel[d] : voxel[d];
      for (std::size_t a = 0; a < 3; ++a) {
        // The extension of the chain of links is u above the low face, and −u below the high face.
        const double shorter = links * static_cast<double>(limit_m_[d][a][0].widest),
                     longer = links * static_cast<double>(limit_m_[d][a][1].widest);
        double& at = result[static_cast<int>(a)];
        at = std::clamp(at, end == 1 ? -longer : -shorter, end == 1 ? shorter : longer);
      }
    }
  }
  return result;
}

void CompositeGrid::reserve_like(const CompositeGrid& original) {
  const auto reserve = [](auto& list, const auto& like) { list.reserve(like.capacity()); };
  for (std::size_t l = 0; l < levels_.size(); ++l) {
    const Level& like = original.levels_[l];
    reserve(levels_[l].ghosts, like.ghosts);
    reserve(levels_[l].ghost_neighbours, like.ghost_neighbours);
    reserve(levels_[l].correction_springs, like.correction_springs);
    reserve(levels_[l].obstacle_nodes, like.obstacle_nodes);
  }
  reserve(pressed_, original.pressed_);
  reserve(beside_rigid_, original.beside_rigid_);
  reserve(obstacle_bounds_, original.obstacle_bounds_);
  reserve(supporting_bounds_, original.supporting_bounds_);
}

void CompositeGrid::find_chains_to_anchors() {
  if (material_.has_scattered_anchors() || material_.has_own_limits()) chains_ = chains_to_anchors(lattice_);
}

glm::dvec3 CompositeGrid::clamp_to_chains(const Index3& voxel, const glm::dvec3& u) const noexcept {
  const std::uint32_t s = lattice_.surface_number(lattice_.at(voxel[0], voxel[1], voxel[2]));
  if (s >= chains_.size()) return u;
  glm::dvec3 result = u;
  for (std::size_t a = 0; a < 3; ++a) {
    double& at = result[static_cast<int>(a)];
    at = std::clamp(at, -static_cast<double>(chains_[s][a][0]), static_cast<double>(chains_[s][a][1]));
  }
  return result;
}

void CompositeGrid::clear_pressed(double moved_m) noexcept {
  pressed_.clear();
  recedes_m_ = static_cast<float>(kSteepest * moved_m + kSettles * lattice_.min_spacing_m());
}

void CompositeGrid::press(const Index3& voxel, const glm::dvec3& u, const glm::dvec3& normal) noexcept {
  if (pressed_.size() == kMaxPressed) return;
  const Index3 p = shifted(voxel);
  const auto& nodes = levels_[0].nodes;
  pressed_.push_back({{p[0] - nodes[0].begin, p[1] - nodes[1].begin, p[2] - nodes[2].begin},
                      glm::vec3(u),
                      glm::vec3(normal)});
}

}  // namespace voxel
