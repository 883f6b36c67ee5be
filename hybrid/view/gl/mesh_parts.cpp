// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/gl/mesh_parts.h"

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_access.hpp>
#include <limits>
#include <utility>

namespace hybrid {
namespace {

// Triangles of a part. Smaller parts leave out more, but each costs a test and at worst a draw call.
constexpr std::size_t kPartTriangles = 128;
constexpr std::uint32_t kCodeCells = 1024;  // cells along each axis in which triangles are sorted

// Spreads ten bits to every third bit (Morton 1966).
std::uint32_t every_third_bit(std::uint32_t x) {
  x = (x | (x << 16U)) & 0x030000FFU;
  x = (x | (x << 8U)) & 0x0300F00FU;
  x = (x | (x << 4U)) & 0x030C30C3U;
  return (x | (x << 2U)) & 0x09249249U;
}

std::uint32_t morton_code(const glm::vec3& share) {
  std::uint32_t code = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const float cell = std::clamp(share[axis], 0.0F, 1.0F) * static_cast<float>(kCodeCells - 1);
    code |= every_third_bit(static_cast<std::uint32_t>(cell)) << static_cast<std::uint32_t>(axis);
  }
  return code;
}

glm::vec3 middle_of(const DrawMesh& mesh, std::size_t first) {
  glm::vec3 sum(0.0F);
  for (std::size_t n = 0; n < 3; ++n) sum += mesh.vertices[mesh.indices[first + n]].position;
  return sum / 3.0F;
}

void sort_triangles(DrawMesh& mesh) {
  glm::vec3 low(std::numeric_limits<float>::max()), high(-low);
  for (const DrawVertex& v : mesh.vertices) {
    low = glm::min(low, v.position);
    high = glm::max(high, v.position);
  }
  const glm::vec3 size = glm::max(high - low, glm::vec3(std::numeric_limits<float>::min()));
  std::vector<std::pair<std::uint32_t, std::uint32_t>> order;  // code, number of the triangle
  for (std::uint32_t t = 0; t < mesh.indices.size() / 3; ++t)
    order.emplace_back(morton_code((middle_of(mesh, std::size_t{3} * t) - low) / size), t);
  std::sort(order.begin(), order.end());
  std::vector<std::uint32_t> sorted;
  sorted.reserve(mesh.indices.size());
  for (const auto& [code, t] : order) {
    for (std::size_t n = 0; n < 3; ++n) sorted.push_back(mesh.indices[std::size_t{3} * t + n]);
  }
  mesh.indices = std::move(sorted);
}

MeshPart part_of(const DrawMesh& mesh, std::size_t first, std::size_t count) {
  glm::vec3 low(std::numeric_limits<float>::max()), high(-low);
  float most_value = 0.0F;
  for (std::size_t n = first; n < first + count; ++n) {
    const glm::vec3& at = mesh.vertices[mesh.indices[n]].position;
    low = glm::min(low, at);
    high = glm::max(high, at);
    most_value = std::max(most_value, mesh.vertices[mesh.indices[n]].value);
  }
  return {static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(count), 0.5F * (low + high),
          0.5F * glm::length(high - low), most_value};
}

}  // namespace

std::vector<MeshPart> divide_mesh(DrawMesh& mesh) {
  sort_triangles(mesh);
  std::vector<MeshPart> parts;
  for (std::size_t first = 0; first < mesh.indices.size(); first += 3 * kPartTriangles)
    parts.push_back(part_of(mesh, first, std::min(3 * kPartTriangles, mesh.indices.size() - first)));
  return parts;
}

void update_parts(const DrawMesh& mesh, std::span<MeshPart> parts) {
  for (MeshPart& part : parts) part = part_of(mesh, part.first, part.count);
}

// After Gribb & Hartmann 2001: a clip coordinate is within the view if it lies between -w and w.
std::array<glm::vec4, 6> planes_of_view(const glm::mat4& clip_from_mesh) {
  std::array<glm::vec4, 6> planes{};
  for (int axis = 0; axis < 3; ++axis) {
    const glm::vec4 w = glm::row(clip_from_mesh, 3), along = glm::row(clip_from_mesh, axis);
    planes[2 * static_cast<std::size_t>(axis)] = w + along;
    planes[2 * static_cast<std::size_t>(axis) + 1] = w - along;
  }
  for (glm::vec4& plane : planes)
    plane /= std::max(glm::length(glm::vec3(plane)), std::numeric_limits<float>::min());
  return planes;
}

std::vector<IndexRange> seen_ranges(std::span<const MeshPart> parts, const glm::mat4& clip_from_mesh,
                                    float margin, const ValueRange& values) {
  const std::array<glm::vec4, 6> planes = planes_of_view(clip_from_mesh);
  const glm::vec4 depth = glm::row(clip_from_mesh, 3);
  std::vector<std::pair<float, IndexRange>> seen;  // distance of the part's middle from the eye's plane
  for (const MeshPart& part : parts) {
    const bool outside = std::ranges::any_of(planes, [&](const glm::vec4& plane) {
      return glm::dot(glm::vec3(plane), part.centre) + plane.w < -(part.radius + margin);
    });
    if (outside || !(part.most_value > values.above && part.most_value <= values.up_to)) continue;
    seen.push_back({glm::dot(glm::vec3(depth), part.centre) + depth.w, {part.first, part.count}});
  }
  std::ranges::sort(seen, {}, [](const auto& part) { return part.first; });
  std::vector<IndexRange> ranges;
  for (const auto& [distance, range] : seen) {
    if (!ranges.empty() && ranges.back().first + ranges.back().count == range.first) {
      ranges.back().count += range.count;
    } else {
      ranges.push_back(range);
    }
  }
  return ranges;
}

bool is_closed_outwards(const polygon::TriangleMesh& mesh) {
  std::vector<std::uint64_t> edges, opposite;
  const glm::dvec3 about = mesh.vertices.empty() ? glm::dvec3(0.0) : mesh.vertices.front();
  double volume = 0.0;
  for (const polygon::TriangleIndices& t : mesh.triangles) {
    for (std::size_t n = 0; n < 3; ++n) {
      const std::uint64_t a = t[n], b = t[(n + 1) % 3];
      if (a >= mesh.vertices.size() || b >= mesh.vertices.size()) return false;
      edges.push_back(a << 32U | b);
      opposite.push_back(b << 32U | a);
    }
    const glm::dvec3 p = mesh.vertices[t[0]] - about, q = mesh.vertices[t[1]] - about;
    volume += glm::dot(p, glm::cross(q, mesh.vertices[t[2]] - about));
  }
  std::sort(edges.begin(), edges.end());
  std::sort(opposite.begin(), opposite.end());
  const bool once = std::adjacent_find(edges.begin(), edges.end()) == edges.end();
  return once && edges == opposite && volume > 0.0;
}

}  // namespace hybrid
