// SPDX-License-Identifier: GPL-3.0-or-later
// A triangle mesh as a RigidSurface over CGAL's AABB tree. It is the baseline for mesh_surface.h, timed on
// the same paths and checked against the same answers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <span>

#include "polygon/mesh/mesh.h"
#include "polygon/surface/rigid_surface.h"

namespace polygon {

// Gives the answers of make_mesh_surface() up to rounding, with the same rules for duplicates, for an
// incomplete gather() and for queries that are not finite. The search differs: one triangle per leaf, boxes
// in double, nearer child first. `solid`: the mesh is closed and consistently oriented; inside() and
// interpolated normals need it. Throws std::invalid_argument for an empty mesh, an index out of range, or a
// vertex that is not finite or beyond 1e12 m.
std::unique_ptr<RigidSurface> make_cgal_surface(const TriangleMesh& mesh, bool solid);

// Finds what an axis-parallel box meets (bounds included), with the same tree. Baseline of the occupancy map.
class BoxSearch {
 public:
  virtual ~BoxSearch() = default;
  // Writes at most out.size() indices in undefined order; returns their number.
  [[nodiscard]] virtual std::size_t in(const glm::dvec3& low, const glm::dvec3& high,
                                       std::span<std::uint32_t> out) const noexcept = 0;
  [[nodiscard]] virtual std::size_t memory_bytes() const noexcept = 0;  // without the geometry itself
};
// Over points or the triangles of a mesh, which must outlive the search and must not be empty.
std::unique_ptr<BoxSearch> make_cgal_search(std::span<const glm::dvec3> points);
std::unique_ptr<BoxSearch> make_cgal_search(const TriangleMesh& mesh);

}  // namespace polygon
