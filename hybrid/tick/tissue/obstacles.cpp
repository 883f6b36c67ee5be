// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tick/tissue/obstacles.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <span>

#include "hybrid/tick/bodies/bodies_press_tissue.h"
#include "hybrid/tick/tissue/press_tissue.h"

namespace hybrid {
namespace {

constexpr std::uint32_t kObstacleSlice = 256;  // surface voxels whose motion is checked a tick
constexpr std::size_t kObstacleQueries = 24;   // exact queries a tick
// Further exact queries in a tick in which an asynchronous result moved rows.
constexpr std::size_t kArrivedQueries = 40;
constexpr double kInside = 0.01;  // spacings: a voxel deeper than this in a surface leaves it
// kMovedEnough, kUnknownAhead and kKnownAhead are in spacings. A voxel queries again when two things hold: it
// has moved by kMovedEnough, and it may meet an unknown surface within kUnknownAhead. For a voxel with an
// obstacle the second distance is kKnownAhead, because its ball of half a spacing meets no other surface
// earlier.
constexpr float kMovedEnough = 0.25F, kUnknownAhead = 2.0F, kKnownAhead = 0.6F;
// In objects with bricks, a voxel on its obstacle queries again when it has slid by kSlideOnObstacle
// (spacings), so that it follows a curved surface. Links give way only along their axes and hardly need this.
constexpr float kSlideOnObstacle = 0.02F;

}  // namespace

NearestRigid nearest_rigid(const World& world, const WorldState& state, const glm::dvec3& point,
                           double range) noexcept {
  NearestRigid best;
  const std::uint64_t mask = state.map.rigid_in(point - range, point + range);
  best.distance = range;
  for (std::uint32_t o = 0; o < world.rigid.size(); ++o) {
    if ((mask & OccupancyMap::rigid_bit(o)) == 0) continue;
    const RigidObject& object = world.rigid[o];
    if (object.presses_tissue) continue;  // queried in every tick (bodies_press_tissue.h)
    polygon::NearPoint near;
    if (!object.surface->nearest(object.to_body(point), best.distance, near) || !(near.distance > 0.0))
      continue;
    best = {(point - object.to_scene(near.point)) / near.distance, near.distance, o, true};
  }
  return best;
}

namespace {

// Inside a solid, the direction from the surface's nearest point to the voxel points further inwards. An
// obstacle with this normal would keep the voxel inside, so the direction is flipped.
NearestRigid flip_if_inside(const World& world, const glm::dvec3& point, NearestRigid near) noexcept {
  const RigidObject& object = world.rigid[near.object];
  if (!near.found || !object.surface->inside(object.to_body(point))) return near;
  near.normal = -near.normal;
  near.distance = -near.distance;
  return near;
}

voxel::Obstacle obstacle_of(const SoftBody& body, const voxel::SoftObject& object, voxel::VoxelId v,
                            const NearestRigid& near) noexcept {
  // The voxel is a ball. If its displacement changes by Δu, its distance from the surface's plane, now
  // near.distance, grows by n · Δu. It has to be at least the ball's radius.
  const glm::dvec3 n = glm::inverse(body.pose.rotation) * near.normal;
  const double bound = glm::dot(n, object.displacement(v)) + object.voxel_radius() - near.distance;
  return {glm::vec3(n), static_cast<float>(bound)};
}

}  // namespace

std::size_t find_obstacles(const World& world, WorldState& state, std::size_t soft) {
  voxel::SoftObject& object = *state.soft[soft];
  const SoftBody& body = world.soft[soft];
  const auto surface = object.lattice().surface();
  const double range = kObstacleRange * object.lattice().max_spacing_m();
  std::size_t count = 0;
  // Reserved even if nothing is near: the object may be pressed beyond the search range.
  object.reserve_obstacles();
  state.obstacle_queries[soft].assign(surface.size(), {});
  if (object.uses_patches()) state.obstacles_at_rest[soft].reserve(surface.size());
  for (std::size_t s = 0; s < surface.size(); ++s) {
    const NearestRigid near = nearest_rigid(world, state, body.to_scene(object.position(surface[s])), range);
    state.obstacle_queries[soft][s].clear_m = static_cast<float>(near.distance);
    if (!near.found) continue;
    ++count;
    voxel::Obstacle obstacle = obstacle_of(body, object, surface[s], near);
    obstacle.bound = std::min(obstacle.bound, 0.0F);  // nothing presses at rest
    set_standing_obstacle(state, soft, s, obstacle);
  }
  return count;
}

namespace {

// The surface voxels that are due for a query of rigid surfaces. Those that may meet a surface soonest come
// first.
class ObstacleQueue {
 public:
  ObstacleQueue(const WorldState& state, std::size_t soft)
      : state_(state),
        soft_(soft),
        object_(*state.soft[soft]),
        queries_(state.obstacle_queries[soft]),
        spacing_m_(static_cast<float>(object_.lattice().min_spacing_m())),
        radius_m_(static_cast<float>(object_.voxel_radius())) {}

