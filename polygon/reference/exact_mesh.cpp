// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/reference/exact_mesh.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Exact_rational.h>
#include <CGAL/Simple_cartesian.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "polygon/mesh/mesh_bounds.h"

namespace polygon {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Rational = CGAL::Exact_rational;
using Exact = CGAL::Simple_cartesian<Rational>;
using ExactTriangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, ExactTriangles::const_iterator>;
using ExactTraits = CGAL::AABB_traits<Kernel, Primitive>;
using ExactTree = CGAL::AABB_tree<ExactTraits>;
using ExactNode = CGAL::AABB_node<ExactTraits>;

constexpr double kRoundingSlack = 1e-12;      // relative; covers a few roundings in double
constexpr std::size_t kMostEquallyNear = 64;  // triangles that are compared exactly
constexpr int kMostRays = 32;                 // rays that are tried until one meets no edge

Kernel::Point_3 to_cgal(const glm::dvec3& p) {
  return {p.x, p.y, p.z};
}

glm::dvec3 to_glm(const Kernel::Point_3& p) {
  return {p.x(), p.y(), p.z()};
}

// A long double is exactly the sum of two doubles.
Rational rational(double base, long double offset) {
  const auto high = static_cast<double>(offset);
  return Rational(base) + Rational(high) + Rational(static_cast<double>(offset - high));
}

Exact::Point_3 to_exact(const Kernel::Point_3& p) {
  return {Rational(p.x()), Rational(p.y()), Rational(p.z())};
}

Exact::Triangle_3 to_exact(const Kernel::Triangle_3& t) {
  return {to_exact(t[0]), to_exact(t[1]), to_exact(t[2])};
}

glm::dvec3 low_corner(const CGAL::Bbox_3& box) {
  return {box.xmin(), box.ymin(), box.zmin()};
}
glm::dvec3 high_corner(const CGAL::Bbox_3& box) {
  return {box.xmax(), box.ymax(), box.zmax()};
}

double squared_box_distance(const glm::dvec3& p, const CGAL::Bbox_3& box) {
  const glm::dvec3 out = glm::max(glm::max(low_corner(box) - p, p - high_corner(box)), glm::dvec3(0.0));
  return glm::dot(out, out);
}

// Whether the segment meets the box widened by `margin` (slab test of Kay & Kajiya).
bool enters(const glm::dvec3& from, const glm::dvec3& way, const CGAL::Bbox_3& box, double margin) {
  const glm::dvec3 low = low_corner(box) - margin, high = high_corner(box) + margin;
  double first = 0.0, last = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    if (way[axis] == 0.0) {
      if (from[axis] < low[axis] || from[axis] > high[axis]) return false;
      continue;
    }
    const double a = (low[axis] - from[axis]) / way[axis], b = (high[axis] - from[axis]) / way[axis];
    first = std::max(first, std::min(a, b));
    last = std::min(last, std::max(a, b));
  }
  return first <= last + kRoundingSlack;
}

// Traversal traits for CGAL's tree. The traversal descends into a box if opens(box), and calls
// found(triangle) at each leaf. Both functions may share state, so that an improving bound narrows the
// traversal.
template <typename Opens, typename Found>
class ExactVisit {
 public:
  using Priority = double;

  ExactVisit(const Opens& opens, const Found& found) : opens_(opens), found_(found) {}
  [[nodiscard]] bool go_further() const { return true; }
  void intersection(int /*query*/, const Primitive& primitive) const { found_(primitive.id()); }
  [[nodiscard]] bool do_intersect(int /*query*/, const ExactNode& node) const {
    return opens_(node.bbox()).first;
  }
  [[nodiscard]] std::pair<bool, Priority> do_intersect_with_priority(int /*query*/,
                                                                     const ExactNode& node) const {
    return opens_(node.bbox());
  }

 private:
  const Opens& opens_;
  const Found& found_;
};

enum class Crossing : std::uint8_t { no, yes, touches, through_start };

