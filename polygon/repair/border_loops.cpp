// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/repair/border_loops.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>
#include <tuple>
#include <utility>

#include "polygon/mesh/disjoint_sets.h"

namespace polygon {
namespace {

// The sides that meet in a point are compared in pairs, so the time grows with the square of their number. A
// point with more sides than this ends the loops that come to it.
constexpr std::size_t kMostSidesAtPoint = 256;
constexpr double kTurnRounding = 1e-9;  // rad; two edges with a smaller angle have one direction

// A border edge, in the direction opposite to that of its triangle's side.
struct BorderSide {
  std::array<std::uint32_t, 2> ends{};  // points
  std::uint32_t triangle = 0;
  std::array<std::uint32_t, 2> next{kNoIndex, kNoIndex};  // [end] the side that follows there
};

class BorderWalk {
 public:
  BorderWalk(std::span<const glm::dvec3> points, std::span<const TriangleIndices> triangles,
             const EdgeTable& edges)
      : points_(points), triangles_(triangles) {
    edges.for_each([&](const EdgeTable::Edge& edge) {
      if (edge.uses.size() != 1) return;
      const bool forward = edge.uses[0].forward();
      BorderSide side;
      side.ends = {forward ? edge.high : edge.low, forward ? edge.low : edge.high};
      side.triangle = edge.uses[0].triangle();
      sides_.push_back(side);
    });
    connect();
  }

  std::vector<BorderLoop> loops() {
    std::vector<BorderLoop> loops;
    std::vector<bool> walked(sides_.size(), false);
    for (const bool closed : {false, true}) {
      for (std::uint32_t first = 0; first < sides_.size(); ++first) {
        if (walked[first]) continue;
        // An open loop is walked from one of its ends.
        const auto& next = sides_[first].next;
        if (!closed && next[0] != kNoIndex && next[1] != kNoIndex) continue;
        loops.push_back(walk(first, next[0] == kNoIndex ? 0 : 1, closed, walked));
      }
    }
    std::sort(loops.begin(), loops.end(), [](const BorderLoop& a, const BorderLoop& b) {
      return std::pair(a.points[0], a.triangles[0]) < std::pair(b.points[0], b.triangles[0]);
    });
    return loops;
  }

 private:
  // Walks from side to side, from `first` on. A closed loop begins in the direction of the first side.
  BorderLoop walk(std::uint32_t first, std::size_t from_end, bool closed, std::vector<bool>& walked) const {
    BorderLoop loop;
    loop.closed = closed;
    loop.lower = loop.upper = points_[sides_[first].ends[0]];
    std::size_t from = closed ? 0 : from_end;
    for (std::uint32_t at = first; at != kNoIndex && !walked[at];) {
      walked[at] = true;
      const BorderSide& side = sides_[at];
      loop.points.push_back(side.ends[from]);
      loop.triangles.push_back(side.triangle);
      for (const std::uint32_t end : side.ends) {
        loop.lower = glm::min(loop.lower, points_[end]);
        loop.upper = glm::max(loop.upper, points_[end]);
      }
      const std::uint32_t to = side.ends[1 - from], next = side.next[1 - from];
      if (next == kNoIndex) {
        loop.points.push_back(to);
        break;
      }
      from = sides_[next].ends[0] == to ? 0 : 1;
      at = next;
    }
    return loop;
  }

  // Items grouped by point. Those of point p begin at start[p], in ascending order.
  struct ByPoint {
    std::vector<std::size_t> start;
    std::vector<std::uint32_t> items;
    [[nodiscard]] std::span<const std::uint32_t> at(std::uint32_t point) const {
      return {items.data() + start[point], start[point + 1] - start[point]};
    }
  };

  // Groups items by point. `visit_all(use)` has to call use(point, item) for each pair, and the same pairs at
  // every call.
  template <typename VisitAll>
  [[nodiscard]] ByPoint by_point(VisitAll&& visit_all) const {
    ByPoint result;
    result.start.assign(points_.size() + 1, 0);
    visit_all([&](std::uint32_t point, std::uint32_t) { ++result.start[point + 1]; });
    for (std::size_t p = 0; p < points_.size(); ++p) result.start[p + 1] += result.start[p];
    result.items.resize(result.start.back());
    std::vector<std::size_t> next(result.start.begin(), result.start.end() - 1);
    visit_all([&](std::uint32_t point, std::uint32_t item) { result.items[next[point]++] = item; });
    return result;
  }

  void connect() {
    const ByPoint sides = by_point([&](auto&& use) {
      for (std::uint32_t s = 0; s < sides_.size(); ++s) {
        for (const std::uint32_t end : sides_[s].ends) use(end, s);
      }
    });
    const auto branches = [&](std::uint32_t point) {
      const std::size_t count = sides.at(point).size();
      return count > 2 && count <= kMostSidesAtPoint;
    };
    const ByPoint triangles = by_point([&](auto&& use) {
      for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
        if (has_repeated_corner(triangles_[t])) continue;
        for (const std::uint32_t corner : triangles_[t]) {
          if (branches(corner)) use(corner, t);
        }
      }
    });
    for (std::uint32_t p = 0; p < points_.size(); ++p) {
      const std::span<const std::uint32_t> here = sides.at(p);
      if (here.size() == 2) join(p, here[0], here[1]);
      if (branches(p)) join_across_gaps(p, here, triangles.at(p));
    }
  }

