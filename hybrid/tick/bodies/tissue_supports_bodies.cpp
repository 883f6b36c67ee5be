// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tick/bodies/tissue_supports_bodies.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <span>

#include "hybrid/tick/bodies/bodies_press_tissue.h"
#include "hybrid/tick/bodies/body_collisions.h"
#include "hybrid/tick/bodies/move_bodies.h"
#include "voxel/lattice/voxel_links.h"

namespace hybrid {
namespace {

constexpr double kUnblocked = 0.002;  // of the spacing: no deeper than this a voxel is blocked no more
constexpr double kUnpaid = 0.005;     // of the spacing, in a step
constexpr double kOnBody = 1e-3;      // of the spacing: no further from the body than this it is on it
constexpr double kAcross = 1e-3;      // of the sum of normals: what they hardly span they do not take
// Times the stiffness of links: what is more than theirs is a damper. Relaxed apart, tissue is a spring
// between two results, and gives back in one what it took before another: with 1 a box of 17 g hopped 0.2 mm
// high for ever, from 2 on it rests.
constexpr double kDamping = 3.0;
// The same of tight links. What these hand on changes in steps, on which bodies would dance.
constexpr double kTightDamping = 20.0;
constexpr double kOthers = 1e-2;  // of that: tissue that may leave the way of a body that goes back
constexpr double kRigid = 1e4;    // times what stops the body within a tick: as good as rigid

// A surface voxel that the body is the nearest one to.
struct Held {
  glm::dvec3 normal;  // out of the body, volume frame
  double gap_m;       // negative: it is in the body
};

Held held_of(const voxel::SoftObject& object, const BodyObstacles& beside, std::uint32_t s) noexcept {
  const voxel::Obstacle& o = beside.moving[s];
  const glm::dvec3 n(o.normal);
  return {n, glm::dot(n, object.state().at(object.lattice().surface()[s])) - static_cast<double>(o.bound)};
}

// The contact that it is, without force: where the body's surface was nearest to it when it was looked at.
// (Since then it may have moved along its half-space, and forces from there would turn a ball.)
BodyContact contact_at(const SoftBody& body, const voxel::SoftObject& object, const BodyQuery& sight,
                       std::uint32_t s, const Held& held) noexcept {
  const glm::dvec3 out = body.pose.rotation * held.normal;
  const glm::dvec3 u(sight.u), at = body.to_scene(object.lattice().rest(object.lattice().surface()[s]) + u);
  const double moved = glm::dot(held.normal, object.state().at(object.lattice().surface()[s]) - u);
  return {at - (object.voxel_radius() + held.gap_m - moved) * out, -out, 0.0, 0.0};
}

// Every voxel that body b is the nearest one to: visit(soft object, its BodyObstacles, surface number).
template <class Visit>
void for_voxels_at(const WorldState& state, std::uint32_t b, const Visit& visit) noexcept {
  for (std::size_t o = 0; o < state.body_obstacles.size(); ++o) {
    for (const std::uint32_t s : state.body_obstacles[o].near) {
      if (state.body_obstacles[o].whose[s] == b) visit(o, s);
    }
  }
}

double rigid_stiffness(const FreeBody& body, double dt_s) noexcept {
  return dt_s > 0.0 ? kRigid * body.mass.mass_kg / (dt_s * dt_s) : 0.0;
}

bool as_good_as_rigid(const WorldState& state, std::size_t o, std::uint32_t s) noexcept {
  const voxel::Lattice& lattice = state.soft[o]->lattice();
  return state.body_obstacles[o].jammed[s] != 0 || lattice.anchored(lattice.surface()[s]);
}

// The body may come to voxels of which `which` says so, and no nearer.
template <class Which>
void add_stops(const World& world, WorldState& state, std::uint32_t b, double stiffness,
               const Which& which) noexcept {
  for_voxels_at(state, b, [&](std::size_t o, std::uint32_t s) {
    if (!which(o, s)) return;
    const voxel::SoftObject& object = *state.soft[o];
    const Held held = held_of(object, state.body_obstacles[o], s);
    BodyContact contact = contact_at(world.soft[o], object, state.body_obstacles[o].queries[b][s], s, held);
    const double left = held.gap_m + kJammedProbe * object.lattice().min_spacing_m();
    contact.force_N = -stiffness * std::max(left, 0.0);
    contact.stiffness_N_per_m = stiffness;
    add_contact(state, contact);
  });
}

void add_rigid_contacts(const World& world, WorldState& state, std::uint32_t b, double stiffness) noexcept {
  add_stops(world, state, b, stiffness,
            [&](std::size_t o, std::uint32_t s) { return as_good_as_rigid(state, o, s); });
}

// Is it on the body, or would its links by themselves take it there?
bool presses(voxel::SoftObject& object, std::uint32_t s, const Held& held) noexcept {
  if (held.gap_m < kOnBody * object.lattice().min_spacing_m()) return true;
  const voxel::VoxelId v = object.lattice().surface()[s];
  const glm::dvec3 stiffness = 1.0 / object.compliance(v);
  const glm::dvec3 place =
      voxel::clamp_to_links(object.lattice(), object.state(), v, object.free_displacement(v));
  const glm::dvec3 left = place - object.state().at(v) + held.gap_m * held.normal;
  return glm::dot(held.normal, stiffness * left) < 0.0;
}

// Of one object the voxels at body b that move, those that press on it first. Returns how many these are.
std::size_t list_pressing(WorldState& state, std::uint32_t b, std::size_t o) noexcept {
  voxel::SoftObject& object = *state.soft[o];
  const BodyObstacles& beside = state.body_obstacles[o];
  std::size_t pressed = 0;
  state.scratch.at_body.clear();
  for (const bool on : {true, false}) {
    for (const std::uint32_t s : beside.near) {
      if (beside.whose[s] != b || !object.obstacles()[s].moving) continue;
      if (object.lattice().anchored(object.lattice().surface()[s])) continue;
      if (presses(object, s, held_of(object, beside, s)) != on) continue;
      if (state.scratch.at_body.size() == state.scratch.at_body.capacity()) {
        state.faults |= fault_body_crowded;
        break;
      }
      state.scratch.at_body.push_back(s);
    }
    if (on) pressed = state.scratch.at_body.size();
  }
  state.scratch.held_by_body.clear();
  for (const std::uint32_t s : state.scratch.at_body)
    state.scratch.held_by_body.push_back(object.lattice().surface()[s]);
  return pressed;
}

// How far a voxel comes towards the body (m; negative: it is in it). What its chain keeps from coming all the
// way hands what pulls it there on to voxels that are on the body. (Counted as far off as it is, it took what
// the links would lose on a way that it cannot go: a fifteenth of the weight of a ball on a tight chain.)
double way_to_body(const voxel::SoftObject& object, std::uint32_t s, const Held& held, bool tight) noexcept {
  if (!tight || held.gap_m <= 0.0) return held.gap_m;
  const voxel::VoxelId v = object.lattice().surface()[s];
  const glm::dvec3 u = object.state().at(v);
  const glm::dvec3 place =
      voxel::clamp_to_links(object.lattice(), object.state(), v, u - held.gap_m * held.normal);
  return glm::clamp(glm::dot(held.normal, u - place), 0.0, held.gap_m);
}

// What these press with: along its normal each what is pulled into the body by it. Tight links hand load from
// voxel to voxel, across the normals as well, and of that only the sum is left: so what the sum then lacks is
// shared among them, along their normals, as little of it to each as can be. (Added to each as it was booked
// it turned a ball, which no surface without friction can.) Where limits and obstacles were found that
// balance all, they press with that: the share above has no torque that a box could rest by.
void add_pressing(const World& world, WorldState& state, std::uint32_t b, std::size_t o) noexcept {
  const voxel::SoftObject& object = *state.soft[o];
  const BodyObstacles& beside = state.body_obstacles[o];
  const auto pressed = [&](std::size_t n, const glm::dvec3& normal) {
    return std::max(0.0, -glm::dot(normal, state.scratch.held_loads[n].force_N));
  };
  glm::dvec3 lacking_N(0.0);
  glm::dmat3 normals(0.0);
  for (std::size_t n = 0; n < state.scratch.at_body.size(); ++n) {
    if (!state.scratch.held_loads[n].tight) continue;
    const glm::dvec3 normal(beside.moving[state.scratch.at_body[n]].normal);
    lacking_N += -state.scratch.held_loads[n].force_N - pressed(n, normal) * normal;
    normals += glm::outerProduct(normal, normal);
  }
  const double most = normals[0][0] + normals[1][1] + normals[2][2];
  const glm::dvec3 share =
      most > 0.0 ? glm::inverse(normals + glm::dmat3(kAcross * most)) * lacking_N : glm::dvec3(0.0);
  for (std::size_t n = 0; n < state.scratch.at_body.size(); ++n) {
    const std::uint32_t s = state.scratch.at_body[n];
    const voxel::HeldLoad& load = state.scratch.held_loads[n];
    const Held held = held_of(object, beside, s);
    BodyContact contact = contact_at(world.soft[o], object, beside.queries[b][s], s, held);
    const double springs = glm::dot(held.normal, load.stiffness_N_per_m * held.normal);
    contact.stiffness_N_per_m = kDamping * springs;
    contact.force_N =
        -glm::dot(held.normal, load.force_N) - springs * way_to_body(object, s, held, load.tight);
    if (load.balanced) {
      const bool presses = load.pressed_N > 0.0;
      contact.force_N = presses ? load.pressed_N : -kDamping * springs * std::max(held.gap_m, 0.0);
      contact.stiffness_N_per_m = (presses && load.tight ? kTightDamping : kDamping) * springs;
      add_contact(state, contact);
      continue;
    }
    // What would not come to the body by itself begins to press where they meet, and no earlier.
    if (contact.force_N < 0.0) contact.force_N *= kDamping;
    if (load.tight && pressed(n, held.normal) > 0.0) {
      contact.force_N += glm::dot(share, held.normal);
      contact.stiffness_N_per_m = kTightDamping * springs;
    }
    add_contact(state, contact);
  }
}

}  // namespace

std::size_t add_tissue_contacts(const World& world, WorldState& state, std::uint32_t b,
                                double dt_s) noexcept {
  const std::size_t before = state.scratch.body_contacts.size();
  for (std::size_t o = 0; o < state.body_obstacles.size(); ++o) {
    const std::size_t pressed = list_pressing(state, b, o);
    state.soft[o]->load_held(state.scratch.held_by_body, pressed, state.scratch.held_loads);
    add_pressing(world, state, b, o);
  }
  const std::size_t links = state.scratch.body_contacts.size();
  add_rigid_contacts(world, state, b, rigid_stiffness(world.rigid[b].motion.free_body(), dt_s));
  return links - before;
}

namespace {

// Lists contacts that take overlaps beyond the probe back; false: there is none beyond `limit`.
bool list_overlaps(const World& world, WorldState& state, std::uint32_t b, double limit,
                   double stiffness) noexcept {
  bool any = false;
  state.scratch.body_contacts.clear();
  for_voxels_at(state, b, [&](std::size_t o, std::uint32_t s) {
    const voxel::SoftObject& object = *state.soft[o];
    const double h = object.lattice().min_spacing_m();
    const Held held = held_of(object, state.body_obstacles[o], s);
    std::uint8_t& jammed = state.body_obstacles[o].jammed[s];
    if (-held.gap_m > limit * h) {
      any = true;
      jammed = 1;
    }
    if (-held.gap_m <= kJammedProbe * h) return;
    BodyContact contact = contact_at(world.soft[o], object, state.body_obstacles[o].queries[b][s], s, held);
    contact.stiffness_N_per_m = stiffness;
    contact.force_N = stiffness * (-held.gap_m - kJammedProbe * h);
    add_contact(state, contact);
  });
  return any;
}

// What goes back is lifted, too, and its motion pays for that as far as it can; for `unpaid_m` in a tick
// tissue does, and no more: or a body that is crushed in would be lifted out.
FreeBodyState paid_for(const FreeBody& body, const FreeBodyState& before, FreeBodyState after,
                       double unpaid_m) noexcept {
  const glm::dvec3 weight_N = body.mass.mass_kg * body.gravity_m_per_s2;
  const double lift_J = glm::dot(weight_N, before.centre_m - after.centre_m);
  if (!(lift_J > 0.0)) return after;
  const double had_J = kinetic_energy_J(body, before), has_J = kinetic_energy_J(body, after);
  const double share = std::min(1.0, (had_J + unpaid_m * glm::length(weight_N)) / lift_J);
  after.centre_m = glm::mix(before.centre_m, after.centre_m, share);
  after.rotation = glm::slerp(before.rotation, after.rotation, share);
  const double left_J = std::max(0.0, had_J - share * lift_J);
  if (has_J > left_J) {
    after.velocity_m_per_s *= std::sqrt(left_J / has_J);
    after.spin_rad_per_s *= std::sqrt(left_J / has_J);
  }
  return after;
}

}  // namespace

double least_spacing_m(const WorldState& state) noexcept {
  double least = state.soft.front()->lattice().min_spacing_m();
  for (const auto& object : state.soft) least = std::min(least, object->lattice().min_spacing_m());
  return least;
}

bool give_way_to_tissue(const World& world, WorldState& state, std::uint32_t b, const Pose& pose,
                        double limit, double dt_s) noexcept {
  if (!(dt_s > 0.0)) return false;
  const RigidMotion& motion = world.rigid[b].motion;
  const FreeBody body = alone(motion.free_body());
  RigidState& near = state.rigid[b];
  const double stiffness = rigid_stiffness(body, dt_s);
  if (!list_overlaps(world, state, b, limit, stiffness)) return false;
  const std::size_t overlaps = state.scratch.body_contacts.size();
  add_rigid_contacts(world, state, b, stiffness);
  add_collision_stops(world, state, b, stiffness);
  const std::size_t rigid = state.scratch.body_contacts.size();
  // Into other tissue only as far as it has to: the least motion of its mass may be a turn that goes far.
  add_stops(world, state, b, kOthers * stiffness,
            [&](std::size_t o, std::uint32_t s) { return !as_good_as_rigid(state, o, s); });
  // Out of the overlap, but not on its own: what it is moved by it does not go on with …
  FreeBodyState before = state_at(body, pose), out = before;
  before.velocity_m_per_s = near.free.velocity_m_per_s;
  before.spin_rad_per_s = near.free.spin_rad_per_s;
  FreeBodyState stopped = before;
  const bool found = step_free_body(body, out, state.scratch.body_contacts, dt_s);
  // … and what it came in with ends.
  for (std::size_t n = 0; n < overlaps; ++n) state.scratch.body_contacts[n].force_N = 0.0;
  if (!found || !step_free_body(body, stopped, std::span(state.scratch.body_contacts).first(rigid), dt_s)) {
    state.faults |= fault_nonfinite_body;
    return false;
  }
  stopped.centre_m = out.centre_m;
  stopped.rotation = out.rotation;
  near.free = paid_for(motion.free_body(), before, stopped, kUnpaid * least_spacing_m(state));
  set_rigid_pose(world, state, b, pose_of(body, near.free));
  near.before = near.pose;
  near.calm_ticks = 0;
  state.body_moved_m[b] = motion.displacement_bound(pose, near.pose);
  state.body_travel_m[b] += state.body_moved_m[b];
  look_again(world, state, b);
  return true;
}

void relax_under_paths(const World& world, WorldState& state) noexcept {
  for (std::size_t o = 0; o < state.body_obstacles.size(); ++o) {
    voxel::SoftObject& object = *state.soft[o];
    const BodyObstacles& beside = state.body_obstacles[o];
    state.scratch.held_by_body.clear();
    for (const std::uint32_t s : beside.near) {
      const std::uint32_t b = beside.whose[s];
      if (b == BodyObstacles::kNobody || is_free(world, b) || !object.obstacles()[s].moving) continue;
      if (held_of(object, beside, s).gap_m >= kOnBody * object.lattice().min_spacing_m()) continue;
      if (state.scratch.held_by_body.size() == state.scratch.held_by_body.capacity()) break;
      state.scratch.held_by_body.push_back(object.lattice().surface()[s]);
    }
    if (!state.scratch.held_by_body.empty()) object.relax_held(state.scratch.held_by_body);
  }
}

void push_bodies_out_of_tissue(const World& world, WorldState& state, double dt_s) noexcept {
  if (state.body_obstacles.empty()) return;
  for (std::uint32_t b = 0; b < world.rigid.size(); ++b) {
    if (!world.rigid[b].presses_tissue || !is_free(world, b)) continue;
    give_way_to_tissue(world, state, b, state.rigid[b].pose, kTooDeep, dt_s);
    for_voxels_at(state, b, [&](std::size_t o, std::uint32_t s) {
      const voxel::SoftObject& object = *state.soft[o];
      const double gap_m = held_of(object, state.body_obstacles[o], s).gap_m;
      const double spacing_m = object.lattice().min_spacing_m();
      std::uint8_t& jammed = state.body_obstacles[o].jammed[s];
      if (gap_m > -kUnblocked * spacing_m) jammed = 0;
      // Not only once it is too deep: bodies that went from voxel to voxel, lifted out of each, never rested.
      if (gap_m < -kJammedProbe * spacing_m) jammed = 1;
    });
  }
}

}  // namespace hybrid
