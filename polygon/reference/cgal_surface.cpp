// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/reference/cgal_surface.h"

// CGAL's own checks would visit every box twice. Timings of CGAL are taken without these checks.
#define CGAL_NDEBUG
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numeric>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "polygon/mesh/mesh_bounds.h"
#include "polygon/mesh/topology.h"
#include "polygon/mesh/triangle.h"
#include "polygon/mesh/vertex_normals.h"

namespace polygon {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

constexpr double kRelativeSlack =
    1e-12;  // of a squared radius; rounding may put a triangle nearer than its box

struct Corners {
  const std::vector<glm::dvec3>* vertices = nullptr;
  const std::vector<TriangleIndices>* triangles = nullptr;

  [[nodiscard]] const glm::dvec3& operator()(std::uint32_t triangle, std::size_t corner) const {
    return (*vertices)[(*triangles)[triangle][corner]];
  }
};

// Models AABBPrimitiveWithSharedData in four bytes per triangle, so that the tree does not store the geometry
// again.
class IndexedTriangle {
 public:
  using Id = std::uint32_t;
  using Point = Kernel::Point_3;
  using Point_reference = Point;
  using Datum = Kernel::Triangle_3;
  using Datum_reference = Datum;
  using Shared_data = Corners;

  IndexedTriangle() = default;
  IndexedTriangle(std::vector<std::uint32_t>::const_iterator id, const Corners& /*corners*/) : id_(*id) {}
  [[nodiscard]] Id id() const { return id_; }
  [[nodiscard]] Datum datum(const Shared_data& corners) const {
    return {point(corners, 0), point(corners, 1), point(corners, 2)};
  }
  [[nodiscard]] Point reference_point(const Shared_data& corners) const { return point(corners, 0); }
  static Shared_data construct_shared_data(const Corners& corners) { return corners; }

 private:
  [[nodiscard]] Point point(const Corners& corners, std::size_t corner) const {
    const glm::dvec3& v = corners(id_, corner);
    return {v.x, v.y, v.z};
  }
  Id id_ = 0;
};

using Traits = CGAL::AABB_traits<Kernel, IndexedTriangle>;
using Tree = CGAL::AABB_tree<Traits>;
using Node = CGAL::AABB_node<Traits>;

double squared_distance(const glm::dvec3& p, const glm::dvec3& low, const glm::dvec3& high) {
  const glm::dvec3 out = glm::max(glm::max(low - p, p - high), glm::dvec3(0.0));
  return glm::dot(out, out);
}
double squared_distance(const glm::dvec3& p, const CGAL::Bbox_3& box) {
  return squared_distance(p, {box.xmin(), box.ymin(), box.zmin()}, {box.xmax(), box.ymax(), box.zmax()});
}

// Traversal traits for CGAL's tree. They descend into boxes whose squared distance from `point` is at most
// `squared_radius`. The callback `leaf` handles each triangle, and may reduce the radius.
template <typename Leaf>
class Visit {
 public:
  using Priority = double;

  Visit(const glm::dvec3& point, double squared_radius, Leaf& leaf)
      : point_(point), squared_radius_(squared_radius), leaf_(leaf) {}
  [[nodiscard]] bool go_further() const { return squared_radius_ >= 0.0; }
  void intersection(int /*query*/, const IndexedTriangle& triangle) { leaf_(triangle.id(), squared_radius_); }
  [[nodiscard]] bool do_intersect(int /*query*/, const Node& node) const {
    return squared_distance(point_, node.bbox()) <= squared_radius_;
  }
  [[nodiscard]] std::pair<bool, Priority> do_intersect_with_priority(int /*query*/, const Node& node) const {
    const double squared = squared_distance(point_, node.bbox());
    return {squared <= squared_radius_, -squared};  // the nearer box first
  }

 private:
  glm::dvec3 point_;
  double squared_radius_;
  Leaf& leaf_;
};

// Counts the triangles that a ray crosses, with exact predicates. Degenerate triangles enclose nothing and do
// not count.
class Crossings {
 public:
  Crossings(const Kernel::Ray_3& ray, const Corners& corners) : ray_(ray), corners_(corners) {}
  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] bool go_further() const { return true; }
  void intersection(int /*query*/, const IndexedTriangle& triangle) {
    const Kernel::Triangle_3 datum = triangle.datum(corners_);
    if (!datum.is_degenerate() && CGAL::do_intersect(ray_, datum)) ++count_;
  }
  [[nodiscard]] bool do_intersect(int /*query*/, const Node& node) const {
    return CGAL::do_intersect(ray_, node.bbox());
  }

 private:
  Kernel::Ray_3 ray_;
  Corners corners_;
  int count_ = 0;
};

