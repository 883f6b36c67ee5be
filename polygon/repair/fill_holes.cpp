// SPDX-License-Identifier: GPL-3.0-or-later
// Fills small holes: loops of border edges get the triangles of least area. Fills that would intersect the mesh
// or one another are dropped.
#include <algorithm>
#include <array>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "polygon/mesh/disjoint_sets.h"
#include "polygon/mesh/topology.h"
#include "polygon/mesh/triangle.h"
#include "polygon/repair/least_area.h"
#include "polygon/repair/repair_soup.h"
#include "polygon/repair/self_intersections.h"

namespace polygon {
namespace {

// Triangulating n edges takes n³ steps. This bounds the sum over all loops (about a minute).
constexpr double kMostSteps = 3e8;

struct LoopBox {
  glm::dvec3 low{std::numeric_limits<double>::infinity()}, high{-std::numeric_limits<double>::infinity()};
  void add(const glm::dvec3& p) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  [[nodiscard]] glm::dvec3 middle() const { return 0.5 * (low + high); }
  [[nodiscard]] double diagonal() const { return glm::length(high - low); }
};

// A loop of border edges, in the direction of a fill that agrees with the triangle at its first edge.
struct Loop {
  std::vector<std::uint32_t> points;
  std::vector<std::uint32_t> triangles;  // [i] at the edge from points[i] to points[i + 1]
  bool branching = false;                // more than two border edges meet at one of its points
  LoopBox box;
};

std::uint64_t edge_key(std::uint32_t a, std::uint32_t b) {
  return static_cast<std::uint64_t>(std::min(a, b)) << 32U | std::max(a, b);
}

class Border {
 public:
  Border(const TriangleMesh& mesh, const std::vector<EdgeUse>& edges)
      : mesh_(mesh), degree_(mesh.vertices.size(), 0), at_(mesh.vertices.size(), {kNoIndex, kNoIndex}) {
    for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
      end = begin + 1;
      while (end < edges.size() && edges[end].low == edges[begin].low && edges[end].high == edges[begin].high)
        ++end;
      if (end - begin != 1) continue;
      for (const std::uint32_t p : {edges[begin].low, edges[begin].high}) {
        if (degree_[p] < 2) at_[p][degree_[p]] = static_cast<std::uint32_t>(border_.size());
        if (degree_[p] < 3) ++degree_[p];
      }
      border_.push_back(edges[begin]);
    }
  }

  [[nodiscard]] std::vector<Loop> loops() const {
    std::vector<Loop> loops;
    std::vector<bool> used(border_.size(), false);
    for (std::uint32_t first = 0; first < border_.size(); ++first) {
      if (used[first]) continue;
      Loop loop;
      // The fill runs opposite to the triangle.
      std::uint32_t from = border_[first].forward ? border_[first].high : border_[first].low;
      for (std::uint32_t edge = first;;) {
        used[edge] = true;
        add(loop, from, border_[edge]);
        const std::uint32_t to = border_[edge].low == from ? border_[edge].high : border_[edge].low;
        const std::uint32_t next = degree_[to] != 2 ? kNoIndex : at_[to][0] == edge ? at_[to][1] : at_[to][0];
        if (next == kNoIndex) {
          loop.branching = true;
          loop.points.push_back(to);
          break;
        }
        if (used[next]) break;  // closed
        edge = next;
        from = to;
      }
      loops.push_back(std::move(loop));
    }
    return with_branches_joined(std::move(loops));
  }

 private:
  void add(Loop& loop, std::uint32_t from, const EdgeUse& e) const {
    loop.points.push_back(from);
    loop.triangles.push_back(e.triangle);
    loop.box.add(mesh_.vertices[e.low]);
    loop.box.add(mesh_.vertices[e.high]);
  }

  // Branching loops were followed piece by piece, from a start to a branch. Connected pieces become one loop.
  [[nodiscard]] std::vector<Loop> with_branches_joined(std::vector<Loop> loops) const {
    DisjointSets ends(mesh_.vertices.size());
    for (const Loop& loop : loops) {
      for (const std::uint32_t p : loop.points) ends.unite(loop.points[0], p);
    }
    std::unordered_map<std::uint32_t, std::size_t> joined;
    std::vector<Loop> result;
    for (Loop& loop : loops) {
      if (loop.branching) {
        const auto [at, is_new] = joined.try_emplace(ends.find(loop.points[0]), result.size());
        if (!is_new) {
          Loop& first = result[at->second];
          first.points.insert(first.points.end(), loop.points.begin(), loop.points.end());
          first.box.add(loop.box.low);
          first.box.add(loop.box.high);
          continue;
        }
      }
      result.push_back(std::move(loop));
    }
    return result;
  }

  const TriangleMesh& mesh_;
  std::vector<std::uint8_t> degree_;  // border edges at each point: 0, 1, 2, or 3 for more
  std::vector<std::array<std::uint32_t, 2>> at_;
  std::vector<EdgeUse> border_;
};

// Diagonal of the bounding box of the piece that contains a point.
class Pieces {
 public:
  explicit Pieces(const TriangleMesh& mesh) : sets_(mesh.vertices.size()), boxes_(mesh.vertices.size()) {
    for (const TriangleIndices& t : mesh.triangles) {
      sets_.unite(t[0], t[1]);
      sets_.unite(t[0], t[2]);
    }
    for (const TriangleIndices& t : mesh.triangles) {
      for (const std::uint32_t corner : t) boxes_[sets_.find(corner)].add(mesh.vertices[corner]);
    }
  }
  double diagonal(std::uint32_t point) { return boxes_[sets_.find(point)].diagonal(); }

