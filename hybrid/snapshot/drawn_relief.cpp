// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/snapshot/drawn_relief.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <glm/geometric.hpp>
#include <unordered_map>
#include <vector>

namespace hybrid {
namespace {

using polygon::TriangleIndices;
using polygon::TriangleMesh;

constexpr double kEdgesInPeriod = 24.0;
constexpr std::size_t kMostTriangles = 250'000;

// Halves every edge longer than `longest_m`, once. Returns false if there was none.
class EdgeSplitter {
 public:
  explicit EdgeSplitter(TriangleMesh& mesh, double longest_m) : mesh_(mesh), longest_m_(longest_m) {}

  bool split() {
    std::vector<TriangleIndices> out;
    out.reserve(2 * mesh_.triangles.size());
    for (const TriangleIndices& t : mesh_.triangles) split(t, out);
    mesh_.triangles = std::move(out);
    return !middles_.empty();
  }

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  // The vertex in the middle of a long edge, common to both triangles of the edge. kNone: the edge is short.
  std::uint32_t middle(std::uint32_t a, std::uint32_t b) {
    const glm::dvec3 p = mesh_.vertices[a], q = mesh_.vertices[b];
    if (glm::distance(p, q) <= longest_m_) return kNone;
    const std::uint64_t key = std::uint64_t{std::min(a, b)} << 32U | std::max(a, b);
    const auto [at, fresh] = middles_.try_emplace(key, static_cast<std::uint32_t>(mesh_.vertices.size()));
    if (fresh) mesh_.vertices.push_back(0.5 * (p + q));
    return at->second;
  }

  // Splits a triangle with one, two or three long edges into two, three or four triangles.
  void split(const TriangleIndices& t, std::vector<TriangleIndices>& out) {
    const std::array<std::uint32_t, 3> m{middle(t[0], t[1]), middle(t[1], t[2]), middle(t[2], t[0])};
    const auto longs = std::count_if(m.begin(), m.end(), [](std::uint32_t v) { return v != kNone; });
    if (longs == 0) {
      out.push_back(t);
    } else if (longs == 3) {
      out.insert(out.end(), {{t[0], m[0], m[2]}, {m[0], t[1], m[1]}, {m[2], m[1], t[2]}, {m[0], m[1], m[2]}});
    } else {
      // Numbers the edges so that the first is long. If two are long, the second is long too.
      std::size_t first = 0;
      while (m[first] == kNone || (longs == 2 && m[(first + 1) % 3] == kNone)) ++first;
      const std::size_t second = (first + 1) % 3, third = (first + 2) % 3;
      const std::uint32_t a = t[first], b = t[second], c = t[third], ab = m[first], bc = m[second];
      if (longs == 1) {
        out.insert(out.end(), {{a, ab, c}, {ab, b, c}});
      } else {
        out.insert(out.end(), {{ab, b, bc}, {a, ab, bc}, {a, bc, c}});
      }
    }
  }

  TriangleMesh& mesh_;
  double longest_m_;
  std::unordered_map<std::uint64_t, std::uint32_t> middles_;
};

// Normals of the vertices, weighted by area; zero where the triangles cancel out.
std::vector<glm::dvec3> normals_of(const TriangleMesh& mesh) {
  std::vector<glm::dvec3> normals(mesh.vertices.size(), glm::dvec3(0.0));
  for (const TriangleIndices& t : mesh.triangles) {
    const glm::dvec3& a = mesh.vertices[t[0]];
    const glm::dvec3 twice_area = glm::cross(mesh.vertices[t[1]] - a, mesh.vertices[t[2]] - a);
    for (const std::uint32_t v : t) normals[v] += twice_area;
  }
  for (glm::dvec3& n : normals) {
    const double length = glm::length(n);
    n = length > 0.0 ? n / length : glm::dvec3(0.0);
  }
  return normals;
}

}  // namespace

polygon::TriangleMesh with_relief(polygon::TriangleMesh mesh, const HeightTexture& texture, double share) {
  if (texture.mapping().kind != TextureKind::height) return mesh;
  const double longest_m = texture.mapping().size_m / kEdgesInPeriod;
  // A round makes at most four triangles of one.
  while (4 * mesh.triangles.size() <= kMostTriangles && EdgeSplitter(mesh, longest_m).split()) {
  }
  const std::vector<glm::dvec3> normals = normals_of(mesh);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    mesh.vertices[v] += share * relief_at(texture, mesh.vertices[v], normals[v]).height_m * normals[v];
  return mesh;
}

}  // namespace hybrid