double reach_squared(double radius) {
  return radius * radius * (1.0 + kRelativeSlack);
}

class CgalSurface final : public RigidSurface {
 public:
  CgalSurface(const TriangleMesh& mesh, bool solid);

  [[nodiscard]] GatherResult gather(const glm::dvec3& point, double radius,
                                    std::span<NearPoint> out) const noexcept override;
  [[nodiscard]] bool nearest(const glm::dvec3& point, double radius, NearPoint& out) const noexcept override;
  [[nodiscard]] GatherResult survey(const glm::dvec3& centre, double radius, const glm::dvec3& view,
                                    std::span<ElementPlane> out) const noexcept override;
  [[nodiscard]] NearPoint closest(std::uint32_t element, const glm::dvec3& point) const noexcept override;
  [[nodiscard]] glm::dvec3 face_normal(std::uint32_t element) const noexcept override;
  [[nodiscard]] double support(std::uint32_t element, const glm::dvec3& normal) const noexcept override;
  [[nodiscard]] std::array<std::uint32_t, 3> neighbours(std::uint32_t element) const noexcept override {
    return across_[element];
  }
  [[nodiscard]] glm::dvec3 shaded_normal(std::uint32_t element, const glm::dvec3& point,
                                         const glm::dvec3& away) const noexcept override;
  [[nodiscard]] bool inside(const glm::dvec3& point) const noexcept override;
  [[nodiscard]] bool solid() const noexcept override { return solid_; }
  [[nodiscard]] std::size_t element_count() const noexcept override { return triangles_.size(); }
  [[nodiscard]] glm::dvec3 lower() const noexcept override { return centre_ + lower_; }
  [[nodiscard]] glm::dvec3 upper() const noexcept override { return centre_ + upper_; }
  [[nodiscard]] std::size_t memory_bytes() const noexcept override;

 private:
  // Coordinates are relative to centre_, like all geometry in this class.
  [[nodiscard]] NearPoint closest_local(std::uint32_t element, const glm::dvec3& local) const {
    const TrianglePoint found =
        closest_on_triangle(local, corners_(element, 0), corners_(element, 1), corners_(element, 2));
    return {found.point, std::sqrt(found.squared_distance), element};
  }
  [[nodiscard]] bool answerable(const glm::dvec3& point, double radius) const {
    const glm::dvec3 local = point - centre_;
    return radius >= 0.0 && glm::dot(local, local) < kFurthestQuery * kFurthestQuery;  // also false for NaN
  }

  bool solid_;
  glm::dvec3 centre_{0.0};
  glm::dvec3 lower_{0.0}, upper_{0.0};  // relative to centre_
  std::vector<glm::dvec3> vertices_;    // relative to centre_
  std::vector<TriangleIndices> triangles_, across_;
  std::vector<glm::vec3> vertex_normals_;  // solid only
  Corners corners_;
  Tree tree_;
};

CgalSurface::CgalSurface(const TriangleMesh& mesh, bool solid) : solid_(solid), triangles_(mesh.triangles) {
  const MeshBounds bounds = checked_bounds(mesh);
  centre_ = 0.5 * (bounds.low + bounds.high);
  lower_ = bounds.low - centre_;
  upper_ = bounds.high - centre_;
  vertices_.reserve(mesh.vertices.size());
  for (const glm::dvec3& v : mesh.vertices) vertices_.push_back(v - centre_);
  across_ = connect_triangles(mesh).across;
  corners_ = {&vertices_, &triangles_};
  if (solid_) vertex_normals_ = angle_weighted_normals(mesh);

  std::vector<std::uint32_t> elements;
  {
    const WeldedVertices points = weld_vertices(mesh.vertices);
    const std::vector<TriangleIndices> welded = welded_triangles(mesh, points);
    const std::vector<std::uint32_t> first = first_duplicates(welded, points.points);
    elements.reserve(first.size());
    for (std::uint32_t i = 0; i < first.size(); ++i) {
      if (first[i] == i) elements.push_back(i);
    }
  }
  // A search starts from its own radius, so CGAL's k-d tree of starting points would never be used.
  tree_.do_not_accelerate_distance_queries();
  tree_.insert(elements.cbegin(), elements.cend(), corners_);
  tree_.build();
}

