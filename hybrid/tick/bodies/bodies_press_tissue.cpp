// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tick/bodies/bodies_press_tissue.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "hybrid/tick/bodies/tissue_supports_bodies.h"
#include "polygon/surface/signed_distance.h"

namespace hybrid {
namespace {

// Exact queries per tick and soft object. A query takes 50 to 100 ns for a primitive and 1 to 2 µs for a
// mesh.
constexpr std::size_t kMaxSurfaceQueries = 3000, kMaxMeshQueries = 750;
constexpr double kWatchedRange = 1.5;  // spacings: a voxel this near to a body gets a half-space from it
constexpr double kQueryAhead = 8.0;    // spacings added to a query's range, so that the next is not due soon
// Spacings: a voxel near a standing body is queried again after it moved this far.
constexpr double kRequeryMotion = 0.02;
// Spacings: a deep voxel leaves a body by at most this much plus the body's motion in a tick.
constexpr double kExitStep = 0.25;
constexpr double kLiesOn = 1e-3;  // spacings: a voxel this near to the plane of its half-space lies on it
// Spacings: a fixed surface this near gives the voxel its half-space, even if a body is nearer.
constexpr double kNearFixed = 0.3;
// Sine of the smallest angle between body and bone at which a voxel has a way out.
constexpr double kLeastGapSine = 0.4;
constexpr double kNoWayOut = 0.5;     // spacings: a voxel that is deeper after the wave has no way out
constexpr double kOnSurface = 1e-9;   // spacings: a point this near to a surface counts as on it
constexpr double kLongestStep = 0.5;  // spacings: longest step of a body
constexpr int kMaxSteps = 8;          // largest number of steps in a tick
constexpr double kSqueezed = 0.05;    // spacings: a deeper overlap is a fault
constexpr int kMaxRounds = 4;         // per step: rounds in which free body and tissue give way in turn
constexpr double kStopDepth = 0.25;   // spacings: a free body this deep in tissue stops

bool is_set(const voxel::Obstacle& o) {
  return o.normal != glm::vec3(0.0F);
}

// How far a voxel is from the plane it may not cross (m).
double slack_m(const voxel::Obstacle& o, const glm::dvec3& u) {
  return glm::dot(glm::dvec3(o.normal), u) - static_cast<double>(o.bound);
}

// A moment within the tick: simulated time, and the fraction of the tick that is still to come.
struct Moment {
  double t_s = 0.0, to_come = 0.0;
};

// Pose of a body at `moment`. A free body moves straight from its previous pose to its present one.
Pose pose_at(const World& world, const WorldState& state, std::uint32_t b, const Moment& moment) noexcept {
  if (!is_free(world, b)) return world.rigid[b].motion.pose_at(moment.t_s);
  const Pose &before = state.rigid[b].before, &now = state.rigid[b].pose;
  return {glm::mix(now.position_m, before.position_m, moment.to_come),
          glm::slerp(now.rotation, before.rotation, moment.to_come)};
}

class TissueAtBodies {
 public:
  // Bodies are queried in their pose at `moment`.
  TissueAtBodies(const World& world, WorldState& state, std::size_t soft, const Moment& moment = {})
      : world_(world),
        state_(state),
        body_(world.soft[soft]),
        object_(*state.soft[soft]),
        beside_(state.body_obstacles[soft]),
        spacing_m_(object_.lattice().min_spacing_m()),
        watched_m_(kWatchedRange * object_.lattice().max_spacing_m()),
        moment_(moment) {}

  // Lists the voxels that may be near body b and are due for a query.
  void list_due(std::uint32_t b) noexcept {
    const polygon::RigidSurface& surface = *world_.rigid[b].surface;
    meshes_ = meshes_ || surface.element_count() > 1;
    const double moved = state_.body_moved_m[b];
    for (const std::uint32_t s : beside_.near) {
      if (beside_.whose[s] != b) continue;
      const double since = glm::distance(displacement(s), glm::dvec3(query_of(b, s).u));
      if (moved > 0.0 || since > kRequeryMotion * spacing_m_) add(remaining_travel_m(b, s), b, s);
    }
    if (moved == 0.0 && object_.asleep()) return;
    const BodyFrame& frame = frame_of(b);
    const glm::dvec3 half = 0.5 * (surface.upper() - surface.lower());
    glm::dvec3 reach(watched_m_ + moved + object_.voxel_radius() + 2.0 * state_.map.cell_m());
    for (int axis = 0; axis < 3; ++axis) reach += glm::abs(frame.rotation[axis]) * half[axis];
    const glm::dvec3 middle = frame.to_scene(0.5 * (surface.upper() + surface.lower()));
    const std::size_t count = state_.map.soft_in(middle - reach, middle + reach, state_.scratch.map_hits);
    if (count == state_.scratch.map_hits.size()) state_.faults |= fault_body_crowded;
    const std::size_t surface_count = object_.lattice().surface().size();
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t s = state_.scratch.map_hits[i] - body_.first_number;
      if (state_.scratch.map_hits[i] < body_.first_number || s >= surface_count || beside_.whose[s] == b)
        continue;
      const double left_m = remaining_travel_m(b, s);
      if (left_m <= moved) add(left_m, b, s);
    }
  }

