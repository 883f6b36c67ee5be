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

constexpr double kReleased = 0.002;  // spacings: a voxel no deeper than this is no longer jammed
constexpr double kFreeLift = 0.005;  // spacings: lift per tick for which no kinetic energy is needed
constexpr double kOnBody = 1e-3;     // spacings: a voxel this near to the body lies on it
// Regularises directions that the normals hardly span. Unit: trace of the sum of n nᵀ over the normals n.
constexpr double kRegularisation = 1e-3;
// Factor on the stiffness with which links resist a body. The part beyond 1 acts as a damper. It is needed
// under asynchronous relaxation. Between two results tissue acts as a spring, and a result may return energy
// that tissue took up before an earlier result. Without the damper bodies would hop.
constexpr double kLinkDamping = 3.0;
// Factor on the stiffness of links at their limits. Their shares of a load change abruptly, which would make
// bodies jitter.
constexpr double kLimitDamping = 20.0;
constexpr double kMovableTissue = 1e-2;  // factor on the stiffness of stops at tissue that can still give way
// Stiffness of stops: as good as rigid. Unit: mass / dt², which stops the body within a tick.
constexpr double kStopStiffness = 1e4;

// Place of a surface voxel relative to the body that is nearest to it.
struct NearVoxel {
  glm::dvec3 normal;  // out of the body, volume frame
  double gap_m;       // negative: inside the body
};

NearVoxel near_voxel(const voxel::SoftObject& object, const BodyObstacles& beside, std::uint32_t s) noexcept {
  const voxel::Obstacle& o = beside.moving[s];
  const glm::dvec3 n(o.normal);
  return {n, glm::dot(n, object.state().at(object.lattice().surface()[s])) - static_cast<double>(o.bound)};
}

// The contact of a near voxel, with zero force. The contact's point is the point of the body's surface that
// was nearest at the query. The voxel may have moved along its half-space since then. A force at the voxel's
// present place would turn a ball.
BodyContact contact_at(const SoftBody& body, const voxel::SoftObject& object, const BodyQuery& query,
                       std::uint32_t s, const NearVoxel& voxel_at) noexcept {
  const glm::dvec3 out = body.pose.rotation * voxel_at.normal;
  const glm::dvec3 u(query.u), at = body.to_scene(object.lattice().rest(object.lattice().surface()[s]) + u);
  const double moved = glm::dot(voxel_at.normal, object.state().at(object.lattice().surface()[s]) - u);
  return {at - (object.voxel_radius() + voxel_at.gap_m - moved) * out, -out, 0.0, 0.0};
}

// Visits every voxel whose nearest body is b: visit(soft object, surface number).
template <class Visit>
void for_voxels_at(const WorldState& state, std::uint32_t b, const Visit& visit) noexcept {
  for (std::size_t o = 0; o < state.body_obstacles.size(); ++o) {
    for (const std::uint32_t s : state.body_obstacles[o].near) {
      if (state.body_obstacles[o].whose[s] == b) visit(o, s);
    }
  }
}

double rigid_stiffness(const FreeBody& body, double dt_s) noexcept {
  return dt_s > 0.0 ? kStopStiffness * body.mass.mass_kg / (dt_s * dt_s) : 0.0;
}

bool is_jammed(const WorldState& state, std::size_t o, std::uint32_t s) noexcept {
  const voxel::Lattice& lattice = state.soft[o]->lattice();
  return state.body_obstacles[o].jammed[s] != 0 || lattice.anchored(lattice.surface()[s]);
}

// Adds contacts at the voxels for which which(o, s) is true. They stop the body where it overlaps such a
// voxel by kJammedProbe.
template <class Which>
void add_stops(const World& world, WorldState& state, std::uint32_t b, double stiffness,
               const Which& which) noexcept {
  for_voxels_at(state, b, [&](std::size_t o, std::uint32_t s) {
    if (!which(o, s)) return;
    const voxel::SoftObject& object = *state.soft[o];
    const NearVoxel voxel_at = near_voxel(object, state.body_obstacles[o], s);
    BodyContact contact =
        contact_at(world.soft[o], object, state.body_obstacles[o].queries[b][s], s, voxel_at);
    const double left = voxel_at.gap_m + kJammedProbe * object.lattice().min_spacing_m();
    contact.force_N = -stiffness * std::max(left, 0.0);
    contact.stiffness_N_per_m = stiffness;
    add_contact(state, contact);
  });
}