GatherResult CgalSurface::gather(const glm::dvec3& point, double radius,
                                 std::span<NearPoint> out) const noexcept {
  GatherResult result;
  if (!answerable(point, radius)) return result;
  const glm::dvec3 local = point - centre_;
  auto leaf = [&](std::uint32_t element, double& squared_radius) {
    const NearPoint found = closest_local(element, local);
    if (!(found.distance <= radius)) return;
    if (result.count < out.size()) {
      out[result.count++] = found;
      if (result.count == out.size()) std::make_heap(out.begin(), out.end(), nearer);
      return;
    }
    // `out` is full. It keeps the nearest points, and the radius shrinks to the furthest of these.
    result.complete = false;
    if (out.empty()) {
      squared_radius = -1.0;
      return;
    }
    if (nearer(found, out.front())) {
      std::pop_heap(out.begin(), out.end(), nearer);
      out.back() = found;
      std::push_heap(out.begin(), out.end(), nearer);
    }
    squared_radius = std::min(squared_radius, reach_squared(out.front().distance));
  };
  Visit visit(local, reach_squared(radius), leaf);
  tree_.traversal(0, visit);
  const std::span<NearPoint> found = out.first(result.count);
  std::sort(found.begin(), found.end(),
            [](const NearPoint& a, const NearPoint& b) { return a.element < b.element; });
  for (NearPoint& p : found) p.point += centre_;
  return result;
}

bool CgalSurface::nearest(const glm::dvec3& point, double radius, NearPoint& out) const noexcept {
  if (!answerable(point, radius)) return false;
  const glm::dvec3 local = point - centre_;
  // If distances are equal, the lower element number wins. kNoElement is above every element number, so an
  // element at exactly `radius` is found.
  NearPoint best{{}, radius, kNoElement};
  auto leaf = [&](std::uint32_t element, double& squared_radius) {
    const NearPoint found = closest_local(element, local);
    if (!nearer(found, best)) return;
    best = found;
    squared_radius = std::min(squared_radius, reach_squared(found.distance));
  };
  Visit visit(local, reach_squared(radius), leaf);
  tree_.traversal_with_priority(0, visit);
  if (best.element == kNoElement) return false;
  out = best;
  out.point += centre_;
  return true;
}

GatherResult CgalSurface::survey(const glm::dvec3& centre, double radius, const glm::dvec3& view,
                                 std::span<ElementPlane> out) const noexcept {
  GatherResult result;
  if (!answerable(centre, radius)) return result;
  const glm::dvec3 local = centre - centre_;
  auto leaf = [&](std::uint32_t element, double& squared_radius) {
    TrianglePlane plane;
    if (!triangle_plane_within(local, radius, view - centre_, corners_(element, 0), corners_(element, 1),
                               corners_(element, 2), plane))
      return;
    if (result.count == out.size()) {
      result.complete = false;
      squared_radius = -1.0;
      return;
    }
    out[result.count++] = {plane.normal, plane.support + glm::dot(plane.normal, centre_), element};
  };
  // The box test needs no slack, because minima, maxima and differences are monotonic under rounding.
  Visit visit(local, radius * radius, leaf);
  tree_.traversal(0, visit);
  return result;
}

NearPoint CgalSurface::closest(std::uint32_t element, const glm::dvec3& point) const noexcept {
  NearPoint found = closest_local(element, point - centre_);
  found.point += centre_;
  return found;
}

glm::dvec3 CgalSurface::face_normal(std::uint32_t element) const noexcept {
  return unit_normal(corners_(element, 0), corners_(element, 1), corners_(element, 2));
}

double CgalSurface::support(std::uint32_t element, const glm::dvec3& normal) const noexcept {
  return glm::dot(normal, centre_) +
         std::max({glm::dot(normal, corners_(element, 0)), glm::dot(normal, corners_(element, 1)),
                   glm::dot(normal, corners_(element, 2))});
}

glm::dvec3 CgalSurface::shaded_normal(std::uint32_t element, const glm::dvec3& point,
                                      const glm::dvec3& away) const noexcept {
  const glm::dvec3 face = face_normal(element);
  glm::dvec3 shaded = face;
  if (!vertex_normals_.empty() && face != glm::dvec3(0.0)) {
    const glm::dvec3 p = point - centre_;
    glm::dvec3 sum(0.0);
    for (std::size_t c = 0; c < 3; ++c) {
      const glm::dvec3 &next = corners_(element, (c + 1) % 3), &last = corners_(element, (c + 2) % 3);
      const double weight = std::max(0.0, glm::dot(face, glm::cross(last - next, p - next)));
      sum += weight * glm::dvec3(vertex_normals_[triangles_[element][c]]);
    }
    if (glm::dot(sum, sum) > 0.0) shaded = glm::normalize(sum);
  }
  return glm::dot(shaded, away) < 0.0 ? -shaded : shaded;
}

