// SPDX-License-Identifier: GPL-3.0-or-later
// Constrained projection of one touched voxel: the displacement of least link energy outside of the tool and
// of the obstacle, within the links' limits. All other voxels are fixed.
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "voxel/lattice/voxel_links.h"
#include "voxel/object/soft_object.h"

namespace voxel {
namespace {

// Number of projections onto the tool in the search for the least energy.
constexpr int kProjections = 3;
constexpr double kSlides = 0.1;  // sin² of the angle between tool and obstacle; a voxel between nearly
                                 // parallel surfaces is squeezed and does not slide

// The least force along the normal (N) that brings the voxel to normal · u >= bound. `wished`: displacement
// without a force. `way`: motion by 1 N (m); no component is opposite to the normal's. Each axis is clamped
// to its links' interval. If no force is enough, returns the force at which no axis moves any further.
double least_force_N(const VoxelLinks& links, const glm::dvec3& wished, const glm::dvec3& way,
                     const glm::dvec3& normal, double bound) {
  constexpr double kNoBound = std::numeric_limits<double>::infinity();
  double force_N = 0.0;
  for (int n = 0; n < 7; ++n) {  // each axis starts to move once and stops once
    double reached = 0.0, rise = 0.0, next_N = kNoBound;
    for (int axis = 0; axis < 3; ++axis) {
      const auto& in = links.interval[static_cast<std::size_t>(axis)];
      const double low = static_cast<double>(in[0]), high = std::max(low, static_cast<double>(in[1]));
      const double at = wished[axis] + force_N * way[axis];
      reached += normal[axis] * std::clamp(at, low, high);
      if (way[axis] == 0.0) continue;
      const double begin_N = ((way[axis] > 0.0 ? low : high) - wished[axis]) / way[axis],
                   end_N = ((way[axis] > 0.0 ? high : low) - wished[axis]) / way[axis];
      if (force_N >= end_N) continue;
      if (force_N >= begin_N) rise += normal[axis] * way[axis];
      next_N = std::min(next_N, force_N >= begin_N ? end_N : begin_N);
    }
    if (reached >= bound) break;
    const double to_N = rise > 0.0 ? force_N + (bound - reached) / rise : kNoBound;
    if (to_N <= next_N && to_N < kNoBound) return to_N;
    if (next_N == kNoBound) break;
    force_N = next_N;
  }
  return force_N;
}

}  // namespace

// Finds the place of least spring energy on the tool's surface. The energy alone decides the voxel's place on
// the surface, so the voxel slides on the tool without friction. This is a projection in the metric of the
// springs. In each step the surface is replaced by its tangent plane at the last place.
glm::dvec3 SoftObject::project_on_tool(const ToolInBody& tool, const glm::dvec3& rest,
                                       const glm::dvec3& wished, const glm::dvec3& compliance,
                                       Gap& g) const noexcept {
  glm::dvec3 place = wished;
  for (int n = 0; n < kProjections && g.distance < voxel_radius(); ++n) {
    const double denominator = glm::dot(g.normal, compliance * g.normal);
    if (denominator <= 0.0) break;
    place =
        wished - ((g.distance + glm::dot(g.normal, wished - place)) / denominator) * compliance * g.normal;
    g = gap(tool, rest + place);
  }
  return g.distance < 0.0 ? place - g.distance * g.normal : place;
}

// A voxel that its links keep in the tool gets no deeper than it was.
glm::dvec3 SoftObject::clamp_depth_in_tool(const ToolInBody& tool, const glm::dvec3& rest,
                                           const glm::dvec3& now, const glm::dvec3& place) const noexcept {
  const double was = std::min(gap(tool, rest + now).distance, voxel_radius());
  glm::dvec3 to = place;
  for (int n = 0; n < kProjections; ++n) {
    const double is = gap(tool, rest + to).distance;
    if (is >= 0.0 || is >= was) return to;
    if (was <= 0.0) return now;
    to = now + was / (was - is) * (to - now);
  }
  return to;
}

// Replaces project_on_tool() where links do not allow its result. Finds the least energy on the tool's
// surface within the links' limits. For a given force of the tool the axes are independent. Projecting first
// and clamping afterwards would leave the voxel off the tool or inside of it, and the next tick would push it
// out with its dependents.
glm::dvec3 SoftObject::project_on_tool_within_limits(const ToolInBody& tool, const VoxelLinks& links,
                                                     const glm::dvec3& wished, Touch& t) const noexcept {
  const glm::dvec3 now = state_.at(t.v);
  glm::dvec3 place = clamp_to_links(links, wished, now);
  for (int n = 0; n < kProjections; ++n) {
    const Gap g = gap(tool, t.rest + place);
    t.normal = g.normal;
    if (n == 0 && g.distance >= 0.0) break;
    const glm::dvec3 way = links.compliance * g.normal;  // motion by 1 N
    const double force_N =
        least_force_N(links, wished, way, g.normal, glm::dot(g.normal, place) - g.distance);
    place = clamp_to_links(links, wished + force_N * way, now);
  }
  return clamp_depth_in_tool(tool, t.rest, now, place);
}

// Displacement of least energy of a touched voxel, with everything else fixed. Sets `pressed` if the tool
// presses the voxel.
glm::dvec3 SoftObject::project_voxel(const ToolInBody& tool, const VoxelLinks& links, Touch& t) noexcept {
  const glm::dvec3 rest = t.rest, now = state_.at(t.v);
  glm::dvec3 wanted = links.minimum;
  if (is_claimed(t)) wanted += links.compliance * glm::dvec3(pair_load_[t.surface]);
  const glm::dvec3 wished = wanted;
  t.pressed = !surely_clear_of(tool, rest + wanted);
  Gap g;
  if (t.pressed) {
    g = gap(tool, rest + wanted);
    t.pressed = g.distance < 0.0;
  }
  if (t.pressed) {
    wanted = project_on_tool(tool, rest, wanted, links.compliance, g);
    t.normal = g.normal;
  }
  if (obstacles_.empty()) {
    const glm::dvec3 place = clamp_to_links(links, wanted, now);
    // The voxel is moved out of the tool within its limits, with two exceptions. Beside another soft object
    // the solver of pairs moves it later. If anchors keep the voxel in the tool, the tool gives way instead,
    // because it must not push tissue apart as a wedge would.
    const bool let_out = t.pressed && place != wanted && claimed_voxels_.empty() &&
                         !(anchors_pull_ && gap(tool, rest + now).distance < -kGiveWay * voxel_radius());
    return let_out ? project_on_tool_within_limits(tool, links, wished, t) : place;
  }
  const Obstacle& o = obstacles_[t.surface];
  const glm::dvec3 n(o.normal);
  const double depth = static_cast<double>(o.bound) - glm::dot(n, wanted);
  if (depth > 0.0 && n != glm::dvec3(0.0)) {
    wanted += depth * n;
    // If the obstacle pushes the voxel into the tool, the voxel slides along the obstacle until it is out of
    // the tool. Otherwise the tool would have to give way to tissue that bulges beside bone.
    for (int k = 0; k < kProjections; ++k) {
      g = gap(tool, rest + wanted);
      const glm::dvec3 slide = g.normal - glm::dot(g.normal, n) * n;
      if (g.distance >= 0.0 || g.distance < -voxel_radius() || glm::dot(slide, slide) < kSlides) break;
      wanted -= g.distance / glm::dot(slide, slide) * slide;
      t.pressed = true;
      t.normal = g.normal;
    }
  }
  const glm::dvec3 place = clamp_to_links(links, wanted, now);
  return n == glm::dvec3(0.0) ? place : no_deeper(o, now, place);
}

void SoftObject::relax_touch(const ToolInBody& tool, Touch& t) noexcept {
  if (lattice_->anchored(t.v) || t.block != 0) return;
  const glm::dvec3 before = state_.at(t.v);
  const bool was_pressed = t.pressed;
  // While the shadow relaxes the object, voxels that the tool does not press belong to the shadow.
  if (relaxation_.shadow_busy() && !t.pressed && clear_of(tool, position(t))) return;
  // A voxel that another soft object presses belongs to its pair. At the equilibrium of its links alone it
  // would lie inside of the other object when the force is measured.
  if (is_claimed(t) && !t.pressed && clear_of(tool, position(t))) return;
  const VoxelLinks links = links_of(relaxation_.couplings(), state_, t.v);
  glm::dvec3 place = project_voxel(tool, links, t);
  if (relaxation_.shadow_busy() && was_pressed && t.pressed) {
    place -= t.frozen_motion;
    const Gap g = gap(tool, t.rest + place);
    if (g.distance < 0.0) place -= g.distance * g.normal;
    place = clamp_to_links(links, place, before);
  }
  state_.set(t.v, place);
  relaxation_.multigrid().log().note(0, t.v / kRow);
  if (t.pressed != was_pressed) unsettled_m_ += glm::distance(before, state_.at(t.v));
  // If the tool jumped away, follow() moves no pressed voxel. So released voxels wake the background.
  if (was_pressed && !t.pressed &&
      glm::distance(before, state_.at(t.v)) > kDirtyMotion * lattice_->min_spacing_m()) {
    relaxation_.wake();
  }
}

}  // namespace voxel
