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

constexpr std::uint32_t kObstacleSlice = 256;  // surface voxels whose motion is looked at a tick
constexpr std::size_t kObstacleQueries = 24;   // exact queries a tick
// … where a result arrived (1.9 % of a cell of overlap in `head`; with 64, which took 150 us, 2.1 %).
constexpr std::size_t kArrivedQueries = 40;
constexpr double kInside = 0.01;  // of the spacing: deeper in a surface a voxel leaves it
// A voxel looks again when it has moved by so many spacings, and to within so many of where it might meet a
// rigid surface that it has not seen: fewer where it has a half-space, since its ball, half a spacing large,
// meets nothing before. (Looked for within two spacings in any case, a brain 1.5 spacings from its skull had
// 28 looks a tick, 2.5 us each, and ticks with a result took half as much again: p99 612 us in place of 430.
// It overlaps the skull by 2.1 % of a cell in place of 1.6.)
constexpr float kMovedEnough = 0.25F, kSeenAhead = 2.0F, kKnownAhead = 0.6F;
// Of bricks, one that lies on its half-space looks again when it has slid by so much: over a ridge that
// turns. (By a quarter, tissue slid over it was carried 9 degrees off, and the hand felt 6 % of its force
// sideways. Links give way along their axes alone, and are hardly drawn aside: 0.3 %.)
constexpr float kSlid = 0.02F, kLiesOn = 1e-3F;

struct NearestRigid {
  glm::dvec3 normal{0.0};  // away from the surface, scene frame, unit
  double distance = 0.0;   // negative: within the solid
  std::uint32_t object = 0;
  bool found = false;
};

NearestRigid nearest_rigid(const World& world, const WorldState& state, const glm::dvec3& point,
                           double range) noexcept {
  NearestRigid best;
  const std::uint64_t mask = state.map.rigid_in(point - range, point + range);
  best.distance = range;
  for (std::uint32_t o = 0; o < world.rigid.size(); ++o) {
    if ((mask & OccupancyMap::rigid_bit(o)) == 0) continue;
    const RigidObject& object = world.rigid[o];
    if (object.presses_tissue) continue;  // is looked at in every tick (bodies_press_tissue.h)
    polygon::NearPoint near;
    if (!object.surface->nearest(object.to_body(point), best.distance, near) || !(near.distance > 0.0))
      continue;
    best = {(point - object.to_scene(near.point)) / near.distance, near.distance, o, true};
  }
  return best;
}

// From within a solid the nearest surface is seen from its wrong side, and would hold a voxel in there for
// ever.
NearestRigid from_outside(const World& world, const glm::dvec3& point, NearestRigid near) noexcept {
  const RigidObject& object = world.rigid[near.object];
  if (!near.found || !object.surface->inside(object.to_body(point))) return near;
  near.normal = -near.normal;
  near.distance = -near.distance;
  return near;
}

voxel::Obstacle obstacle_of(const SoftBody& body, const voxel::SoftObject& object, voxel::VoxelId v,
                            const NearestRigid& near) noexcept {
  // n·(y + Δu − c) >= radius, with n·(y − c) = distance now.
  const glm::dvec3 n = glm::inverse(body.pose.rotation) * near.normal;
  const double bound = glm::dot(n, object.state().at(v)) + object.voxel_radius() - near.distance;
  return {glm::vec3(n), static_cast<float>(bound)};
}

}  // namespace

