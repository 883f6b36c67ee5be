// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tick/copy_state.h"

#include "hybrid/tick/bodies/body_collisions.h"

namespace hybrid {

std::unique_ptr<WorldState> copy_state(const World& world, const WorldState& state) {
  auto copy = std::make_unique<WorldState>(world, OccupancyMap(state.map));
  for (const auto& object : state.soft) copy->soft.push_back(object->copy());
  copy->prepare(world);
  prepare_collisions(world, *copy);
  copy->map.reserve_bricks(1024);
  static_cast<CarriedState&>(*copy) = static_cast<const CarriedState&>(state);
  return copy;
}

}  // namespace hybrid