// Whether the segment from `start` to `end` crosses the triangle's interior, only touches it, or starts on
// it.
Crossing crossing(const Kernel::Point_3& start, const Kernel::Point_3& end, const Kernel::Triangle_3& t) {
  if (t.is_degenerate()) return Crossing::no;
  const CGAL::Orientation below = CGAL::orientation(t[0], t[1], t[2], start);
  const CGAL::Orientation above = CGAL::orientation(t[0], t[1], t[2], end);
  if (below == CGAL::COPLANAR) {
    if (t.has_on(start)) return Crossing::through_start;
    return above == CGAL::COPLANAR ? Crossing::touches : Crossing::no;
  }
  if (above == CGAL::COPLANAR) return Crossing::touches;
  if (below == above) return Crossing::no;
  bool left = false, right = false, on = false;
  for (int i = 0; i < 3; ++i) {
    const CGAL::Orientation side = CGAL::orientation(start, end, t[i], t[(i + 1) % 3]);
    left = left || side == CGAL::POSITIVE;
    right = right || side == CGAL::NEGATIVE;
    on = on || side == CGAL::COPLANAR;
  }
  if (left && right) return Crossing::no;
  return on ? Crossing::touches : Crossing::yes;
}

}  // namespace

struct ExactMesh::Data {
  ExactTriangles triangles;
  ExactTree tree;
  CGAL::Bbox_3 box;
  double size = 0.0;
  double furthest = 0.0;

  [[nodiscard]] std::uint32_t index(const Primitive::Id& id) const {
    return static_cast<std::uint32_t>(id - triangles.begin());
  }
};

ExactMesh::ExactMesh(const TriangleMesh& mesh) : data_(std::make_unique<Data>()) {
  const MeshBounds bounds = checked_bounds(mesh);
  data_->triangles.reserve(mesh.triangles.size());
  for (const TriangleIndices& t : mesh.triangles) {
    data_->triangles.emplace_back(to_cgal(mesh.vertices[t[0]]), to_cgal(mesh.vertices[t[1]]),
                                  to_cgal(mesh.vertices[t[2]]));
  }
  const glm::dvec3 furthest = glm::max(glm::abs(bounds.low), glm::abs(bounds.high));
  data_->furthest = std::max({furthest.x, furthest.y, furthest.z});
  data_->tree.do_not_accelerate_distance_queries();
  data_->tree.insert(data_->triangles.cbegin(), data_->triangles.cend());
  data_->tree.build();
  data_->box = data_->tree.bbox();
  data_->size = glm::length(high_corner(data_->box) - low_corner(data_->box));
}

ExactMesh::~ExactMesh() = default;

double ExactMesh::size() const {
  return data_->size;
}

double ExactMesh::furthest() const {
  return data_->furthest;
}

std::array<glm::dvec3, 3> ExactMesh::corners(std::uint32_t triangle) const {
  const Kernel::Triangle_3& t = data_->triangles[triangle];
  return {to_glm(t[0]), to_glm(t[1]), to_glm(t[2])};
}

void ExactMesh::near_point(const glm::dvec3& point, double radius, std::vector<std::uint32_t>& out) const {
  out.clear();
  const double reach = radius * radius * (1.0 + kRoundingSlack);
  const auto opens = [&](const CGAL::Bbox_3& box) {
    return std::pair(squared_box_distance(point, box) <= reach, 0.0);
  };
  const auto found = [&](const Primitive::Id& id) {
    if (opens(id->bbox()).first) out.push_back(data_->index(id));
  };
  ExactVisit visit(opens, found);
  data_->tree.traversal(0, visit);
}

void ExactMesh::near_segment(const glm::dvec3& from, const glm::dvec3& to, double radius,
                             std::vector<std::uint32_t>& out) const {
  out.clear();
  const glm::dvec3 way = to - from;
  const double margin = radius + kRoundingSlack * (radius + glm::length(way) + data_->size);
  const auto opens = [&](const CGAL::Bbox_3& box) { return std::pair(enters(from, way, box, margin), 0.0); };
  const auto found = [&](const Primitive::Id& id) {
    if (opens(id->bbox()).first) out.push_back(data_->index(id));
  };
  ExactVisit visit(opens, found);
  data_->tree.traversal(0, visit);
}

double ExactMesh::distance(const FinePoint& point, std::uint32_t triangle) const {
  const Exact::Point_3 p(rational(point.base.x, point.offset[0]), rational(point.base.y, point.offset[1]),
                         rational(point.base.z, point.offset[2]));
  return std::sqrt(CGAL::to_double(CGAL::squared_distance(p, to_exact(data_->triangles[triangle]))));
}

