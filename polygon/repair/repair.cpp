// SPDX-License-Identifier: GPL-3.0-or-later
// The repair pipeline: merging, cracks and holes, then CGAL's orientation, stitching and degenerate faces.
// Each step reports what it changed.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/connected_components.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_mesh_to_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/repair_degeneracies.h>
#include <CGAL/Polygon_mesh_processing/repair_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/stitch_borders.h>
#include <CGAL/Surface_mesh.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <exception>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "polygon/mesh/topology.h"
#include "polygon/mesh/triangle.h"
#include "polygon/repair/check.h"
#include "polygon/repair/repair_soup.h"
#include "polygon/repair/self_intersections.h"

namespace polygon {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Polygon = std::array<std::size_t, 3>;
using Surface = CGAL::Surface_mesh<Point>;
using Changes = std::vector<Finding>;

struct CgalSoup {
  std::vector<Point> points;
  std::vector<Polygon> polygons;
};

glm::dvec3 to_glm(const Point& p) {
  return {p.x(), p.y(), p.z()};
}

CgalSoup to_cgal(const TriangleMesh& mesh) {
  CgalSoup soup;
  soup.points.reserve(mesh.vertices.size());
  for (const glm::dvec3& v : mesh.vertices) soup.points.emplace_back(v.x, v.y, v.z);
  soup.polygons.reserve(mesh.triangles.size());
  for (const TriangleIndices& t : mesh.triangles) soup.polygons.push_back({t[0], t[1], t[2]});
  return soup;
}

TriangleMesh to_mesh(const CgalSoup& soup) {
  TriangleMesh mesh;
  mesh.vertices.reserve(soup.points.size());
  for (const Point& p : soup.points) mesh.vertices.push_back(to_glm(p));
  mesh.triangles.reserve(soup.polygons.size());
  for (const Polygon& t : soup.polygons) {
    mesh.triangles.push_back({static_cast<std::uint32_t>(t[0]), static_cast<std::uint32_t>(t[1]),
                              static_cast<std::uint32_t>(t[2])});
  }
  return mesh;
}

TriangleMesh to_mesh(const Surface& surface) {
  CgalSoup soup;
  pmp::polygon_mesh_to_polygon_soup(surface, soup.points, soup.polygons);
  return to_mesh(soup);
}

glm::dvec3 centroid(const std::vector<glm::dvec3>& points, const TriangleIndices& t) {
  return (points[t[0]] + points[t[1]] + points[t[2]]) / 3.0;
}

std::string in_words(double value) {
  std::ostringstream text;
  text.precision(3);
  text << value;
  return text.str();
}

// Merges equal vertices. Of equal triangles only the first is kept.
RepairSoup merge_equal(const TriangleMesh& mesh, Changes& changes) {
  const WeldedVertices welded = weld_vertices(mesh.vertices);
  RepairSoup soup;
  soup.mesh.vertices.resize(welded.points);
  FindingTally unused, merged, repeated, duplicates;
  std::vector<bool> used(mesh.vertices.size(), false);
  for (const TriangleIndices& t : mesh.triangles) {
    for (const std::uint32_t corner : t) used[corner] = true;
  }
  std::vector<bool> seen(welded.points, false);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (!used[i]) unused.add(mesh.vertices[i]);
    if (seen[welded.point_of[i]]) {
      merged.add(mesh.vertices[i]);
    } else {
      soup.mesh.vertices[welded.point_of[i]] = mesh.vertices[i] + 0.0;  // + 0.0 turns -0 into 0
      seen[welded.point_of[i]] = true;
    }
  }
  const std::vector<TriangleIndices> triangles = welded_triangles(mesh, welded);
  const std::vector<std::uint32_t> first = first_duplicates(triangles, welded.points);
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    const glm::dvec3 where = centroid(soup.mesh.vertices, triangles[i]);
    if (has_repeated_corner(triangles[i])) {
      repeated.add(where, i);
    } else if (first[i] != i) {
      duplicates.add(where, i);
    } else {
      soup.mesh.triangles.push_back(triangles[i]);
      soup.number.push_back(i);
    }
  }
  add_finding(changes, "R16-unused-vertices", Severity::info, unused,
              "vertices that belong to no triangle left out");
  add_finding(changes, "R01-merged-vertices", Severity::info, merged, "coincident vertices merged into one");
  add_finding(changes, "R02-repeated-corners", Severity::info, repeated,
              "triangles with two equal corners removed");
  add_finding(changes, "R03-duplicate-triangles", Severity::info, duplicates,
              "triangles that repeated another removed");
  return soup;
}