std::size_t find_obstacles(const World& world, WorldState& state, std::size_t soft) {
  voxel::SoftObject& object = *state.soft[soft];
  const SoftBody& body = world.soft[soft];
  const auto surface = object.lattice().surface();
  const double range = kObstacleRange * object.lattice().max_spacing_m();
  std::size_t count = 0;
  // Also where nothing is near: it may be pressed further than one looks.
  object.reserve_obstacles();
  state.obstacle_queries[soft].assign(surface.size(), {});
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

// Surface voxels of one object that have to look for rigid surfaces again, those first that may meet one
// first.
class LooksDue {
 public:
  LooksDue(const WorldState& state, std::size_t soft)
      : state_(state),
        soft_(soft),
        object_(*state.soft[soft]),
        seen_(state.obstacle_queries[soft]),
        spacing_m_(static_cast<float>(object_.lattice().min_spacing_m())),
        radius_m_(static_cast<float>(object_.voxel_radius())) {}

  // Voxel number s of the surface, if it has moved enough.
  void consider(std::uint32_t s) noexcept {
    const ObstacleQuery& seen = seen_[s];
    const glm::vec3 way = glm::vec3(object_.state().at(object_.lattice().surface()[s])) - seen.from;
    const float square = glm::dot(way, way);
    // The surface that it knows holds it; another is further than that one was.
    const bool held = standing_obstacle(state_, soft_, s).normal != glm::vec3(0.0F);
    const float ahead = seen.clear_m / spacing_m_ - (held ? kKnownAhead : kSeenAhead);
    const float enough = std::max(kMovedEnough, ahead) * spacing_m_;
    if (square < enough * enough && !slid_on(s, square)) return;
    const float room = held ? std::max(seen.clear_m, spacing_m_) : seen.clear_m - radius_m_;
    add({room - std::sqrt(square), s});
  }
  // Does it lie on its half-space, elsewhere than that was looked for? What presses it goes across that.
  [[nodiscard]] bool slid_on(std::uint32_t s, float square) const noexcept {
    const float slid = kSlid * spacing_m_;
    if (!object_.lattice().has_bricks() || square < slid * slid) return false;
    const voxel::Obstacle& o = standing_obstacle(state_, soft_, s);
    const glm::vec3 u(object_.state().at(object_.lattice().surface()[s]));
    return o.normal != glm::vec3(0.0F) && glm::dot(o.normal, u) - o.bound < kLiesOn * spacing_m_;
  }
  // All of rows that were moved.
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
    float room_m;  // left until it may meet what it has not seen
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
  std::span<const ObstacleQuery> seen_;
  float spacing_m_, radius_m_;
  std::array<Due, kArrivedQueries> first_{};
  std::size_t count_ = 0;
};

void renew_obstacle(const World& world, WorldState& state, std::size_t o, std::uint32_t s) noexcept {
  const voxel::SoftObject& object = *state.soft[o];
  const SoftBody& body = world.soft[o];
  const voxel::VoxelId v = object.lattice().surface()[s];
  const glm::vec3 u(object.state().at(v));
  const double range = kObstacleRange * object.lattice().max_spacing_m();
  const glm::dvec3 at = body.to_scene(object.position(v));
  const NearestRigid near = from_outside(world, at, nearest_rigid(world, state, at, range));
  state.obstacle_queries[o][s] = {u, static_cast<float>(std::max(near.distance, 0.0))};
  if (!near.found) {
    set_standing_obstacle(state, o, s, {});
    return;
  }
  const voxel::Obstacle old = standing_obstacle(state, o, s);
  voxel::Obstacle fresh = obstacle_of(body, object, v, near);
  // A thin sheet seen from its other side: the voxel was squeezed through by rounding; its own side stands.
  if (old.normal != glm::vec3(0.0F) && glm::dot(old.normal, fresh.normal) < 0.0F) return;
  // A voxel that overlaps may not be thrown out at once: it comes out by as much as is looked at anew. (The
  // depth it has was left to it once: then a fast tool presses it in deeper tick by tick, and through.)
  const float enough = kMovedEnough * static_cast<float>(object.lattice().min_spacing_m());
  fresh.bound = std::min(fresh.bound, glm::dot(fresh.normal, u) + enough);
  set_standing_obstacle(state, o, s, fresh);
}

}  // namespace

void refresh_obstacles(const World& world, WorldState& state) noexcept {
  std::size_t left = kObstacleQueries;
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    voxel::SoftObject& object = *state.soft[o];
    if (object.obstacles().empty()) continue;
    if (!object.asleep()) {
      const voxel::Lattice& lattice = object.lattice();
      LooksDue due(state, o);
      for (const std::uint32_t number : object.touched_numbers()) due.consider(number);
      due.consider_moved();
      // What moves by itself, a little in each tick, is found in turns.
      const auto count = static_cast<std::uint32_t>(lattice.surface().size());
      for (std::uint32_t i = 0; i < std::min(kObstacleSlice, count); ++i) {
        fetch_surface_ahead(object, state.obstacle_cursor[o]);
        due.consider(state.obstacle_cursor[o]);
        if (++state.obstacle_cursor[o] == count) state.obstacle_cursor[o] = 0;
      }
      const std::size_t looks = std::min(left, due.count());
      for (std::size_t n = 0; n < looks; ++n) renew_obstacle(world, state, o, due[n]);
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
    LooksDue due(state, o);
    due.consider_moved();
    const double depth = kInside * object.lattice().min_spacing_m();
    std::array<std::uint32_t, kArrivedQueries> inside{};
    std::size_t count = 0;
    const std::size_t looks = std::min(left, due.count());
    for (std::size_t n = 0; n < looks; ++n) {
      const std::uint32_t s = due[n];
      renew_obstacle(world, state, o, s);
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
