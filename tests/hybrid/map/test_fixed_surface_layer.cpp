// SPDX-License-Identifier: GPL-3.0-or-later
// The cells of a triangle against a separating-axis test of each cell (Akenine-Möller 2001).
#include "hybrid/map/fixed_surface_layer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <random>

#include "tests/hybrid/fixtures/touch.h"

namespace {

using glm::dvec3;
using tests::between;

constexpr double kCell = 1e-3;  // m
constexpr double kRounding = 1e-7;

// Does the triangle touch the cube around `centre`? Three axes of the cube, the triangle's normal, and nine
// cross products of edges.
bool touches(const std::array<dvec3, 3>& t, const dvec3& centre, double half) {
  const std::array<dvec3, 3> v{t[0] - centre, t[1] - centre, t[2] - centre};
  const std::array<dvec3, 3> edges{v[1] - v[0], v[2] - v[1], v[0] - v[2]};
  const auto separates = [&](const dvec3& axis) {
    const double a = glm::dot(v[0], axis), b = glm::dot(v[1], axis), c = glm::dot(v[2], axis);
    const double reach = half * (std::fabs(axis.x) + std::fabs(axis.y) + std::fabs(axis.z));
    return std::min({a, b, c}) > reach || std::max({a, b, c}) < -reach;
  };
  for (int d = 0; d < 3; ++d) {
    dvec3 axis(0.0);
    axis[d] = 1.0;
    if (separates(axis)) return false;
    for (const dvec3& edge : edges) {
      if (separates(glm::cross(axis, edge))) return false;
    }
  }
  return !separates(glm::cross(edges[0], edges[1]));
}

class SurfaceCellsOfATriangle : public ::testing::TestWithParam<dvec3> {
 protected:
  // Each cell around the triangle is occupied if the triangle touches it. A cell that it misses by more than
  // rounding is free. `margin_m`: the cells are enlarged by it.
  void expect_exact(const std::array<dvec3, 3>& t, double margin_m) {
    const dvec3 origin = GetParam();
    hybrid::SurfaceCells cells(kCell, origin);
    cells.add_triangle(1, origin + t[0], origin + t[1], origin + t[2], margin_m);
    cells.seal();
    const dvec3 low = glm::min(t[0], glm::min(t[1], t[2])) - margin_m - 1.5 * kCell,
                high = glm::max(t[0], glm::max(t[1], t[2])) + margin_m + 1.5 * kCell;
    // Positions far from the world's origin are rounded.
    const double rounding = kRounding + 4e-16 * glm::length(origin) / kCell;
    hybrid::CellCoordinates c{};
    const auto cell = [](double x) { return static_cast<std::int32_t>(std::floor(x / kCell)); };
    for (c[2] = cell(low.z); c[2] <= cell(high.z); ++c[2]) {
      for (c[1] = cell(low.y); c[1] <= cell(high.y); ++c[1]) {
        for (c[0] = cell(low.x); c[0] <= cell(high.x); ++c[0]) {
          const dvec3 centre = kCell * (dvec3(c[0], c[1], c[2]) + 0.5);
          const double half = 0.5 * kCell + margin_m;
          const bool said = cells.occupied(c);
          if (touches(t, centre, half - rounding * kCell)) {
            ASSERT_TRUE(said) << c[0] << ' ' << c[1] << ' ' << c[2];
          } else if (!touches(t, centre, half + rounding * kCell)) {
            ASSERT_FALSE(said) << c[0] << ' ' << c[1] << ' ' << c[2];
          }
        }
      }
    }
  }
};

TEST_P(SurfaceCellsOfATriangle, AreThoseThatItTouches) {
  std::mt19937 random(7);
  for (int n = 0; n < 600; ++n) {
    const double size = kCell * std::exp(between(random, std::log(0.02), std::log(25.0)));
    const auto place = [&] {
      return dvec3(between(random, -1, 1), between(random, -1, 1), between(random, -1, 1));
    };
    const dvec3 middle = 20.0 * kCell * place();
    std::array<dvec3, 3> t{middle + size * place(), middle + size * place(), middle + size * place()};
    switch (n % 6) {
      case 1:  // a sliver
        t[2] = glm::mix(t[0], t[1], between(random, 0, 1)) + 1e-6 * size * place();
        break;
      case 2:  // in a plane of the axes
        t[1][n % 3] = t[2][n % 3] = t[0][n % 3];
        break;
      case 3:  // in the face between two cells
        for (dvec3& p : t) p[n % 3] = kCell * std::round(t[0][n % 3] / kCell);
        break;
      case 4:  // nearly so
        for (dvec3& p : t)
          p[n % 3] = kCell * (std::round(t[0][n % 3] / kCell) + 1e-13 * between(random, -1, 1));
        break;
      case 5:  // a line, or a point
        t[2] = n % 4 == 1 ? t[1] : t[0];
        if (n % 12 == 5) t[1] = t[0];
        break;
      default:
        break;
    }
    SCOPED_TRACE(n);
    ASSERT_NO_FATAL_FAILURE(expect_exact(t, n % 5 == 0 ? between(random, 0, 2) * kCell : 0.0));
  }
}
INSTANTIATE_TEST_SUITE_P(AtAndFarFromTheOrigin, SurfaceCellsOfATriangle,
                         ::testing::Values(dvec3(0.0), dvec3(1e3, -2e3, 5e2)));

}  // namespace
