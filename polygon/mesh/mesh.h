// SPDX-License-Identifier: GPL-3.0-or-later
// The triangle mesh that every part of polygon/ works on: an indexed soup. It makes no promise of
// being closed, manifold or oriented, because an open or broken mesh is touchable too (a two-sided sheet).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace polygon {

using TriangleIndices = std::array<std::uint32_t, 3>;

struct TriangleMesh {
  std::vector<glm::dvec3> vertices;        // (unit: meter), body frame, all finite
  std::vector<TriangleIndices> triangles;  // indices into vertices, all in range

  [[nodiscard]] bool empty() const { return triangles.empty(); }
};

enum class Severity : std::uint8_t { info, warning, error };

// Where in the mesh something was found or done (body frame, unit: meter).
struct FindingPlace {
  glm::dvec3 first_m{0.0};                  // middle of the first triangle, edge, vertex or loop
  glm::dvec3 lower_m{0.0}, upper_m{0.0};    // box of the middles of all of them
  std::optional<std::uint32_t> triangle{};  // the first, counted from 0 in the mesh as it was given
};

// One numbered thing that a check or a loader found, in words a person can act on.
struct Finding {
  std::string id;  // stable and short, e.g. "M04-nonmanifold-edges"
  Severity severity = Severity::info;
  std::size_t count = 0;
  std::string text;                     // what, where (a place in the file or in space) and what to do
  std::optional<FindingPlace> place{};  // the same place as numbers, where there is one in space
};

}  // namespace polygon
