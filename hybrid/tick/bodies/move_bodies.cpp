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

constexpr int kWaysAside = 8;  // looked for when a body pushes the proxy into another
// A body rests after so many ticks in which it goes no further than this (spacings), and no force changes or
// is left over by more than this share of all that presses; it moves again when that is more than so many
// times.
constexpr std::uint32_t kCalmTicks = 100;
constexpr double kCalmWay = 1e-5, kCalmForce = 1e-3, kRoused = 3.0;
constexpr double kStayed = 1e-9;  // of the ball: a proxy that is so near where it was pushed is there

// What pressed on the body in the last tick: the proxy's coupling, shared as the contacts share it.
std::size_t contacts_of(const World& world, const WorldState& state, std::uint32_t object,
                        std::array<BodyContact, 4>& contacts) noexcept {
  std::size_t count = 0;
  for (std::uint32_t n = 0; n < state.active_count; ++n) {
    const ActiveElement& active = state.active[n];
    if (active.object != object) continue;
    const double pressed = glm::length(active.force_N);
    if (!(pressed > 0.0)) continue;
    const glm::dvec3 normal = active.force_N / pressed;  // away from the body
    contacts[count++] = {state.proxy_m - world.contact_radius_m() * normal, -normal, pressed,
                         world.tool.stiffness_N_per_m};
  }
  const double rubbed = glm::length(state.friction_N);
  if (count > 0 && rubbed > 0.0 && state.rubbed == object) {
    const glm::dvec3 along = state.friction_N / rubbed;
    contacts[count] = {contacts[0].point_m, -along, rubbed, world.tool.stiffness_N_per_m};
    ++count;
  }
  return count;
}

double stayed_m(const World& world) noexcept {
  return kStayed * world.contact_radius_m() + 4.0 * world.rounding_m;
}

// The proxy, feasible against the body alone, is brought to where it is so against everything.
void step_aside(const World& world, WorldState& state, std::uint32_t object, const glm::dvec3& before,
                const glm::dvec3& pushed) noexcept {
  const double near = stayed_m(world);
  glm::dvec3 way = pushed, from = before;
  for (int n = 0; n < kWaysAside; ++n) {
    const Sweep others = sweep_past(world, state, object, true, from, way);
    state.proxy_m = others.point;
    if (glm::length(others.point - way) <= near) return;
    // The others hold it: where does the body let it be that is nearest to there?
    const Sweep body = sweep_past(world, state, object, false, way, others.point);
    if (glm::length(body.point - others.point) <= near) return;
    from = others.point;
    way = body.point;
  }
  state.faults |= fault_infeasible;
}

// Friction holds the proxy on this body, or lets it slide: it is drawn along either way.
bool carries(const WorldState& state, std::uint32_t object) noexcept {
  return (state.stuck || state.sliding) && state.active_count > 0 && state.rubbed == object;
}

// What holds the proxy turns with the body.
void turn_contacts(WorldState& state, std::uint32_t object, const glm::dmat3& turn) noexcept {
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
    const glm::dvec3 target = carries(state, object) ? from : after.to_body(state.proxy_m);
    expected = after.to_scene(target);
    // In the body's own frame it is the proxy that moves.
    near.frame = BodyFrame();
    pushed = after.to_scene(sweep_past(world, state, object, false, from, target).point);
  }
  turn_contacts(state, object, after.rotation * glm::transpose(before_move.rotation));
  near.frame = after;
  near.pose = pose;
  if (world.use_map) state.map.move_body(object, pose.position_m, pose.rotation);
  state.look_m = -1.0;
  state.swept_to_m = glm::dvec3(std::numeric_limits<double>::quiet_NaN());  // all is seen afresh
  const glm::dvec3 before = state.proxy_m;
  state.proxy_m = pushed;
  if (pushed != before && world.rigid.size() > 1) step_aside(world, state, object, before, pushed);
  state.pushed = state.pushed || glm::length(state.proxy_m - expected) > stayed_m(world);
}

namespace {

// Is a body that went from `before` to `after` about to come to rest, or still there? `springs`: the tool and
// what tissue's links press with.
bool is_calm(const FreeBody& body, const FreeBodyState& before, const FreeBodyState& after,
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

// What acts on a free body by itself: first the tool, then what tissue's links press with, then what is as
// good as rigid.
OwnContacts list_contacts(const World& world, WorldState& state, std::uint32_t o, std::uint32_t member,
                          double dt_s) noexcept {
  std::array<BodyContact, 4> of_tool;
  const std::size_t count = contacts_of(world, state, o, of_tool);
  OwnContacts own{.first = state.scratch.body_contacts.size()};
  for (std::size_t n = 0; n < count; ++n) own.springs += add_contact(state, of_tool[n]) ? 1 : 0;
  if (world.rigid[o].presses_tissue) own.springs += add_tissue_contacts(world, state, o, dt_s);
  for (std::size_t n = own.first; n < state.scratch.body_contacts.size(); ++n)
    state.scratch.body_contacts[n].body = member;
  return own;
}

// Beside tissue: does the body rest, in place of what its step says?
bool rests(const World& world, WorldState& state, std::uint32_t o, const FreeBodyState& next,
           const OwnContacts& own, double dt_s) noexcept {
  const RigidMotion& motion = world.rigid[o].motion;
  RigidState& near = state.rigid[o];
  const double most = near.calm_ticks == kCalmTicks ? kRoused : 1.0;
  const auto springs = std::span(state.scratch.body_contacts).subspan(own.first, own.springs);
  const bool calm = state.body_moved_m[o] <= most * kCalmWay * least_spacing_m(state) &&
                    is_calm(motion.free_body(), near.free, next, springs, dt_s, most * kCalmForce);
  near.calm_ticks = calm ? std::min(near.calm_ticks + 1, kCalmTicks) : 0;
  return near.calm_ticks == kCalmTicks;
}

void move_free_bodies(const World& world, WorldState& state, double dt_s) noexcept {
  FreeBodyStep& all = state.scratch.free_bodies;
  all.stepped.clear();
  all.object.clear();
  all.own.clear();
  state.scratch.body_contacts.clear();
  for (std::uint32_t o = 0; o < world.rigid.size(); ++o) {
    if (!is_free(world, o)) continue;
    all.own.push_back(list_contacts(world, state, o, static_cast<std::uint32_t>(all.stepped.size()), dt_s));
    all.stepped.push_back({.body = &world.rigid[o].motion.free_body(), .state = state.rigid[o].free});
    all.object.push_back(o);
  }
  if (all.stepped.empty()) return;
  step_past_rigid(world, state, dt_s);
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
