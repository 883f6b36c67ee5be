// SPDX-License-Identifier: GPL-3.0-or-later
// Closes cracks. Border vertices within a tolerance are merged if the merging joins two border edges,
// degenerates no triangle and gives no edge a third triangle.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <set>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include "polygon/mesh/disjoint_sets.h"
#include "polygon/mesh/topology.h"
#include "polygon/repair/repair_soup.h"

namespace polygon {
namespace {

// Two border edges are joined only if each is at least this many times longer than the gap between them.
constexpr double kEdgePerGap = 10.0;

// The edges that belong to exactly one triangle.
std::vector<EdgeUse> border_of(const std::vector<EdgeUse>& edges) {
  std::vector<EdgeUse> border;
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    end = begin + 1;
    while (end < edges.size() && edges[end].low == edges[begin].low && edges[end].high == edges[begin].high)
      ++end;
    if (end - begin == 1) border.push_back(edges[begin]);
  }
  return border;
}

// Leader clustering: each point joins the nearest leader within the tolerance, or becomes a leader. Leaders
// are further apart than the tolerance, so a grid cell holds few of them, whatever the input.
class Leaders {
 public:
  Leaders(const std::vector<glm::dvec3>& points, const glm::dvec3& low, double tolerance)
      : points_(points), low_(low), tolerance_(tolerance) {}

  std::uint32_t join(std::uint32_t p) {
    const glm::dvec3 cell = glm::floor((points_[p] - low_) / tolerance_);
    std::uint32_t best = kNoIndex;
    double nearest = tolerance_;
    for (int i = 0; i < 27; ++i) {
      const auto found = first_.find(key(cell + glm::dvec3(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1)));
      if (found == first_.end()) continue;
      for (std::uint32_t at = found->second; at != kNoIndex; at = leaders_[at].next) {
        const double distance = glm::length(points_[leaders_[at].point] - points_[p]);
        if (distance > nearest || (distance == nearest && best != kNoIndex)) continue;
        nearest = distance;
        best = leaders_[at].point;
      }
    }
    if (best != kNoIndex) return best;
    const auto number = static_cast<std::uint32_t>(leaders_.size());
    const auto [at, is_new] = first_.try_emplace(key(cell), number);
    leaders_.push_back({p, is_new ? kNoIndex : at->second});
    at->second = number;
    return p;
  }

 private:
  // Each axis has 21 bits. Keys are unique if the tolerance is at least 1e-6 of the bounds. Otherwise keys
  // may collide, which only costs time.
  static std::uint64_t key(const glm::dvec3& cell) {
    std::uint64_t k = 0;
    for (int i = 0; i < 3; ++i) {
      k = k << 21U | (static_cast<std::uint64_t>(static_cast<std::int64_t>(cell[i])) & 0x1fffffU);
    }
    return k;
  }
  struct Leader {
    std::uint32_t point, next;
  };
  const std::vector<glm::dvec3>& points_;
  glm::dvec3 low_;
  double tolerance_;
  std::unordered_map<std::uint64_t, std::uint32_t> first_;
  std::vector<Leader> leaders_;
};

// Two border edges side by side: xa is merged with ya, xb with yb.
struct Match {
  std::uint32_t xa, ya, xb, yb;
};

std::vector<Match> match_edges(const std::vector<glm::dvec3>& points, const std::vector<EdgeUse>& border,
                               const std::vector<std::uint32_t>& leader, double tolerance) {
  struct Side {
    std::uint32_t a, b;    // leaders, a < b
    std::uint32_t pa, pb;  // the edge's ends: points in the clusters of a and b
  };
  std::vector<Side> sides;
  for (const EdgeUse& e : border) {
    const std::uint32_t a = leader[e.low], b = leader[e.high];
    if (a < b) sides.push_back({a, b, e.low, e.high});
    if (b < a) sides.push_back({b, a, e.high, e.low});
  }
  std::sort(sides.begin(), sides.end(), [](const Side& x, const Side& y) {
    return std::tie(x.a, x.b, x.pa, x.pb) < std::tie(y.a, y.b, y.pa, y.pb);
  });
  std::vector<Match> matches;
  for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
    end = begin + 1;
    while (end < sides.size() && sides[end].a == sides[begin].a && sides[end].b == sides[begin].b) ++end;
    if (end - begin != 2) continue;
    const Side &x = sides[begin], &y = sides[begin + 1];
    const double gap =
        std::max(glm::length(points[x.pa] - points[y.pa]), glm::length(points[x.pb] - points[y.pb]));
    const double edge =
        std::min(glm::length(points[x.pa] - points[x.pb]), glm::length(points[y.pa] - points[y.pb]));
    if (gap > tolerance || edge < kEdgePerGap * gap) continue;
    matches.push_back({x.pa, y.pa, x.pb, y.pb});
  }
  return matches;
}

