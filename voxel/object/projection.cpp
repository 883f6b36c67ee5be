// SPDX-License-Identifier: GPL-3.0-or-later
// Where a touched voxel belongs while all else stands: at the least energy of its links, outside of the tool
// and of its obstacle, within its limits.
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "voxel/lattice/voxel_links.h"
#include "voxel/object/soft_object.h"

namespace voxel {
namespace {

constexpr int kProjections = 3;  // of a pressed voxel onto the tool, in search of its least energy
constexpr double kSlides = 0.1;  // sin² between tool and obstacle; where they meet nearly flat it is squeezed

// The least force along `way` (m, of 1 N; no component against the normal) that brings `wished`, each axis
// within its links' interval, to normal · u >= bound; where none does, one at which no axis goes any further.
double least_force_N(const VoxelLinks& links, const glm::dvec3& wished, const glm::dvec3& way,
                     const glm::dvec3& normal, double bound) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  double force_N = 0.0;
  for (int n = 0; n < 7; ++n) {  // an axis begins to go once, and is stopped once
    double reached = 0.0, rise = 0.0, next_N = kNone;
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
    const double to_N = rise > 0.0 ? force_N + (bound - reached) / rise : kNone;
    if (to_N <= next_N && to_N < kNone) return to_N;
    if (next_N == kNone) break;
    force_N = next_N;
  }
  return force_N;
}

}  // namespace

// Where the springs' energy is least on the tool's surface, so that sliding round the tool is free of
// friction: in their own metric, the surface straightened at the last place (one step left 3e-4 of the force
// scale of friction).
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

// Where links do not let a voxel out of the tool altogether it goes no deeper than it was.
glm::dvec3 SoftObject::no_deeper_in(const ToolInBody& tool, const glm::dvec3& rest, const glm::dvec3& now,
                                    const glm::dvec3& place) const noexcept {
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

// As project_on_tool(), where its links do not let it go there: the least energy on the tool within their
// limits. Given the tool's force, each axis is for itself. (Brought onto the tool and then within its limits,
// it stood a tenth of a spacing off the tool, or went into it, was pushed out by the next tick, and what
// hangs on it with it: at a ball ten spacings deep 1.3 % of the energy in every tick, for good.)
glm::dvec3 SoftObject::project_on_tool_within_limits(const ToolInBody& tool, const VoxelLinks& links,
                                                     const glm::dvec3& wished, Touch& t) const noexcept {
  const glm::dvec3 now = state_.at(t.v);
  glm::dvec3 place = clamp_to_links(links, wished, now);
  for (int n = 0; n < kProjections; ++n) {
    const Gap g = gap(tool, t.rest + place);
    t.normal = g.normal;
    if (n == 0 && g.distance >= 0.0) break;
    const glm::dvec3 way = links.compliance * g.normal;  // of 1 N
    const double force_N =
        least_force_N(links, wished, way, g.normal, glm::dot(g.normal, place) - g.distance);
    place = clamp_to_links(links, wished + force_N * way, now);
  }
  return no_deeper_in(tool, t.rest, now, place);
}

// Where a touched voxel belongs, everything else where it is; `pressed`: by the tool.
glm::dvec3 SoftObject::place_of(const ToolInBody& tool, const VoxelLinks& links, Touch& t) noexcept {
  const glm::dvec3 rest = t.rest, now = state_.at(t.v);
  glm::dvec3 wanted = links.minimum;
  if (pair_held(t)) wanted += links.compliance * glm::dvec3(pair_load_[t.surface]);
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
    // What other objects press, too, goes where its pairs have it; and of what anchors keep in the tool, that
    // is to give way, not to part it as a wedge would.
    const bool let_out = t.pressed && place != wanted && held_voxels_.empty() &&
                         !(anchors_pull_ && gap(tool, rest + now).distance < -kGiveWay * voxel_radius());
    return let_out ? project_on_tool_within_limits(tool, links, wished, t) : place;
  }
  const Obstacle& o = obstacles_[t.surface];
  const glm::dvec3 n(o.normal);
  const double depth = static_cast<double>(o.bound) - glm::dot(n, wanted);
  if (depth > 0.0 && n != glm::dvec3(0.0)) {
    wanted += depth * n;
    // Where that takes it into the tool it slides along the obstacle, out of its way. (Left there, the tool
    // had to give way to tissue that bulged against the side of a bone: by 0.08 N of 1.1, in three ticks of
    // four.)
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
  if (lattice_->anchored(t.v) || t.part != 0) return;
  const glm::dvec3 before = state_.at(t.v);
  const bool was_pressed = t.pressed;
  // While another relaxes the object, a voxel that the tool does not press is his.
  if (relaxation_.away() && !t.pressed && clear_of(tool, position(t))) return;
  // One that another soft object presses is its pair's. (Brought to where its links alone would have it, it
  // was a spacing deep in the other object whenever the force was measured, and the tool felt nothing of what
  // that carries: 0.31 N of 0.61.)
  if (pair_held(t) && !t.pressed && clear_of(tool, position(t))) return;
  const VoxelLinks links = links_of(relaxation_.couplings(), state_, t.v);
  glm::dvec3 place = place_of(tool, links, t);
  if (relaxation_.away() && was_pressed && t.pressed) {
    place -= t.left;
    const Gap g = gap(tool, t.rest + place);
    if (g.distance < 0.0) place -= g.distance * g.normal;
    place = clamp_to_links(links, place, before);
  }
  state_.set(t.v, place);
  relaxation_.multigrid().log().note(0, t.v / kRow);
  if (t.pressed != was_pressed) unsettled_m_ += glm::distance(before, state_.at(t.v));
  // A tool that jumped away moves no pressed voxel by follow(): what it let go of wakes the rest.
  if (was_pressed && !t.pressed &&
      glm::distance(before, state_.at(t.v)) > kDirtyMotion * lattice_->min_spacing_m()) {
    relaxation_.wake();
  }
}

}  // namespace voxel
