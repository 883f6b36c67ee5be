// SPDX-License-Identifier: GPL-3.0-or-later
// Leaves out the triangles of a mesh that a view cannot show. The mesh is divided into parts of neighbouring
// triangles, and a part outside the view is not drawn. Uses no graphics library.
#pragma once

#include <array>
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <limits>
#include <span>
#include <vector>

#include "hybrid/view/gl/unit_shapes.h"
#include "polygon/mesh/mesh.h"

namespace hybrid {

// Consecutive indices of a mesh, and a ball that contains their triangles (mesh's frame).
struct MeshPart {
  std::uint32_t first = 0, count = 0;
  glm::vec3 centre{0.0F};
  float radius = 0.0F;
  float most_value = 0.0F;  // largest DrawVertex::value
};
// Parts whose largest value is above `above` and at most `up_to`.
struct ValueRange {
  float above = -1.0F, up_to = std::numeric_limits<float>::infinity();
};
struct IndexRange {
  std::uint32_t first = 0, count = 0;
};

// Puts the mesh's triangles into an order in which neighbours are near each other, and returns its parts.
// Together they cover all indices. The vertices stay as they are.
std::vector<MeshPart> divide_mesh(DrawMesh& mesh);

// The six planes that bound the points whose clip coordinates are within the view. Normals point inwards and
// have unit length.
std::array<glm::vec4, 6> planes_of_view(const glm::mat4& clip_from_mesh);

// Call after vertices of the mesh have moved or have other values.
void update_parts(const DrawMesh& mesh, std::span<MeshPart> parts);

// The indices of all parts that may be in the view and whose values are in a range. Touching ranges are
// joined. `margin`: greatest distance of a vertex from its place in the part (mesh's frame).
std::vector<IndexRange> seen_ranges(std::span<const MeshPart> parts, const glm::mat4& clip_from_mesh,
                                    float margin, const ValueRange& values = {});

// Is every edge shared by exactly two triangles that agree on their side, and is the volume positive? Then no
// back of a triangle is visible from outside.
bool is_closed_outwards(const polygon::TriangleMesh& mesh);

}  // namespace hybrid
