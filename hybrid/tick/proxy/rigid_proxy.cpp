// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tick/proxy/rigid_proxy.h"

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

#include "hybrid/tick/proxy/proxy_surroundings.h"

namespace hybrid {
namespace {

constexpr int kMaxFreePieces = 512;  // pieces of the way through free space examined in one tick

}  // namespace

double gather_planes(const World& world, WorldState& state, const glm::dvec3& point, double radius) noexcept {
  state.scratch.planes.clear();
  const std::uint64_t mask = state.map.rigid_in(point - radius, point + radius, state.map_trail);
  double known = radius;
  for (std::uint32_t o = 0; o < world.rigid.size(); ++o) {
    if ((mask & OccupancyMap::rigid_bit(o)) == 0) continue;
    const BodyFrame& frame = state.rigid[o].frame;
    const polygon::GatherResult found =
        world.rigid[o].surface->gather(frame.to_body(point), radius, state.scratch.near);
    double furthest = 0.0;
    for (std::uint32_t i = 0; i < found.count; ++i) {
      const polygon::NearPoint& near = state.scratch.near[i];
      furthest = std::max(furthest, near.distance);
      if (state.scratch.planes.size() == state.scratch.planes.capacity()) {
        known = std::min(known, near.distance);
        continue;
      }
      const glm::dvec3 on_surface = frame.to_scene(near.point);
      const glm::dvec3 away = point - on_surface;
      const double distance = glm::length(away);
      if (!(distance > 0.0))
        continue;  // a point on the surface has no side; the planes of neighbouring elements decide
      const glm::dvec3 normal = away / distance;
      state.scratch.planes.push_back(
          {normal, glm::dot(normal, on_surface) + world.contact_radius_m(), o, near.element});
    }
    if (!found.complete) known = std::min(known, furthest);
  }
  return known;
}

bool advance_through_free_space(const World& world, WorldState& state, const glm::dvec3& goal,
                                double soft_reach_m) noexcept {
  const double radius = world.contact_radius_m();
  if (world.soft.empty() && state.look_m > 0.0) {
    if (state.active_count > 0) return false;
    // Both ends lie within the last map query: it is empty, or the sweep must consider its objects.
    const glm::dvec3 a = glm::abs(state.proxy_m - state.look_at), b = glm::abs(goal - state.look_at);
    const double most = state.look_m - radius;
    if (a.x <= most && a.y <= most && a.z <= most && b.x <= most && b.y <= most && b.z <= most) {
      if (state.look_mask == 0) state.proxy_m = goal;
      return state.look_mask == 0;
    }
  }
  if (!world.use_map) return false;
  const double margin = std::max(radius, soft_reach_m) + state.map.cell_m();
  const double piece = kQueryCells * state.map.cell_m();
  for (int n = 0; n < kMaxFreePieces; ++n) {
    const glm::dvec3 way = goal - state.proxy_m;
    const double length = glm::length(way);
    const bool last = length <= piece;
    const glm::dvec3 next = last ? goal : state.proxy_m + way * (piece / length);
    if (state.map.any_near(glm::min(state.proxy_m, next) - margin, glm::max(state.proxy_m, next) + margin))
      return false;
    state.proxy_m = next;
    if (last) {
      if (world.soft.empty()) {  // keeps a query for the next ticks
        state.look_at = goal;
        state.look_m = radius + kQueryCells * state.map.cell_m();
        state.look_mask = state.map.rigid_in(goal - state.look_m, goal + state.look_m, state.map_trail);
      }
      return true;
    }
  }
  return false;
}

bool start_proxy(const World& world, WorldState& state, const glm::dvec3& device_m) noexcept {
  const double radius = world.contact_radius_m();
  state.device_m = device_m;
  state.proxy_m = device_m;
  state.active_count = 0;
  state.stuck = state.sliding = false;
  state.look_m = -1.0;
  state.swept_to_m = glm::dvec3(std::numeric_limits<double>::quiet_NaN());
  for (RigidState& near : state.rigid) near.near.forget();
  for (int n = 0; n < 64; ++n) {
    glm::dvec3 away(0.0);
    double deepest = 0.0;
    for (std::size_t o = 0; o < world.rigid.size(); ++o) {
      const RigidObject& object = world.rigid[o];
      const glm::dvec3 p = state.rigid[o].frame.to_body(state.proxy_m);
      if (object.surface->inside(p)) return false;
      polygon::NearPoint near;
      if (!object.surface->nearest(p, radius, near)) continue;
      const double depth = radius - near.distance;
      if (depth <= deepest) continue;
      if (!(near.distance > 0.0)) return false;
      deepest = depth;
      away = state.rigid[o].frame.rotation * ((p - near.point) / near.distance);
    }
    if (deepest <= 0.0) return true;
    state.proxy_m += (deepest * (1.0 + 1e-9)) * away;
  }
  return false;
}

RigidStep step_rigid(const World& world, WorldState& state, const glm::dvec3& device_m) noexcept {
  RigidStep step;
  step.free = advance_through_free_space(world, state, device_m, 0.0);
  if (step.free) {
    state.active_count = 0;
  } else {
    const Sweep sweep =
        sweep_proxy(world, state, state.proxy_m, device_m, glm::dmat3(coupling_N_per_m(world, state)),
                    std::numeric_limits<double>::max());
    state.proxy_m = sweep.point;
    step.arrived = sweep.arrived;
    step.steps = sweep.steps;
    step.surveys = sweep.surveys;
  }
  step.proxy_m = state.proxy_m;
  step.force_N = coupling_force_N(world, state, device_m);
  return step;
}

}  // namespace hybrid
