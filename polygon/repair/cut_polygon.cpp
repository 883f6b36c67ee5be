// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/repair/cut_polygon.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <exception>
#include <glm/geometric.hpp>
#include <map>
#include <optional>
#include <utility>

#include "polygon/mesh/triangle.h"
#include "polygon/repair/least_area.h"

namespace polygon {
namespace {

using Plane2 = CGAL::Exact_predicates_inexact_constructions_kernel;
using Flat = Plane2::Point_2;

// A polygon that crosses itself and has more corners than this is cut as a fan, because the triangulation of
// least area takes n³ steps.
constexpr std::size_t kMostOfLeastArea = 64;

struct Area {
  std::optional<int> winding;  // winding number of the polygon around the area; empty: not visited yet
};
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<std::uint32_t, Plane2>;
using FaceBase =
    CGAL::Triangulation_face_base_with_info_2<Area, Plane2,
                                              CGAL::Constrained_triangulation_face_base_2<Plane2>>;
using Cells = CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>;
using Delaunay =
    CGAL::Constrained_Delaunay_triangulation_2<Plane2, Cells,
                                               CGAL::No_constraint_intersection_requiring_constructions_tag>;

// A vector along the polygon's normal, of twice the enclosed area (Newell).
glm::dvec3 area_vector(const std::vector<glm::dvec3>& ring) {
  glm::dvec3 sum(0.0);
  for (std::size_t i = 1; i + 1 < ring.size(); ++i)
    sum += glm::cross(ring[i] - ring[0], ring[i + 1] - ring[0]);
  return sum;
}

// Projects the polygon along the axis in which its normal is largest. The two remaining coordinates are
// exact. Their order keeps the polygon counterclockwise.
std::vector<Flat> along_axis(const std::vector<glm::dvec3>& ring, const glm::dvec3& normal) {
  int axis = 0;
  for (int a = 1; a < 3; ++a) axis = std::abs(normal[a]) > std::abs(normal[axis]) ? a : axis;
  int u = (axis + 1) % 3, v = (axis + 2) % 3;
  if (normal[axis] < 0.0) std::swap(u, v);
  std::vector<Flat> flat;
  flat.reserve(ring.size());
  for (const glm::dvec3& p : ring) flat.emplace_back(p[u], p[v]);
  return flat;
}

// Projects the polygon along its normal. The coordinates are rounded. But corners a little off the plane
// distort the shape less than they do in along_axis().
std::vector<Flat> along_normal(const std::vector<glm::dvec3>& ring, const glm::dvec3& normal) {
  const glm::dvec3 n = glm::normalize(normal);
  const glm::dvec3 other = std::abs(n.x) < 0.5 ? glm::dvec3(1.0, 0.0, 0.0) : glm::dvec3(0.0, 1.0, 0.0);
  const glm::dvec3 u = glm::normalize(glm::cross(other, n)), v = glm::cross(n, u);
  std::vector<Flat> flat;
  flat.reserve(ring.size());
  for (const glm::dvec3& p : ring) flat.emplace_back(glm::dot(p - ring[0], u), glm::dot(p - ring[0], v));
  return flat;
}

// Whether all corners follow in angular order within half a turn, seen from the first corner. Then a fan from
// there lies inside the polygon.
bool fans_from_first(const std::vector<Flat>& ring) {
  for (std::size_t i = 2; i < ring.size(); ++i) {
    if (CGAL::orientation(ring[0], ring[1], ring[i]) != CGAL::LEFT_TURN ||
        CGAL::orientation(ring[0], ring[i - 1], ring[i]) != CGAL::LEFT_TURN)
      return false;
  }
  return true;
}

// Net number of passages of the polygon from one vertex of the triangulation to a neighbour: passages there
// minus passages back.
class Passages {
 public:
  void add(std::uint32_t from, std::uint32_t to) { ++net_[{from, to}], --net_[{to, from}]; }
  [[nodiscard]] int net(std::uint32_t from, std::uint32_t to) const {
    const auto found = net_.find({from, to});
    return found == net_.end() ? 0 : found->second;
  }

