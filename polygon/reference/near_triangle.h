// SPDX-License-Identifier: GPL-3.0-or-later
// Closest points of triangles for the first-order reference: in long double, and written apart from those
// that the proxy uses, so that a fault in either shows.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>

#include "polygon/reference/stationary_point.h"

namespace polygon {

// A triangle in coordinates from a place near it, where long double resolves what matters.
struct NearTriangle {
  std::uint32_t id = 0;
  std::array<FineVec, 3> corner;  // from that place, exact or nearly
  std::array<FineVec, 3> side;    // unit direction from corner i to i + 1; zero where they coincide
  std::array<FineReal, 3> length{};
  FineVec normal{0.0L};
  bool flat = false;         // it has an area, so `normal` means something
  FineReal distance = 0.0L;  // of that place from it
};

[[nodiscard]] NearTriangle near_triangle(std::uint32_t id, const std::array<glm::dvec3, 3>& corners,
                                         const glm::dvec3& origin);

// The nearest point of a triangle to a point.
struct Place {
  FineVec point{0.0L};
  FineReal distance = 0.0L;
};

// The foot on the plane where it lies within all sides, or else the nearest point of the sides. A triangle
// without area is its sides.
[[nodiscard]] Place place_on(const NearTriangle& t, const FineVec& x);

// The nearest point of the side from corner i to corner (i + 1) % 3.
[[nodiscard]] Place place_on_side(const NearTriangle& t, std::size_t i, const FineVec& x);

// Of unit length; zero for zero.
[[nodiscard]] FineVec unit(const FineVec& v);

}  // namespace polygon
