// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/repair/check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <span>

#include "polygon/mesh/disjoint_sets.h"
#include "polygon/mesh/findings.h"
#include "polygon/mesh/topology.h"
#include "polygon/mesh/triangle.h"
#include "polygon/repair/border_loops.h"
#include "polygon/repair/self_intersections.h"

namespace polygon {
namespace {

// The mesh with coincident vertices welded.
struct Connected {
  const TriangleMesh* mesh = nullptr;
  WeldedVertices welded;
  std::span<const glm::dvec3> points;          // [point]
  std::span<const TriangleIndices> triangles;  // with point indices as corners
  // Storage of `points` and `triangles` if vertices were welded; otherwise these refer to the mesh.
  std::vector<glm::dvec3> own_points;
  std::vector<TriangleIndices> own_triangles;
};

Connected connect(const TriangleMesh& mesh) {
  Connected c;
  c.mesh = &mesh;
  c.welded = weld_vertices(mesh.vertices);
  c.points = mesh.vertices;
  c.triangles = mesh.triangles;
  if (c.welded.points == mesh.vertices.size()) return c;
  c.own_points.resize(c.welded.points);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    c.own_points[c.welded.point_of[i]] = mesh.vertices[i];
  }
  c.own_triangles = welded_triangles(mesh, c.welded);
  c.points = c.own_points;
  c.triangles = c.own_triangles;
  return c;
}

glm::dvec3 centroid_of(const Connected& c, std::uint32_t triangle) {
  const TriangleIndices& t = c.triangles[triangle];
  return (c.points[t[0]] + c.points[t[1]] + c.points[t[2]]) / 3.0;
}

void check_triangles(const Connected& c, MeshCheck& check) {
  FindingTally repeated, flat, duplicates;
  for (std::uint32_t i = 0; i < c.triangles.size(); ++i) {
    const TriangleIndices& t = c.triangles[i];
    if (has_repeated_corner(t)) {
      repeated.add(centroid_of(c, i), i);
    } else if (is_degenerate(c.points[t[0]], c.points[t[1]], c.points[t[2]])) {
      flat.add(centroid_of(c, i), i);
    }
  }
  const std::vector<std::uint32_t> first = first_duplicates(c.triangles, c.welded.points);
  for (std::uint32_t i = 0; i < first.size(); ++i) {
    if (first[i] != i && !has_repeated_corner(c.triangles[i])) duplicates.add(centroid_of(c, i), i);
  }
  add_finding(
      check.findings, "M01-repeated-corners", Severity::warning, repeated,
      "triangles have two equal corners and no area; they are touched as a line. Repair removes them");
  add_finding(check.findings, "M02-degenerate-triangles", Severity::warning, flat,
              "triangles have three corners on one line and no normal; they are touched as a line. Repair "
              "collapses them");
  add_finding(check.findings, "M03-duplicate-triangles", Severity::warning, duplicates,
              "triangles repeat another with the same corners; they are touched once. Repair removes them");
}

void check_vertices(const Connected& c, MeshCheck& check) {
  const std::vector<glm::dvec3>& vertices = c.mesh->vertices;
  std::vector<bool> used(vertices.size(), false);
  for (const TriangleIndices& t : c.mesh->triangles) {
    for (const std::uint32_t corner : t) used[corner] = true;
  }
  FindingTally coincident, unused;
  std::vector<bool> seen(c.points.size(), false);
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (!used[i]) unused.add(vertices[i]);
    if (seen[c.welded.point_of[i]]) coincident.add(vertices[i]);
    seen[c.welded.point_of[i]] = true;
  }
  add_finding(check.findings, "M04-coincident-vertices", Severity::info, coincident,
              "vertices lie exactly where another does; everything here treats them as one");
  add_finding(check.findings, "M05-unused-vertices", Severity::info, unused,
              "vertices belong to no triangle and are ignored");
}

void check_edges(const Connected& c, const EdgeTable& edges, MeshCheck& check) {
  FindingTally nonmanifold, against;
  edges.for_each([&](const EdgeTable::Edge& edge) {
    const std::size_t uses = edge.uses.size();
    const auto forward = static_cast<std::size_t>(std::count_if(
        edge.uses.begin(), edge.uses.end(), [](const EdgeTable::Use& use) { return use.forward(); }));
    if (uses == 2 && forward == 1) return;
    const glm::dvec3 where = 0.5 * (c.points[edge.low] + c.points[edge.high]);
    const std::uint32_t triangle = edge.uses[0].triangle();
    if (uses == 1) ++check.border_edges;
    if (uses > 2) nonmanifold.add(where, triangle);
    if (forward > 1) against.add(where, triangle);
    if (uses - forward > 1) against.add(where, triangle);
  });
  add_finding(check.findings, "M06-nonmanifold-edges", Severity::warning, nonmanifold,
              "edges have more than two triangles; the mesh has no inside there. Repair parts the sheets "
              "that meet, and moves none");
  add_finding(
      check.findings, "M07-inconsistent-orientation", Severity::warning, against,
      "edges are run through in the same direction by two triangles, one of which is turned over. Repair "
      "orients them, where the surface has two sides");
  check.nonmanifold_edges = nonmanifold.count;
  check.turned_edges = against.count;
}

