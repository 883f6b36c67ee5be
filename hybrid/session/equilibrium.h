// SPDX-License-Identifier: GPL-3.0-or-later
// The equilibrium of a state: the force once all tissue is at rest.
#pragma once

#include <glm/vec3.hpp>
#include <optional>

#include "hybrid/tick/copy_state.h"

namespace hybrid {

// The force at the present device position once all tissue is at rest (N). A copy of the state is relaxed
// until two things hold: the force changes by less than `tolerance_N` over dozens of whole relaxation cycles,
// and the anchors carry it. Moving bodies stand still meanwhile. Empty if the force does not settle, or if a
// signal came.
std::optional<glm::dvec3> equilibrium_force(const World& world, const WorldState& state,
                                            double tolerance_N = 1e-4);

}  // namespace hybrid