// Closes cracks and fills holes. Returns the number of holes that were not tried.
std::size_t mend_borders(RepairSoup& soup, const RepairOptions& options, Changes& changes) {
  glm::dvec3 low(std::numeric_limits<double>::infinity()), high(-std::numeric_limits<double>::infinity());
  for (const TriangleIndices& t : soup.mesh.triangles) {
    for (const std::uint32_t corner : t) {
      low = glm::min(low, soup.mesh.vertices[corner]);
      high = glm::max(high, soup.mesh.vertices[corner]);
    }
  }
  if (soup.mesh.empty()) return 0;
  const double tolerance_m = options.crack_share * glm::length(high - low);
  const ClosedCracks cracks = close_cracks(soup, tolerance_m);
  add_finding(changes, "R12-closed-cracks", Severity::info, cracks.edges,
              "pairs of border edges joined by moving " + std::to_string(cracks.vertices) +
                  " vertices, none by more than " + in_words(cracks.furthest_m) +
                  " m (cracks are closed up to " + in_words(tolerance_m) + " m)");
  const FilledHoles holes = fill_holes(soup, options);
  add_finding(changes, "R13-filled-holes", Severity::info, holes.filled,
              "holes filled with " + std::to_string(holes.triangles) + " triangles");
  return holes.untried;
}

// Whether triangle i runs in the same direction in both soups. Corners are compared by their coordinates,
// because orienting may replace a triangle's corners by copies.
bool same_sense(const CgalSoup& before, const CgalSoup& after, std::size_t i) {
  const Polygon& a = before.polygons[i];
  const Polygon& b = after.polygons[i];
  for (std::size_t turn = 0; turn < 3; ++turn) {
    bool same = true;
    for (std::size_t k = 0; k < 3; ++k) same = same && before.points[a[k]] == after.points[b[(k + turn) % 3]];
    if (same) return true;
  }
  return false;
}

void orient(CgalSoup& soup, const RepairSoup& origin, Changes& changes) {
  const CgalSoup before = soup;
  pmp::orient_polygon_soup(soup.points, soup.polygons);
  FindingTally turned, split;
  for (std::size_t i = 0; i < soup.polygons.size(); ++i) {
    if (origin.number[i] == RepairSoup::kFilled || same_sense(before, soup, i)) continue;
    turned.add(centroid(origin.mesh.vertices, origin.mesh.triangles[i]), origin.number[i]);
  }
  for (std::size_t p = before.points.size(); p < soup.points.size(); ++p) split.add(to_glm(soup.points[p]));
  add_finding(changes, "R04-oriented-triangles", Severity::info, turned,
              "triangles turned over, to agree with their neighbours");
  add_finding(
      changes, "R05-split-vertices", Severity::info, split,
      "copies of vertices made where more than two triangles met at an edge, or parts only at a point");
}

glm::dvec3 middle(const Surface& surface, Surface::Halfedge_index h) {
  return 0.5 * (to_glm(surface.point(source(h, surface))) + to_glm(surface.point(target(h, surface))));
}

glm::dvec3 middle(const Surface& surface, Surface::Face_index f) {
  glm::dvec3 sum(0.0);
  for (const auto v : surface.vertices_around_face(surface.halfedge(f))) sum += to_glm(surface.point(v));
  return sum / 3.0;
}

void stitch(Surface& surface, Changes& changes) {
  std::vector<std::pair<Surface::Halfedge_index, glm::dvec3>> border;
  for (const auto h : surface.halfedges()) {
    if (surface.is_border(h)) border.emplace_back(h, middle(surface, h));
  }
  pmp::stitch_borders(surface);
  FindingTally stitched;
  for (const auto& [h, where] : border) {
    if (surface.is_removed(h) || !surface.is_border(h)) stitched.add(where);
  }
  stitched.count = (stitched.count + 1) / 2;  // each edge was counted from both sides
  add_finding(changes, "R06-stitched-borders", Severity::info, stitched,
              "pairs of coincident border edges stitched together");
}