  // Queries the listed voxels, the nearest first, within the budget.
  void query() noexcept {
    auto& due = state_.scratch.due;
    const std::size_t most = meshes_ ? kMaxMeshQueries : kMaxSurfaceQueries;
    if (due.size() > most) {
      const auto end = due.begin() + static_cast<std::ptrdiff_t>(most);
      std::nth_element(due.begin(), end, due.end());
      // A voxel that was left out may overlap a body.
      for (auto d = end; d != due.end(); ++d) {
        if (d->left_m < -watched_m_ - kSqueezed * spacing_m_) state_.faults |= fault_body_crowded;
      }
      due.resize(most);
    }
    // The map lists voxels in the order in which they moved. Sorting makes the result independent of that.
    std::sort(due.begin(), due.end(), [](const DueQuery& a, const DueQuery& b) {
      return a.body != b.body ? a.body < b.body : a.surface_number < b.surface_number;
    });
    for (const DueQuery& d : due) query(d.body, d.surface_number);
  }

  // Chooses the half-space of each voxel near a body, and moves voxels out that are inside a body.
  void press() noexcept {
    auto& in_the_way = state_.scratch.in_the_way;
    in_the_way.clear();
    std::size_t kept = 0;
    for (const std::uint32_t s : beside_.near) {
      choose_obstacle(s);
      if (set_way_out(s)) in_the_way.push_back(s);
      if (beside_.whose[s] != BodyObstacles::kNobody) {
        beside_.near[kept++] = s;
      } else {
        beside_.listed[s] = 0;
      }
    }
    const bool all_left = kept == 0 && !beside_.near.empty();
    beside_.near.resize(kept);
    if (all_left) mark_all_dirty();
    if (in_the_way.empty()) return;
    for (const std::uint32_t s : beside_.near) tolerate_depth(s);
    object_.leave_obstacles(in_the_way);
    // Voxels that the wave moved into bone are moved out again, even where the bone is inside the body. A
    // voxel whose depth in a body was tolerated leaves the body by relaxation.
    in_the_way.clear();
    for (const std::uint32_t s : beside_.near) {
      choose_obstacle(s);
      const voxel::Obstacle& o = object_.obstacles()[s];
      if (is_set(o) && !o.moving && slack_m(o, displacement(s)) < -kLiesOn * spacing_m_)
        in_the_way.push_back(s);
    }
    if (!in_the_way.empty()) object_.leave_obstacles(in_the_way);
    let_deep_through();
  }

  void query_again(std::uint32_t b) noexcept {
    for (const std::uint32_t s : beside_.near) {
      if (beside_.whose[s] == b) query(b, s);
    }
  }

  void query_all(std::uint32_t b) noexcept {
    const auto count = static_cast<std::uint32_t>(object_.lattice().surface().size());
    for (std::uint32_t s = 0; s < count; ++s) query(b, s);
    for (const std::uint32_t s : beside_.near) choose_obstacle(s);
  }

  // Sets the voxel's half-space to that of the nearer surface. Near a fixed surface it is always that of the
  // fixed surface.
  void choose_obstacle(std::uint32_t s) noexcept {
    const voxel::Obstacle &moving = beside_.moving[s], &standing = beside_.standing[s];
    const glm::dvec3 u = displacement(s);
    const voxel::Obstacle* in_force = &standing;
    if (is_set(moving)) {
      const double of_standing = is_set(standing) ? slack_m(standing, u) : std::numeric_limits<double>::max();
      const double at_bone = kNearFixed * spacing_m_ + state_.body_moved_m[beside_.whose[s]];
      if (of_standing > at_bone && slack_m(moving, u) < of_standing) in_force = &moving;
    }
    const voxel::Obstacle old = object_.obstacles()[s];
    if (old.normal == in_force->normal && old.bound == in_force->bound && old.moving == in_force->moving)
      return;
    object_.set_obstacle(s, *in_force);
    if (is_set(old) && slack_m(old, u) < kLiesOn * spacing_m_) object_.mark_dirty(s);
  }

