// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/gl/unit_shapes.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>

#include "polygon/mesh/is_finite.h"
#include "polygon/mesh/mesh.h"

namespace hybrid {
namespace {

bool usable(const polygon::TriangleMesh& mesh, const polygon::TriangleIndices& corner) {
  return std::ranges::all_of(corner, [&](std::uint32_t v) {
    return v < mesh.vertices.size() && polygon::is_finite(mesh.vertices[v]);
  });
}

glm::vec3 unit_or_zero(const glm::vec3& v) {
  const float length = glm::length(v);
  return length > 0.0F && std::isfinite(length) ? v / length : glm::vec3(0.0F);
}

// Computes area-weighted normals of shared vertices, in a form that does not leave the range of floats for
// triangles of micrometers.
void set_shared_normals(DrawMesh& draw) {
  for (DrawVertex& vertex : draw.vertices) vertex.normal = glm::vec3(0.0F);
  for (std::size_t t = 0; t + 2 < draw.indices.size(); t += 3) {
    DrawVertex& a = draw.vertices[draw.indices[t]];
    DrawVertex& b = draw.vertices[draw.indices[t + 1]];
    DrawVertex& c = draw.vertices[draw.indices[t + 2]];
    const glm::vec3 u = b.position - a.position;
    const glm::vec3 v = c.position - a.position;
    const float size = std::max(std::max(glm::length(u), glm::length(v)), 1e-30F);
    // The weight is the area over the longest edge. Its exponent stays small.
    const glm::vec3 normal = glm::cross(u / size, v / size) * size;
    a.normal += normal;
    b.normal += normal;
    c.normal += normal;
  }
  for (DrawVertex& vertex : draw.vertices) vertex.normal = unit_or_zero(vertex.normal);
}

DrawMesh shared_mesh(const polygon::TriangleMesh& mesh, const glm::dvec3& origin_m) {
  DrawMesh draw;
  draw.vertices.resize(mesh.vertices.size());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (polygon::is_finite(mesh.vertices[v]))
      draw.vertices[v].position = glm::vec3(mesh.vertices[v] - origin_m);
  }
  draw.indices.reserve(3 * mesh.triangles.size());
  for (const polygon::TriangleIndices& corner : mesh.triangles) {
    if (usable(mesh, corner)) draw.indices.insert(draw.indices.end(), corner.begin(), corner.end());
  }
  set_shared_normals(draw);
  return draw;
}

// Gives every triangle three vertices of its own. The normal at a corner is the mean over those triangles at
// the vertex whose normals differ by less than the crease angle.
DrawMesh creased_mesh(const polygon::TriangleMesh& mesh, const glm::dvec3& origin_m) {
  constexpr double crease = 40.0 * std::numbers::pi / 180.0;
  const double cos_crease = std::cos(crease);
  std::vector<polygon::TriangleIndices> kept;
  std::vector<glm::dvec3> area;  // face normals whose length is twice the area
  for (const polygon::TriangleIndices& corner : mesh.triangles) {
    if (!usable(mesh, corner)) continue;
    const glm::dvec3& a = mesh.vertices[corner[0]];
    kept.push_back(corner);
    area.push_back(glm::cross(mesh.vertices[corner[1]] - a, mesh.vertices[corner[2]] - a));
  }
  // The triangles around each vertex, as one array with offsets.
  std::vector<std::uint32_t> begin(mesh.vertices.size() + 1, 0);
  for (const auto& corner : kept) {
    for (const std::uint32_t v : corner) ++begin[v + 1];
  }
  for (std::size_t v = 1; v < begin.size(); ++v) begin[v] += begin[v - 1];
  std::vector<std::uint32_t> around(3 * kept.size());
  std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
  for (std::uint32_t t = 0; t < kept.size(); ++t) {
    for (const std::uint32_t v : kept[t]) around[next[v]++] = t;
  }
  DrawMesh draw;
  draw.vertices.reserve(3 * kept.size());
  draw.indices.reserve(3 * kept.size());
  // Greatest number of triangles that count around a vertex. Without a limit the cost would be quadratic in
  // the triangles that share a vertex, which may be all of them.
  constexpr std::uint32_t at_most = 64;
  for (std::size_t t = 0; t < kept.size(); ++t) {
    const double own = glm::length(area[t]);
    for (const std::uint32_t v : kept[t]) {
      glm::dvec3 sum = area[t];
      const std::uint32_t end = std::min(begin[v + 1], begin[v] + at_most);
      for (std::uint32_t n = begin[v]; n < end; ++n) {
        const glm::dvec3& other = area[around[n]];
        if (around[n] != t && glm::dot(area[t], other) > cos_crease * own * glm::length(other)) sum += other;
      }
      const double length = glm::length(sum);
      DrawVertex vertex;
      vertex.position = glm::vec3(mesh.vertices[v] - origin_m);
      if (length > 0.0) vertex.normal = glm::vec3(sum / length);
      draw.indices.push_back(static_cast<std::uint32_t>(draw.vertices.size()));
      draw.vertices.push_back(vertex);
    }
  }
  return draw;
}

constexpr std::uint32_t sides = 48;

// A shape from rings of `sides` vertices about z, joined in order. Each ring has a radius, a height and a
// normal (radial, axial).
struct Ring {
  float radius, z, normal_radial, normal_z;
};
DrawMesh lathe(std::span<const Ring> rings) {
  DrawMesh draw;
  for (const Ring& ring : rings) {
    for (std::uint32_t s = 0; s < sides; ++s) {
      const float angle =
          2.0F * std::numbers::pi_v<float> * static_cast<float>(s) / static_cast<float>(sides);
      const glm::vec3 out(std::cos(angle), std::sin(angle), 0.0F);
      draw.vertices.push_back({ring.radius * out + glm::vec3(0.0F, 0.0F, ring.z),
                               unit_or_zero(ring.normal_radial * out + glm::vec3(0.0F, 0.0F, ring.normal_z)),
                               0.0F});
    }
  }
  for (std::uint32_t r = 0; r + 1 < rings.size(); ++r) {
    for (std::uint32_t s = 0; s < sides; ++s) {
      const std::uint32_t a = r * sides + s;
      const std::uint32_t b = r * sides + (s + 1) % sides;
      draw.indices.insert(draw.indices.end(), {a, b, b + sides, a, b + sides, a + sides});
    }
  }
  return draw;
}

}  // namespace

