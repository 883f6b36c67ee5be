// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/mesh_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numeric>
#include <sstream>

#include "polygon/self_intersections.h"
#include "polygon/topology.h"
#include "polygon/triangle.h"

namespace polygon {
namespace {

// "(0.01, -0.2, 3) m": enough digits to find the place in any viewer.
std::string place(const glm::dvec3& p) {
  std::ostringstream text;
  text.precision(7);
  text << '(' << p.x << ", " << p.y << ", " << p.z << ") m";
  return text.str();
}

class UnionFind {
 public:
  explicit UnionFind(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0U); }
  std::uint32_t find(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  // Towards the lower, so that names of sets do not depend on the order of unions.
  void unite(std::uint32_t a, std::uint32_t b) {
    a = find(a);
    b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

// The mesh as it is connected, and where each thing that can be wrong with it was first met.
struct Connected {
  const TriangleMesh* mesh = nullptr;
  WeldedVertices welded;
  std::vector<glm::dvec3> points;          // one a welded point
  std::vector<TriangleIndices> triangles;  // corners are points
  std::vector<EdgeUse> edges;
};

struct Count {
  std::size_t count = 0;
  glm::dvec3 first{0.0};
  void add(const glm::dvec3& where) {
    if (count++ == 0) first = where;
  }
};

void add_finding(MeshCheck& check, const char* id, Severity severity, const Count& count,
                 const std::string& text) {
  if (count.count == 0) return;
  check.findings.push_back({id, severity, count.count, text + " (first: " + place(count.first) + ")"});
}

Connected connect(const TriangleMesh& mesh) {
  Connected c;
  c.mesh = &mesh;
  c.welded = weld_vertices(mesh.vertices);
  c.points.resize(c.welded.points);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) c.points[c.welded.point_of[i]] = mesh.vertices[i];
  c.triangles = welded_triangles(mesh, c.welded);
  c.edges = sorted_edges(c.triangles, c.welded.points);
  return c;
}

glm::dvec3 middle(const Connected& c, std::uint32_t triangle) {
  const TriangleIndices& t = c.triangles[triangle];
  return (c.points[t[0]] + c.points[t[1]] + c.points[t[2]]) / 3.0;
}

void check_triangles(const Connected& c, MeshCheck& check) {
  Count repeated, flat, duplicates;
  for (std::uint32_t i = 0; i < c.triangles.size(); ++i) {
    const TriangleIndices& t = c.triangles[i];
    if (has_repeated_corner(t)) {
      repeated.add(middle(c, i));
    } else if (is_degenerate(c.points[t[0]], c.points[t[1]], c.points[t[2]])) {
      flat.add(middle(c, i));
    }
  }
  const std::vector<std::uint32_t> first = first_duplicates(c.triangles, c.welded.points);
  for (std::uint32_t i = 0; i < first.size(); ++i) {
    if (first[i] != i && !has_repeated_corner(c.triangles[i])) duplicates.add(middle(c, i));
  }
  add_finding(
      check, "M01-repeated-corners", Severity::warning, repeated,
      "triangles have two equal corners and no area; they are touched as a line. Repair removes them");
  add_finding(check, "M02-degenerate-triangles", Severity::warning, flat,
              "triangles have three corners on one line and no normal; they are touched as a line. Repair "
              "collapses them");
  add_finding(check, "M03-duplicate-triangles", Severity::warning, duplicates,
              "triangles repeat another with the same corners; they are touched once. Repair removes them");
}

void check_vertices(const Connected& c, MeshCheck& check) {
  const std::vector<glm::dvec3>& vertices = c.mesh->vertices;
  std::vector<bool> used(vertices.size(), false);
  for (const TriangleIndices& t : c.mesh->triangles) {
    for (const std::uint32_t corner : t) used[corner] = true;
  }
  Count coincident, unused;
  std::vector<bool> seen(c.points.size(), false);
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (!used[i]) unused.add(vertices[i]);
    if (seen[c.welded.point_of[i]]) coincident.add(vertices[i]);
    seen[c.welded.point_of[i]] = true;
  }
  add_finding(check, "M04-coincident-vertices", Severity::info, coincident,
              "vertices lie exactly where another does; everything here treats them as one");
  add_finding(check, "M05-unused-vertices", Severity::info, unused,
              "vertices belong to no triangle and are ignored");
}

struct EdgeCounts {
  Count boundary, nonmanifold, against;
};

// Calls visit(begin, end) for the uses of each edge.
template <typename Visit>
void for_each_edge(const std::vector<EdgeUse>& edges, Visit&& visit) {
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    end = begin + 1;
    while (end < edges.size() && edges[end].low == edges[begin].low && edges[end].high == edges[begin].high)
      ++end;
    visit(begin, end);
  }
}

EdgeCounts check_edges(const Connected& c, MeshCheck& check) {
  EdgeCounts counts;
  for_each_edge(c.edges, [&](std::size_t begin, std::size_t end) {
    const glm::dvec3 where = 0.5 * (c.points[c.edges[begin].low] + c.points[c.edges[begin].high]);
    if (end - begin == 1) counts.boundary.add(where);
    if (end - begin > 2) counts.nonmanifold.add(where);
    const auto forward = static_cast<std::size_t>(std::count_if(
        c.edges.begin() + static_cast<std::ptrdiff_t>(begin),
        c.edges.begin() + static_cast<std::ptrdiff_t>(end), [](const EdgeUse& e) { return e.forward; }));
    if (forward > 1) counts.against.add(where);
    if (end - begin - forward > 1) counts.against.add(where);
  });
  add_finding(check, "M06-nonmanifold-edges", Severity::warning, counts.nonmanifold,
              "edges have more than two triangles; the mesh has no inside there. Repair splits them");
  add_finding(
      check, "M07-inconsistent-orientation", Severity::warning, counts.against,
      "edges are run through in the same direction by two triangles, one of which is turned over. Repair "
      "orients them");
  return counts;
}

// Triangles around a point that hang together by their edges are one fan; a manifold point has one.
void check_points(const Connected& c, MeshCheck& check) {
  UnionFind corners(c.triangles.size() * 3);
  for_each_edge(c.edges, [&](std::size_t begin, std::size_t end) {
    const auto corner_at = [&](const EdgeUse& use, std::uint32_t point) {
      const TriangleIndices& t = c.triangles[use.triangle];
      const auto at = static_cast<std::uint32_t>(std::find(t.begin(), t.end(), point) - t.begin());
      return use.triangle * 3 + at;
    };
    for (std::size_t i = begin + 1; i < end; ++i) {
      for (const std::uint32_t p : {c.edges[begin].low, c.edges[begin].high}) {
        corners.unite(corner_at(c.edges[begin], p), corner_at(c.edges[i], p));
      }
    }
  });
  std::vector<std::uint8_t> fans(c.points.size(), 0);
  for (std::uint32_t i = 0; i < c.triangles.size(); ++i) {
    if (has_repeated_corner(c.triangles[i])) continue;
    for (std::uint32_t k = 0; k < 3; ++k) {
      std::uint8_t& n = fans[c.triangles[i][k]];
      if (corners.find(i * 3 + k) == i * 3 + k && n < 2) ++n;
    }
  }
  Count nonmanifold;
  for (std::size_t p = 0; p < fans.size(); ++p) {
    if (fans[p] > 1) nonmanifold.add(c.points[p]);
  }
  add_finding(check, "M08-nonmanifold-vertices", Severity::info, nonmanifold,
              "vertices join parts that share no edge there. Repair splits them");
}

// Boundary edges that hang together are one loop (loops that touch in a point count as one).
void check_boundary(const Connected& c, const EdgeCounts& edges, MeshCheck& check) {
  if (edges.boundary.count == 0) return;
  UnionFind ends(c.points.size());
  std::vector<bool> on_boundary(c.points.size(), false);
  for_each_edge(c.edges, [&](std::size_t begin, std::size_t end) {
    if (end - begin != 1) return;
    ends.unite(c.edges[begin].low, c.edges[begin].high);
    on_boundary[c.edges[begin].low] = on_boundary[c.edges[begin].high] = true;
  });
  Count loops;
  for (std::uint32_t p = 0; p < c.points.size(); ++p) {
    if (on_boundary[p] && ends.find(p) == p) loops.add(c.points[p]);
  }
  add_finding(check, "M09-boundary-loops", Severity::info, loops,
              "holes or rims, of " + std::to_string(edges.boundary.count) +
                  " edges in all: the mesh is open, is touched as a two-sided sheet, and has no inside");
}

// Pieces that share no point, and the signed volume of each about the mesh's own middle (about the origin, a
// mesh far from it would lose the digits of its volume).
void check_pieces(const Connected& c, MeshCheck& check) {
  UnionFind pieces(c.points.size());
  glm::dvec3 low(std::numeric_limits<double>::infinity()), high(-std::numeric_limits<double>::infinity());
  for (const TriangleIndices& t : c.triangles) {
    pieces.unite(t[0], t[1]);
    pieces.unite(t[1], t[2]);
    for (const std::uint32_t p : t) {
      low = glm::min(low, c.points[p]);
      high = glm::max(high, c.points[p]);
    }
  }
  const glm::dvec3 centre = 0.5 * (low + high);
  std::vector<double> volume(c.points.size(), 0.0);
  std::vector<bool> is_piece(c.points.size(), false);
  for (const TriangleIndices& t : c.triangles) {
    const std::uint32_t piece = pieces.find(t[0]);
    is_piece[piece] = true;
    const glm::dvec3 p = c.points[t[0]] - centre, q = c.points[t[1]] - centre, r = c.points[t[2]] - centre;
    volume[piece] += glm::dot(p, glm::cross(q, r)) / 6.0;
  }
  Count all, negative;
  for (std::size_t p = 0; p < c.points.size(); ++p) {
    if (!is_piece[p]) continue;
    all.add(c.points[p]);
    if (volume[p] < 0.0) negative.add(c.points[p]);
    check.volume_m3 += volume[p];
  }
  if (all.count > 1) add_finding(check, "M10-pieces", Severity::info, all, "pieces that share no vertex");
  const bool consistent = check.closed && check.oriented;
  if (!consistent) check.volume_m3 = 0.0;
  check.oriented = consistent && check.volume_m3 > 0.0;
  if (!consistent) return;
  if (check.volume_m3 < 0.0) {
    add_finding(
        check, "M11-inside-out", Severity::error, negative,
        "pieces are inside out (negative volume): the inside would be taken for the outside. Repair turns "
        "them");
  } else if (negative.count > 0) {
    add_finding(check, "M11-inside-out", Severity::info, negative,
                "pieces have a negative volume: cavities, or else turned inside out");
  }
}

void check_intersections(const Connected& c, MeshCheck& check) {
  std::vector<TriangleIndices> proper;
  const std::vector<std::uint32_t> first = first_duplicates(c.triangles, c.welded.points);
  for (std::uint32_t i = 0; i < c.triangles.size(); ++i) {
    const TriangleIndices& t = c.triangles[i];
    if (first[i] == i && !has_repeated_corner(t) &&
        !is_degenerate(c.points[t[0]], c.points[t[1]], c.points[t[2]])) {
      proper.push_back(t);
    }
  }
  const SelfIntersections found = find_self_intersections(c.points, proper);
  Count pairs;
  pairs.count = found.pairs;
  if (found.pairs > 0) {
    const TriangleIndices& t = proper[found.first];
    pairs.first = (c.points[t[0]] + c.points[t[1]] + c.points[t[2]]) / 3.0;
  }
  add_finding(
      check, "M12-self-intersections", Severity::warning, pairs,
      "pairs of triangles cut one another: what is inside there is ambiguous; unite the parts before export");
}

}  // namespace

MeshCheck check_mesh(const TriangleMesh& mesh, bool deep) {
  MeshCheck check;
  if (mesh.empty()) {
    check.findings.push_back(
        {"M00-empty", Severity::error, 1, "the mesh has no triangle: there is nothing to touch"});
    return check;
  }
  const Connected c = connect(mesh);
  check_triangles(c, check);
  check_vertices(c, check);
  const EdgeCounts edges = check_edges(c, check);
  check_points(c, check);
  check_boundary(c, edges, check);
  check.closed = !c.edges.empty() && edges.boundary.count == 0 && edges.nonmanifold.count == 0;
  check.oriented = check.closed && edges.against.count == 0;  // outward or not, check_pieces tells
  check_pieces(c, check);
  if (deep) check_intersections(c, check);
  return check;
}

}  // namespace polygon