  // Lists surface voxel s if it has moved enough.
  void consider(std::uint32_t s) noexcept {
    const ObstacleQuery& seen = queries_[s];
    const glm::vec3 way = glm::vec3(object_.displacement(object_.lattice().surface()[s])) - seen.from;
    const float square = glm::dot(way, way);
    // A voxel with an obstacle is held by the obstacle's surface; other surfaces are further away.
    const bool held = standing_obstacle(state_, soft_, s).normal != glm::vec3(0.0F);
    const float ahead = seen.clear_m / spacing_m_ - (held ? kKnownAhead : kUnknownAhead);
    const float enough = std::max(kMovedEnough, ahead) * spacing_m_;
    if (square < enough * enough && !slid_on_obstacle(s, square)) return;
    const float room = held ? std::max(seen.clear_m, spacing_m_) : seen.clear_m - radius_m_;
    add({room - std::sqrt(square), s});
  }
  // Does the voxel lie on its obstacle, and has it slid away from the place of its last query? The surface
  // there may have another normal.
  [[nodiscard]] bool slid_on_obstacle(std::uint32_t s, float square) const noexcept {
    const float slid = kSlideOnObstacle * spacing_m_;
    if (!object_.lattice().has_bricks() || square < slid * slid) return false;
    const voxel::Obstacle& o = standing_obstacle(state_, soft_, s);
    const glm::vec3 u(object_.state().at(object_.lattice().surface()[s]));
    return o.normal != glm::vec3(0.0F) && glm::dot(o.normal, u) - o.bound < kLiesOn * spacing_m_;
  }
  // Considers all surface voxels of moved rows.
  void consider_moved() noexcept {
    for (const voxel::RowId row : object_.moved_rows()) {
      const auto [first, last] = object_.lattice().surface_in(row);
      for (std::uint32_t s = first; s < last; ++s) consider(s);
    }
  }
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] std::uint32_t operator[](std::size_t n) const { return first_[n].s; }

 private:
  struct Due {
    float room_m;  // distance until the voxel may meet a surface unknown to it
    std::uint32_t s;
  };
  void add(const Due& due) noexcept {
    const bool full = count_ == first_.size();
    if (full && due.room_m >= first_[count_ - 1].room_m) return;
    for (std::size_t n = 0; n < count_; ++n) {
      if (first_[n].s == due.s) return;
    }
    std::size_t at = full ? count_ - 1 : count_++;
    for (; at > 0 && first_[at - 1].room_m > due.room_m; --at) first_[at] = first_[at - 1];
    first_[at] = due;
  }