void add_jammed_contacts(const World& world, WorldState& state, std::uint32_t b, double stiffness) noexcept {
  add_stops(world, state, b, stiffness,
            [&](std::size_t o, std::uint32_t s) { return is_jammed(state, o, s); });
}

// Is the voxel on the body, or would its links alone pull it there?
bool presses(voxel::SoftObject& object, std::uint32_t s, const NearVoxel& voxel_at) noexcept {
  if (voxel_at.gap_m < kOnBody * object.lattice().min_spacing_m()) return true;
  const voxel::VoxelId v = object.lattice().surface()[s];
  const glm::dvec3 stiffness = 1.0 / object.compliance(v);
  const glm::dvec3 place =
      voxel::clamp_to_links(object.lattice(), object.state(), v, object.unconstrained_minimum(v));
  const glm::dvec3 left = place - object.state().at(v) + voxel_at.gap_m * voxel_at.normal;
  return glm::dot(voxel_at.normal, stiffness * left) < 0.0;
}

// Lists the movable voxels of soft object o near body b. Those that press on the body come first. Returns how
// many press.
std::size_t list_pressing(WorldState& state, std::uint32_t b, std::size_t o) noexcept {
  voxel::SoftObject& object = *state.soft[o];
  const BodyObstacles& beside = state.body_obstacles[o];
  std::size_t pressed = 0;
  state.scratch.body_surface_numbers.clear();
  for (const bool on : {true, false}) {
    for (const std::uint32_t s : beside.near) {
      if (beside.whose[s] != b || !object.obstacles()[s].moving) continue;
      if (object.lattice().anchored(object.lattice().surface()[s])) continue;
      if (presses(object, s, near_voxel(object, beside, s)) != on) continue;
      if (state.scratch.body_surface_numbers.size() == state.scratch.body_surface_numbers.capacity()) {
        state.faults |= fault_body_crowded;
        break;
      }
      state.scratch.body_surface_numbers.push_back(s);
    }
    if (on) pressed = state.scratch.body_surface_numbers.size();
  }
  state.scratch.body_voxels.clear();
  for (const std::uint32_t s : state.scratch.body_surface_numbers)
    state.scratch.body_voxels.push_back(object.lattice().surface()[s]);
  return pressed;
}

// How far (m) a voxel can move towards the body; negative: it is in the body. If the chain keeps the voxel
// from reaching the body (`tight`), the force that pulls it passes to voxels on the body. So only the
// distance that the links allow may reduce that force.
double distance_to_body_m(const voxel::SoftObject& object, std::uint32_t s, const NearVoxel& voxel_at,
                          bool tight) noexcept {
  if (!tight || voxel_at.gap_m <= 0.0) return voxel_at.gap_m;
  const voxel::VoxelId v = object.lattice().surface()[s];
  const glm::dvec3 u = object.state().at(v);
  const glm::dvec3 place =
      voxel::clamp_to_links(object.lattice(), object.state(), v, u - voxel_at.gap_m * voxel_at.normal);
  return glm::clamp(glm::dot(voxel_at.normal, u - place), 0.0, voxel_at.gap_m);
}

