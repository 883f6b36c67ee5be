// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/session/pair_presses.h"

#include <cstdint>
#include <glm/geometric.hpp>

#include "hybrid/session/forces_between.h"

namespace hybrid {

std::vector<PairPress> pair_presses(const World& world, const WorldState& state) {
  const auto rigid = static_cast<std::uint32_t>(world.rigid.size());
  std::vector<PairPress> out;
  for (const PairForce& force : forces_between(world, state).pairs) {
    PairPress press{.soft = rigid + force.pair.soft};
    if (force.pair.kind == ObjectPair::Kind::rigid) press.other = force.pair.other;
    if (force.pair.kind == ObjectPair::Kind::soft) press.other = rigid + force.pair.other;
    if (force.on_soft_N) press.force_N = glm::length(*force.on_soft_N);
    out.push_back(press);
  }
  return out;
}

}  // namespace hybrid
