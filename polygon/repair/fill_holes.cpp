// SPDX-License-Identifier: GPL-3.0-or-later
// Fills small holes: each loop of border edges gets its triangulation of least area. Fills that would
// intersect the mesh or one another are dropped.
#include <algorithm>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <unordered_set>
#include <utility>
#include <vector>

#include "polygon/mesh/disjoint_sets.h"
#include "polygon/mesh/topology.h"
#include "polygon/mesh/triangle.h"
#include "polygon/repair/border_loops.h"
#include "polygon/repair/least_area.h"
#include "polygon/repair/repair_soup.h"
#include "polygon/repair/self_intersections.h"

namespace polygon {
namespace {

// Triangulating n edges takes n³ steps. This bounds the sum over all loops (about a minute).
constexpr double kMostSteps = 3e8;

using EdgeKeys = std::unordered_set<std::uint64_t>;

std::uint64_t edge_key(std::uint32_t a, std::uint32_t b) {
  return static_cast<std::uint64_t>(std::min(a, b)) << 32U | std::max(a, b);
}

double diagonal_of(const BorderLoop& loop) {
  return glm::length(loop.upper - loop.lower);
}

glm::dvec3 middle_of(const BorderLoop& loop) {
  return 0.5 * (loop.lower + loop.upper);
}

// The mesh's pieces. They give the diagonal of the bounding box of the piece that contains a point.
class Pieces {
 public:
  Pieces(std::span<const glm::dvec3> points, std::span<const TriangleIndices> triangles)
      : sets_(points.size()),
        lower_(points.size(), glm::dvec3(std::numeric_limits<double>::infinity())),
        upper_(points.size(), glm::dvec3(-std::numeric_limits<double>::infinity())) {
    for (const TriangleIndices& t : triangles) {
      sets_.unite(t[0], t[1]);
      sets_.unite(t[0], t[2]);
    }
    for (const TriangleIndices& t : triangles) {
      for (const std::uint32_t corner : t) {
        const std::uint32_t piece = sets_.find(corner);
        lower_[piece] = glm::min(lower_[piece], points[corner]);
        upper_[piece] = glm::max(upper_[piece], points[corner]);
      }
    }
  }
  double diagonal(std::uint32_t point) {
    const std::uint32_t piece = sets_.find(point);
    return glm::length(upper_[piece] - lower_[piece]);
  }

 private:
  DisjointSets sets_;
  std::vector<glm::dvec3> lower_, upper_;
};

// A loop of three points on one line: a vertex lies on another triangle's edge, and the gap has no width. A
// degenerate triangle closes it. Later it is dissolved with the other degenerate triangles.
bool is_split_edge(const BorderLoop& loop, std::span<const glm::dvec3> points) {
  return loop.closed && loop.points.size() == 3 &&
         is_degenerate(points[loop.points[0]], points[loop.points[1]], points[loop.points[2]]);
}

enum class Limit : std::uint8_t { none, branching, too_long, too_large };

// The first limit that the loop exceeds.
Limit limit_of(const BorderLoop& loop, std::span<const glm::dvec3> points, Pieces& pieces,
               const RepairOptions& options) {
  if (!loop.closed) return Limit::branching;
  if (loop.points.size() > options.hole_edges) return Limit::too_long;
  const bool large = diagonal_of(loop) > options.hole_share * pieces.diagonal(loop.points[0]);
  return large && !is_split_edge(loop, points) ? Limit::too_large : Limit::none;
}

// All edges of the fill's triangles. Empty unless each edge of the loop belongs to one triangle and each
// other edge to two.
std::vector<std::uint64_t> inner_edges(const BorderLoop& loop,
                                       const std::vector<TriangleIndices>& triangles) {
  std::vector<std::uint64_t> keys;
  for (const TriangleIndices& t : triangles) {
    for (std::size_t e = 0; e < 3; ++e) keys.push_back(edge_key(t[e], t[(e + 1) % 3]));
  }
  for (std::size_t i = 0; i < loop.points.size(); ++i)
    keys.push_back(edge_key(loop.points[i], loop.points[(i + 1) % loop.points.size()]));
  std::sort(keys.begin(), keys.end());
  for (std::size_t i = 0; i < keys.size(); i += 2) {
    const bool pair = i + 1 < keys.size() && keys[i] == keys[i + 1];
    if (!pair || (i + 2 < keys.size() && keys[i] == keys[i + 2])) return {};
  }
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

struct Fill {
  const BorderLoop* loop;
  std::vector<TriangleIndices> triangles;
  bool flat = false;  // one triangle without area, which closes a gap without width
};

// The fill of a loop that is within the limits. It has no triangle if no triangulation fits. Adds the fill's
// edges to `old_edges`.
Fill fill_of(const BorderLoop& loop, const std::vector<glm::dvec3>& points, EdgeKeys& old_edges) {
  Fill fill{.loop = &loop, .triangles = {}, .flat = is_split_edge(loop, points)};
  const bool lone = std::all_of(loop.triangles.begin(), loop.triangles.end(),
                                [&](std::uint32_t t) { return t == loop.triangles[0]; });
  if (lone) return fill;  // the rim of a single triangle would be covered by a copy of it
  std::vector<TriangleIndices> triangles;
  if (fill.flat) {
    triangles = {{loop.points[0], loop.points[1], loop.points[2]}};
  } else {
    triangles = least_area_triangles(loop.points, points, [&](std::uint32_t a, std::uint32_t b) {
      return old_edges.contains(edge_key(a, b));
    });
  }
  const std::vector<std::uint64_t> edges = inner_edges(loop, triangles);
  if (edges.empty()) return fill;
  old_edges.insert(edges.begin(), edges.end());
  fill.triangles = std::move(triangles);
  return fill;
}

// Removes fills that intersect the mesh or one another.
void drop_cutting(std::vector<Fill>& fills, const TriangleMesh& mesh) {
  std::vector<TriangleIndices> all;
  for (const TriangleIndices& t : mesh.triangles) {
    if (!is_degenerate(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]])) all.push_back(t);
  }
  const auto first_new = static_cast<std::uint32_t>(all.size());
  std::vector<std::size_t> fill_of_triangle;
  for (std::size_t f = 0; f < fills.size(); ++f) {
    if (fills[f].flat) continue;
    all.insert(all.end(), fills[f].triangles.begin(), fills[f].triangles.end());
    fill_of_triangle.insert(fill_of_triangle.end(), fills[f].triangles.size(), f);
  }
  if (fill_of_triangle.empty()) return;
  std::vector<bool> cuts(fills.size(), false);
  for (const std::uint32_t t : new_triangles_that_cut(mesh.vertices, all, first_new))
    cuts[fill_of_triangle[t - first_new]] = true;
  std::size_t at = 0;
  std::erase_if(fills, [&](const Fill&) { return cuts[at++]; });
}

}  // namespace

