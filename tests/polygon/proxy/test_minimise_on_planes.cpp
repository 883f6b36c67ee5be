// SPDX-License-Identifier: GPL-3.0-or-later
// The constrained minimum against brute force. The reference is the cheapest feasible point over all subsets
// of at most three planes, because in three dimensions no more than three independent planes are active.
#include "polygon/proxy/minimise_on_planes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <optional>
#include <random>
#include <vector>

namespace {

using glm::dmat3;
using glm::dvec3;
using polygon::ContactPlane;
using polygon::minimise_on_planes;
using polygon::PlaneMinimum;

constexpr double kTolerance = 1e-15;  // of the planes (m), 1e-12 times the radius of a tool of 1 mm

dvec3 random_vector(std::mt19937_64& random, double size) {
  std::normal_distribution<double> normal(0.0, size);
  const double x = normal(random), y = normal(random), z = normal(random);
  return {x, y, z};
}

dvec3 random_direction(std::mt19937_64& random) {
  for (;;) {
    const dvec3 v = random_vector(random, 1.0);
    if (glm::length(v) > 1e-3) return glm::normalize(v);
  }
}

// Symmetric, positive definite; eigenvalues from 1 to `spread`.
dmat3 random_metric(std::mt19937_64& random, double spread) {
  const dvec3 a = random_direction(random);
  const dvec3 b = glm::normalize(glm::cross(a, random_direction(random)));
  const dvec3 c = glm::cross(a, b);
  std::uniform_real_distribution<double> power(0.0, 1.0);
  dmat3 metric(0.0);
  for (const dvec3& axis : {a, b, c})
    metric += std::pow(spread, power(random)) * glm::outerProduct(axis, axis);
  return metric;
}

double cost(const dvec3& q, const dvec3& target, const dmat3& metric) {
  return glm::dot(q - target, metric * (q - target));
}

double worst_depth(const dvec3& q, const std::vector<ContactPlane>& planes) {
  double worst = 0.0;
  for (const ContactPlane& p : planes) worst = std::max(worst, p.offset - glm::dot(p.normal, q));
  return worst;
}

// The minimum on the intersection of a subset's planes, by elimination in long double. Empty if the planes
// are dependent.
std::optional<dvec3> on_subset(const dvec3& target, const dmat3& metric,
                               const std::vector<ContactPlane>& planes,
                               const std::vector<std::size_t>& subset) {
  // | A  -Nᵀ | | q − t |   |      0     |
  // | N   0  | |   λ   | = | o − N t    |
  const std::size_t n = 3 + subset.size();
  std::vector<std::vector<long double>> m(n, std::vector<long double>(n + 1, 0.0L));
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) m[i][j] = metric[static_cast<int>(j)][static_cast<int>(i)];
  }
  for (std::size_t s = 0; s < subset.size(); ++s) {
    const ContactPlane& p = planes[subset[s]];
    m[3 + s][n] = p.offset;
    for (std::size_t i = 0; i < 3; ++i) {
      const long double c = p.normal[static_cast<int>(i)];
      m[3 + s][i] = c;
      m[i][3 + s] = -c;
      m[3 + s][n] -= c * target[static_cast<int>(i)];
    }
  }
  for (std::size_t column = 0; column < n; ++column) {
    std::size_t pivot = column;
    for (std::size_t row = column; row < n; ++row) {
      if (std::fabs(m[row][column]) > std::fabs(m[pivot][column])) pivot = row;
    }
    if (std::fabs(m[pivot][column]) < 1e-13L) return std::nullopt;
    std::swap(m[pivot], m[column]);
    for (std::size_t row = 0; row < n; ++row) {
      if (row == column) continue;
      const long double f = m[row][column] / m[column][column];
      for (std::size_t k = column; k <= n; ++k) m[row][k] -= f * m[column][k];
    }
  }
  dvec3 q = target;
  for (std::size_t i = 0; i < 3; ++i) q[static_cast<int>(i)] += static_cast<double>(m[i][n] / m[i][i]);
  return q;
}