 private:
  DisjointSets sets_;
  std::vector<LoopBox> boxes_;
};

// Three points on one line: a vertex on another triangle's edge, and a gap without width. A degenerate
// triangle closes it, and is dissolved later with the others of its kind.
bool is_split_edge(const Loop& loop, const std::vector<glm::dvec3>& points) {
  return loop.points.size() == 3 &&
         is_degenerate(points[loop.points[0]], points[loop.points[1]], points[loop.points[2]]);
}

std::vector<TriangleIndices> triangulated(const Loop& loop, const std::vector<glm::dvec3>& points,
                                          const std::unordered_set<std::uint64_t>& old_edges) {
  const bool lone = std::all_of(loop.triangles.begin(), loop.triangles.end(),
                                [&](std::uint32_t t) { return t == loop.triangles[0]; });
  if (lone) return {};  // the rim of a single triangle would be covered by a copy of it
  if (is_split_edge(loop, points)) return {{loop.points[0], loop.points[1], loop.points[2]}};
  return least_area_triangles(loop.points, points, [&](std::uint32_t a, std::uint32_t b) {
    return old_edges.contains(edge_key(a, b));
  });
}

struct Fill {
  const Loop* loop;
  std::vector<TriangleIndices> triangles;
  bool flat = false;  // no area: closes a gap without width
};

// Removes fills that intersect the mesh or one another, and returns their loops.
std::vector<const Loop*> drop_cutting(std::vector<Fill>& fills, const TriangleMesh& mesh) {
  std::vector<TriangleIndices> all;
  for (const TriangleIndices& t : mesh.triangles) {
    if (!is_degenerate(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]])) all.push_back(t);
  }
  const auto first_new = static_cast<std::uint32_t>(all.size());
  std::vector<std::size_t> fill_of;
  for (std::size_t f = 0; f < fills.size(); ++f) {
    if (fills[f].flat) continue;
    all.insert(all.end(), fills[f].triangles.begin(), fills[f].triangles.end());
    fill_of.insert(fill_of.end(), fills[f].triangles.size(), f);
  }
  if (fill_of.empty()) return {};
  std::vector<bool> cuts(fills.size(), false);
  for (const std::uint32_t t : new_triangles_that_cut(mesh.vertices, all, first_new)) {
    cuts[fill_of[t - first_new]] = true;
  }
  std::vector<const Loop*> dropped;
  std::vector<Fill> kept;
  for (std::size_t f = 0; f < fills.size(); ++f) {
    if (cuts[f]) {
      dropped.push_back(fills[f].loop);
    } else {
      kept.push_back(std::move(fills[f]));
    }
  }
  fills = std::move(kept);
  return dropped;
}

}  // namespace

FilledHoles fill_holes(RepairSoup& soup, std::size_t most_edges, double most_share) {
  FilledHoles result;
  TriangleMesh& mesh = soup.mesh;
  const std::vector<EdgeUse> edges =
      sorted_edges(mesh.triangles, static_cast<std::uint32_t>(mesh.vertices.size()));
  std::vector<Loop> loops = Border(mesh, edges).loops();
  if (loops.empty()) return result;
  std::stable_sort(loops.begin(), loops.end(),
                   [](const Loop& a, const Loop& b) { return a.points.size() > b.points.size(); });
  Pieces pieces(mesh);
  std::unordered_set<std::uint64_t> old_edges;
  for (const EdgeUse& e : edges) old_edges.insert(edge_key(e.low, e.high));

  std::vector<Fill> fills;
  std::vector<const Loop*> left;
  double steps = 0.0;
  for (auto loop = loops.rbegin(); loop != loops.rend(); ++loop) {  // short ones first
    const auto n = static_cast<double>(loop->points.size());
    const bool flat = is_split_edge(*loop, mesh.vertices);
    std::size_t* reason = nullptr;
    if (loop->branching) {
      reason = &result.branching;
    } else if (loop->points.size() > most_edges || steps + n * n * n > kMostSteps) {
      reason = &result.too_long;
    } else if (!flat && loop->box.diagonal() > most_share * pieces.diagonal(loop->points[0])) {
      reason = &result.too_large;
    }
    Fill fill{.loop = &*loop, .triangles = {}, .flat = flat};
    if (reason == nullptr) {
      steps += n * n * n;
      fill.triangles = triangulated(*loop, mesh.vertices, old_edges);
      if (fill.triangles.empty()) {
        reason = &result.unfillable;
      }
    }
    if (reason != nullptr) {
      ++*reason;
      left.push_back(&*loop);
      continue;
    }
    for (const TriangleIndices& t : fill.triangles) {
      for (std::size_t e = 0; e < 3; ++e) old_edges.insert(edge_key(t[e], t[(e + 1) % 3]));
    }
    fills.push_back(std::move(fill));
  }

  const std::vector<const Loop*> dropped = drop_cutting(fills, mesh);
  result.unfillable += dropped.size();
  left.insert(left.end(), dropped.begin(), dropped.end());
  for (const Fill& fill : fills) {
    result.filled.add(fill.loop->box.middle(), soup.number[fill.loop->triangles[0]]);
    result.triangles += fill.triangles.size();
    mesh.triangles.insert(mesh.triangles.end(), fill.triangles.begin(), fill.triangles.end());
    soup.number.insert(soup.number.end(), fill.triangles.size(), RepairSoup::kFilled);
  }
  std::stable_sort(left.begin(), left.end(),
                   [](const Loop* a, const Loop* b) { return a->points.size() > b->points.size(); });
  for (const Loop* loop : left) result.left.add(loop->box.middle(), soup.number[loop->triangles[0]]);
  return result;
}

}  // namespace polygon