  // Is tissue deeper in a body than allowed? Anchored voxels count too, although they cannot leave the body's
  // way.
  [[nodiscard]] bool squeezed() noexcept {
    double worst = -kSqueezed * spacing_m_;
    std::uint32_t where = BodyObstacles::kNobody;
    for (const std::uint32_t s : beside_.near) {
      const double here = slack_m(beside_.moving[s], displacement(s));
      if (here >= worst) continue;
      worst = here;
      where = s;
    }
    if (where == BodyObstacles::kNobody) return false;
    polygon::SignedDistance near;
    const double radius = object_.voxel_radius();
    return signed_distance_at(beside_.whose[where], where, radius, near) &&
           near.distance < radius - kSqueezed * spacing_m_;
  }

 private:
  // A voxel that is far inside and could not leave is let through the body. If it were pushed on, it would
  // leave on the nearest side and might be caught behind the body.
  void let_deep_through() noexcept {
    for (const std::uint32_t s : beside_.near) {
      // A free body gives way itself.
      if (beside_.whose[s] == BodyObstacles::kNobody || is_free(world_, beside_.whose[s])) continue;
      if (slack_m(beside_.moving[s], displacement(s)) >= -kNoWayOut * spacing_m_) continue;
      query_of(beside_.whose[s], s).given_up = true;
      forget(s);
      choose_obstacle(s);
      state_.faults |= fault_body_squeezed;
    }
  }
  // Links at their limits may have held squeezed tissue far from equilibrium, and relaxation may have skipped
  // it. When the last body has left, all tissue must relax.
  void mark_all_dirty() noexcept {
    if ((state_.faults & fault_body_squeezed) == 0) return;
    for (std::size_t s = 0; s < object_.lattice().surface().size(); ++s) object_.mark_dirty(s);
  }
  // Is voxel s inside a moving body, and is there a way out that does not lead into a fixed surface? If the
  // shortest way out leads into one, the voxel gets another half-space in each tick until it is out. This one
  // moves the voxel out along the fixed surface.
  bool set_way_out(std::uint32_t s) noexcept {
    const voxel::Obstacle &moving = beside_.moving[s], &standing = beside_.standing[s];
    if (!is_set(moving)) return false;
    const glm::dvec3 u = displacement(s), n(moving.normal);
    const double depth = -slack_m(moving, u) - tolerated_depth_m(s);
    // At a body that stands, relaxation alone brings voxels out; a wave each tick would prevent rest.
    if (!(depth > 0.0) || state_.body_moved_m[beside_.whose[s]] == 0.0) return false;
    if (!is_set(standing) || slack_m(standing, u + depth * n) >= 0.0) {
      object_.set_obstacle(s, moving);
      return true;
    }
    const glm::dvec3 wall(standing.normal), along = n - glm::dot(n, wall) * wall;
    const double part = glm::length(along);
    if (part < kLeastGapSine) return false;  // no way out between body and fixed surface
    object_.set_obstacle(
        s, {glm::vec3(along / part), static_cast<float>(glm::dot(along / part, u) + depth / part), true});
    return true;
  }
  // Depth (m) by which a voxel may stay in a body. A jammed voxel cannot leave the body completely, and the
  // wave must not demand it. Otherwise the wave would pull neighbours of the voxel into the body, through
  // links at their limits, and these neighbours would in turn pull at the voxel. Of two voxels that are
  // pulled apart the wave favours one, so bodies would creep without end.
  [[nodiscard]] double tolerated_depth_m(std::uint32_t s) const noexcept {
    return beside_.jammed[s] != 0 ? kJammedProbe * spacing_m_ : 0.0;
  }
  void tolerate_depth(std::uint32_t s) noexcept {
    voxel::Obstacle o = object_.obstacles()[s];
    if (beside_.jammed[s] == 0 || !o.moving) return;
    o.bound -= static_cast<float>(tolerated_depth_m(s));
    object_.set_obstacle(s, o);
  }
  [[nodiscard]] glm::dvec3 displacement(std::uint32_t s) const noexcept {
    return object_.state().at(object_.lattice().surface()[s]);
  }
  [[nodiscard]] BodyQuery& query_of(std::uint32_t b, std::uint32_t s) const noexcept {
    return beside_.queries[b][s];
  }
  // How far (m) body and voxel together may still move before the voxel can be within the watched range.
  [[nodiscard]] double remaining_travel_m(std::uint32_t b, std::uint32_t s) const noexcept {
    const BodyQuery& seen = query_of(b, s);
    return seen.until_m - state_.body_travel_m[b] - glm::distance(displacement(s), glm::dvec3(seen.u));
  }
  void add(double left_m, std::uint32_t b, std::uint32_t s) noexcept {
    if (state_.scratch.due.size() < state_.scratch.due.capacity())
      state_.scratch.due.push_back({left_m, b, s});
  }

