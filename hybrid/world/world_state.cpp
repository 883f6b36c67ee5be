// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/world/world.h"

#include <algorithm>

namespace hybrid {
namespace {

constexpr double kFirstMargin = 1.0 / 64.0;  // of an object's extent, of the proxy's first survey

}  // namespace

WorldState::WorldState(const World& world, OccupancyMap occupancy) : map(std::move(occupancy)) {
  feel.resize(world.object_count());
  rigid_force_N.resize(world.rigid.size());
  near.resize(world.rigid.empty() ? 0 : kMaxNear);
  rigid.reserve(world.rigid.size());
  for (const RigidObject& object : world.rigid) {
    const double extent = glm::length(object.surface->upper() - object.surface->lower());
    rigid.push_back({.frame = BodyFrame(object.pose),
                     .pose = object.pose,
                     .free = {},
                     .before = object.pose,
                     .near = polygon::Neighbourhood(object.surface->element_count()),
                     .margin_m = kFirstMargin * extent,
                     .ridges = {}});
    if (object.motion.kind() == RigidMotion::Kind::free)
      rigid.back().free = state_at(object.motion.free_body(), object.pose);
  }
  planes.reserve(kMaxPlanes);
}

void WorldState::prepare(const World& world) {
  reactions.resize(soft.size());
  obstacle_seen.resize(soft.size());
  cursor.assign(soft.size(), 0);
  obstacle_cursor.assign(soft.size(), 0);
  touched.resize(soft.size());
  for (auto& list : touched) list.reserve(voxel::SoftObject::kMaxTouched);
  if (!soft.empty()) {
    bounds.resize(kMaxPlanes / 2);
    blocked.reserve(kMaxPlanes);
    found.resize(kMaxFound);
  }
  prepare_beside_bodies(world);
  pair_cursor.assign(world.meeting.size(), 0);
  paired.resize(world.meeting.size());
  for (std::size_t m = 0; m < world.meeting.size(); ++m) {
    paired[m].assign(soft[world.meeting[m][0]]->lattice().surface().size(), 0);
  }
  pairs.reserve(world.meeting.empty() ? 0 : kMaxPairs);
}

void WorldState::prepare_beside_bodies(const World& world) {
  const auto presses = [](const RigidObject& object) { return object.presses_tissue; };
  if (std::none_of(world.rigid.begin(), world.rigid.end(), presses)) return;
  body_travel_m.assign(world.rigid.size(), 0.0);
  body_moved_m.assign(world.rigid.size(), 0.0);
  std::size_t most = 0;
  for (const auto& object : soft) {
    object->prepare_beside_bodies();
    const std::size_t count = object->lattice().surface().size();
    most = std::max(most, count);
    BesideBodies beside;
    beside.standing.resize(count);
    beside.moving.resize(count);
    beside.whose.assign(count, BesideBodies::kNobody);
    beside.listed.assign(count, 0);
    beside.blocked.assign(count, 0);
    for (const RigidObject& rigid_object : world.rigid)
      beside.sights.emplace_back(rigid_object.presses_tissue ? count : 0);
    beside_bodies.push_back(std::move(beside));
    beside_bodies.back().near.reserve(count);
  }
  const auto bodies =
      static_cast<std::size_t>(std::count_if(world.rigid.begin(), world.rigid.end(), presses));
  due.reserve(most * bodies);
  in_the_way.reserve(most);
  held_by_body.reserve(voxel::SoftObject::kMaxTouched);
  const auto free = [](const RigidObject& object) {
    return object.presses_tissue && object.motion.kind() == RigidMotion::Kind::free;
  };
  if (std::none_of(world.rigid.begin(), world.rigid.end(), free)) return;
  at_body.reserve(voxel::SoftObject::kMaxTouched);
  held_loads.resize(voxel::SoftObject::kMaxTouched);
}

}  // namespace hybrid
