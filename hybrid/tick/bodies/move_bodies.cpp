// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tick/bodies/move_bodies.h"

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "hybrid/tick/bodies/body_collisions.h"
#include "hybrid/tick/bodies/tissue_supports_bodies.h"
#include "hybrid/tick/proxy/proxy_sweep.h"

namespace hybrid {
namespace {

// Greatest number of attempts to move the proxy aside when a body pushes it into another body.
constexpr int kMaxWaysAside = 8;
// A body comes to rest after kRestTicks ticks in which it meets two bounds. It moves by at most kRestMotion
// (spacings). The change of the force on it, and the unbalanced force, are below kRestForce (share of the
// load). It wakes when it exceeds kWakeFactor times one of these bounds.
constexpr std::uint32_t kRestTicks = 100;
constexpr double kRestMotion = 1e-5, kRestForce = 1e-3, kWakeFactor = 3.0;
// A proxy this near to a place counts as being there (unit: the ball's radius).
constexpr double kSamePlace = 1e-9;

// Loads of the proxy on the body in the last tick: the coupling force as the proxy's active elements share
// it, and friction. Returns their number.
std::size_t proxy_contacts(const World& world, const WorldState& state, std::uint32_t object,
                           std::array<BodyContact, 4>& contacts) noexcept {
  std::size_t count = 0;
  for (std::uint32_t n = 0; n < state.active_count; ++n) {
    const ActiveElement& active = state.active[n];
    if (active.object != object) continue;
    const double pressed = glm::length(active.force_N);
    if (!(pressed > 0.0)) continue;
    const glm::dvec3 normal = active.force_N / pressed;  // away from the body
    contacts[count++] = {state.proxy_m - world.contact_radius_m() * normal, -normal, pressed,
                         coupling_N_per_m(world, state)};
  }
  const double rubbed = glm::length(state.friction_N);
  if (count > 0 && rubbed > 0.0 && state.rubbed == object) {
    const glm::dvec3 along = state.friction_N / rubbed;
    contacts[count] = {contacts[0].point_m, -along, rubbed, coupling_N_per_m(world, state)};
    ++count;
  }
  return count;
}

double same_place_m(const World& world) noexcept {
  return kSamePlace * world.contact_radius_m() + 4.0 * world.rounding_m;
}

// At `pushed` the proxy is outside the body that pushed it, but maybe inside others. Moves the proxy to a
// place that is outside all bodies.
void step_aside(const World& world, WorldState& state, std::uint32_t object, const glm::dvec3& before,
                const glm::dvec3& pushed) noexcept {
  const double near = same_place_m(world);
  glm::dvec3 way = pushed, from = before;
  for (int n = 0; n < kMaxWaysAside; ++n) {
    const Sweep others = sweep_past(world, state, object, true, from, way);
    state.proxy_m = others.point;
    if (glm::length(others.point - way) <= near) return;
    // Other bodies hold the proxy. Finds the nearest place that the pushing body allows.
    const Sweep body = sweep_past(world, state, object, false, way, others.point);
    if (glm::length(body.point - others.point) <= near) return;
    from = others.point;
    way = body.point;
  }
  state.faults |= fault_infeasible;
}

// Does this body carry the proxy along? It does if friction holds the proxy on the body or lets it slide.
bool carries_proxy(const WorldState& state, std::uint32_t object) noexcept {
  return (state.stuck || state.sliding) && state.active_count > 0 && state.rubbed == object;
}

// Turns the body's contact forces on the proxy with the body.
void rotate_contact_forces(WorldState& state, std::uint32_t object, const glm::dmat3& turn) noexcept {
  for (std::uint32_t n = 0; n < state.active_count; ++n) {
    if (state.active[n].object == object) state.active[n].force_N = turn * state.active[n].force_N;
  }
}

}  // namespace

void set_rigid_pose(const World& world, WorldState& state, std::uint32_t object, const Pose& pose) noexcept {
  RigidState& near = state.rigid[object];
  const RigidMotion& motion = world.rigid[object].motion;
  const double reach = world.contact_radius_m() + motion.displacement_bound(near.pose, pose);
  const bool within = !world.use_map || (state.map.rigid_in(state.proxy_m - reach, state.proxy_m + reach) &
                                         OccupancyMap::rigid_bit(object)) != 0;
  const BodyFrame before_move = near.frame, after(pose);
  glm::dvec3 expected = state.proxy_m, pushed = state.proxy_m;
  if (within) {
    const glm::dvec3 from = near.frame.to_body(state.proxy_m);
    const glm::dvec3 target = carries_proxy(state, object) ? from : after.to_body(state.proxy_m);
    expected = after.to_scene(target);
    // In the body's frame the body stands still, and the proxy moves instead.
    near.frame = BodyFrame();
    pushed = after.to_scene(sweep_past(world, state, object, false, from, target).point);
  }
  rotate_contact_forces(state, object, after.rotation * glm::transpose(before_move.rotation));
  near.frame = after;
  near.pose = pose;
  if (world.use_map) state.map.move_body(object, pose.position_m, pose.rotation);
  state.look_m = -1.0;
  state.swept_to_m = glm::dvec3(std::numeric_limits<double>::quiet_NaN());  // cached planes are void
  const glm::dvec3 before = state.proxy_m;
  state.proxy_m = pushed;
  if (pushed != before && world.rigid.size() > 1) step_aside(world, state, object, before, pushed);
  state.pushed = state.pushed || glm::length(state.proxy_m - expected) > same_place_m(world);
}

namespace {

// Is a body that went from `before` to `after` (nearly) at rest? `springs`: contacts of the tool and of
// tissue's links.
bool is_at_rest(const FreeBody& body, const FreeBodyState& before, const FreeBodyState& after,
                std::span<const BodyContact> springs, double dt_s, double most) noexcept {
  double pressed = 0.0, change = 0.0;
  for (const BodyContact& c : springs) {
    if (!(c.force_N > 0.0)) continue;
    const glm::dvec3 way =
        after.velocity_m_per_s + glm::cross(after.spin_rad_per_s, c.point_m - before.centre_m);
    pressed += c.force_N;
    change += dt_s * c.stiffness_N_per_m * std::abs(glm::dot(c.normal, way));
  }
  const double left =
      body.mass.mass_kg * glm::length(after.velocity_m_per_s - before.velocity_m_per_s) / dt_s;
  const double weight = body.mass.mass_kg * glm::length(body.gravity_m_per_s2);
  return pressed > 0.0 && std::max(change, left) <= most * std::max(pressed, weight);
}

// The loads on one free body: first the tool, then tissue's links, then contacts that are as good as rigid.
OwnContacts list_loads(const World& world, WorldState& state, std::uint32_t o, std::uint32_t member,
                       double dt_s) noexcept {
  std::array<BodyContact, 4> of_tool;
  const std::size_t count = proxy_contacts(world, state, o, of_tool);
  OwnContacts own{.first = state.scratch.body_contacts.size()};
  for (std::size_t n = 0; n < count; ++n) own.springs += add_contact(state, of_tool[n]) ? 1 : 0;
  if (world.rigid[o].presses_tissue) own.springs += add_tissue_contacts(world, state, o, dt_s);
  for (std::size_t n = own.first; n < state.scratch.body_contacts.size(); ++n)
    state.scratch.body_contacts[n].body = member;
  return own;
}

// Does a body on tissue stay at rest instead of taking its step?
bool rests(const World& world, WorldState& state, std::uint32_t o, const FreeBodyState& next,
           const OwnContacts& own, double dt_s) noexcept {
  const RigidMotion& motion = world.rigid[o].motion;
  RigidState& near = state.rigid[o];
  const double most = near.rest_ticks == kRestTicks ? kWakeFactor : 1.0;
  const auto springs = std::span(state.scratch.body_contacts).subspan(own.first, own.springs);
  const bool calm = state.body_moved_m[o] <= most * kRestMotion * smallest_spacing_m(state) &&
                    is_at_rest(motion.free_body(), near.free, next, springs, dt_s, most * kRestForce);
  near.rest_ticks = calm ? std::min(near.rest_ticks + 1, kRestTicks) : 0;
  return near.rest_ticks == kRestTicks;
}

void move_free_bodies(const World& world, WorldState& state, double dt_s) noexcept {
  FreeBodyStep& all = state.scratch.free_bodies;
  all.stepped.clear();
  all.object.clear();
  all.own.clear();
  state.scratch.body_contacts.clear();
  for (std::uint32_t o = 0; o < world.rigid.size(); ++o) {
    if (!is_free(world, o)) continue;
    all.own.push_back(list_loads(world, state, o, static_cast<std::uint32_t>(all.stepped.size()), dt_s));
    all.stepped.push_back({.body = &world.rigid[o].motion.free_body(), .state = state.rigid[o].free});
    all.object.push_back(o);
  }
  if (all.stepped.empty()) return;
  step_with_collisions(world, state, dt_s);
  for (std::size_t n = 0; n < all.stepped.size(); ++n) {
    const std::uint32_t o = all.object[n];
    RigidState& near = state.rigid[o];
    const SteppedBody& stepped = all.stepped[n];
    if (stepped.stopped) state.faults |= fault_nonfinite_body;
    const Pose pose = pose_of(*stepped.body, stepped.state);
    if (world.rigid[o].presses_tissue) {
      near.before = near.pose;
      state.body_moved_m[o] = world.rigid[o].motion.displacement_bound(near.pose, pose);
      if (rests(world, state, o, stepped.state, all.own[n], dt_s)) {
        near.free.velocity_m_per_s = near.free.spin_rad_per_s = glm::dvec3(0.0);
        state.body_moved_m[o] = 0.0;
        continue;
      }
    }
    near.free = stepped.state;
    set_rigid_pose(world, state, o, pose);
  }
}

}  // namespace

void move_bodies(const World& world, WorldState& state, double dt_s) noexcept {
  state.clock.add(dt_s);
  for (std::uint32_t o = 0; o < world.rigid.size(); ++o) {
    const RigidMotion& motion = world.rigid[o].motion;
    if (motion.kind() != RigidMotion::Kind::path) continue;
    const Pose next = motion.pose_at(state.clock.now_s());
    if (world.rigid[o].presses_tissue)
      state.body_moved_m[o] = motion.displacement_bound(state.rigid[o].pose, next);
    set_rigid_pose(world, state, o, next);
  }
  move_free_bodies(world, state, dt_s);
}

}  // namespace hybrid
