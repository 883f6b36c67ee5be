// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/world.h"

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
  pair_cursor.assign(world.meeting.size(), 0);
  paired.resize(world.meeting.size());
  for (std::size_t m = 0; m < world.meeting.size(); ++m) {
    paired[m].assign(soft[world.meeting[m][0]]->lattice().surface().size(), 0);
  }
  pairs.reserve(world.meeting.empty() ? 0 : kMaxPairs);
}

}  // namespace hybrid