// Parity of ray crossings, with exact predicates. A ray through an edge or a corner would be counted twice,
// so three rays in general directions vote.
bool CgalSurface::inside(const glm::dvec3& point) const noexcept {
  if (!solid_ || !answerable(point, 0.0)) return false;
  const glm::dvec3 local = point - centre_;
  if (squared_distance(local, lower_, upper_) > 0.0) return false;
  NearPoint on;
  if (nearest(point, 0.0, on)) return false;
  static const std::array<Kernel::Vector_3, 3> kWays{Kernel::Vector_3(0.2718, 0.3141, 0.9099),
                                                     Kernel::Vector_3(-0.8437, 0.1732, 0.5081),
                                                     Kernel::Vector_3(0.4409, -0.7877, -0.4303)};
  int votes = 0;
  for (const Kernel::Vector_3& way : kWays) {
    Crossings crossings({Kernel::Point_3(local.x, local.y, local.z), way}, corners_);
    tree_.traversal(0, crossings);
    votes += crossings.count() % 2;
  }
  return votes >= 2;
}

std::size_t CgalSurface::memory_bytes() const noexcept {
  return sizeof(*this) + tree_.size() * (sizeof(Node) + sizeof(IndexedTriangle)) +
         vertices_.capacity() * sizeof(glm::dvec3) +
         (triangles_.capacity() + across_.capacity()) * sizeof(TriangleIndices) +
         vertex_normals_.capacity() * sizeof(glm::vec3);
}

// A point given by its index. It serves points as IndexedTriangle serves triangles.
class IndexedPoint {
 public:
  using Id = std::uint32_t;
  using Point = Kernel::Point_3;
  using Point_reference = Point;
  using Datum = Point;
  using Datum_reference = Datum;
  using Shared_data = const glm::dvec3*;

  IndexedPoint() = default;
  IndexedPoint(std::vector<std::uint32_t>::const_iterator id, Shared_data /*points*/) : id_(*id) {}
  [[nodiscard]] Id id() const { return id_; }
  [[nodiscard]] Datum datum(Shared_data points) const {
    return {points[id_].x, points[id_].y, points[id_].z};
  }
  [[nodiscard]] Point reference_point(Shared_data points) const { return datum(points); }
  static Shared_data construct_shared_data(Shared_data points) { return points; }

 private:
  Id id_ = 0;
};

template <class Primitive>
class CgalBoxSearch final : public BoxSearch {
 public:
  using Shared = typename Primitive::Shared_data;
  CgalBoxSearch(std::size_t count, const Shared& shared) : shared_(shared) {
    std::vector<std::uint32_t> ids(count);
    std::iota(ids.begin(), ids.end(), 0U);
    tree_.do_not_accelerate_distance_queries();
    tree_.insert(ids.cbegin(), ids.cend(), shared_);
    tree_.build();
  }

  [[nodiscard]] std::size_t in(const glm::dvec3& low, const glm::dvec3& high,
                               std::span<std::uint32_t> out) const noexcept override {
    Listing listing{{low.x, low.y, low.z, high.x, high.y, high.z}, shared_, out};
    if (!out.empty()) tree_.traversal(0, listing);
    return listing.count;
  }
  [[nodiscard]] std::size_t memory_bytes() const noexcept override {
    return tree_.size() * (sizeof(BoxNode) + sizeof(Primitive));
  }

 private:
  using BoxTraits = CGAL::AABB_traits<Kernel, Primitive>;
  using BoxNode = CGAL::AABB_node<BoxTraits>;
  struct Listing {  // a model of the tree's traversal traits
    CGAL::Bbox_3 box;
    const Shared& shared;
    std::span<std::uint32_t> out;
    std::size_t count = 0;

    [[nodiscard]] bool go_further() const { return count < out.size(); }
    [[nodiscard]] bool do_intersect(int /*query*/, const BoxNode& node) const {
      return CGAL::do_overlap(box, node.bbox());
    }
    void intersection(int /*query*/, const Primitive& primitive) {
      const auto datum = primitive.datum(shared);
      bool meets = CGAL::do_overlap(box, datum.bbox());
      if constexpr (std::is_same_v<Primitive, IndexedTriangle>)
        meets = meets && CGAL::do_intersect(box, datum);
      if (meets) out[count++] = primitive.id();
    }
  };

  Shared shared_;
  CGAL::AABB_tree<BoxTraits> tree_;
};

}  // namespace

std::unique_ptr<BoxSearch> make_cgal_search(std::span<const glm::dvec3> points) {
  return std::make_unique<CgalBoxSearch<IndexedPoint>>(points.size(), points.data());
}

std::unique_ptr<BoxSearch> make_cgal_search(const TriangleMesh& mesh) {
  return std::make_unique<CgalBoxSearch<IndexedTriangle>>(mesh.triangles.size(),
                                                          Corners{&mesh.vertices, &mesh.triangles});
}

std::unique_ptr<RigidSurface> make_cgal_surface(const TriangleMesh& mesh, bool solid) {
  return std::make_unique<CgalSurface>(mesh, solid);
}

}  // namespace polygon
