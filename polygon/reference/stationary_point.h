// SPDX-License-Identifier: GPL-3.0-or-later
// Stationary points of the distance to a goal on one, two or three offset surfaces. An offset surface is the
// set of points at one distance from a plane, a line or a point. The functions serve only the optimality
// reference. They use long double, and ignore the extent of triangles and obstacles.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>

namespace polygon {

using FineReal = long double;
using FineVec = glm::vec<3, FineReal>;

enum class FeatureKind : std::uint8_t { face, edge, corner };

struct OffsetFeature {
  FeatureKind kind = FeatureKind::face;
  FineVec at{0.0L};     // a point of the feature (unit: meter)
  FineVec along{0.0L};  // face: unit normal on the ball's side; edge: unit direction
};

struct StationaryPoint {
  FineVec point{0.0L};
  std::array<FineReal, 3> multiplier{};  // point − goal = Σ multiplier · normal (unit: meter)
  std::array<FineVec, 3> normal{};       // unit vectors from each feature to the point
};

// Writes all stationary points on one surface (at most two), in closed form, and returns their number. If the
// goal is on the axis or at the centre, the direction is that from there to `from`.
[[nodiscard]] int stationary_on_one(const OffsetFeature& feature, const FineVec& goal, FineReal radius,
                                    const FineVec& from, std::array<StationaryPoint, 2>& out);

// The stationary point on two or three surfaces that Newton's method finds from `start`, if it stays within
// `reach`. False if the normals are dependent, or if the iteration does not converge.
[[nodiscard]] bool stationary_on_several(std::span<const OffsetFeature> features, const FineVec& goal,
                                         FineReal radius, const FineVec& start, FineReal reach,
                                         StationaryPoint& out);

}  // namespace polygon
