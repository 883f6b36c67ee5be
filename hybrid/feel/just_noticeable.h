// SPDX-License-Identifier: GPL-3.0-or-later
// The just noticeable difference (JND) of a force, in which this project states every force error. An error
// in JND is |force − reference| / max(kJndShare · |reference|, floor). The floor is that of the device
// (jnd_floor_N()). Source: the thesis, Table 4 (force at the elbow, 7 %).
#pragma once

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <numbers>

namespace hybrid {

inline constexpr double kJndShare = 0.07;        // share of the reference
inline constexpr double kJndFloor_N = 0.04;      // floor for a device without friction
inline constexpr double kLeastDirected_N = 0.1;  // the direction of a smaller force cannot be felt

// The just noticeable difference of a force (N).
[[nodiscard]] inline double noticeable_N(const glm::dvec3& reference, double floor_N) noexcept {
  return std::max(kJndShare * glm::length(reference), floor_N);
}

// Difference between `force` (N) and `reference` (N) in just noticeable differences.
[[nodiscard]] inline double jnd_of(const glm::dvec3& force, const glm::dvec3& reference,
                                   double floor_N) noexcept {
  return glm::length(force - reference) / noticeable_N(reference, floor_N);
}

// Angle between two forces (degrees). It is exactly 0 for equal forces. Neither may be 0.
[[nodiscard]] inline double angle_between_deg(const glm::dvec3& a, const glm::dvec3& b) noexcept {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b)) * 180.0 / std::numbers::pi;
}

}  // namespace hybrid
