// SPDX-License-Identifier: GPL-3.0-or-later
// Where the distance to a goal is stationary on one, two or three surfaces at once, each the points at one
// distance from a plane, a line or a point. For the first-order reference only: in long double, and knowing
// nothing of triangles' bounds or of what is in the way.
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
  FineVec at{0.0L};     // a point of it (unit: meter)
  FineVec along{0.0L};  // face: unit normal on the ball's side; edge: unit direction
};

struct StationaryPoint {
  FineVec point{0.0L};
  std::array<FineReal, 3> multiplier{};  // point − goal = Σ multiplier · normal (unit: meter)
  std::array<FineVec, 3> normal{};       // from each feature to the point, of unit length
};

// All (at most two) on one surface, in closed form. `from` breaks the tie of a goal on the axis or centre
// itself. Returns how many.
[[nodiscard]] int stationary_on_one(const OffsetFeature& feature, const FineVec& goal, FineReal radius,
                                    const FineVec& from, std::array<StationaryPoint, 2>& out);

// The one that Newton's method finds from `start` on two or three surfaces (two or three features), if it
// stays within `reach`. False where the normals are dependent, or when it does not converge.
[[nodiscard]] bool stationary_on_several(std::span<const OffsetFeature> features, const FineVec& goal,
                                         FineReal radius, const FineVec& start, FineReal reach,
                                         StationaryPoint& out);

}  // namespace polygon
