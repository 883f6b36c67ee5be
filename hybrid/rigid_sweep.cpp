// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/rigid_sweep.h"

#include <algorithm>
#include <glm/geometric.hpp>

namespace hybrid {
namespace {

constexpr int kMaxSteps = 32;
constexpr double kConverged = 1e-7;  // of the tool's radius: a step shorter than this is the end
constexpr double kSmallestStep =
    1e-3;  // of the tool's radius: below it, crowding is a fault, not a reason to look nearer
constexpr double kTolerance = 1e-12;  // of the tool's radius: depth in a plane that is rounding

}  // namespace

bool gather_planes(const World& world, WorldState& state, const glm::dvec3& point, double radius) noexcept {
  state.planes.clear();
  const std::uint64_t mask = state.map.rigid_in(point - radius, point + radius);
  if (mask == 0) return true;
  bool complete = true;
  for (std::uint32_t o = 0; o < world.rigid.size(); ++o) {
    if ((mask & OccupancyMap::rigid_bit(o)) == 0) continue;
    const RigidObject& object = world.rigid[o];
    const polygon::GatherResult found = object.surface->gather(object.to_body(point), radius, state.near);
    complete = complete && found.complete;
    for (std::uint32_t i = 0; i < found.count; ++i) {
      if (state.planes.size() == state.planes.capacity()) return false;
      const polygon::NearPoint& near = state.near[i];
      const glm::dvec3 on_surface = object.to_scene(near.point);
      const glm::dvec3 away = point - on_surface;
      const double distance = glm::length(away);
      if (!(distance > 0.0))
        continue;  // on the surface itself, where no side is right: its neighbours decide
      const glm::dvec3 normal = away / distance;
      state.planes.push_back({normal, glm::dot(normal, on_surface) + world.tool.radius_m, o, near.element});
    }
  }
  return complete;
}

Sweep sweep_proxy(const World& world, WorldState& state, const glm::dvec3& from, const glm::dvec3& target,
                  const glm::dmat3& metric, double travel) noexcept {
  const double radius = world.tool.radius_m;
  Sweep sweep;
  sweep.point = from;
  sweep.arrived = false;
  for (int n = 0; n < kMaxSteps; ++n) {
    // Look as far as the target is, but no further than what fits: what is gathered within radius + step
    // makes a step of that length safe.
    double step = std::min(glm::length(target - sweep.point) + kConverged * radius, state.gather_step_m);
    while (!gather_planes(world, state, sweep.point, radius + step)) {
      step *= 0.5;
      state.gather_step_m = step;
      if (step > kSmallestStep * radius) continue;
      state.faults |= fault_triangle_overflow;
      break;
    }
    if (state.planes.size() < kMaxNear / 4)
      state.gather_step_m = std::min(2.0 * state.gather_step_m, 8.0 * radius);
    const polygon::PlaneMinimum minimum =
        polygon::minimise_on_planes(target, metric, state.planes, kTolerance * radius);
    if (!minimum.feasible) {
      state.faults |= fault_infeasible;
      return sweep;  // stay: the place before was outside everything
    }
    sweep.force_N = glm::dvec3(0.0);
    std::fill(state.rigid_force_N.begin(), state.rigid_force_N.end(), glm::dvec3(0.0));
    for (std::uint32_t i = 0; i < minimum.active_count; ++i) {
      const polygon::ContactPlane& plane = state.planes[minimum.active[i]];
      const glm::dvec3 force = minimum.multiplier[i] * plane.normal;
      sweep.force_N += force;
      state.rigid_force_N[plane.object] += force;
    }
    const glm::dvec3 move = minimum.point - sweep.point;
    const double length = glm::length(move);
    // The half-spaces are convex and hold the point before, so any part of the way is as safe as the whole.
    const double most = std::min(step, travel);
    const bool whole = length <= most;
    sweep.point += whole ? move : move * (most / length);
    travel -= std::min(length, most);
    sweep.arrived = whole && (length <= kConverged * radius || minimum.active_count == 0);
    if (sweep.arrived || travel <= 0.0) break;
  }
  return sweep;
}

}  // namespace hybrid
