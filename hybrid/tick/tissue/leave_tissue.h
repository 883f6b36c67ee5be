// SPDX-License-Identifier: GPL-3.0-or-later
// The start of a session whose tool begins inside tissue.
#pragma once

#include "hybrid/world/world_state.h"

namespace hybrid {

// Moves the proxy out of all tissue at rest, along the axis or diagonal of an object's lattice on which the
// way out is shortest. The first ticks then press the tool in from there, as from any start outside. Call it
// before the first tick, with the proxy outside everything rigid. False: there is no free place for the tool,
// and the session must not start.
bool leave_tissue(const World& world, WorldState& state) noexcept;

// Starts the proxy of a session that goes on in tissue at rest, where the tool may be inside an object. The
// proxy gets the first free place from `from` along `towards`, or else along an axis or diagonal of the
// scene. False: there is none.
bool start_outside(const World& world, WorldState& state, const glm::dvec3& device_m, const glm::dvec3& from,
                   const glm::dvec3& towards) noexcept;

}  // namespace hybrid