FilledHoles fill_holes(RepairSoup& soup, const RepairOptions& options) {
  FilledHoles result;
  TriangleMesh& mesh = soup.mesh;
  const EdgeTable edges(mesh.triangles, static_cast<std::uint32_t>(mesh.vertices.size()));
  std::vector<BorderLoop> loops = border_loops(mesh.vertices, mesh.triangles, edges);
  if (loops.empty()) return result;
  std::stable_sort(loops.begin(), loops.end(), [](const BorderLoop& a, const BorderLoop& b) {
    return a.points.size() < b.points.size();  // short loops first
  });
  Pieces pieces(mesh.vertices, mesh.triangles);
  EdgeKeys old_edges;
  edges.for_each([&](const EdgeTable::Edge& edge) { old_edges.insert(edge_key(edge.low, edge.high)); });

  std::vector<Fill> fills;
  double steps = 0.0;
  for (const BorderLoop& loop : loops) {
    if (limit_of(loop, mesh.vertices, pieces, options) != Limit::none) continue;
    const auto n = static_cast<double>(loop.points.size());
    if (steps + n * n * n > kMostSteps) {
      ++result.untried;
      continue;
    }
    steps += n * n * n;
    Fill fill = fill_of(loop, mesh.vertices, old_edges);
    if (!fill.triangles.empty()) fills.push_back(std::move(fill));
  }
  drop_cutting(fills, mesh);
  for (const Fill& fill : fills) {
    result.filled.add(middle_of(*fill.loop), soup.number[fill.loop->triangles[0]]);
    result.triangles += fill.triangles.size();
  }
  for (const Fill& fill : fills) {
    mesh.triangles.insert(mesh.triangles.end(), fill.triangles.begin(), fill.triangles.end());
    soup.number.insert(soup.number.end(), fill.triangles.size(), RepairSoup::kFilled);
  }
  return result;
}

HolesLeft holes_left(const TriangleMesh& mesh, const RepairOptions& options) {
  HolesLeft result;
  const WeldedVertices welded = weld_vertices(mesh.vertices);
  std::vector<glm::dvec3> points(welded.points);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) points[welded.point_of[i]] = mesh.vertices[i];
  const std::vector<TriangleIndices> triangles = welded_triangles(mesh, welded);
  std::vector<BorderLoop> loops = border_loops(points, triangles, EdgeTable(triangles, welded.points));
  if (loops.empty()) return result;
  std::stable_sort(loops.begin(), loops.end(), [](const BorderLoop& a, const BorderLoop& b) {
    return a.triangles.size() > b.triangles.size();
  });
  Pieces pieces(points, triangles);
  for (const BorderLoop& loop : loops) {
    result.left.add(middle_of(loop));
    const Limit limit = limit_of(loop, points, pieces, options);
    ++(limit == Limit::branching   ? result.branching
       : limit == Limit::too_long  ? result.too_long
       : limit == Limit::too_large ? result.too_large
                                   : result.unfillable);
  }
  return result;
}

}  // namespace polygon
