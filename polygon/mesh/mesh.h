// SPDX-License-Identifier: GPL-3.0-or-later
// The triangle mesh that every part of polygon/ works on: an indexed soup. It need not be closed, manifold or
// oriented. An open or broken mesh can be touched too, as a two-sided sheet.
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

inline constexpr std::uint32_t kNoIndex = 0xffffffffU;  // no vertex, triangle or edge

using TriangleIndices = std::array<std::uint32_t, 3>;

struct TriangleMesh {
  std::vector<glm::dvec3> vertices;        // (unit: meter), body frame, all finite
  std::vector<TriangleIndices> triangles;  // indices into vertices, all in range

  [[nodiscard]] bool empty() const { return triangles.empty(); }
};

enum class Severity : std::uint8_t { info, warning, error };

// Where in the mesh something was found or changed (body frame, unit: meter).
struct FindingPlace {
  glm::dvec3 first_m{0.0};                  // centre of the first triangle, edge, vertex or loop
  glm::dvec3 lower_m{0.0}, upper_m{0.0};    // box around the centres of all of them
  std::optional<std::uint32_t> triangle{};  // the triangle at the first place; index in the mesh as given
};

// One finding of a check or a loader, with a text that a person can act on.
struct Finding {
  std::string id;  // stable and short, e.g. "M04-nonmanifold-edges"
  Severity severity = Severity::info;
  std::size_t count = 0;
  std::string text;                     // what, where (in the file or in space) and what to do
  std::optional<FindingPlace> place{};  // the same place as numbers, if it is a place in space
};

}  // namespace polygon