double ExactMesh::segment_distance(const glm::dvec3& from, const glm::dvec3& to,
                                   std::uint32_t triangle) const {
  if (crosses(from, to, triangle)) return 0.0;
  const Exact::Triangle_3 t = to_exact(data_->triangles[triangle]);
  const Exact::Point_3 a = to_exact(to_cgal(from)), b = to_exact(to_cgal(to));
  Rational least = std::min(CGAL::squared_distance(a, t), CGAL::squared_distance(b, t));
  for (int i = 0; i < 3 && a != b; ++i) {
    if (t[i] == t[(i + 1) % 3]) continue;  // zero length: the other two sides contain this point
    const Exact::Segment_3 side(t[i], t[(i + 1) % 3]);
    least = std::min(least, Rational(CGAL::squared_distance(Exact::Segment_3(a, b), side)));
  }
  return std::sqrt(CGAL::to_double(least));
}

bool ExactMesh::crosses(const glm::dvec3& from, const glm::dvec3& to, std::uint32_t triangle) const {
  const Kernel::Triangle_3& t = data_->triangles[triangle];
  if (from == to || t.is_degenerate()) return false;
  return CGAL::do_intersect(Kernel::Segment_3(to_cgal(from), to_cgal(to)), t);
}

// Searches in double. Candidates that tie within rounding are then compared exactly.
ExactMesh::Closest ExactMesh::closest(const glm::dvec3& point) const {
  const Kernel::Point_3 p = to_cgal(point);
  double least = std::numeric_limits<double>::infinity();
  const double slack = 1e-15 * (data_->furthest + glm::length(point));
  std::vector<std::pair<double, std::uint32_t>> candidates;
  const auto limit = [&] { return (least + slack) * (1.0 + kRoundingSlack) + slack; };
  const auto opens = [&](const CGAL::Bbox_3& box) {
    const double squared = squared_box_distance(point, box);
    return std::pair(std::sqrt(squared) <= limit(), -squared);  // the nearer box first
  };
  const auto found = [&](const Primitive::Id& id) {
    const double distance = std::sqrt(CGAL::squared_distance(p, *id));
    least = std::min(least, distance);
    if (distance > limit()) return;
    if (candidates.size() >= 2 * kMostEquallyNear) {
      std::nth_element(candidates.begin(), candidates.begin() + kMostEquallyNear, candidates.end());
      candidates.resize(kMostEquallyNear);
    }
    candidates.emplace_back(distance, data_->index(id));
  };
  ExactVisit visit(opens, found);
  data_->tree.traversal_with_priority(0, visit);

  std::sort(candidates.begin(), candidates.end());
  Closest best{0, std::numeric_limits<double>::infinity()};
  for (std::size_t i = 0; i < std::min(candidates.size(), kMostEquallyNear); ++i) {
    if (candidates[i].first > limit()) break;
    const double exact = distance({point, {}}, candidates[i].second);
    if (exact < best.distance) best = {candidates[i].second, exact};
  }
  return best;
}

bool ExactMesh::inside(const glm::dvec3& point) const {
  if (squared_box_distance(point, data_->box) > 0.0) return false;
  const Kernel::Point_3 start = to_cgal(point);
  // A segment that touches an edge or a corner is inconclusive, so another direction is tried. The directions
  // form a spiral on the sphere. None of them is parallel to an axis or another direction that is usual in
  // models.
  for (int ray = 0; ray < kMostRays; ++ray) {
    const double height = 1.0 - 2.0 * (ray + 0.5141592) / kMostRays, turn = 2.3999632 * ray + 0.7182818;
    const double across = std::sqrt(1.0 - height * height);
    const glm::dvec3 way =
        (2.0 * data_->size + 1e-300) * glm::dvec3(across * std::cos(turn), across * std::sin(turn), height);
    const Kernel::Point_3 end = to_cgal(point + way);
    const double margin = kRoundingSlack * data_->size;
    int crossings = 0;
    bool on_surface = false, unclear = false;
    const auto opens = [&](const CGAL::Bbox_3& box) {
      return std::pair(enters(point, way, box, margin), 0.0);
    };
    const auto found = [&](const Primitive::Id& id) {
      const Crossing how = crossing(start, end, *id);
      crossings += how == Crossing::yes ? 1 : 0;
      unclear = unclear || how == Crossing::touches;
      on_surface = on_surface || how == Crossing::through_start;
    };
    ExactVisit visit(opens, found);
    data_->tree.traversal(0, visit);
    if (on_surface) return false;
    if (!unclear) return crossings % 2 == 1;
  }
  return false;
}

std::size_t ExactMesh::memory_bytes() const {
  return sizeof(*this) + sizeof(Data) + data_->triangles.capacity() * sizeof(Kernel::Triangle_3) +
         data_->tree.size() * (sizeof(Primitive) + sizeof(ExactNode));
}

}  // namespace polygon
