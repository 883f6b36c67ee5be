// SPDX-License-Identifier: GPL-3.0-or-later
// Connectivity of a triangle soup. Vertices with exactly equal coordinates are one point. The soup itself is
// not changed.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "polygon/mesh/mesh.h"

namespace polygon {

// Vertices with exactly equal coordinates (0 and -0 are equal) become one point.
struct WeldedVertices {
  std::vector<std::uint32_t> point_of;  // [vertex] its point, numbered in order of first appearance
  std::uint32_t points = 0;
};
[[nodiscard]] WeldedVertices weld_vertices(std::span<const glm::dvec3> vertices);

// The mesh's triangles, with point indices as corners.
[[nodiscard]] std::vector<TriangleIndices> welded_triangles(const TriangleMesh& mesh,
                                                            const WeldedVertices& welded);

// True if two corners are the same point. Such a triangle has no interior and is ignored in connectivity.
[[nodiscard]] inline bool has_repeated_corner(const TriangleIndices& t) {
  return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

// The sides of all triangles without repeated corners, grouped by edge. 8 bytes per side; built in linear
// time.
class EdgeTable {
 public:
  // Throws std::invalid_argument for 2^31 triangles or more.
  EdgeTable(std::span<const TriangleIndices> triangles, std::uint32_t points);

  // One triangle's use of the edge.
  class Use {
   public:
    Use() = default;
    Use(std::uint32_t high, std::uint32_t triangle, bool forward)
        : bits_(std::uint64_t{high} << 32U | std::uint64_t{triangle} << 1U | (forward ? 1U : 0U)) {}
    [[nodiscard]] std::uint32_t high() const { return static_cast<std::uint32_t>(bits_ >> 32U); }
    [[nodiscard]] std::uint32_t triangle() const { return static_cast<std::uint32_t>(bits_) >> 1U; }
    [[nodiscard]] bool forward() const { return (bits_ & 1U) != 0; }  // runs from the low to the high point
    [[nodiscard]] std::uint64_t order() const { return bits_; }

   private:
    std::uint64_t bits_ = 0;
  };
  struct Edge {
    std::uint32_t low = 0, high = 0;  // points, low < high
    std::span<const Use> uses;        // in ascending order of triangles; at least one
  };

  // Calls visit(Edge) for each edge, in ascending order of (low, high).
  template <typename Visit>
  void for_each(Visit&& visit) const {
    for (std::uint32_t low = 0; low + 1 < starts_.size(); ++low) {
      std::span<const Use> rest(uses_.data() + starts_[low], starts_[low + 1] - starts_[low]);
      while (!rest.empty()) {
        std::size_t same = 1;
        while (same < rest.size() && rest[same].high() == rest[0].high()) ++same;
        visit(Edge{low, rest[0].high(), rest.first(same)});
        rest = rest.subspan(same);
      }
    }
  }
  [[nodiscard]] bool empty() const { return uses_.empty(); }

 private:
  std::vector<std::size_t> starts_;  // [point] start of the sides whose low end is this point
  std::vector<Use> uses_;
};

// One side of one triangle. Side i runs from corner i to corner (i + 1) % 3.
struct EdgeUse {
  std::uint32_t low = 0, high = 0;  // points, low < high
  std::uint32_t triangle = 0;
  std::uint8_t edge = 0;
  bool forward = false;  // the triangle runs from low to high
};

// All sides of all triangles without repeated corners, in ascending order of (low, high, triangle). Sides of
// the same edge are neighbours in the list.
[[nodiscard]] std::vector<EdgeUse> sorted_edges(std::span<const TriangleIndices> triangles,
                                                std::uint32_t points);

// [triangle] the lowest-numbered triangle with the same three points in any order. This may be the triangle
// itself.
[[nodiscard]] std::vector<std::uint32_t> first_duplicates(std::span<const TriangleIndices> triangles,
                                                          std::uint32_t points);

inline constexpr std::uint32_t kNoTriangle = kNoIndex;

// [triangle][i] the neighbour across the edge from corner i to corner (i + 1) % 3. kNoTriangle if the edge
// has no other triangle or several, and for a triangle with a repeated corner.
[[nodiscard]] std::vector<TriangleIndices> triangles_across(std::span<const TriangleIndices> triangles,
                                                            std::uint32_t points);

// The connectivity of a mesh that a surface needs. Corners are compared by their coordinates.
struct Connections {
  std::vector<std::uint32_t>
      distinct;  // triangles without an earlier duplicate, ascending; empty if no triangle is a duplicate
  std::vector<TriangleIndices> across;  // triangles_across()
};
[[nodiscard]] Connections connect_triangles(const TriangleMesh& mesh);

}  // namespace polygon
