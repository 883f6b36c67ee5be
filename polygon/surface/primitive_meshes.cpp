// SPDX-License-Identifier: GPL-3.0-or-later
// Tessellations of the primitives: watertight meshes in which each vertex occurs once.
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <unordered_map>

#include "polygon/mesh/topology.h"
#include "polygon/surface/primitives.h"
#include "polygon/surface/require_size.h"

namespace polygon {
namespace {

void require_count(const char* what, int value, int lowest, int highest) {
  if (value >= lowest && value <= highest) return;
  throw std::invalid_argument(std::string(what) + " is " + std::to_string(value) + "; it must be " +
                              std::to_string(lowest) + " to " + std::to_string(highest));
}

TriangleMesh icosahedron() {
  const double g = std::numbers::phi;
  TriangleMesh mesh;
  mesh.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                   {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  for (glm::dvec3& v : mesh.vertices) v = glm::normalize(v);
  mesh.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                    {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                    {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  return mesh;
}

// Splits each triangle into four. New vertices lie on the unit sphere, one for the two triangles that share
// an edge.
void subdivide(TriangleMesh& mesh) {
  std::unordered_map<std::uint64_t, std::uint32_t> middles;
  middles.reserve(mesh.triangles.size() * 3 / 2);
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const std::uint64_t key = (static_cast<std::uint64_t>(std::min(a, b)) << 32U) | std::max(a, b);
    const auto [place, is_new] = middles.try_emplace(key, static_cast<std::uint32_t>(mesh.vertices.size()));
    if (is_new) {
      const glm::dvec3 between = glm::normalize(mesh.vertices[a] + mesh.vertices[b]);
      mesh.vertices.push_back(between);
    }
    return place->second;
  };
  std::vector<TriangleIndices> finer;
  finer.reserve(mesh.triangles.size() * 4);
  for (const auto& [a, b, c] : mesh.triangles) {
    const std::uint32_t ab = middle(a, b);
    const std::uint32_t bc = middle(b, c);
    const std::uint32_t ca = middle(c, a);
    finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
  }
  mesh.triangles = std::move(finer);
}

// n × n quads over corner + s·u + t·v, s and t in 0..1, counter-clockwise seen from the side of u × v.
void add_grid(TriangleMesh& mesh, const glm::dvec3& corner, const glm::dvec3& u, const glm::dvec3& v, int n) {
  const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
  const auto row = static_cast<std::uint32_t>(n) + 1;
  for (int j = 0; j <= n; ++j) {
    for (int i = 0; i <= n; ++i) {
      const double s = static_cast<double>(i) / n;
      const double t = static_cast<double>(j) / n;
      mesh.vertices.push_back(corner + s * u + t * v);
    }
  }
  for (std::uint32_t j = 0; j + 1 < row; ++j) {
    for (std::uint32_t i = 0; i + 1 < row; ++i) {
      const std::uint32_t a = base + j * row + i;
      mesh.triangles.push_back({a, a + 1, a + row + 1});
      mesh.triangles.push_back({a, a + row + 1, a + row});
    }
  }
}

}  // namespace

TriangleMesh make_ball_mesh(double radius, int subdivisions) {
  require_size("the ball's radius", radius);
  require_count("the number of subdivisions", subdivisions, 0, 9);
  TriangleMesh mesh = icosahedron();
  for (int i = 0; i < subdivisions; ++i) subdivide(mesh);
  for (glm::dvec3& v : mesh.vertices) v *= radius;
  return mesh;
}

TriangleMesh make_box_mesh(const glm::dvec3& half_size, int quads_per_edge) {
  require_size("the box's half size along x", half_size.x);
  require_size("the box's half size along y", half_size.y);
  require_size("the box's half size along z", half_size.z);
  require_count("the number of quads an edge", quads_per_edge, 1, 1024);
  // Built on the integer lattice -n..n in steps of 2 first: there the edges shared by two faces are exactly
  // equal and can be welded.
  TriangleMesh faces;
  const double n = quads_per_edge;
  for (int axis = 0; axis < 3; ++axis) {
    glm::dvec3 out(0.0), u(0.0), v(0.0);
    out[axis] = n;
    u[(axis + 1) % 3] = 2.0 * n;
    v[(axis + 2) % 3] = 2.0 * n;
    add_grid(faces, out - 0.5 * (u + v), u, v, quads_per_edge);
    add_grid(faces, -out - 0.5 * (u + v), v, u, quads_per_edge);
  }
  for (glm::dvec3& corner : faces.vertices) {
    corner = {std::round(corner.x), std::round(corner.y), std::round(corner.z)};
  }
  const WeldedVertices welded = weld_vertices(faces.vertices);
  TriangleMesh mesh;
  mesh.triangles = welded_triangles(faces, welded);
  mesh.vertices.resize(welded.points);
  for (std::size_t i = 0; i < faces.vertices.size(); ++i) {
    mesh.vertices[welded.point_of[i]] = faces.vertices[i] / n * half_size;
  }
  return mesh;
}

TriangleMesh make_capsule_mesh(double radius, double half_length, int segments) {
  require_size("the capsule's radius", radius);
  require_size("the capsule's half length", half_length, true);
  require_count("the number of segments", segments, 3, 1024);
  // Rings from the lower pole to the upper one. The quarter circles are divided as finely as the rings, with
  // one band between the equators.
  const int quarter = std::max(1, segments / 4);
  const auto around = static_cast<std::uint32_t>(segments);
  TriangleMesh mesh;
  mesh.vertices.emplace_back(0.0, 0.0, -half_length - radius);
  const auto add_ring = [&](double latitude, double z_offset) {
    for (int i = 0; i < segments; ++i) {
      const double longitude = 2.0 * std::numbers::pi * i / segments;
      mesh.vertices.emplace_back(radius * std::cos(latitude) * std::cos(longitude),
                                 radius * std::cos(latitude) * std::sin(longitude),
                                 z_offset + radius * std::sin(latitude));
    }
  };
  std::uint32_t rings = 0;
  for (int i = 1; i <= quarter; ++i, ++rings)
    add_ring((static_cast<double>(i) / quarter - 1.0) * 0.5 * std::numbers::pi, -half_length);
  // Without a cylinder the two equators would be the same ring.
  for (int i = half_length > 0.0 ? 0 : 1; i < quarter; ++i, ++rings)
    add_ring(static_cast<double>(i) / quarter * 0.5 * std::numbers::pi, half_length);
  const auto top = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.emplace_back(0.0, 0.0, half_length + radius);
  for (std::uint32_t i = 0; i < around; ++i) {
    const std::uint32_t j = (i + 1) % around;
    mesh.triangles.push_back({0, 1 + j, 1 + i});
    for (std::uint32_t ring = 0; ring + 1 < rings; ++ring) {
      const std::uint32_t below = 1 + ring * around;
      const std::uint32_t above = below + around;
      mesh.triangles.push_back({below + i, below + j, above + j});
      mesh.triangles.push_back({below + i, above + j, above + i});
    }
    const std::uint32_t last = 1 + (rings - 1) * around;
    mesh.triangles.push_back({last + i, last + j, top});
  }
  return mesh;
}

TriangleMesh make_plane_mesh(double half_size, int quads_per_edge) {
  require_size("the plane's half size", half_size);
  require_count("the number of quads an edge", quads_per_edge, 1, 1024);
  TriangleMesh mesh;
  add_grid(mesh, {-half_size, -half_size, 0.0}, {2.0 * half_size, 0.0, 0.0}, {0.0, 2.0 * half_size, 0.0},
           quads_per_edge);
  return mesh;
}

}  // namespace polygon
