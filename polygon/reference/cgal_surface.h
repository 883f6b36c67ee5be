// SPDX-License-Identifier: GPL-3.0-or-later
// A triangle mesh as a RigidSurface over CGAL's AABB tree: what mesh_surface.h does with Embree, done with
// the other library that people reach for, so that the two can be timed on the same paths.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <span>

#include "polygon/surface/rigid_surface.h"
#include "polygon/mesh/mesh.h"

namespace polygon {

// The same answers as make_mesh_surface() (up to rounding), the same rules for duplicates, for gather() when
// it is not complete and for queries that are not finite. Only the search differs: one triangle a leaf, boxes
// in double, nearer child first. `solid`: closed and consistently oriented, so inside() and shaded normals
// mean something. Throws std::invalid_argument for an empty mesh, an index out of range or a vertex that is
// not finite (or beyond 1e12 m).
std::unique_ptr<RigidSurface> make_cgal_surface(const TriangleMesh& mesh, bool solid);

// What meets an axis-parallel box (bounds included), by the same tree: the baseline of the occupancy map.
class BoxSearch {
 public:
  virtual ~BoxSearch() = default;
  // Writes at most out.size() indices, in no order; returns how many.
  [[nodiscard]] virtual std::size_t in(const glm::dvec3& low, const glm::dvec3& high,
                                       std::span<std::uint32_t> out) const noexcept = 0;
  [[nodiscard]] virtual std::size_t memory_bytes() const noexcept = 0;  // without the geometry itself
};
// Over points, or a mesh's triangles; they must outlive the search. Something must be there.
std::unique_ptr<BoxSearch> make_cgal_search(std::span<const glm::dvec3> points);
std::unique_ptr<BoxSearch> make_cgal_search(const TriangleMesh& mesh);

}  // namespace polygon