  void join(std::uint32_t point, std::uint32_t a, std::uint32_t b) {
    sides_[a].next[sides_[a].ends[0] == point ? 0 : 1] = b;
    sides_[b].next[sides_[b].ends[0] == point ? 0 : 1] = a;
  }

  // Joins the sides at a point in pairs, best pairs first. Three criteria rank the pairs, in this order:
  //   1. One side comes to the point and the other leaves it. This fails where a triangle is turned over.
  //   2. The two sides bound different fans of triangles. This fails where there is only one fan.
  //   3. The gap angle is small.
  // The gap angle is measured from each of the two sides, away from the triangle of that side. The smaller
  // value counts: at a crease a triangle can lie across the plane of the gap, which makes the angle from its
  // side unreliable.
  void join_across_gaps(std::uint32_t point, std::span<const std::uint32_t> here,
                        std::span<const std::uint32_t> triangles_here) {
    struct Gap {
      bool turned = false, same_fan = false;
      double angle = 0.0;
      std::uint32_t a = 0, b = 0;
      [[nodiscard]] auto order() const { return std::tuple(turned, same_fan, angle); }
    };
    const std::vector<std::uint32_t> fans = fans_of(point, here, triangles_here);
    std::vector<Gap> gaps;
    for (std::size_t i = 0; i < here.size(); ++i) {
      for (std::size_t k = i + 1; k < here.size(); ++k) {
        const std::uint32_t a = here[i], b = here[k];
        const bool turned = (sides_[a].ends[0] == point) == (sides_[b].ends[0] == point);
        gaps.push_back({turned, fans[i] == fans[k], std::min(turn(point, a, b), turn(point, b, a)), a, b});
      }
    }
    std::stable_sort(gaps.begin(), gaps.end(),
                     [](const Gap& a, const Gap& b) { return a.order() < b.order(); });
    const auto is_free = [&](std::uint32_t side) {
      return sides_[side].next[sides_[side].ends[0] == point ? 0 : 1] == kNoIndex;
    };
    for (const Gap& gap : gaps) {
      if (is_free(gap.a) && is_free(gap.b)) join(point, gap.a, gap.b);
    }
  }

  // [i] the fan of the triangle of side here[i]. A fan is a set of triangles around the point that are
  // connected through shared edges.
  [[nodiscard]] std::vector<std::uint32_t> fans_of(std::uint32_t point, std::span<const std::uint32_t> here,
                                                   std::span<const std::uint32_t> triangles_here) const {
    std::vector<std::pair<std::uint32_t, std::uint32_t>>
        spokes;  // other end of an edge from the point; index into triangles_here
    for (std::uint32_t i = 0; i < triangles_here.size(); ++i) {
      for (const std::uint32_t corner : triangles_[triangles_here[i]]) {
        if (corner != point) spokes.emplace_back(corner, i);
      }
    }
    std::sort(spokes.begin(), spokes.end());
    DisjointSets fans(triangles_here.size());
    for (std::size_t i = 1; i < spokes.size(); ++i) {
      if (spokes[i].first == spokes[i - 1].first) fans.unite(spokes[i].second, spokes[i - 1].second);
    }
    std::vector<std::uint32_t> fan_of_side;
    for (const std::uint32_t side : here) {
      const auto at = std::lower_bound(triangles_here.begin(), triangles_here.end(), sides_[side].triangle);
      fan_of_side.push_back(fans.find(static_cast<std::uint32_t>(at - triangles_here.begin())));
    }
    return fan_of_side;
  }

  // The angle from one side to another about their common point (rad), measured away from the triangle of the
  // first side.
  [[nodiscard]] double turn(std::uint32_t point, std::uint32_t from, std::uint32_t to) const {
    const auto direction = [&](std::uint32_t side) {
      const auto& ends = sides_[side].ends;
      return points_[ends[0] == point ? ends[1] : ends[0]] - points_[point];
    };
    const glm::dvec3 u = direction(from), v = direction(to);
    glm::dvec3 third = u;
    for (const std::uint32_t corner : triangles_[sides_[from].triangle]) {
      if (corner != sides_[from].ends[0] && corner != sides_[from].ends[1])
        third = points_[corner] - points_[point];
    }
    const glm::dvec3 towards = glm::cross(u, third);
    const double length = glm::length(towards);
    const double side = length > 0.0 ? glm::dot(towards, glm::cross(u, v)) / length : 0.0;
    const double angle = std::atan2(side, glm::dot(u, v));
    return angle <= kTurnRounding ? std::abs(std::min(angle, 0.0)) : 2.0 * std::numbers::pi - angle;
  }

  std::span<const glm::dvec3> points_;
  std::span<const TriangleIndices> triangles_;
  std::vector<BorderSide> sides_;
};

}  // namespace

std::vector<BorderLoop> border_loops(std::span<const glm::dvec3> points,
                                     std::span<const TriangleIndices> triangles, const EdgeTable& edges) {
  return BorderWalk(points, triangles, edges).loops();
}

}  // namespace polygon
