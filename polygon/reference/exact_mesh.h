// SPDX-License-Identifier: GPL-3.0-or-later
// Exact queries of a triangle mesh by CGAL: inside, distance, crossing. They are for references and tests
// only, because they allocate and an exact distance takes microseconds.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <span>
#include <vector>

#include "polygon/mesh/mesh.h"

namespace polygon {

// The point base + offset, without rounding the sum. It can be nearer to a surface than the spacing of
// doubles at these coordinates.
struct FinePoint {
  glm::dvec3 base{0.0};                 // (unit: meter)
  std::array<long double, 3> offset{};  // (unit: meter)
};

class ExactMesh {
 public:
  // Keeps a copy of the triangles. Throws std::invalid_argument for an empty mesh, an index out of range or a
  // vertex that is not finite (or beyond 1e12 m).
  explicit ExactMesh(const TriangleMesh& mesh);
  ExactMesh(const ExactMesh&) = delete;
  ExactMesh& operator=(const ExactMesh&) = delete;
  ExactMesh(ExactMesh&&) = delete;
  ExactMesh& operator=(ExactMesh&&) = delete;
  ~ExactMesh();

  [[nodiscard]] double size() const;      // diagonal of the bounds (unit: meter)
  [[nodiscard]] double furthest() const;  // largest magnitude of a coordinate (unit: meter)
  [[nodiscard]] std::array<glm::dvec3, 3> corners(std::uint32_t triangle) const;

  // Writes the triangles whose bounds come within `radius` of the point or segment. These include all
  // triangles that are so near, and some others. Replaces the contents of `out`.
  void near_point(const glm::dvec3& point, double radius, std::vector<std::uint32_t>& out) const;
  void near_segment(const glm::dvec3& from, const glm::dvec3& to, double radius,
                    std::vector<std::uint32_t>& out) const;

  // Distance to one triangle, computed exactly and rounded once at the end (unit: meter).
  [[nodiscard]] double distance(const FinePoint& point, std::uint32_t triangle) const;
  [[nodiscard]] double segment_distance(const glm::dvec3& from, const glm::dvec3& to,
                                        std::uint32_t triangle) const;

  // Whether the closed segment meets the triangle; false for a degenerate one.
  [[nodiscard]] bool crosses(const glm::dvec3& from, const glm::dvec3& to, std::uint32_t triangle) const;

  struct Closest {
    std::uint32_t triangle = 0;
    double distance = 0.0;
  };
  [[nodiscard]] Closest closest(const glm::dvec3& point) const;

  // Whether the point is inside, by the parity of crossings along a segment that ends beyond the bounds.
  // False on the surface.
  [[nodiscard]] bool inside(const glm::dvec3& point) const;

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace polygon