std::vector<TriangleIndices> moved(const std::vector<TriangleIndices>& triangles, DisjointSets& target) {
  std::vector<TriangleIndices> result = triangles;
  for (TriangleIndices& t : result) t = {target.find(t[0]), target.find(t[1]), target.find(t[2])};
  return result;
}

// Maps each point to the point that replaces it.
DisjointSets merged(const std::vector<Match>& matches, std::uint32_t points) {
  DisjointSets target(points);
  for (const Match& m : matches) {
    target.unite(m.xa, m.ya);
    target.unite(m.xb, m.yb);
  }
  return target;
}

// Removes the matches at points whose merging would remove a triangle or give an edge a third triangle. One
// pass is enough: a defect that the remaining matches cause would also occur with all matches, and the
// matches at such defects have been removed.
void drop_harmful(std::vector<Match>& matches, const std::vector<TriangleIndices>& triangles,
                  std::uint32_t points) {
  DisjointSets target = merged(matches, points);
  const std::vector<TriangleIndices> after = moved(triangles, target);
  std::vector<bool> harmful(points, false);
  for (const TriangleIndices& t : after) {
    if (!has_repeated_corner(t)) continue;
    for (const std::uint32_t corner : t) harmful[corner] = true;
  }
  const std::vector<std::uint32_t> first = first_duplicates(after, points);
  for (std::size_t i = 0; i < after.size(); ++i) {
    if (first[i] == i) continue;
    for (const std::uint32_t corner : after[i]) harmful[corner] = true;
  }
  const std::vector<EdgeUse> edges = sorted_edges(after, points);
  for (std::size_t i = 2; i < edges.size(); ++i) {
    if (edges[i].low == edges[i - 2].low && edges[i].high == edges[i - 2].high) {
      harmful[edges[i].low] = harmful[edges[i].high] = true;
    }
  }
  std::erase_if(matches,
                [&](const Match& m) { return harmful[target.find(m.xa)] || harmful[target.find(m.xb)]; });
}

}  // namespace

ClosedCracks close_cracks(RepairSoup& soup, double tolerance_m) {
  ClosedCracks closed;
  const std::vector<glm::dvec3>& points = soup.mesh.vertices;
  const auto count = static_cast<std::uint32_t>(points.size());
  const std::vector<EdgeUse> border = border_of(sorted_edges(soup.mesh.triangles, count));
  if (border.empty() || !(tolerance_m > 0.0)) return closed;

  std::vector<std::uint32_t> leader(count, kNoIndex);
  glm::dvec3 low(std::numeric_limits<double>::infinity());
  for (const EdgeUse& e : border) {
    low = glm::min(low, glm::min(points[e.low], points[e.high]));
    leader[e.low] = leader[e.high] = 0;
  }
  Leaders leaders(points, low, tolerance_m);
  for (std::uint32_t p = 0; p < count; ++p) {
    if (leader[p] != kNoIndex) leader[p] = leaders.join(p);
  }
  std::vector<Match> matches = match_edges(points, border, leader, tolerance_m);
  drop_harmful(matches, soup.mesh.triangles, count);
  DisjointSets target = merged(matches, count);

  // Counts border edges that are no longer borders. Each joined pair occurs twice and is counted once.
  std::vector<TriangleIndices> after = moved(soup.mesh.triangles, target);
  const auto before = [](const EdgeUse& a, const EdgeUse& b) {
    return std::tie(a.triangle, a.edge) < std::tie(b.triangle, b.edge);
  };
  std::vector<EdgeUse> open = border_of(sorted_edges(after, count));
  std::sort(open.begin(), open.end(), before);
  std::set<std::pair<std::uint32_t, std::uint32_t>> joined;
  for (const EdgeUse& e : border) {
    if (std::binary_search(open.begin(), open.end(), e, before)) continue;
    const std::pair<std::uint32_t, std::uint32_t> ends =
        std::minmax({target.find(e.low), target.find(e.high)});
    if (joined.insert(ends).second) {
      closed.edges.add(0.5 * (points[e.low] + points[e.high]), soup.number[e.triangle]);
    }
  }
  if (closed.edges.count == 0) return closed;
  for (std::uint32_t p = 0; p < count; ++p) {
    if (target.find(p) == p) continue;
    ++closed.vertices;
    closed.furthest_m = std::max(closed.furthest_m, glm::length(points[p] - points[target.find(p)]));
  }
  soup.mesh.triangles = std::move(after);
  return closed;
}

}  // namespace polygon