  const WorldState& state_;
  std::size_t soft_;
  const voxel::SoftObject& object_;
  std::span<const ObstacleQuery> queries_;
  float spacing_m_, radius_m_;
  std::array<Due, kArrivedQueries> first_{};
  std::size_t count_ = 0;
};

void query_obstacle(const World& world, WorldState& state, std::size_t o, std::uint32_t s) noexcept {
  const voxel::SoftObject& object = *state.soft[o];
  const SoftBody& body = world.soft[o];
  const voxel::VoxelId v = object.lattice().surface()[s];
  const glm::vec3 u(object.displacement(v));
  const double range = kObstacleRange * object.lattice().max_spacing_m();
  const glm::dvec3 at = body.to_scene(object.position(v));
  const NearestRigid near = flip_if_inside(world, at, nearest_rigid(world, state, at, range));
  ObstacleQuery& query = state.obstacle_queries[o][s];
  if (object.patches_in_use() != nullptr && !query.replaced) {
    state.obstacles_at_rest[o].push_back({s, object.obstacles()[s], query});
    query.replaced = true;
  }
  query.from = u;
  query.clear_m = static_cast<float>(std::max(near.distance, 0.0));
  if (!near.found) {
    set_standing_obstacle(state, o, s, {});
    return;
  }
  const voxel::Obstacle old = standing_obstacle(state, o, s);
  voxel::Obstacle fresh = obstacle_of(body, object, v, near);
  // The opposite normal belongs to the other side of a thin sheet: rounding moved the voxel through the
  // sheet. The voxel keeps its side.
  if (old.normal != glm::vec3(0.0F) && glm::dot(old.normal, fresh.normal) < 0.0F) return;
  // A voxel that overlaps leaves by at most kMovedEnough per query, never all at once. If it stayed at its
  // depth, a fast tool would press it deeper in each tick, and through the surface.
  const float enough = kMovedEnough * static_cast<float>(object.lattice().min_spacing_m());
  fresh.bound = std::min(fresh.bound, glm::dot(fresh.normal, u) + enough);
  set_standing_obstacle(state, o, s, fresh);
}

// Restores the obstacles at rest after a contact on nested patches.
void put_obstacles_to_rest(WorldState& state, std::size_t o) noexcept {
  for (const ObstacleAtRest& at_rest : state.obstacles_at_rest[o]) {
    set_standing_obstacle(state, o, at_rest.surface_number, at_rest.obstacle);
    state.obstacle_queries[o][at_rest.surface_number] = at_rest.query;
  }
  state.obstacles_at_rest[o].clear();
}

}  // namespace

void refresh_obstacles(const World& world, WorldState& state) noexcept {
  std::size_t left = kObstacleQueries;
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    voxel::SoftObject& object = *state.soft[o];
    if (object.obstacles().empty()) continue;
    if (object.patches_in_use() == nullptr) put_obstacles_to_rest(state, o);
    if (!object.asleep()) {
      const voxel::Lattice& lattice = object.lattice();
      ObstacleQueue due(state, o);
      for (const std::uint32_t number : object.touched_numbers()) due.consider(number);
      due.consider_moved();
      if (object.patches_in_use() != nullptr) {
        for (const voxel::VoxelId v : object.near_on_grid()) due.consider(object.surface_number(v));
      }
      // Slow motion, which makes no waves, is found by visiting all surface voxels in turns.
      const auto count = static_cast<std::uint32_t>(lattice.surface().size());
      for (std::uint32_t i = 0; i < std::min(kObstacleSlice, count); ++i) {
        prefetch_surface(object, state.obstacle_cursor[o]);
        due.consider(state.obstacle_cursor[o]);
        if (++state.obstacle_cursor[o] == count) state.obstacle_cursor[o] = 0;
      }
      const std::size_t looks = std::min(left, due.count());
      for (std::size_t n = 0; n < looks; ++n) query_obstacle(world, state, o, due[n]);
      left -= looks;
    }
    object.forget_moved_rows();
  }
}

void refresh_obstacles_of_arrived_rows(const World& world, WorldState& state) noexcept {
  std::size_t left = kArrivedQueries;
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    voxel::SoftObject& object = *state.soft[o];
    if (object.obstacles().empty() || object.moved_rows().empty()) continue;
    ObstacleQueue due(state, o);
    due.consider_moved();
    const double depth = kInside * object.lattice().min_spacing_m();
    std::array<std::uint32_t, kArrivedQueries> inside{};
    std::size_t count = 0;
    const std::size_t looks = std::min(left, due.count());
    for (std::size_t n = 0; n < looks; ++n) {
      const std::uint32_t s = due[n];
      query_obstacle(world, state, o, s);
      const voxel::Obstacle& now = object.obstacles()[s];
      const glm::dvec3 u = object.state().at(object.lattice().surface()[s]);
      if (now.normal != glm::vec3(0.0F) &&
          glm::dot(glm::dvec3(now.normal), u) < static_cast<double>(now.bound) - depth)
        inside[count++] = s;
    }
    left -= looks;
    if (count > 0) object.leave_obstacles(std::span(inside).first(count));
    object.forget_moved_rows();
  }
}

}  // namespace hybrid