// The cheapest of the subsets' minima that violate no plane by more than `allowed`. Empty if there is none.
std::optional<dvec3> brute_force(const dvec3& target, const dmat3& metric,
                                 const std::vector<ContactPlane>& planes, double allowed) {
  std::optional<dvec3> best;
  const auto look = [&](const std::vector<std::size_t>& subset) {
    const auto q = on_subset(target, metric, planes, subset);
    if (!q || worst_depth(*q, planes) > allowed) return;
    if (!best || cost(*q, target, metric) < cost(*best, target, metric)) best = q;
  };
  look({});
  for (std::size_t i = 0; i < planes.size(); ++i) {
    look({i});
    for (std::size_t j = i + 1; j < planes.size(); ++j) {
      look({i, j});
      for (std::size_t k = j + 1; k < planes.size(); ++k) look({i, j, k});
    }
  }
  return best;
}

// Expects a feasible point on its active planes, with multipliers of at least 0. The gradient must be the sum
// of the normals, weighted by the multipliers.
void expect_first_order(const PlaneMinimum& found, const dvec3& target, const dmat3& metric,
                        const std::vector<ContactPlane>& planes, double size) {
  ASSERT_LE(found.active_count, 3U);
  EXPECT_LE(worst_depth(found.point, planes), 1e-12 * size + kTolerance);
  dvec3 gradient = metric * (found.point - target);
  const double scale = glm::length(gradient);
  for (std::uint32_t i = 0; i < found.active_count; ++i) {
    const ContactPlane& p = planes[found.active[i]];
    EXPECT_GE(found.multiplier[i], 0.0);
    EXPECT_NEAR(glm::dot(p.normal, found.point), p.offset, 1e-9 * size);
    gradient -= found.multiplier[i] * p.normal;
  }
  EXPECT_LE(glm::length(gradient), 1e-7 * scale + 1e-12 * size);
}

class MinimiseOnPlanes : public ::testing::Test {
 protected:
  std::mt19937_64 random{20240607};

  // Planes with a common feasible point, like those around a proxy.
  std::vector<ContactPlane> planes_around(const dvec3& inside, int count, double size) {
    std::uniform_real_distribution<double> slack(0.0, size);
    std::vector<ContactPlane> planes;
    for (int i = 0; i < count; ++i) {
      const dvec3 n = random_direction(random);
      planes.push_back({n, glm::dot(n, inside) - slack(random), 0, static_cast<std::uint32_t>(i)});
    }
    return planes;
  }

  void expect_as_brute_force(const dvec3& target, const dmat3& metric,
                             const std::vector<ContactPlane>& planes, double size, double close = 1e-9) {
    const PlaneMinimum found = minimise_on_planes(target, metric, planes, kTolerance);
    const auto reference = brute_force(target, metric, planes, 1e-11 * size);
    ASSERT_TRUE(reference.has_value());
    ASSERT_TRUE(found.feasible);
    EXPECT_LE(glm::length(found.point - *reference), close * size);
    expect_first_order(found, target, metric, planes, size);
  }
};

TEST_F(MinimiseOnPlanes, StaysAtItsTargetWithoutPlanesOrInFreeSpace) {
  const dvec3 target(1.0, 2.0, 3.0);
  EXPECT_EQ(minimise_on_planes(target, dmat3(1.0), {}, kTolerance).point, target);
  const std::vector<ContactPlane> below{{{0.0, 0.0, 1.0}, 2.0, 0, 0}};
  const PlaneMinimum free = minimise_on_planes(target, dmat3(5.0), below, kTolerance);
  EXPECT_EQ(free.point, target);
  EXPECT_EQ(free.active_count, 0U);
  EXPECT_TRUE(free.feasible);
}

