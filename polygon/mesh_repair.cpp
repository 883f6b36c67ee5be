// SPDX-License-Identifier: GPL-3.0-or-later
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/connected_components.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_mesh_to_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/repair_degeneracies.h>
#include <CGAL/Polygon_mesh_processing/repair_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Polygon_mesh_processing/stitch_borders.h>
#include <CGAL/Surface_mesh.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <exception>
#include <string>
#include <vector>

#include "polygon/mesh_check.h"

namespace polygon {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Polygon = std::array<std::size_t, 3>;
using Surface = CGAL::Surface_mesh<Point>;

struct Soup {
  std::vector<Point> points;
  std::vector<Polygon> polygons;
};

Soup to_soup(const TriangleMesh& mesh) {
  Soup soup;
  soup.points.reserve(mesh.vertices.size());
  // + 0.0 turns -0 into 0: equal coordinates, and equal bits.
  for (const glm::dvec3& v : mesh.vertices) soup.points.emplace_back(v.x + 0.0, v.y + 0.0, v.z + 0.0);
  soup.polygons.reserve(mesh.triangles.size());
  for (const TriangleIndices& t : mesh.triangles) soup.polygons.push_back({t[0], t[1], t[2]});
  return soup;
}

TriangleMesh to_mesh(const Soup& soup) {
  TriangleMesh mesh;
  mesh.vertices.reserve(soup.points.size());
  for (const Point& p : soup.points) mesh.vertices.emplace_back(p.x(), p.y(), p.z());
  mesh.triangles.reserve(soup.polygons.size());
  for (const Polygon& t : soup.polygons) {
    mesh.triangles.push_back({static_cast<std::uint32_t>(t[0]), static_cast<std::uint32_t>(t[1]),
                              static_cast<std::uint32_t>(t[2])});
  }
  return mesh;
}

void report(std::vector<Finding>& changes, const char* id, std::size_t count, const std::string& text,
            Severity severity = Severity::info) {
  if (count > 0) changes.push_back({id, severity, count, text});
}

// Same corners in the same sense, by coordinates: orienting may have given a triangle copies of its corners.
bool same_sense(const Soup& before, const Soup& after, std::size_t i) {
  const Polygon& a = before.polygons[i];
  const Polygon& b = after.polygons[i];
  for (std::size_t turn = 0; turn < 3; ++turn) {
    bool same = true;
    for (std::size_t k = 0; k < 3; ++k) same = same && before.points[a[k]] == after.points[b[(k + turn) % 3]];
    if (same) return true;
  }
  return false;
}

void repair_soup(Soup& soup, std::vector<Finding>& changes) {
  report(changes, "R01-merged-vertices",
         pmp::merge_duplicate_points_in_polygon_soup(soup.points, soup.polygons),
         "coincident vertices merged into one");
  report(changes, "R02-repeated-corners",
         std::erase_if(soup.polygons,
                       [](const Polygon& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }),
         "triangles with two equal corners removed");
  report(changes, "R03-duplicate-triangles",
         pmp::merge_duplicate_polygons_in_polygon_soup(
             soup.points, soup.polygons,
             CGAL::parameters::erase_all_duplicates(false).require_same_orientation(false)),
         "triangles that repeated another removed");
  pmp::remove_isolated_points_in_polygon_soup(soup.points, soup.polygons);
  const Soup before = soup;
  pmp::orient_polygon_soup(soup.points, soup.polygons);
  std::size_t turned = 0;
  for (std::size_t i = 0; i < soup.polygons.size(); ++i) turned += same_sense(before, soup, i) ? 0 : 1;
  report(changes, "R04-oriented-triangles", turned, "triangles turned over, to agree with their neighbours");
  report(changes, "R05-split-vertices", soup.points.size() - before.points.size(),
         "copies of vertices made where more than two triangles met at an edge, or parts only at a point");
}

// Every piece outward; where pieces are nested and do not cut one another, the inner ones become cavities.
std::size_t turn_outward(Surface& surface) {
  std::vector<std::size_t> piece_of(num_faces(surface));
  const auto pieces = pmp::connected_components(surface, CGAL::make_property_map(piece_of));
  const double before = pmp::volume(surface);
  if (pieces == 1) {
    if (pmp::is_outward_oriented(surface)) return 0;
    pmp::reverse_face_orientations(surface);
    return 1;
  }
  if (pmp::does_self_intersect(surface)) {
    pmp::orient(surface);  // nothing is nested for certain
  } else {
    pmp::orient_to_bound_a_volume(surface);
  }
  return pmp::volume(surface) == before ? 0 : 1;
}

}  // namespace

RepairedMesh repair_mesh(const TriangleMesh& mesh) {
  RepairedMesh repaired;
  Soup soup = to_soup(mesh);
  repair_soup(soup, repaired.changes);
  repaired.mesh = to_mesh(soup);
  if (soup.polygons.empty() || !pmp::is_polygon_soup_a_polygon_mesh(soup.polygons)) return repaired;
  // What follows works on a surface. Should CGAL refuse a step on some freak of a mesh, what was done until
  // then stands, and the report says so.
  try {
    Surface surface;
    pmp::polygon_soup_to_polygon_mesh(soup.points, soup.polygons, surface);
    report(repaired.changes, "R06-stitched-borders", pmp::stitch_borders(surface),
           "pairs of coincident border edges stitched together");
    std::vector<Surface::Face_index> flat;
    pmp::degenerate_faces(surface, std::back_inserter(flat));
    if (!flat.empty()) {
      const bool all = pmp::remove_degenerate_faces(surface);
      report(repaired.changes, "R07-degenerate-triangles", flat.size(),
             all ? "triangles with three corners on one line collapsed"
                 : "triangles have three corners on one line; not all of them could be collapsed");
    }
    surface.collect_garbage();
    if (CGAL::is_closed(surface)) {
      report(repaired.changes, "R08-turned-outward", turn_outward(surface),
             "surface turned, so that its outside is out");
    }
    soup = {};
    pmp::polygon_mesh_to_polygon_soup(surface, soup.points, soup.polygons);
    repaired.mesh = to_mesh(soup);
    std::size_t border = 0;
    for (const auto h : halfedges(surface)) border += surface.is_border(h) ? 1 : 0;
    if (border == 0) {
      report(repaired.changes, "R09-closed", 1, "the repaired mesh is closed");
    } else {
      report(repaired.changes, "R10-open", border,
             "border edges are left: the mesh stays open (holes are not filled), and is touched as a "
             "two-sided sheet",
             Severity::warning);
    }
  } catch (const std::exception& error) {
    report(repaired.changes, "R11-unfinished", 1,
           std::string("CGAL could not finish (") + error.what() +
               "); the mesh is merged and oriented, but not stitched nor turned outward",
           Severity::warning);
  }
  return repaired;
}

}  // namespace polygon
