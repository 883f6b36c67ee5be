// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tick/copy_state.h"

#include "hybrid/tick/bodies/body_collisions.h"

namespace hybrid {

namespace {

std::unique_ptr<WorldState> copied(const World& world, const WorldState& state, voxel::Tables tables) {
  auto copy = std::make_unique<WorldState>(world, OccupancyMap(state.map));
  for (const auto& object : state.soft) copy->soft.push_back(object->copy(tables));
  copy->prepare(world);
  prepare_collisions(world, *copy);
  static_cast<CarriedState&>(*copy) = static_cast<const CarriedState&>(state);
  return copy;
}

}  // namespace

std::unique_ptr<WorldState> copy_state(const World& world, const WorldState& state) {
  auto copy = copied(world, state, voxel::Tables::whole);
  copy->map.reserve_bricks(1024);
  return copy;
}

std::unique_ptr<WorldState> kept_copy(const World& world, const WorldState& state) {
  return copied(world, state, voxel::Tables::where_used);
}

}  // namespace hybrid
