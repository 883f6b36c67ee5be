// SPDX-License-Identifier: GPL-3.0-or-later
// Steps of a pressed voxel in the tool's tangent plane.
#include "voxel/multigrid/tangential_contact.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "voxel/lattice/voxel_links.h"

namespace voxel {
namespace {

// True if its links allow a voxel to move by `way`, which is tangential. Otherwise the voxel has to stay: if
// its motion were clamped on one axis, it would leave the tool or enter it.
bool allowed(LevelStiffness& couplings, const Displacement& state, VoxelId v,
             const glm::dvec3& way) noexcept {
  const glm::dvec3 wanted = state.at(v) + way;
  for (int axis = 0; axis < 3; ++axis) {
    const auto interval = link_interval(couplings.lattice(), state, v, axis);
    const auto to = static_cast<float>(wanted[axis]);
    if (to < interval[0] || to > interval[1]) return false;
  }
  return true;
}

glm::dvec3 along(const Displacement& state, const Lattice& lattice, VoxelId v, const glm::dvec3& way) {
  const glm::dvec3 n(state.tool_normal[lattice.surface_number(v)]);
  return way - glm::dot(way, n) * n;
}

float size_of(const glm::dvec3& way) {
  return static_cast<float>(std::max({std::fabs(way.x), std::fabs(way.y), std::fabs(way.z)}));
}

// Force on a voxel, and its motion to the least energy in the tangent plane, in the metric of the springs.
struct Slide {
  glm::dvec3 force_N, way_m;
};
Slide slide_of(LevelStiffness& couplings, const Displacement& state, VoxelId v, const glm::dvec3& load_N) {
  const glm::dvec3 n(state.tool_normal[couplings.lattice().surface_number(v)]);
  const glm::dvec3 w = link_compliance(couplings, v), force = link_force(couplings, state, v) + load_N;
  const glm::dvec3 wn = w * n;
  const double denominator = glm::dot(n, wn);
  return {force, denominator > 0.0 ? w * force - (glm::dot(wn, force) / denominator) * wn : glm::dvec3(0.0)};
}

}  // namespace

std::optional<glm::dvec3> sliding_force(LevelStiffness& couplings, const Displacement& state, VoxelId v,
                                        const glm::dvec3& load_N) noexcept {
  const Slide to = slide_of(couplings, state, v, load_N);
  if (!allowed(couplings, state, v, to.way_m)) return std::nullopt;
  return along(state, couplings.lattice(), v, to.force_N);
}

float slide(LevelStiffness& couplings, Displacement& state, VoxelId v, const glm::dvec3& load_N) noexcept {
  const glm::dvec3 way = slide_of(couplings, state, v, load_N).way_m;
  if (!allowed(couplings, state, v, way)) return 0.0F;
  state.set(v, state.at(v) + way);
  return size_of(way);
}

float slide_by(LevelStiffness& couplings, Displacement& state, VoxelId v, const glm::dvec3& given) noexcept {
  const glm::dvec3 way = along(state, couplings.lattice(), v, given);
  if (!allowed(couplings, state, v, way)) return 0.0F;
  state.set(v, state.at(v) + way);
  return size_of(way);
}

}  // namespace voxel
