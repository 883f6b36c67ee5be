// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/mesh/mesh_bounds.h"

#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>

namespace polygon {
namespace {

constexpr std::size_t kMaxCount = 0xffffffffU;  // triangles or vertices; the number itself means "none"

}  // namespace

bool is_usable(const glm::dvec3& v) {
  return std::abs(v.x) <= kLargestCoordinate && std::abs(v.y) <= kLargestCoordinate &&
         std::abs(v.z) <= kLargestCoordinate;
}

MeshBounds checked_bounds(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) {
    throw std::invalid_argument("the mesh has no triangle; a surface needs at least one");
  }
  if (mesh.triangles.size() >= kMaxCount || mesh.vertices.size() >= kMaxCount) {
    throw std::invalid_argument("the mesh has " + std::to_string(mesh.triangles.size()) +
                                " triangles, more than 2^32 - 2; split it");
  }
  MeshBounds bounds{glm::dvec3(std::numeric_limits<double>::infinity()),
                    glm::dvec3(-std::numeric_limits<double>::infinity())};
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (const std::uint32_t corner : mesh.triangles[i]) {
      if (corner >= mesh.vertices.size()) {
        throw std::invalid_argument("triangle " + std::to_string(i) + " uses vertex " +
                                    std::to_string(corner) + " of " + std::to_string(mesh.vertices.size()) +
                                    "; leave it out");
      }
      const glm::dvec3& v = mesh.vertices[corner];
      if (!is_usable(v)) {
        throw std::invalid_argument("vertex " + std::to_string(corner) +
                                    " is not finite, or beyond 1e12 m; leave out the triangles that use it");
      }
      bounds.low = glm::min(bounds.low, v);
      bounds.high = glm::max(bounds.high, v);
    }
  }
  return bounds;
}

bool winds_around(const TriangleMesh& mesh, const glm::dvec3& point) noexcept {
  double half_angle = 0.0;
  for (const TriangleIndices& t : mesh.triangles) {
    const glm::dvec3 a = mesh.vertices[t[0]] - point, b = mesh.vertices[t[1]] - point,
                     c = mesh.vertices[t[2]] - point;
    const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
    half_angle += std::atan2(glm::dot(a, glm::cross(b, c)),
                             la * lb * lc + glm::dot(a, b) * lc + glm::dot(b, c) * la + glm::dot(c, a) * lb);
  }
  return half_angle > std::numbers::pi;  // the sum is 2π inside and 0 outside
}

}  // namespace polygon
