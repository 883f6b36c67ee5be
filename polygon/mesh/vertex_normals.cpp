// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/mesh/vertex_normals.h"

#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "polygon/mesh/topology.h"
#include "polygon/mesh/triangle.h"

namespace polygon {

std::vector<glm::vec3> angle_weighted_normals(const TriangleMesh& mesh) {
  const WeldedVertices welded = weld_vertices(mesh.vertices);
  std::vector<glm::dvec3> sums(welded.points, glm::dvec3(0.0));
  for (const TriangleIndices& t : mesh.triangles) {
    const std::array<glm::dvec3, 3> corner{mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
    const glm::dvec3 normal = unit_normal(corner[0], corner[1], corner[2]);
    for (std::size_t c = 0; c < 3; ++c) {
      sums[welded.point_of[t[c]]] +=
          corner_angle(corner[c], corner[(c + 1) % 3], corner[(c + 2) % 3]) * normal;
    }
  }
  std::vector<glm::vec3> normals;
  normals.reserve(mesh.vertices.size());
  for (const std::uint32_t point : welded.point_of) {
    const double length = glm::length(sums[point]);
    normals.emplace_back(length > 0.0 ? sums[point] / length : glm::dvec3(0.0));
  }
  return normals;
}

}  // namespace polygon