void dissolve_flat(Surface& surface, Changes& changes) {
  std::vector<Surface::Face_index> flat;
  pmp::degenerate_faces(surface, std::back_inserter(flat));
  if (flat.empty()) return;
  FindingTally found;
  for (const auto f : flat) found.add(middle(surface, f));
  const bool all = pmp::remove_degenerate_faces(surface);
  add_finding(changes, "R07-degenerate-triangles", all ? Severity::info : Severity::warning, found,
              all ? "triangles with three corners on one line dissolved in their neighbours"
                  : "triangles have three corners on one line; not all of them could be dissolved");
}

// Self-intersections of the mesh after welding, without its degenerate triangles.
SelfIntersections intersections_of(const TriangleMesh& mesh) {
  const WeldedVertices welded = weld_vertices(mesh.vertices);
  std::vector<glm::dvec3> points(welded.points);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) points[welded.point_of[i]] = mesh.vertices[i];
  std::vector<TriangleIndices> proper;
  for (const TriangleIndices& t : welded_triangles(mesh, welded)) {
    if (!has_repeated_corner(t) && !is_degenerate(points[t[0]], points[t[1]], points[t[2]]))
      proper.push_back(t);
  }
  return find_self_intersections(points, proper);
}

struct PieceSides {
  std::vector<double> volume;              // [piece] signed, about the mesh's centre
  std::vector<Surface::Face_index> first;  // [piece] one of its faces
  std::vector<std::size_t> piece_of;       // [face]
};

PieceSides sides_of(const Surface& surface) {
  PieceSides sides;
  sides.piece_of.resize(surface.number_of_faces());
  const auto pieces = pmp::connected_components(surface, CGAL::make_property_map(sides.piece_of));
  sides.volume.assign(pieces, 0.0);
  sides.first.resize(pieces);
  glm::dvec3 low(std::numeric_limits<double>::infinity()), high(-std::numeric_limits<double>::infinity());
  for (const auto v : surface.vertices()) {
    low = glm::min(low, to_glm(surface.point(v)));
    high = glm::max(high, to_glm(surface.point(v)));
  }
  for (const auto f : surface.faces()) {
    std::array<glm::dvec3, 3> p;
    auto h = surface.halfedge(f);
    for (glm::dvec3& corner : p) {
      corner = to_glm(surface.point(surface.target(h))) - 0.5 * (low + high);
      h = surface.next(h);
    }
    const std::size_t piece = sides.piece_of[f];
    if (!sides.first[piece].is_valid()) sides.first[piece] = f;
    sides.volume[piece] += glm::dot(p[0], glm::cross(p[1], p[2])) / 6.0;
  }
  return sides;
}

// Turns every piece outward. If pieces are nested and nothing intersects, inner pieces become cavities.
void turn_outward(Surface& surface, bool cuts_itself, Changes& changes) {
  const PieceSides before = sides_of(surface);
  if (before.volume.size() > 1 && !cuts_itself) {
    pmp::orient_to_bound_a_volume(surface);
  } else {
    std::vector<Surface::Face_index> inward;
    for (const auto f : surface.faces()) {
      if (before.volume[before.piece_of[f]] < 0.0) inward.push_back(f);
    }
    pmp::reverse_face_orientations(inward, surface);
  }
  const PieceSides after = sides_of(surface);
  FindingTally turned;
  for (std::size_t piece = 0; piece < before.volume.size(); ++piece) {
    const double now = after.volume[after.piece_of[before.first[piece]]];
    if (now * before.volume[piece] < 0.0) turned.add(middle(surface, before.first[piece]));
  }
  add_finding(changes, "R08-turned-outward", Severity::info, turned,
              "pieces turned over, so that their outside is out (an inner one: towards the hollow)");
}

void say_what_is_left(const TriangleMesh& mesh, const RepairOptions& options, std::size_t untried,
                      Changes& changes) {
  const HolesLeft holes = holes_left(mesh, options);
  std::string why;
  const auto because = [&](std::size_t count, const std::string& reason) {
    if (count > 0) why += (why.empty() ? "" : ", ") + std::to_string(count) + " " + reason;
  };
  because(holes.too_long, "of more than " + std::to_string(options.hole_edges) + " edges");
  because(holes.too_large, "larger than " + in_words(options.hole_share) + " of their piece");
  because(holes.branching, "whose rims end at edges of more than two triangles");
  because(holes.unfillable, "that no fill fits without cutting the mesh");
  because(untried, "of these not tried, because filling them takes too long");
  add_finding(changes, "R14-holes-left", Severity::warning, holes.left,
              "holes or rims were not filled: " + why);
}

