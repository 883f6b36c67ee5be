// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/repair/least_area.h"

#include <cstddef>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "polygon/mesh/triangle.h"

namespace polygon {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kLengthCost = 0.01;  // fraction of an inner edge's squared length that is added to the area

}  // namespace

std::vector<TriangleIndices> least_area_triangles(
    std::span<const std::uint32_t> loop, std::span<const glm::dvec3> points,
    const std::function<bool(std::uint32_t, std::uint32_t)>& forbidden) {
  const std::size_t n = loop.size();
  if (n < 3) return {};
  const auto at = [&](std::size_t i) { return points[loop[i]]; };
  const auto area = [&](std::size_t i, std::size_t j, std::size_t k) {
    if (is_degenerate(at(i), at(j), at(k))) return kNever;
    return 0.5 * glm::length(glm::cross(at(j) - at(i), at(k) - at(i)));
  };
  // cost[first * n + last] is the least cost of the part of the loop from `first` to `last`, by dynamic
  // programming.
  std::vector<double> cost(n * n, 0.0);
  std::vector<std::size_t> apex(n * n, 0);
  for (std::size_t span = 2; span < n; ++span) {
    for (std::size_t i = 0; i + span < n; ++i) {
      const std::size_t k = i + span;
      const bool inner = span + 1 < n;
      double& best = cost[i * n + k];
      best = kNever;
      if (inner && (loop[i] == loop[k] || forbidden(loop[i], loop[k]))) continue;
      for (std::size_t j = i + 1; j < k; ++j) {
        const double parts = cost[i * n + j] + cost[j * n + k];
        if (!(parts < best)) continue;
        const double whole = parts + area(i, j, k);
        if (whole < best) {
          best = whole;
          apex[i * n + k] = j;
        }
      }
      if (inner) best += kLengthCost * glm::dot(at(k) - at(i), at(k) - at(i));
    }
  }
  std::vector<TriangleIndices> triangles;
  if (!(cost[n - 1] < kNever)) return triangles;
  std::vector<std::pair<std::size_t, std::size_t>> open{{0, n - 1}};
  while (!open.empty()) {
    const auto [i, k] = open.back();
    open.pop_back();
    if (k - i < 2) continue;
    const std::size_t j = apex[i * n + k];
    triangles.push_back({loop[i], loop[j], loop[k]});
    open.emplace_back(i, j);
    open.emplace_back(j, k);
  }
  return triangles;
}

}  // namespace polygon