// Adds the contact forces of the listed voxels. The force of a contact is the one that pulls its voxel into
// the body along the normal.
//
// If AdmmRegion has found multipliers that balance all loads, these are the forces. Otherwise only the sum of
// the loads is known where links are at their limits. Such links pass loads from voxel to voxel, also across
// the normals. The forces along the normals may lack a part of this sum. This part is divided among the
// voxels at limits, along their normals, such that the sum of the squared shares is least. If instead each
// voxel got the load that its links show, a ball would turn, although no surface without friction can turn a
// ball. The shares are not exact either: their torque does not support a box. So multipliers are preferred.
void add_pressing(const World& world, WorldState& state, std::uint32_t b, std::size_t o) noexcept {
  const voxel::SoftObject& object = *state.soft[o];
  const BodyObstacles& beside = state.body_obstacles[o];
  const auto pressed = [&](std::size_t n, const glm::dvec3& normal) {
    return std::max(0.0, -glm::dot(normal, state.scratch.body_loads[n].force_N));
  };
  glm::dvec3 lacking_N(0.0);
  glm::dmat3 normals(0.0);
  for (std::size_t n = 0; n < state.scratch.body_surface_numbers.size(); ++n) {
    if (!state.scratch.body_loads[n].at_limit) continue;
    const glm::dvec3 normal(beside.moving[state.scratch.body_surface_numbers[n]].normal);
    lacking_N += -state.scratch.body_loads[n].force_N - pressed(n, normal) * normal;
    normals += glm::outerProduct(normal, normal);
  }
  const double most = normals[0][0] + normals[1][1] + normals[2][2];
  const glm::dvec3 share =
      most > 0.0 ? glm::inverse(normals + glm::dmat3(kRegularisation * most)) * lacking_N : glm::dvec3(0.0);
  for (std::size_t n = 0; n < state.scratch.body_surface_numbers.size(); ++n) {
    const std::uint32_t s = state.scratch.body_surface_numbers[n];
    const voxel::ContactLoad& load = state.scratch.body_loads[n];
    const NearVoxel voxel_at = near_voxel(object, beside, s);
    BodyContact contact = contact_at(world.soft[o], object, beside.queries[b][s], s, voxel_at);
    const double springs = glm::dot(voxel_at.normal, load.stiffness_N_per_m * voxel_at.normal);
    contact.stiffness_N_per_m = kLinkDamping * springs;
    contact.force_N = -glm::dot(voxel_at.normal, load.force_N) -
                      springs * distance_to_body_m(object, s, voxel_at, load.at_limit);
    if (load.has_multipliers) {
      const bool presses = load.pressed_N > 0.0;
      contact.force_N = presses ? load.pressed_N : -kLinkDamping * springs * std::max(voxel_at.gap_m, 0.0);
      contact.stiffness_N_per_m = (presses && load.at_limit ? kLimitDamping : kLinkDamping) * springs;
      add_contact(state, contact);
      continue;
    }
    // A voxel that would not reach the body by itself presses only from the place where voxel and body meet.
    if (contact.force_N < 0.0) contact.force_N *= kLinkDamping;
    if (load.at_limit && pressed(n, voxel_at.normal) > 0.0) {
      contact.force_N += glm::dot(share, voxel_at.normal);
      contact.stiffness_N_per_m = kLimitDamping * springs;
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
    state.soft[o]->contact_loads(state.scratch.body_voxels, pressed, state.scratch.body_loads);
    add_pressing(world, state, b, o);
  }
  const std::size_t links = state.scratch.body_contacts.size();
  add_jammed_contacts(world, state, b, rigid_stiffness(world.rigid[b].motion.free_body(), dt_s));
  return links - before;
}

namespace {

// Lists contacts that remove overlaps deeper than kJammedProbe, and marks voxels deeper than `limit`
// (spacings) as jammed. Returns false if there are none deeper than `limit`.
bool list_overlaps(const World& world, WorldState& state, std::uint32_t b, double limit,
                   double stiffness) noexcept {
  bool any = false;
  state.scratch.body_contacts.clear();
  for_voxels_at(state, b, [&](std::size_t o, std::uint32_t s) {
    const voxel::SoftObject& object = *state.soft[o];
    const double h = object.lattice().min_spacing_m();
    const NearVoxel voxel_at = near_voxel(object, state.body_obstacles[o], s);
    std::uint8_t& jammed = state.body_obstacles[o].jammed[s];
    if (-voxel_at.gap_m > limit * h) {
      any = true;
      jammed = 1;
    }
    if (-voxel_at.gap_m <= kJammedProbe * h) return;
    BodyContact contact =
        contact_at(world.soft[o], object, state.body_obstacles[o].queries[b][s], s, voxel_at);
    contact.stiffness_N_per_m = stiffness;
    contact.force_N = stiffness * (-voxel_at.gap_m - kJammedProbe * h);
    add_contact(state, contact);
  });
  return any;
}

// A body that is moved back may also be lifted. Its kinetic energy provides the energy of the lift as far as
// possible. Tissue provides the energy for at most `free_lift_m` of lift per tick, so that a body that is
// pressed in is not lifted out.
FreeBodyState limit_by_energy(const FreeBody& body, const FreeBodyState& before, FreeBodyState after,
                              double free_lift_m) noexcept {
  const glm::dvec3 weight_N = body.mass.mass_kg * body.gravity_m_per_s2;
  const double lift_J = glm::dot(weight_N, before.centre_m - after.centre_m);
  if (!(lift_J > 0.0)) return after;
  const double had_J = kinetic_energy_J(body, before), has_J = kinetic_energy_J(body, after);
  const double share = std::min(1.0, (had_J + free_lift_m * glm::length(weight_N)) / lift_J);
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

double smallest_spacing_m(const WorldState& state) noexcept {
  double least = state.soft.front()->lattice().min_spacing_m();
  for (const auto& object : state.soft) least = std::min(least, object->lattice().min_spacing_m());
  return least;
}

bool give_way_to_tissue(const World& world, WorldState& state, std::uint32_t b, const Pose& pose,
                        double limit, double dt_s) noexcept {
  if (!(dt_s > 0.0)) return false;
  const RigidMotion& motion = world.rigid[b].motion;
  const FreeBody body = without_external_loads(motion.free_body());
  RigidState& near = state.rigid[b];
  const double stiffness = rigid_stiffness(body, dt_s);
  if (!list_overlaps(world, state, b, limit, stiffness)) return false;
  const std::size_t overlaps = state.scratch.body_contacts.size();
  add_jammed_contacts(world, state, b, stiffness);
  add_collision_stops(world, state, b, stiffness);
  const std::size_t rigid = state.scratch.body_contacts.size();
  // The body enters other tissue only as far as necessary. Without these stops the motion of least kinetic
  // energy may be a turn that goes far into tissue.
  add_stops(world, state, b, kMovableTissue * stiffness,
            [&](std::size_t o, std::uint32_t s) { return !is_jammed(state, o, s); });
  // The first step moves the body out of the overlap. Only the pose after this step is kept.
  FreeBodyState before = state_at(body, pose), out = before;
  before.velocity_m_per_s = near.free.velocity_m_per_s;
  before.spin_rad_per_s = near.free.spin_rad_per_s;
  FreeBodyState stopped = before;
  const bool found = step_free_body(body, out, state.scratch.body_contacts, dt_s);
  // The second step ends the velocity into the tissue. Only the velocity after this step is kept.
  for (std::size_t n = 0; n < overlaps; ++n) state.scratch.body_contacts[n].force_N = 0.0;
  if (!found || !step_free_body(body, stopped, std::span(state.scratch.body_contacts).first(rigid), dt_s)) {
    state.faults |= fault_nonfinite_body;
    return false;
  }
  stopped.centre_m = out.centre_m;
  stopped.rotation = out.rotation;
  near.free = limit_by_energy(motion.free_body(), before, stopped, kFreeLift * smallest_spacing_m(state));
  set_rigid_pose(world, state, b, pose_of(body, near.free));
  near.before = near.pose;
  near.rest_ticks = 0;
  state.body_moved_m[b] = motion.displacement_bound(pose, near.pose);
  state.body_travel_m[b] += state.body_moved_m[b];
  query_again(world, state, b);
  return true;
}

void relax_under_paths(const World& world, WorldState& state) noexcept {
  for (std::size_t o = 0; o < state.body_obstacles.size(); ++o) {
    voxel::SoftObject& object = *state.soft[o];
    const BodyObstacles& beside = state.body_obstacles[o];
    state.scratch.body_voxels.clear();
    for (const std::uint32_t s : beside.near) {
      const std::uint32_t b = beside.whose[s];
      if (b == BodyObstacles::kNobody || is_free(world, b) || !object.obstacles()[s].moving) continue;
      if (near_voxel(object, beside, s).gap_m >= kOnBody * object.lattice().min_spacing_m()) continue;
      if (state.scratch.body_voxels.size() == state.scratch.body_voxels.capacity()) break;
      state.scratch.body_voxels.push_back(object.lattice().surface()[s]);
    }
    if (!state.scratch.body_voxels.empty()) object.relax_at_obstacles(state.scratch.body_voxels);
  }
}

void push_bodies_out_of_tissue(const World& world, WorldState& state, double dt_s) noexcept {
  if (state.body_obstacles.empty()) return;
  for (std::uint32_t b = 0; b < world.rigid.size(); ++b) {
    if (!world.rigid[b].presses_tissue || !is_free(world, b)) continue;
    give_way_to_tissue(world, state, b, state.rigid[b].pose, kTooDeep, dt_s);
    for_voxels_at(state, b, [&](std::size_t o, std::uint32_t s) {
      const voxel::SoftObject& object = *state.soft[o];
      const double gap_m = near_voxel(object, state.body_obstacles[o], s).gap_m;
      const double spacing_m = object.lattice().min_spacing_m();
      std::uint8_t& jammed = state.body_obstacles[o].jammed[s];
      if (gap_m > -kReleased * spacing_m) jammed = 0;
      // Every overlap beyond the probe counts. If bodies were only lifted out once they are too deep, they
      // would never come to rest.
      if (gap_m < -kJammedProbe * spacing_m) jammed = 1;
    });
  }
}

}  // namespace hybrid
