// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/repair/self_intersections.h"

#include <CGAL/Box_intersection_d/Box_with_info_d.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/box_intersection_d.h>

#include <algorithm>
#include <array>
#include <glm/common.hpp>
#include <utility>
#include <vector>

namespace polygon {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using TriangleBox = CGAL::Box_intersection_d::Box_with_info_d<double, 3, std::uint32_t>;

class PairTest {
 public:
  PairTest(std::span<const glm::dvec3> points, std::span<const TriangleIndices> triangles)
      : points_(points), triangles_(triangles) {}

  [[nodiscard]] bool intersect(std::uint32_t first, std::uint32_t second) const {
    // Moves shared corners to the front of both triangles, in the same order.
    TriangleIndices a = triangles_[first];
    TriangleIndices b = triangles_[second];
    std::size_t shared = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto found = std::find(b.begin() + static_cast<std::ptrdiff_t>(shared), b.end(), a[i]);
      if (found == b.end()) continue;
      std::swap(a[shared], a[i]);
      std::iter_swap(b.begin() + static_cast<std::ptrdiff_t>(shared), found);
      ++shared;
    }
    switch (shared) {
      case 0:
        return CGAL::do_intersect(triangle(a), triangle(b));
      case 1:
        return CGAL::do_intersect(triangle(a), Kernel::Segment_3(point(b[1]), point(b[2]))) ||
               CGAL::do_intersect(triangle(b), Kernel::Segment_3(point(a[1]), point(a[2])));
      case 2:
        return CGAL::coplanar(point(a[0]), point(a[1]), point(a[2]), point(b[2])) &&
               CGAL::coplanar_orientation(point(a[0]), point(a[1]), point(a[2]), point(b[2])) ==
                   CGAL::POSITIVE;
      default:
        return false;
    }
  }

 private:
  [[nodiscard]] Point point(std::uint32_t i) const { return {points_[i].x, points_[i].y, points_[i].z}; }
  [[nodiscard]] Kernel::Triangle_3 triangle(const TriangleIndices& t) const {
    return {point(t[0]), point(t[1]), point(t[2])};
  }

  std::span<const glm::dvec3> points_;
  std::span<const TriangleIndices> triangles_;
};

std::vector<TriangleBox> boxes_of(std::span<const glm::dvec3> points,
                                  std::span<const TriangleIndices> triangles, std::uint32_t first) {
  std::vector<TriangleBox> boxes;
  boxes.reserve(triangles.size() - first);
  for (std::uint32_t i = first; i < triangles.size(); ++i) {
    CGAL::Bbox_3 bounds;
    for (const std::uint32_t corner : triangles[i]) {
      const glm::dvec3& p = points[corner];
      bounds += CGAL::Bbox_3(p.x, p.y, p.z, p.x, p.y, p.z);
    }
    boxes.emplace_back(bounds, i);
  }
  return boxes;
}

std::size_t most_tests(std::size_t triangles) {
  return 1'000'000 + kMaxTestsPerTriangle * triangles;
}

struct EnoughTests {};  // thrown through CGAL's search, which offers no other early exit

}  // namespace

SelfIntersections find_self_intersections(std::span<const glm::dvec3> points,
                                          std::span<const TriangleIndices> triangles) {
  std::vector<TriangleBox> boxes = boxes_of(points, triangles, 0);
  const PairTest test(points, triangles);
  SelfIntersections result;
  std::size_t tests = 0;
  const auto middle = [&](std::uint32_t i) {
    const TriangleIndices& t = triangles[i];
    return (points[t[0]] + points[t[1]] + points[t[2]]) / 3.0;
  };
  try {
    CGAL::box_self_intersection_d(
        boxes.begin(), boxes.end(), [&](const TriangleBox& x, const TriangleBox& y) {
          if (++tests > most_tests(triangles.size())) throw EnoughTests{};
          const auto [first, second] = std::minmax({x.info(), y.info()});
          if (!test.intersect(first, second)) return;
          // Keeps the pair of lowest indices, so that the result does not depend on the order of CGAL's
          // search.
          if (result.pairs == 0) result.lower = result.upper = middle(first);
          if (result.pairs++ == 0 || std::pair(first, second) < std::pair(result.first, result.second)) {
            result.first = first;
            result.second = second;
          }
          result.lower = glm::min(result.lower, glm::min(middle(first), middle(second)));
          result.upper = glm::max(result.upper, glm::max(middle(first), middle(second)));
        });
  } catch (const EnoughTests&) {
    result.complete = false;
  }
  return result;
}

std::vector<std::uint32_t> new_triangles_that_cut(std::span<const glm::dvec3> points,
                                                  std::span<const TriangleIndices> triangles,
                                                  std::uint32_t first_new) {
  std::vector<TriangleBox> added = boxes_of(points, triangles, first_new);
  std::vector<TriangleBox> all = boxes_of(points, triangles, 0);
  const PairTest test(points, triangles);
  std::vector<bool> cuts(triangles.size(), false);
  std::size_t tests = 0;
  try {
    CGAL::box_intersection_d(added.begin(), added.end(), all.begin(), all.end(),
                             [&](const TriangleBox& x, const TriangleBox& y) {
                               if (++tests > most_tests(triangles.size())) throw EnoughTests{};
                               if (y.info() >= x.info() || cuts[x.info()]) return;
                               cuts[x.info()] = test.intersect(y.info(), x.info());
                             });
  } catch (const EnoughTests&) {
    cuts.assign(cuts.size(), true);
  }
  std::vector<std::uint32_t> result;
  for (std::uint32_t i = first_new; i < triangles.size(); ++i) {
    if (cuts[i]) result.push_back(i);
  }
  return result;
}

}  // namespace polygon
