// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/world/world_state.h"

#include <algorithm>

namespace hybrid {
namespace {

constexpr double kFirstMargin = 1.0 / 64.0;  // margin of the proxy's first survey (unit: the object's extent)

}  // namespace

WorldState::WorldState(const World& world, OccupancyMap occupancy) : map(std::move(occupancy)) {
  feel.resize(world.object_count());
  rigid_force_N.resize(world.rigid.size());
  edited.feel.resize(world.rigid.size());
  scratch.near.resize(world.rigid.empty() ? 0 : kMaxNear);
  rigid.reserve(world.rigid.size());
  for (const RigidObject& object : world.rigid) {
    const double extent = glm::length(object.surface->upper() - object.surface->lower());
    rigid.push_back({.frame = BodyFrame(object.pose),
                     .pose = object.pose,
                     .free = {},
                     .before = object.pose,
                     .near = polygon::Neighbourhood(object.surface->element_count()),
                     .margin_m = kFirstMargin * extent,
                     .crossable_edges = {}});
    if (object.motion.kind() == RigidMotion::Kind::free)
      rigid.back().free = state_at(object.motion.free_body(), object.pose);
  }
  scratch.planes.reserve(kMaxPlanes);
}

void WorldState::prepare(const World& world) {
  reactions.resize(soft.size());
  edited.tissue_factor.assign(soft.size(), 1.0);
  obstacle_queries.resize(soft.size());
  obstacles_at_rest.resize(soft.size());
  cursor.assign(soft.size(), 0);
  obstacle_cursor.assign(soft.size(), 0);
  scratch.touched.resize(soft.size());
  for (auto& list : scratch.touched) list.reserve(voxel::SoftObject::kMaxTouched);
  if (!soft.empty()) {
    scratch.bounds.resize(kMaxPlanes / 2);
    jammed.reserve(kMaxPlanes);
    scratch.stops.reserve(kMaxPlanes);
    scratch.soft_stiffness.resize(soft.size());
    scratch.map_hits.resize(kMaxMapHits);
  }
  prepare_body_obstacles(world);
  pair_cursor.assign(world.soft_pairs.size(), 0);
  paired.resize(world.soft_pairs.size());
  for (std::size_t m = 0; m < world.soft_pairs.size(); ++m) {
    paired[m].assign(soft[world.soft_pairs[m][0]]->lattice().surface().size(), 0);
  }
  facet_contacts.reserve(world.soft_pairs.empty() ? 0 : kMaxFacetContacts);
}

void WorldState::prepare_body_obstacles(const World& world) {
  const auto presses = [](const RigidObject& object) { return object.presses_tissue; };
  if (std::none_of(world.rigid.begin(), world.rigid.end(), presses)) return;
  body_travel_m.assign(world.rigid.size(), 0.0);
  body_moved_m.assign(world.rigid.size(), 0.0);
  std::size_t most = 0;
  for (const auto& object : soft) {
    object->prepare_beside_bodies();
    const std::size_t count = object->lattice().surface().size();
    most = std::max(most, count);
    BodyObstacles beside;
    beside.standing.resize(count);
    beside.moving.resize(count);
    beside.whose.assign(count, BodyObstacles::kNobody);
    beside.listed.assign(count, 0);
    beside.jammed.assign(count, 0);
    for (const RigidObject& rigid_object : world.rigid)
      beside.queries.emplace_back(rigid_object.presses_tissue ? count : 0);
    body_obstacles.push_back(std::move(beside));
    body_obstacles.back().near.reserve(count);
  }
  const auto bodies =
      static_cast<std::size_t>(std::count_if(world.rigid.begin(), world.rigid.end(), presses));
  scratch.due.reserve(most * bodies);
  scratch.in_the_way.reserve(most);
  scratch.body_voxels.reserve(voxel::SoftObject::kMaxTouched);
  const auto free = [](const RigidObject& object) {
    return object.presses_tissue && object.motion.kind() == RigidMotion::Kind::free;
  };
  if (std::none_of(world.rigid.begin(), world.rigid.end(), free)) return;
  scratch.body_surface_numbers.reserve(voxel::SoftObject::kMaxTouched);
  scratch.body_loads.resize(voxel::SoftObject::kMaxTouched);
}

}  // namespace hybrid
