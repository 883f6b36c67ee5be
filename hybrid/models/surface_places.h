// SPDX-License-Identifier: GPL-3.0-or-later
// Places that are spread evenly on a surface for any number of them, and interpolation between them.
#pragma once

#include <array>
#include <cstddef>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <vector>

#include "polygon/mesh/mesh.h"

namespace hybrid {

struct SurfacePlace {
  glm::dvec3 at_m{0.0}, outward{0.0};
};

// Each place is a vertex as far as possible from all places before it, so that any number of them is spread
// evenly (Gonzalez 1985). Two vertices that face opposite sides count as twice `apart_m` apart, even where
// the object is thin.
class SurfacePlaces {
 public:
  SurfacePlaces(const polygon::TriangleMesh& surface, double apart_m);

  // The next place. Empty: every vertex is within `gap_m` of a place.
  [[nodiscard]] std::optional<SurfacePlace> next(double gap_m);
  [[nodiscard]] std::size_t given() const { return given_; }
  // The greatest distance of a vertex from its nearest place.
  [[nodiscard]] double gap_m() const;

  // The value at each vertex, from the values of all places in their order. It is the mean of the places
  // nearest to the vertex, weighted by distance (Franke & Little 1980). NaN is a value that is not known. If
  // the nearest place has no known value, the vertex has none either.
  [[nodiscard]] std::vector<float> spread(std::span<const float> of_places) const;
  // The part of the surface around each vertex (m²). Their sum is the surface's area.
  [[nodiscard]] const std::vector<double>& areas_m2() const { return areas_m2_; }

 private:
  static constexpr std::size_t kNearest = 4;
  struct Vertex {
    glm::vec3 at{0.0F}, facing{0.0F};             // m, from the middle of the surface; normal · apart_m
    std::array<std::uint32_t, kNearest> place{};  // the nearest places, the nearest first
    std::array<float, kNearest> squared{};        // squares of the distances (m²)
  };

  std::vector<Vertex> vertices_;
  std::vector<SurfacePlace> all_;  // [vertex]
  std::vector<double> areas_m2_;
  std::size_t given_ = 0, furthest_ = 0;  // `furthest_`: the vertex that is the next place
};

}  // namespace hybrid
