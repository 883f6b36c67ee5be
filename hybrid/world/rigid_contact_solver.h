// SPDX-License-Identifier: GPL-3.0-or-later
// Solves for the velocities of free bodies at the end of a step, with implicit contact forces and friction.
// All bodies form one convex problem (equation in free_body.h).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>

#include "hybrid/world/free_body.h"

namespace hybrid {

// Velocity and spin, or force and torque, in one vector.
struct Twist {
  glm::dvec3 linear{0.0}, angular{0.0};
  [[nodiscard]] double operator[](std::size_t i) const noexcept {
    return i < 3 ? linear[static_cast<int>(i)] : angular[static_cast<int>(i) - 3];
  }
};

struct SolveScratch {                // buffers for n bodies
  std::span<double> matrix, twists;  // lengths 36 n² and 18 n
  std::span<std::uint32_t> first;    // length n
  std::span<ContactOnLine> ways;     // length kMaxOneSided
};

// Writes each body's twist after a step of dt (> 0), six numbers a body, to the beginning of scratch.twists.
// Contacts of bodies that are `stopped` are ignored. Bounded, allocates nothing. False if a result would not
// be finite.
[[nodiscard]] bool solve_velocities(std::span<const SteppedBody> bodies,
                                    std::span<const BodyContact> contacts, const SolveScratch& scratch,
                                    double dt) noexcept;

[[nodiscard]] inline Twist twist_of(std::span<const double> twists, std::uint32_t body) noexcept {
  const double* v = &twists[6 * std::size_t{body}];
  return {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
}

}  // namespace hybrid