  [[nodiscard]] const BodyFrame& frame_of(std::uint32_t b) noexcept {
    if (moment_.to_come == 0.0) return state_.rigid[b].frame;
    if (frame_of_ != b) frame_ = BodyFrame(pose_at(world_, state_, b, moment_));
    frame_of_ = b;
    return frame_;
  }
  [[nodiscard]] bool signed_distance_at(std::uint32_t b, std::uint32_t s, double range,
                                        polygon::SignedDistance& out) noexcept {
    const BodyFrame& frame = frame_of(b);
    const glm::dvec3 at = frame.to_body(body_.to_scene(object_.position(object_.lattice().surface()[s])));
    glm::dvec3 known(0.0);
    if (beside_.whose[s] == b)
      known = (body_.pose.rotation * glm::dvec3(beside_.moving[s].normal)) * frame.rotation;
    const polygon::RigidSurface& surface = *world_.rigid[b].surface;
    const bool found = polygon::signed_distance(surface, at, range, known, out);
    if (found && std::abs(out.distance) > kOnSurface * spacing_m_) return found;
    // On the surface itself the outward direction is undefined, and the last known one may belong to another
    // face. A point slightly further from the body's middle is queried instead.
    const glm::dvec3 away = at - 0.5 * (surface.lower() + surface.upper());
    const double far = glm::length(away);
    if (!(far > 0.0) || (!found && far > range)) return found;
    return polygon::signed_distance(surface, at + (2.0 * kOnSurface * spacing_m_ / far) * away, range, known,
                                    out);
  }

  void query(std::uint32_t b, std::uint32_t s) noexcept {
    const double moved = state_.body_moved_m[b], watched = watched_m_ + moved,
                 radius = object_.voxel_radius(),
                 range = watched + radius + kQueryAhead * object_.lattice().max_spacing_m();
    polygon::SignedDistance near;
    const bool found = signed_distance_at(b, s, range, near);
    const double gap = found ? near.distance - radius : range - radius;
    const glm::dvec3 u = displacement(s);
    const bool given_up = query_of(b, s).given_up && (!found || gap < 0.0);
    query_of(b, s) = {glm::vec3(u), given_up, state_.body_travel_m[b] + gap - watched_m_};
    std::uint32_t& whose = beside_.whose[s];
    if (!found || given_up || gap >= watched) {
      if (whose == b) forget(s);
      return;
    }
    if (whose != BodyObstacles::kNobody && whose != b && slack_m(beside_.moving[s], u) <= gap) return;
    const glm::dvec3 n = glm::inverse(body_.pose.rotation) * (frame_of(b).rotation * near.normal);
    // A voxel that is deep because it was squeezed leaves the body a little in each tick.
    const double depth = std::min(-gap, moved + kExitStep * spacing_m_);
    beside_.moving[s] = {glm::vec3(n), static_cast<float>(glm::dot(n, u) + depth), true};
    whose = b;
    if (beside_.listed[s] != 0) return;
    beside_.listed[s] = 1;
    beside_.near.push_back(s);
  }
  void forget(std::uint32_t s) noexcept {
    beside_.whose[s] = BodyObstacles::kNobody;
    beside_.moving[s] = {};
    beside_.jammed[s] = 0;
  }

  const World& world_;
  WorldState& state_;
  const SoftBody& body_;
  voxel::SoftObject& object_;
  BodyObstacles& beside_;
  double spacing_m_, watched_m_;
  Moment moment_;
  BodyFrame frame_;  // frame of body frame_of_
  std::uint32_t frame_of_ = BodyObstacles::kNobody;
  bool meshes_ = false;  // some of the bodies are meshes
};

}  // namespace