DrawMesh make_draw_mesh(const polygon::TriangleMesh& mesh, const glm::dvec3& origin_m) {
  constexpr std::size_t small = 30'000;
  return mesh.triangles.size() <= small ? creased_mesh(mesh, origin_m) : shared_mesh(mesh, origin_m);
}

DrawMesh make_moving_mesh(const polygon::TriangleMesh& mesh, const glm::dvec3& origin_m) {
  return shared_mesh(mesh, origin_m);
}

VertexColour bytes_of(const glm::vec3& colour) {
  const glm::vec3 byte = glm::round(255.0F * colour);
  return {static_cast<std::uint8_t>(byte.r), static_cast<std::uint8_t>(byte.g),
          static_cast<std::uint8_t>(byte.b), 255};
}

float move_vertices(DrawMesh& draw, std::span<const glm::dvec3> rest, std::span<const glm::vec3> moved_m,
                    const glm::dvec3& origin_m) {
  float most = 0.0F;
  for (std::size_t v = 0; v < draw.vertices.size(); ++v) {
    DrawVertex& vertex = draw.vertices[v];
    const glm::dvec3 moved(moved_m[v]);
    if (!polygon::is_finite(rest[v])) continue;
    const bool known = polygon::is_finite(moved);
    vertex.position = glm::vec3(rest[v] - origin_m + (known ? moved : glm::dvec3(0.0)));
    vertex.value = known ? static_cast<float>(glm::length(moved)) : 0.0F;
    most = std::max(most, vertex.value);
  }
  set_shared_normals(draw);
  return most;
}

DrawMesh make_unit_ball() {
  constexpr std::uint32_t rows = 32;
  std::vector<Ring> rings;
  for (std::uint32_t r = 0; r <= rows; ++r) {
    const float polar = std::numbers::pi_v<float> * (static_cast<float>(r) / static_cast<float>(rows) - 0.5F);
    rings.push_back({std::cos(polar), std::sin(polar), std::cos(polar), std::sin(polar)});
  }
  return lathe(rings);
}

DrawMesh make_unit_cylinder() {
  return lathe(std::vector<Ring>{{0.0F, 0.0F, 0.0F, -1.0F},
                                 {1.0F, 0.0F, 0.0F, -1.0F},
                                 {1.0F, 0.0F, 1.0F, 0.0F},
                                 {1.0F, 1.0F, 1.0F, 0.0F},
                                 {1.0F, 1.0F, 0.0F, 1.0F},
                                 {0.0F, 1.0F, 0.0F, 1.0F}});
}

DrawMesh make_unit_cone() {
  return lathe(std::vector<Ring>{{0.0F, 0.0F, 0.0F, -1.0F},
                                 {1.0F, 0.0F, 0.0F, -1.0F},
                                 {1.0F, 0.0F, 1.0F, 1.0F},
                                 {0.0F, 1.0F, 1.0F, 1.0F}});
}

DrawMesh make_unit_disc() {
  return lathe(std::vector<Ring>{{0.0F, 0.0F, 0.0F, 1.0F}, {1.0F, 0.0F, 0.0F, 1.0F}});
}

}  // namespace hybrid