 private:
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> net_;
};

// The neighbour of `from` on the segment from `from` to `to`. It is `to` itself, or a corner that lies on the
// segment.
Delaunay::Vertex_handle next_on_segment(const Delaunay& cells, Delaunay::Vertex_handle from,
                                        Delaunay::Vertex_handle to) {
  Delaunay::Vertex_circulator at = cells.incident_vertices(from);
  const Delaunay::Vertex_circulator begin = at;
  do {
    const Delaunay::Vertex_handle next = at;
    if (cells.is_infinite(next)) continue;
    if (next == to) return to;
    if (CGAL::collinear(from->point(), next->point(), to->point()) &&
        CGAL::collinear_are_strictly_ordered_along_line(from->point(), next->point(), to->point()))
      return next;
  } while (++at != begin);
  return {};
}

// Sets the winding numbers of all areas, starting with 0 outside. Across an edge the winding number changes
// by the net number of passages of the polygon there.
void wind(Delaunay& cells, const Passages& passages) {
  std::vector<Delaunay::Face_handle> open{cells.infinite_face()};
  open[0]->info().winding = 0;
  while (!open.empty()) {
    const Delaunay::Face_handle face = open.back();
    open.pop_back();
    for (int i = 0; i < 3; ++i) {
      const Delaunay::Face_handle next = face->neighbor(i);
      if (next->info().winding) continue;
      const auto a = face->vertex(Delaunay::ccw(i)), b = face->vertex(Delaunay::cw(i));
      const bool bound = cells.is_infinite(a) || cells.is_infinite(b);
      next->info().winding = face->info().winding.value() - (bound ? 0 : passages.net(a->info(), b->info()));
      open.push_back(next);
    }
  }
}

// The triangles inside the polygon, as indices into the ring. None if the projected ring crosses itself.
std::vector<std::array<std::uint32_t, 3>> inner_triangles(const std::vector<glm::dvec3>& ring,
                                                          const std::vector<Flat>& flat) {
  Delaunay cells;
  std::vector<Delaunay::Vertex_handle> vertices;
  vertices.reserve(flat.size());
  for (std::uint32_t i = 0; i < flat.size(); ++i) {
    const std::size_t before = cells.number_of_vertices();
    const Delaunay::Vertex_handle at =
        cells.insert(flat[i], i == 0 ? Delaunay::Face_handle() : vertices.back()->face());
    if (cells.number_of_vertices() > before) at->info() = i;
    if (ring[at->info()] != ring[i]) return {};  // different corners that project to one point
    vertices.push_back(at);
  }
  if (cells.dimension() < 2) return {};
  Passages passages;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const auto to = vertices[(i + 1) % vertices.size()];
    if (vertices[i] != to) cells.insert_constraint(vertices[i], to);
  }
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const auto to = vertices[(i + 1) % vertices.size()];
    for (auto from = vertices[i]; from != to;) {
      const auto next = next_on_segment(cells, from, to);
      if (next == Delaunay::Vertex_handle()) return {};
      passages.add(from->info(), next->info());
      from = next;
    }
  }
  wind(cells, passages);
  std::vector<std::array<std::uint32_t, 3>> inside;
  for (const Delaunay::Face_handle face : cells.finite_face_handles()) {
    const int winding = face->info().winding.value();
    if (winding == 0) continue;
    if (winding != 1) return {};
    inside.push_back({face->vertex(0)->info(), face->vertex(1)->info(), face->vertex(2)->info()});
  }
  return inside;
}

std::vector<std::array<std::uint32_t, 3>> inner_triangles_or_none(const std::vector<glm::dvec3>& ring,
                                                                  const std::vector<Flat>& flat) {
  try {
    return inner_triangles(ring, flat);
  } catch (const std::exception&) {  // two edges cross, or CGAL refuses the numbers
    return {};
  }
}

bool is_on_a_line(const std::vector<glm::dvec3>& ring) {
  const glm::dvec3 far = *std::max_element(ring.begin(), ring.end(), [&](const auto& a, const auto& b) {
    return glm::dot(a - ring[0], a - ring[0]) < glm::dot(b - ring[0], b - ring[0]);
  });
  return std::all_of(ring.begin(), ring.end(),
                     [&](const glm::dvec3& p) { return is_degenerate(ring[0], far, p); });
}

}  // namespace

PolygonCut cut_polygon(std::span<const glm::dvec3> points, std::span<const std::uint32_t> corners,
                       std::vector<TriangleIndices>& triangles) {
  std::vector<std::uint32_t> loop;
  std::vector<glm::dvec3> ring;
  for (const std::uint32_t corner : corners) {
    if (!ring.empty() && points[corner] == ring.back()) continue;
    loop.push_back(corner);
    ring.push_back(points[corner]);
  }
  while (ring.size() > 1 && ring.back() == ring.front()) {
    loop.pop_back();
    ring.pop_back();
  }
  if (ring.size() < 3) return PolygonCut::nothing;
  const auto fan = [&] {
    for (std::size_t c = 1; c + 1 < loop.size(); ++c) triangles.push_back({loop[0], loop[c], loop[c + 1]});
  };
  if (ring.size() == 3) {
    fan();
    return PolygonCut::inside;
  }
  const glm::dvec3 normal = area_vector(ring);
  if (normal != glm::dvec3(0.0)) {
    const std::vector<Flat> flat = along_axis(ring, normal);
    if (fans_from_first(flat)) {
      fan();
      return PolygonCut::inside;
    }
    auto inside = inner_triangles_or_none(ring, flat);
    if (inside.empty()) inside = inner_triangles_or_none(ring, along_normal(ring, normal));
    for (const auto& [a, b, c] : inside) triangles.push_back({loop[a], loop[b], loop[c]});
    if (!inside.empty()) return PolygonCut::inside;
  }
  if (is_on_a_line(ring)) {
    fan();
    return PolygonCut::flat;
  }
  std::vector<TriangleIndices> least;
  if (loop.size() <= kMostOfLeastArea) {
    least = least_area_triangles(loop, points, [](std::uint32_t, std::uint32_t) { return false; });
  }
  if (least.empty()) {
    fan();
  } else {
    triangles.insert(triangles.end(), least.begin(), least.end());
  }
  return PolygonCut::crossing;
}

}  // namespace polygon
