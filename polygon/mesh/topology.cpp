// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/mesh/topology.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>

namespace polygon {
namespace {

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

// Counting sort, linear in the number of triangles. The count of bucket b is stored in places_[b + 2]. After
// sum(), places_[b + 1] is the start of bucket b. next(b) advances it to the bucket's end. In the end bucket
// b runs from places_[b] to places_[b + 1].
class Buckets {
 public:
  explicit Buckets(std::uint32_t buckets) : places_(static_cast<std::size_t>(buckets) + 2, 0) {}
  void count(std::uint32_t bucket) { ++places_[static_cast<std::size_t>(bucket) + 2]; }
  // Returns the number of entries.
  std::size_t sum() {
    for (std::size_t i = 1; i < places_.size(); ++i) places_[i] += places_[i - 1];
    return places_.back();
  }
  std::size_t next(std::uint32_t bucket) { return places_[static_cast<std::size_t>(bucket) + 1]++; }
  // The start of each bucket, followed by the end of the last.
  std::vector<std::size_t> starts() && {
    places_.pop_back();
    return std::move(places_);
  }

 private:
  std::vector<std::size_t> places_;
};

// Buckets of at most this size are sorted by insertion; most hold a handful.
constexpr std::size_t kFew = 16;

TriangleIndices in_order(TriangleIndices t) {
  std::sort(t.begin(), t.end());
  return t;
}

}  // namespace

WeldedVertices weld_vertices(std::span<const glm::dvec3> vertices) {
  WeldedVertices welded;
  welded.point_of.resize(vertices.size());
  const std::size_t slots = std::bit_ceil(std::max<std::size_t>(vertices.size() * 2, 16));
  std::vector<std::uint32_t> table(slots, kNoIndex);  // first vertex of each point
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    std::size_t slot = hash_of(vertices[i]) & (slots - 1);
    while (table[slot] != kNoIndex && vertices[table[slot]] != vertices[i]) slot = (slot + 1) & (slots - 1);
    if (table[slot] == kNoIndex) {
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

EdgeTable::EdgeTable(std::span<const TriangleIndices> triangles, std::uint32_t points) {
  if (triangles.size() >= (1ULL << 31U)) {
    throw std::invalid_argument("the mesh has " + std::to_string(triangles.size()) +
                                " triangles, more than 2^31 - 1; split it");
  }
  Buckets by_low(points);
  const auto each_side = [&](auto&& visit) {
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      const TriangleIndices& t = triangles[i];
      if (has_repeated_corner(t)) continue;
      for (std::size_t e = 0; e < 3; ++e) visit(static_cast<std::uint32_t>(i), t[e], t[(e + 1) % 3]);
    }
  };
  each_side([&](std::uint32_t, std::uint32_t from, std::uint32_t to) { by_low.count(std::min(from, to)); });
  uses_.resize(by_low.sum());
  each_side([&](std::uint32_t triangle, std::uint32_t from, std::uint32_t to) {
    uses_[by_low.next(std::min(from, to))] = {std::max(from, to), triangle, from < to};
  });
  starts_ = std::move(by_low).starts();
  const auto before = [](const Use& a, const Use& b) { return a.order() < b.order(); };
  for (std::size_t b = 0; b + 1 < starts_.size(); ++b) {
    Use* const begin = uses_.data() + starts_[b];
    Use* const end = uses_.data() + starts_[b + 1];
    if (static_cast<std::size_t>(end - begin) > kFew) {
      std::sort(begin, end, before);
      continue;
    }
    for (Use* at = begin; at < end; ++at) {
      const Use use = *at;
      Use* to = at;
      for (; to > begin && before(use, to[-1]); --to) *to = to[-1];
      *to = use;
    }
  }
}

std::vector<EdgeUse> sorted_edges(std::span<const TriangleIndices> triangles, std::uint32_t points) {
  std::vector<EdgeUse> edges;
  EdgeTable(triangles, points).for_each([&](const EdgeTable::Edge& edge) {
    for (const EdgeTable::Use& use : edge.uses) {
      const TriangleIndices& t = triangles[use.triangle()];
      const std::uint32_t from = use.forward() ? edge.low : edge.high;
      const auto side = static_cast<std::uint8_t>(std::find(t.begin(), t.end(), from) - t.begin());
      edges.push_back({edge.low, edge.high, use.triangle(), side, use.forward()});
    }
  });
  return edges;
}

std::vector<std::uint32_t> first_duplicates(std::span<const TriangleIndices> triangles,
                                            std::uint32_t points) {
  Buckets by_low(points);
  for (const TriangleIndices& t : triangles) by_low.count(std::min({t[0], t[1], t[2]}));
  std::vector<std::uint32_t> order(by_low.sum());
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    const TriangleIndices& t = triangles[i];
    order[by_low.next(std::min({t[0], t[1], t[2]}))] = i;
  }
  const std::vector<std::size_t> starts = std::move(by_low).starts();

  std::vector<std::uint32_t> first(triangles.size());
  // A triangle's key in its bucket: its other two corners in ascending order, then its index.
  using Key = std::pair<std::uint64_t, std::uint32_t>;
  const auto key_of = [&](std::uint32_t triangle) {
    const TriangleIndices t = in_order(triangles[triangle]);
    return Key(std::uint64_t{t[1]} << 32U | t[2], triangle);
  };
  std::vector<Key> keys;
  for (std::size_t b = 0; b + 1 < starts.size(); ++b) {
    const std::span<const std::uint32_t> bucket(order.data() + starts[b], starts[b + 1] - starts[b]);
    keys.clear();
    for (const std::uint32_t triangle : bucket) keys.push_back(key_of(triangle));
    if (keys.size() > kFew) std::sort(keys.begin(), keys.end());
    for (std::size_t i = 0; i < keys.size(); ++i) {
      first[keys[i].second] = keys[i].second;
      if (keys.size() > kFew) {
        if (i > 0 && keys[i - 1].first == keys[i].first) first[keys[i].second] = first[keys[i - 1].second];
        continue;
      }
      for (std::size_t j = 0; j < i; ++j) {
        if (keys[j].first != keys[i].first) continue;
        first[keys[i].second] = keys[j].second;
        break;
      }
    }
  }
  return first;
}

std::vector<TriangleIndices> triangles_across(std::span<const TriangleIndices> triangles,
                                              std::uint32_t points) {
  std::vector<TriangleIndices> across(triangles.size(),
                                      TriangleIndices{kNoTriangle, kNoTriangle, kNoTriangle});
  EdgeTable(triangles, points).for_each([&](const EdgeTable::Edge& edge) {
    if (edge.uses.size() != 2) return;
    for (std::size_t n = 0; n < 2; ++n) {
      const EdgeTable::Use& use = edge.uses[n];
      const std::uint32_t from = use.forward() ? edge.low : edge.high;
      const TriangleIndices& t = triangles[use.triangle()];
      const std::size_t i = t[0] == from ? 0 : t[1] == from ? 1 : 2;
      across[use.triangle()][i] = edge.uses[1 - n].triangle();
    }
  });
  return across;
}

Connections connect_triangles(const TriangleMesh& mesh) {
  const WeldedVertices welded = weld_vertices(mesh.vertices);
  const bool as_it_is = welded.points == mesh.vertices.size();
  const std::vector<TriangleIndices> by_points =
      as_it_is ? std::vector<TriangleIndices>() : welded_triangles(mesh, welded);
  const std::span<const TriangleIndices> triangles = as_it_is ? mesh.triangles : by_points;
  Connections connections;
  {
    const std::vector<std::uint32_t> first = first_duplicates(triangles, welded.points);
    for (std::uint32_t i = 0; i < first.size(); ++i) {
      if (first[i] == i) connections.distinct.push_back(i);
    }
    if (connections.distinct.size() == first.size()) connections.distinct = {};
  }
  connections.across = triangles_across(triangles, welded.points);
  return connections;
}

}  // namespace polygon
