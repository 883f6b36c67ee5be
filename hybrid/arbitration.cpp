// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/arbitration.h"

#include <algorithm>
#include <glm/geometric.hpp>

#include "hybrid/body_tissue.h"

namespace hybrid {
namespace {

constexpr std::uint32_t kObstacleSlice = 256;  // surface voxels whose motion is looked at a tick
constexpr int kObstacleQueries = 24;           // exact queries a tick
constexpr float kMovedEnough = 0.25F;          // of the spacing: an obstacle is made anew beyond it
constexpr std::uint32_t kPairSlice = 256;      // surface voxels looked up for a partner a tick
constexpr double kPartAt = 1.25;  // a pair parts when further apart than this many touching distances
constexpr int kPairSweeps = 2;

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
    if (object.presses_tissue) continue;  // is looked at in every tick (body_tissue.h)
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
  state.obstacle_seen[soft].assign(surface.size(), glm::vec3(0.0F));
  for (std::size_t s = 0; s < surface.size(); ++s) {
    const NearestRigid near = nearest_rigid(world, state, body.to_scene(object.position(surface[s])), range);
    if (!near.found) continue;
    ++count;
    voxel::Obstacle obstacle = obstacle_of(body, object, surface[s], near);
    obstacle.bound = std::min(obstacle.bound, 0.0F);  // nothing presses at rest
    set_standing_obstacle(state, soft, s, obstacle);
  }
  return count;
}

void refresh_obstacles(const World& world, WorldState& state) noexcept {
  int queries = 0;
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    voxel::SoftObject& object = *state.soft[o];
    if (object.obstacles().empty() || object.asleep()) continue;
    const SoftBody& body = world.soft[o];
    const auto surface = object.lattice().surface();
    const float enough = kMovedEnough * static_cast<float>(object.lattice().min_spacing_m());
    const double range = kObstacleRange * object.lattice().max_spacing_m();
    const auto look = [&](std::uint32_t s) {
      const voxel::VoxelId v = surface[s];
      const glm::vec3 u(object.state().at(v));
      const glm::vec3 moved = u - state.obstacle_seen[o][s];
      if (glm::dot(moved, moved) < enough * enough || queries >= kObstacleQueries) return;
      ++queries;
      state.obstacle_seen[o][s] = u;
      const glm::dvec3 at = body.to_scene(object.position(v));
      const NearestRigid near = from_outside(world, at, nearest_rigid(world, state, at, range));
      const voxel::Obstacle old = standing_obstacle(state, o, s);
      if (!near.found) {
        set_standing_obstacle(state, o, s, {});
        return;
      }
      voxel::Obstacle fresh = obstacle_of(body, object, v, near);
      const bool had = old.normal != glm::vec3(0.0F);
      // A thin sheet seen from its other side: the voxel was squeezed through by rounding; its own side
      // stands.
      if (had && glm::dot(old.normal, fresh.normal) < 0.0F) return;
      // A voxel that overlaps may not be thrown out at once: it comes out by as much as is looked at anew.
      // (The depth it has was left to it once: then a fast tool presses it in deeper tick by tick, and
      // through.)
      fresh.bound = std::min(fresh.bound, glm::dot(fresh.normal, u) + enough);
      set_standing_obstacle(state, o, s, fresh);
    };
    for (const voxel::VoxelId v : object.touched()) look(object.surface_number(v));
    const auto count = static_cast<std::uint32_t>(surface.size());
    for (std::uint32_t i = 0; i < std::min(kObstacleSlice, count); ++i) {
      look(state.obstacle_cursor[o]);
      if (++state.obstacle_cursor[o] == count) state.obstacle_cursor[o] = 0;
    }
  }
}