TEST_F(MinimiseOnPlanes, OnOnePlaneGoesStraightInAnIsotropicMetricAndObliquelyInAnother) {
  const std::vector<ContactPlane> floor{{{0.0, 0.0, 1.0}, 0.0, 7, 9}};
  const PlaneMinimum straight = minimise_on_planes({0.3, -0.2, -0.5}, dmat3(1000.0), floor, kTolerance);
  EXPECT_LE(glm::length(straight.point - dvec3(0.3, -0.2, 0.0)), 1e-15);
  ASSERT_EQ(straight.active_count, 1U);
  EXPECT_NEAR(straight.multiplier[0], 500.0, 1e-9);

  dmat3 metric(1.0);  // x and z are coupled, so the minimum moves sideways: q = t + λ A⁻¹ n
  metric[0][2] = metric[2][0] = 0.5;
  const PlaneMinimum oblique = minimise_on_planes({0.0, 0.0, -1.0}, metric, floor, kTolerance);
  EXPECT_LE(glm::length(oblique.point - dvec3(-0.5, 0.0, 0.0)), 1e-12);
}

TEST_F(MinimiseOnPlanes, IsWhatBruteForceFinds) {
  std::uniform_int_distribution<int> count(1, 14);
  for (int n = 0; n < 3000; ++n) {
    const double size = std::pow(10.0, -4 + n % 5);
    const dvec3 inside = random_vector(random, size);
    const auto planes = planes_around(inside, count(random), size);
    const dvec3 target = inside + random_vector(random, 3.0 * size);
    const dmat3 metric = n % 3 == 0 ? dmat3(1000.0) : random_metric(random, n % 3 == 1 ? 10.0 : 1e3);
    SCOPED_TRACE(n);
    expect_as_brute_force(target, metric, planes, size, n % 3 == 2 ? 1e-7 : 1e-9);
    if (HasFailure()) return;
  }
}

TEST_F(MinimiseOnPlanes, PlanesThroughTheProxyItselfHoldItAsBruteForceSays) {
  // In contact every plane passes through the proxy. This is the most degenerate case, and the usual one.
  for (int n = 0; n < 2000; ++n) {
    const dvec3 proxy = random_vector(random, 1e-2);
    std::vector<ContactPlane> planes;
    for (int i = 0; i < 3 + n % 8; ++i) {
      // All normals lie in one half-space, so that a free direction exists.
      dvec3 normal = random_direction(random);
      normal.z = std::fabs(normal.z) + 0.01;
      normal = glm::normalize(normal);
      planes.push_back({normal, glm::dot(normal, proxy), 0, static_cast<std::uint32_t>(i)});
    }
    SCOPED_TRACE(n);
    expect_as_brute_force(proxy + random_vector(random, 1e-2), dmat3(1.0), planes, 1e-2, 1e-7);
    if (HasFailure()) return;
  }
}

TEST_F(MinimiseOnPlanes, DuplicatePlanesChangeNothing) {
  for (int n = 0; n < 500; ++n) {
    const dvec3 inside = random_vector(random, 1.0);
    auto planes = planes_around(inside, 6, 1.0);
    const dvec3 target = inside + random_vector(random, 3.0);
    const PlaneMinimum once = minimise_on_planes(target, dmat3(1.0), planes, kTolerance);
    const std::size_t count = planes.size();
    for (std::size_t i = 0; i < 3 * count; ++i) planes.push_back(planes[i % count]);
    const PlaneMinimum often = minimise_on_planes(target, dmat3(1.0), planes, kTolerance);
    ASSERT_TRUE(often.feasible);
    EXPECT_LE(glm::length(once.point - often.point), 1e-12);
  }
}

TEST_F(MinimiseOnPlanes, OfParallelPlanesTheOuterOneHolds) {
  const std::vector<ContactPlane> floors{
      {{0, 0, 1}, 0.1, 0, 0}, {{0, 0, 1}, 0.3, 0, 1}, {{0, 0, 1}, 0.2, 0, 2}};
  const PlaneMinimum found = minimise_on_planes({1.0, 1.0, -1.0}, dmat3(1.0), floors, kTolerance);
  ASSERT_TRUE(found.feasible);
  EXPECT_LE(glm::length(found.point - dvec3(1.0, 1.0, 0.3)), 1e-15);
}