void query_bodies(const World& world, WorldState& state) {
  for (std::size_t o = 0; o < state.body_obstacles.size(); ++o) {
    TissueAtBodies tissue(world, state, o);
    for (std::uint32_t b = 0; b < world.rigid.size(); ++b) {
      if (world.rigid[b].presses_tissue) tissue.query_all(b);
    }
  }
}

namespace {

// Presses the bodies into tissue in their poses at `moment`. They moved by body_moved_m since the last step.
void press_once(const World& world, WorldState& state, const Moment& moment) noexcept {
  for (std::size_t o = 0; o < state.body_obstacles.size(); ++o) {
    TissueAtBodies tissue(world, state, o, moment);
    state.scratch.due.clear();
    for (std::uint32_t b = 0; b < world.rigid.size(); ++b) {
      if (world.rigid[b].presses_tissue) tissue.list_due(b);
    }
    tissue.query();
    tissue.press();
  }
}

// If tissue could not leave a free body's way, the body gives way. The body may turn, and other tissue may
// then have to leave its way. So body and tissue give way in turn.
void stop_in_tissue(const World& world, WorldState& state, std::uint32_t b, const Moment& moment,
                    double dt_s) noexcept {
  Pose pose = pose_at(world, state, b, moment);
  double limit = moment.to_come > 0.0 ? kStopDepth : kTooDeep;
  for (int n = 0; n < kMaxRounds && give_way_to_tissue(world, state, b, pose, limit, dt_s); ++n) {
    for (std::size_t o = 0; o < state.body_obstacles.size(); ++o) TissueAtBodies(world, state, o).press();
    pose = state.rigid[b].pose;
    limit = kTooDeep;
  }
}

}  // namespace

void press_bodies_into_tissue(const World& world, WorldState& state, double dt_s) noexcept {
  if (state.body_obstacles.empty()) return;
  double steps = 1.0;
  for (const double moved : state.body_moved_m) {
    for (const auto& object : state.soft)
      steps =
          std::max(steps, std::ceil(moved / (kLongestStep * object->lattice().min_spacing_m()) - kOnSurface));
  }
  const int count = static_cast<int>(std::min(steps, static_cast<double>(kMaxSteps)));
  const double now_s = state.clock.now_s(), step_s = dt_s / count;
  for (int n = 1; n <= count; ++n) {
    const double to_come = 1.0 - static_cast<double>(n) / count, back_s = n == count ? 0.0 : dt_s * to_come;
    const Moment from{now_s - back_s - step_s, to_come + 1.0 / count}, to{now_s - back_s, to_come};
    for (std::uint32_t b = 0; b < world.rigid.size(); ++b) {
      if (!world.rigid[b].presses_tissue) continue;
      if (count > 1)
        state.body_moved_m[b] = world.rigid[b].motion.displacement_bound(pose_at(world, state, b, from),
                                                                         pose_at(world, state, b, to));
      state.body_travel_m[b] += state.body_moved_m[b];
    }
    press_once(world, state, to);
    for (std::uint32_t b = 0; b < world.rigid.size(); ++b) {
      if (world.rigid[b].presses_tissue && is_free(world, b)) stop_in_tissue(world, state, b, to, dt_s);
    }
  }
  relax_under_paths(world, state);
}

void query_again(const World& world, WorldState& state, std::uint32_t b) noexcept {
  for (std::size_t o = 0; o < state.body_obstacles.size(); ++o)
    TissueAtBodies(world, state, o).query_again(b);
}

void flag_squeezed_bodies(const World& world, WorldState& state) noexcept {
  for (std::size_t o = 0; o < state.body_obstacles.size(); ++o) {
    if (TissueAtBodies(world, state, o).squeezed()) state.faults |= fault_body_squeezed;
  }
}

const voxel::Obstacle& standing_obstacle(const WorldState& state, std::size_t soft, std::size_t s) noexcept {
  return state.body_obstacles.empty() ? state.soft[soft]->obstacles()[s]
                                      : state.body_obstacles[soft].standing[s];
}

void set_standing_obstacle(WorldState& state, std::size_t soft, std::size_t s,
                           const voxel::Obstacle& obstacle) noexcept {
  if (state.body_obstacles.empty()) {
    state.soft[soft]->set_obstacle(s, obstacle);
    return;
  }
  BodyObstacles& beside = state.body_obstacles[soft];
  beside.standing[s] = obstacle;
  if (!is_set(beside.moving[s])) state.soft[soft]->set_obstacle(s, obstacle);
}

}  // namespace hybrid