// Reports the outcome as a check of the repaired mesh finds it.
void say_how_it_ended(const TriangleMesh& mesh, Changes& changes) {
  const MeshCheck check = check_mesh(mesh);
  if (check.oriented) {
    changes.push_back({"R09-closed", Severity::info, 1, "the repaired mesh is closed"});
    return;
  }
  // Findings give triangle numbers of the mesh as given. The repaired mesh has other numbers, which are left
  // out.
  const auto place_of = [&](std::string_view id) {
    std::optional<FindingPlace> place;
    for (const Finding& f : check.findings) {
      if (f.id.starts_with(id)) place = f.place;
    }
    if (place) place->triangle.reset();
    return place;
  };
  const std::string sheet = ": the mesh is touched as a two-sided sheet";
  if (check.border_edges > 0) {
    changes.push_back({"R10-open", Severity::warning, check.border_edges, "border edges are left" + sheet,
                       place_of("M09")});
  } else if (check.nonmanifold_edges > 0) {
    changes.push_back({"R17-no-inside", Severity::warning, check.nonmanifold_edges,
                       "edges have more than two triangles, and no edge is open" + sheet, place_of("M06")});
  } else if (check.turned_edges > 0) {
    changes.push_back({"R17-no-inside", Severity::warning, check.turned_edges,
                       "edges have triangles that cannot be turned alike, and no edge is open" + sheet,
                       place_of("M07")});
  } else {
    changes.push_back(
        {"R17-no-inside", Severity::warning, 1, "mesh encloses no volume" + sheet, place_of("M11")});
  }
}

}  // namespace

RepairedMesh repair_mesh(const TriangleMesh& mesh, const RepairOptions& options) {
  RepairedMesh repaired;
  RepairSoup merged = merge_equal(mesh, repaired.changes);
  // If CGAL refuses a step, the result of the previous steps is kept, and the report says so.
  std::size_t untried = 0;
  const char* done = "merged, but not oriented, stitched nor turned outward";
  try {
    untried = mend_borders(merged, options, repaired.changes);
    CgalSoup soup = to_cgal(merged.mesh);
    pmp::remove_isolated_points_in_polygon_soup(soup.points, soup.polygons);
    orient(soup, merged, repaired.changes);
    repaired.mesh = to_mesh(soup);
    if (soup.polygons.empty()) return repaired;
    if (!pmp::is_polygon_soup_a_polygon_mesh(soup.polygons))
      throw std::logic_error("the triangles make no surface");
    done = "merged and oriented, but not stitched nor turned outward";
    Surface surface;
    pmp::polygon_soup_to_polygon_mesh(soup.points, soup.polygons, surface);
    stitch(surface, repaired.changes);
    dissolve_flat(surface, repaired.changes);
    surface.collect_garbage();
    TriangleMesh whole = to_mesh(surface);
    const SelfIntersections cuts = intersections_of(whole);
    if (CGAL::is_closed(surface)) {
      turn_outward(surface, cuts.pairs > 0 || !cuts.complete, repaired.changes);
      whole = to_mesh(surface);
    }
    repaired.mesh = std::move(whole);
    if (cuts.pairs > 0) {
      const FindingTally pairs{cuts.pairs, {0.5 * (cuts.lower + cuts.upper), cuts.lower, cuts.upper, {}}};
      add_finding(repaired.changes, "R15-self-intersections", Severity::warning, pairs,
                  std::string("pairs of triangles cut one another") + (cuts.complete ? "" : " at least") +
                      " and are left so: no way to part them keeps every surface where it is");
    }
    say_what_is_left(repaired.mesh, options, untried, repaired.changes);
    say_how_it_ended(repaired.mesh, repaired.changes);
  } catch (const std::exception& error) {
    if (repaired.mesh.empty()) repaired.mesh = std::move(merged.mesh);
    repaired.changes.push_back(
        {"R11-unfinished", Severity::warning, 1,
         std::string("repair could not be finished (") + error.what() + "); the mesh is " + done});
  }
  return repaired;
}

}  // namespace polygon
