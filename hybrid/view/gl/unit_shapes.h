// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes in the layout of the graphics card: floats relative to an origin, with normals. Uses no graphics
// library.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "polygon/mesh/mesh.h"

namespace hybrid {

struct DrawVertex {
  glm::vec3 position{0.0F};  // relative to the mesh's origin (unit: meter)
  glm::vec3 normal{0.0F};    // unit vector; zero if undefined (degenerate or inconsistently oriented)
  float value = 0.0F;        // the quantity that colours tissue; 0 for a rigid object
};
static_assert(sizeof(DrawVertex) == 28, "uploaded as it stands");

struct DrawMesh {
  std::vector<DrawVertex> vertices;
  std::vector<std::uint32_t> indices;  // three per triangle, all in range
};

// Mesh of a surface that never moves. With up to 30,000 triangles, sharp edges are split, so that they look
// sharp. Larger meshes share normals, because the eye does not resolve their triangles. Triangles with an
// index out of range or a vertex that is not finite are left out.
DrawMesh make_draw_mesh(const polygon::TriangleMesh& mesh, const glm::dvec3& origin_m);

// Mesh of a surface that moves. It has one vertex per mesh vertex, in the mesh's order, as move_vertices()
// needs.
DrawMesh make_moving_mesh(const polygon::TriangleMesh& mesh, const glm::dvec3& origin_m);

using VertexColour = std::array<std::uint8_t, 4>;  // sRGB and alpha
VertexColour bytes_of(const glm::vec3& colour);    // opaque; each part from 0 to 1

// Moves the vertices of a moving mesh by `moved_m` (meters) from rest, and updates normals. Values become
// displacements. Vertices whose displacement is not finite stay at rest. Returns the largest displacement
// (m). `moved_m` must have as many entries as `rest`.
float move_vertices(DrawMesh& draw, std::span<const glm::dvec3> rest, std::span<const glm::vec3> moved_m,
                    const glm::dvec3& origin_m);

// Shapes of unit size for tool and arrow. Their normals point outwards.
DrawMesh make_unit_ball();      // radius 1 about the origin
DrawMesh make_unit_cylinder();  // radius 1 about z, from z = 0 to z = 1, closed
DrawMesh make_unit_cone();      // radius 1 at z = 0, tip at z = 1, closed
DrawMesh make_unit_disc();      // radius 1 in z = 0

}  // namespace hybrid
