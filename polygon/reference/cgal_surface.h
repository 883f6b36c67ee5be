// SPDX-License-Identifier: GPL-3.0-or-later
// A triangle mesh as a RigidSurface over CGAL's AABB tree. This is the baseline for mesh_surface.h: both are
// timed on the same paths, and their answers are compared.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <span>

#include "polygon/mesh/mesh.h"
#include "polygon/surface/rigid_surface.h"

namespace polygon {

// Gives the answers of make_mesh_surface() up to rounding. The rules for duplicates, for an incomplete
// gather() and for queries that are not finite are the same. The search differs: it has one triangle per leaf
// and boxes in double, and visits the nearer child first. `solid`: the mesh is closed and consistently
// oriented; inside() and interpolated normals need it. Throws std::invalid_argument for an empty mesh, an
// index out of range, or a vertex that is not finite or beyond 1e12 m.
std::unique_ptr<RigidSurface> make_cgal_surface(const TriangleMesh& mesh, bool solid);

// Finds the points or triangles that an axis-parallel box meets, its bounds included. It uses a CGAL AABB
// tree too, and is the baseline of the occupancy map.
class BoxSearch {
 public:
  virtual ~BoxSearch() = default;
  // Writes at most out.size() indices in undefined order; returns their number.
  [[nodiscard]] virtual std::size_t in(const glm::dvec3& low, const glm::dvec3& high,
                                       std::span<std::uint32_t> out) const noexcept = 0;
  [[nodiscard]] virtual std::size_t memory_bytes()
      const noexcept = 0;  // of the tree alone, without the geometry
};
// Searches points or the triangles of a mesh. The points or the mesh must outlive the search and must not be
// empty.
std::unique_ptr<BoxSearch> make_cgal_search(std::span<const glm::dvec3> points);
std::unique_ptr<BoxSearch> make_cgal_search(const TriangleMesh& mesh);

}  // namespace polygon