// The triangles around a point form fans: triangles that are connected through shared edges are in one fan. A
// manifold point has one fan.
void check_points(const Connected& c, const EdgeTable& edges, MeshCheck& check) {
  DisjointSets corners(c.triangles.size() * 3);
  edges.for_each([&](const EdgeTable::Edge& edge) {
    const auto corner_at = [&](const EdgeTable::Use& use, std::uint32_t point) {
      const TriangleIndices& t = c.triangles[use.triangle()];
      const auto at = static_cast<std::uint32_t>(std::find(t.begin(), t.end(), point) - t.begin());
      return use.triangle() * 3 + at;
    };
    for (const EdgeTable::Use& use : edge.uses.subspan(1)) {
      for (const std::uint32_t p : {edge.low, edge.high}) {
        corners.unite(corner_at(edge.uses[0], p), corner_at(use, p));
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
  FindingTally nonmanifold;
  for (std::size_t p = 0; p < fans.size(); ++p) {
    if (fans[p] > 1) nonmanifold.add(c.points[p]);
  }
  add_finding(check.findings, "M08-nonmanifold-vertices", Severity::info, nonmanifold,
              "vertices join parts that share no edge there. Repair gives each part its own");
}

// The finding's place is that of the longest loop.
void check_boundary(const Connected& c, const EdgeTable& edges, MeshCheck& check) {
  if (check.border_edges == 0) return;
  std::vector<BorderLoop> loops = border_loops(c.points, c.triangles, edges);
  std::stable_sort(loops.begin(), loops.end(), [](const BorderLoop& a, const BorderLoop& b) {
    return a.triangles.size() > b.triangles.size();
  });
  FindingTally found;
  for (const BorderLoop& loop : loops) found.add(0.5 * (loop.lower + loop.upper), loop.triangles[0]);
  add_finding(check.findings, "M09-boundary-loops", Severity::info, found,
              "holes or rims, of " + std::to_string(check.border_edges) + " edges in all, the longest of " +
                  std::to_string(loops.front().triangles.size()) + ", " +
                  point_in_words(loops.front().upper - loops.front().lower) +
                  " large: the mesh is open, is touched as a two-sided sheet, and has no inside");
}

// Finds the pieces, which share no point, and the signed volume of each. Volumes are computed about the
// mesh's centre, because about a distant origin they would lose digits.
void check_pieces(const Connected& c, MeshCheck& check) {
  DisjointSets pieces(c.points.size());
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
  FindingTally all, negative;
  for (std::uint32_t i = 0; i < c.triangles.size(); ++i) {
    const std::uint32_t p = pieces.find(c.triangles[i][0]);
    if (!is_piece[p]) continue;
    is_piece[p] = false;  // each piece is counted once
    all.add(centroid_of(c, i), i);
    if (volume[p] < 0.0) negative.add(centroid_of(c, i), i);
    check.volume_m3 += volume[p];
  }
  if (all.count > 1)
    add_finding(check.findings, "M10-pieces", Severity::info, all, "pieces that share no vertex");
  const bool consistent = check.closed && check.oriented;
  if (!consistent) check.volume_m3 = 0.0;
  check.oriented = consistent && check.volume_m3 > 0.0;
  if (!consistent) return;
  if (check.volume_m3 < 0.0) {
    add_finding(
        check.findings, "M11-inside-out", Severity::error, negative,
        "pieces are inside out (negative volume): the inside would be taken for the outside. Repair turns "
        "them");
  } else if (negative.count > 0) {
    add_finding(check.findings, "M11-inside-out", Severity::info, negative,
                "pieces have a negative volume: cavities, or else turned inside out");
  }
}

void check_intersections(const Connected& c, MeshCheck& check) {
  std::vector<TriangleIndices> proper;
  std::vector<std::uint32_t> number;
  const std::vector<std::uint32_t> first = first_duplicates(c.triangles, c.welded.points);
  for (std::uint32_t i = 0; i < c.triangles.size(); ++i) {
    const TriangleIndices& t = c.triangles[i];
    if (first[i] == i && !has_repeated_corner(t) &&
        !is_degenerate(c.points[t[0]], c.points[t[1]], c.points[t[2]])) {
      proper.push_back(t);
      number.push_back(i);
    }
  }
  const SelfIntersections found = find_self_intersections(c.points, proper);
  if (found.pairs == 0) return;
  const std::uint32_t at = number[found.first];
  const FindingTally pairs{found.pairs, {centroid_of(c, at), found.lower, found.upper, at}};
  add_finding(check.findings, "M12-self-intersections", Severity::warning, pairs,
              std::string("pairs of triangles cut one another") +
                  (found.complete ? "" : " at least (the search was ended there)") +
                  ": what is inside there is ambiguous; unite the parts before export");
}

}  // namespace

std::string touched_as(const MeshCheck& check) {
  if (check.oriented) return "a closed solid";
  const std::string sheet = "a two-sided sheet, because ";
  if (check.border_edges > 0) return sheet + std::to_string(check.border_edges) + " edges are open";
  if (check.nonmanifold_edges > 0)
    return sheet + std::to_string(check.nonmanifold_edges) + " edges have more than two triangles";
  if (check.turned_edges > 0)
    return sheet + std::to_string(check.turned_edges) +
           " edges have triangles that are turned against each other";
  return sheet + (check.volume_m3 < 0.0 ? "it is inside out" : "it encloses no volume");
}

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
  {
    const EdgeTable edges(c.triangles, c.welded.points);
    check_edges(c, edges, check);
    check_points(c, edges, check);
    check_boundary(c, edges, check);
    check.closed = !edges.empty() && check.border_edges == 0 && check.nonmanifold_edges == 0;
    // check_pieces() decides whether the orientation is outward.
    check.oriented = check.closed && check.turned_edges == 0;
  }
  check_pieces(c, check);
  if (deep) check_intersections(c, check);
  return check;
}

}  // namespace polygon