namespace {

void find_pairs(const World& world, WorldState& state, std::uint32_t meeting) noexcept {
  const auto [ia, ib] = world.meeting[meeting];
  voxel::SoftObject &a = *state.soft[ia], &b = *state.soft[ib];
  if (!a.moved_ever() && !b.moved_ever()) return;
  if (a.asleep() && b.asleep() && state.pair_cursor[meeting] == 0) return;
  const auto surface_a = a.lattice().surface();
  const auto count_a = static_cast<std::uint32_t>(surface_a.size());
  const auto count_b = static_cast<std::uint32_t>(b.lattice().surface().size());
  const double apart = a.voxel_radius() + b.voxel_radius();
  for (std::uint32_t i = 0; i < std::min(kPairSlice, count_a); ++i) {
    const std::uint32_t s = state.pair_cursor[meeting];
    state.pair_cursor[meeting] = s + 1 == count_a ? 0 : s + 1;
    if (state.paired[meeting][s] != 0) continue;
    const glm::dvec3 at = world.soft[ia].to_scene(a.position(surface_a[s]));
    const std::size_t found = state.map.soft_in(at - apart, at + apart, state.found);
    double nearest = apart;
    std::uint32_t partner = voxel::SoftObject::kNoSurface;
    for (std::size_t n = 0; n < found; ++n) {
      const std::uint32_t number = state.found[n] - world.soft[ib].first_number;
      if (state.found[n] < world.soft[ib].first_number || number >= count_b) continue;
      const glm::dvec3 other = world.soft[ib].to_scene(b.position(b.lattice().surface()[number]));
      const double distance = glm::length(other - at);
      if (distance < nearest || (distance == nearest && number < partner)) {
        nearest = distance;
        partner = number;
      }
    }
    if (partner == voxel::SoftObject::kNoSurface) continue;
    if (state.pairs.size() == state.pairs.capacity()) {
      state.faults |= fault_pair_overflow;
      return;
    }
    const voxel::VoxelId va = surface_a[s], vb = b.lattice().surface()[partner];
    const glm::dvec3 side = voxel::side_of_pair({a, world.soft[ia].pose}, va, {b, world.soft[ib].pose}, vb);
    state.pairs.push_back({meeting, {va, vb, glm::dvec3(0.0), side}, s});
    state.paired[meeting][s] = 1;
    a.hold(va);
    b.hold(vb);
  }
}

}  // namespace

void relax_pairs(const World& world, WorldState& state) noexcept {
  for (std::uint32_t m = 0; m < world.meeting.size(); ++m) find_pairs(world, state, m);
  const auto with_objects = [&](VoxelPair& pair, const auto& visit) {
    const auto [ia, ib] = world.meeting[pair.meeting];
    return visit(voxel::PosedObject{*state.soft[ia], world.soft[ia].pose},
                 voxel::PosedObject{*state.soft[ib], world.soft[ib].pose}, pair.pressed);
  };
  for (VoxelPair& pair : state.pairs) {
    with_objects(pair, [](const auto& a, const auto& b, const voxel::PressedPair& p) {
      a.object.clear_pair_load(p.a);
      b.object.clear_pair_load(p.b);
    });
  }
  for (VoxelPair& pair : state.pairs) with_objects(pair, voxel::load_pair);
  for (int sweep = 0; sweep < kPairSweeps; ++sweep) {
    for (std::size_t i = 0; i < state.pairs.size();) {
      const double gap = with_objects(state.pairs[i], voxel::relax_pair);
      const VoxelPair pair = state.pairs[i];
      const auto [ia, ib] = world.meeting[pair.meeting];
      voxel::SoftObject &a = *state.soft[ia], &b = *state.soft[ib];
      if (sweep > 0 || gap < (kPartAt - 1.0) * (a.voxel_radius() + b.voxel_radius())) {
        ++i;
        continue;
      }
      state.paired[pair.meeting][pair.surface_a] = 0;
      state.pairs[i] = state.pairs.back();
      state.pairs.pop_back();
      // Either may be pressed by another voxel still.
      const auto still = [&](std::uint32_t object, voxel::VoxelId v) {
        return std::any_of(state.pairs.begin(), state.pairs.end(), [&](const VoxelPair& p) {
          const auto [pa, pb] = world.meeting[p.meeting];
          return (pa == object && p.pressed.a == v) || (pb == object && p.pressed.b == v);
        });
      };
      if (!still(ia, pair.pressed.a)) a.release(pair.pressed.a);
      if (!still(ib, pair.pressed.b)) b.release(pair.pressed.b);
    }
  }
}

}  // namespace hybrid
