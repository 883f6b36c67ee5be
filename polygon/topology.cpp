// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/topology.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <tuple>

namespace polygon {
namespace {

constexpr std::uint32_t kNone = 0xffffffffU;

std::uint64_t hash_of(const glm::dvec3& v) {
  // + 0.0 turns -0 into 0, so that equal coordinates have equal bits.
  std::uint64_t h = 0x9e3779b97f4a7c15ULL;
  for (const double x : {v.x + 0.0, v.y + 0.0, v.z + 0.0}) {
    h ^= std::bit_cast<std::uint64_t>(x);
    h *= 0xff51afd7ed558ccdULL;
    h ^= h >> 32U;
  }
  return h;
}

// Where the entries of each of `buckets` begin (one more at the end), from how many each has: a counting sort
// keeps building linear in the number of triangles, where sorting them all takes seconds at a million.
std::vector<std::size_t> starts_of(std::span<const std::uint32_t> bucket_of, std::uint32_t buckets) {
  std::vector<std::size_t> starts(static_cast<std::size_t>(buckets) + 1, 0);
  for (const std::uint32_t b : bucket_of) {
    if (b != kNone) ++starts[static_cast<std::size_t>(b) + 1];
  }
  for (std::size_t i = 1; i < starts.size(); ++i) starts[i] += starts[i - 1];
  return starts;
}

TriangleIndices in_order(TriangleIndices t) {
  std::sort(t.begin(), t.end());
  return t;
}

}  // namespace

WeldedVertices weld_vertices(std::span<const glm::dvec3> vertices) {
  WeldedVertices welded;
  welded.point_of.resize(vertices.size());
  const std::size_t slots = std::bit_ceil(std::max<std::size_t>(vertices.size() * 2, 16));
  std::vector<std::uint32_t> table(slots, kNone);  // first vertex of each point
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    std::size_t slot = hash_of(vertices[i]) & (slots - 1);
    while (table[slot] != kNone && vertices[table[slot]] != vertices[i]) slot = (slot + 1) & (slots - 1);
    if (table[slot] == kNone) {
      table[slot] = static_cast<std::uint32_t>(i);
      welded.point_of[i] = welded.points++;
    } else {
      welded.point_of[i] = welded.point_of[table[slot]];
    }
  }
  return welded;
}

std::vector<TriangleIndices> welded_triangles(const TriangleMesh& mesh, const WeldedVertices& welded) {
  std::vector<TriangleIndices> triangles(mesh.triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const TriangleIndices& t = mesh.triangles[i];
    triangles[i] = {welded.point_of[t[0]], welded.point_of[t[1]], welded.point_of[t[2]]};
  }
  return triangles;
}

std::vector<EdgeUse> sorted_edges(std::span<const TriangleIndices> triangles, std::uint32_t points) {
  std::vector<std::uint32_t> low_of(triangles.size() * 3, kNone);
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (has_repeated_corner(triangles[i])) continue;
    for (std::size_t e = 0; e < 3; ++e) {
      low_of[3 * i + e] = std::min(triangles[i][e], triangles[i][(e + 1) % 3]);
    }
  }
  const std::vector<std::size_t> starts = starts_of(low_of, points);
  std::vector<std::size_t> next(starts.begin(), starts.end() - 1);
  std::vector<EdgeUse> edges(starts.back());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    for (std::size_t e = 0; e < 3; ++e) {
      if (low_of[3 * i + e] == kNone) continue;
      const std::uint32_t from = triangles[i][e];
      const std::uint32_t to = triangles[i][(e + 1) % 3];
      edges[next[low_of[3 * i + e]]++] = {std::min(from, to), std::max(from, to),
                                          static_cast<std::uint32_t>(i), static_cast<std::uint8_t>(e),
                                          from < to};
    }
  }
  for (std::size_t b = 0; b + 1 < starts.size(); ++b) {
    std::sort(edges.begin() + static_cast<std::ptrdiff_t>(starts[b]),
              edges.begin() + static_cast<std::ptrdiff_t>(starts[b + 1]),
              [](const EdgeUse& x, const EdgeUse& y) {
                return std::tie(x.high, x.triangle) < std::tie(y.high, y.triangle);
              });
  }
  return edges;
}

std::vector<std::uint32_t> first_duplicates(std::span<const TriangleIndices> triangles,
                                            std::uint32_t points) {
  std::vector<std::uint32_t> low_of(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) low_of[i] = in_order(triangles[i])[0];
  const std::vector<std::size_t> starts = starts_of(low_of, points);
  std::vector<std::size_t> next(starts.begin(), starts.end() - 1);
  std::vector<std::uint32_t> order(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) order[next[low_of[i]]++] = static_cast<std::uint32_t>(i);

  std::vector<std::uint32_t> first(triangles.size());
  for (std::size_t b = 0; b + 1 < starts.size(); ++b) {
    const auto begin = order.begin() + static_cast<std::ptrdiff_t>(starts[b]);
    const auto end = order.begin() + static_cast<std::ptrdiff_t>(starts[b + 1]);
    std::sort(begin, end, [&](std::uint32_t x, std::uint32_t y) {
      return std::make_tuple(in_order(triangles[x]), x) < std::make_tuple(in_order(triangles[y]), y);
    });
    for (auto it = begin; it != end; ++it) {
      const bool repeats = it != begin && in_order(triangles[*it]) == in_order(triangles[*(it - 1)]);
      first[*it] = repeats ? first[*(it - 1)] : *it;
    }
  }
  return first;
}

}  // namespace polygon