// The foot of a ball that slides over a flat mesh comes arbitrarily near to every edge. Just before the edge,
// the planes of the two triangles differ by an arbitrarily small angle.
TEST_F(MinimiseOnPlanes, PlanesThatAreNearlyParallelAreNoDeadEnd) {
  for (int n = 0; n < 4000; ++n) {
    const double angle = std::pow(10.0, -17.0 + 0.004 * n);  // 1e-17 to 0.1
    const dvec3 proxy = random_vector(random, 1e-2);
    const dvec3 normal = random_direction(random);
    const dvec3 across = glm::normalize(glm::cross(normal, random_direction(random)));
    const std::vector<ContactPlane> planes{{normal, glm::dot(normal, proxy), 0, 0},
                                           {glm::normalize(normal + angle * across),
                                            glm::dot(glm::normalize(normal + angle * across), proxy), 0, 1},
                                           {glm::normalize(normal - angle * across),
                                            glm::dot(glm::normalize(normal - angle * across), proxy), 0, 2}};
    // From the proxy, the target lies within the cone of the inward normals. So the proxy is the minimum.
    std::uniform_real_distribution<double> share(-1.0, 1.0);
    const dvec3 target = proxy - 3e-3 * normal + 3e-3 * share(random) * angle * across;
    const PlaneMinimum found = minimise_on_planes(target, dmat3(1000.0), planes, 1e-15);
    ASSERT_TRUE(found.feasible) << "angle " << angle;
    // Despite rounding at such an angle, the point satisfies the planes to a nanometre.
    EXPECT_LE(worst_depth(found.point, planes), 1e-9) << "angle " << angle;
    EXPECT_LE(glm::length(found.point - proxy), 3e-3 * angle + 1e-9) << "angle " << angle;
  }
}

TEST_F(MinimiseOnPlanes, SaysThatOppositePlanesLeaveNoRoom) {
  const std::vector<ContactPlane> gap{{{0, 0, 1}, 0.1, 0, 0},
                                      {{0, 0, -1}, 0.1, 0, 1}};  // z >= 0.1 and z <= -0.1
  EXPECT_FALSE(minimise_on_planes({0, 0, 0}, dmat3(1.0), gap, kTolerance).feasible);
  EXPECT_FALSE(minimise_on_planes({5, 0, -3}, dmat3(1.0), gap, kTolerance).feasible);
  // Four planes without a common feasible point, although any three have one.
  const double s = 1.0 / std::sqrt(3.0);
  const std::vector<ContactPlane> tetrahedron{
      {{s, s, s}, 1, 0, 0}, {{s, -s, -s}, 1, 0, 1}, {{-s, s, -s}, 1, 0, 2}, {{-s, -s, s}, 1, 0, 3}};
  EXPECT_FALSE(minimise_on_planes({0.1, 0.2, -0.1}, dmat3(1.0), tetrahedron, kTolerance).feasible);
}

TEST_F(MinimiseOnPlanes, AGapOfZeroWidthHasRoomForItsPoint) {
  const std::vector<ContactPlane> slit{{{0, 0, 1}, 0.25, 0, 0}, {{0, 0, -1}, -0.25, 0, 1}};
  const PlaneMinimum found = minimise_on_planes({1.0, 2.0, -1.0}, dmat3(1.0), slit, kTolerance);
  ASSERT_TRUE(found.feasible);
  EXPECT_LE(glm::length(found.point - dvec3(1.0, 2.0, 0.25)), 1e-15);
}

TEST_F(MinimiseOnPlanes, AgreesWithBruteForceOnWhetherThereIsRoom) {
  int without = 0;
  std::uniform_real_distribution<double> offset(-1.0, 0.6);
  for (int n = 0; n < 3000; ++n) {
    std::vector<ContactPlane> planes;
    planes.reserve(7);
    for (int i = 0; i < 7; ++i)
      planes.push_back({random_direction(random), offset(random), 0, static_cast<std::uint32_t>(i)});
    const dvec3 target = random_vector(random, 1.0);
    const bool strict = brute_force(target, dmat3(1.0), planes, 1e-12).has_value();
    if (strict != brute_force(target, dmat3(1.0), planes, 1e-8).has_value())
      continue;  // feasible only within rounding
    const PlaneMinimum found = minimise_on_planes(target, dmat3(1.0), planes, kTolerance);
    EXPECT_EQ(found.feasible, strict) << n;
    without += strict ? 0 : 1;
  }
  EXPECT_GT(without, 100);
}

}  // namespace
