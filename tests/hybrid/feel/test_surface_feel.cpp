// SPDX-License-Identifier: GPL-3.0-or-later
// Friction, damping and shading as functions, on surfaces whose exact proxy is a single formula.
#include "hybrid/feel/surface_feel.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "polygon/proxy/minimise_on_planes.h"

namespace {

using hybrid::friction_target;
using hybrid::FrictionStep;

constexpr double kStiffness = 800.0;
const glm::dvec3 up(0.0, 0.0, 1.0);

// The half-space below z = 0.
struct Plane {
  glm::dmat3 metric{kStiffness};
  [[nodiscard]] static glm::dvec3 normal(const glm::dvec3&) { return up; }
  [[nodiscard]] static bool touches(const glm::dvec3& p) { return p.z < 1e-12; }
  [[nodiscard]] glm::dvec3 proxy(const glm::dvec3& target) const {
    const polygon::ContactPlane plane{.normal = up};
    return polygon::minimise_on_planes(target, metric, std::span(&plane, 1), 1e-15).point;
  }
};
struct Sphere {
  glm::dmat3 metric{kStiffness};
  double radius = 0.05;
  [[nodiscard]] static glm::dvec3 normal(const glm::dvec3& p) { return glm::normalize(p); }
  [[nodiscard]] bool touches(const glm::dvec3& p) const { return glm::length(p) < radius + 1e-12; }
  [[nodiscard]] glm::dvec3 proxy(const glm::dvec3& target) const {
    const double distance = glm::length(target);
    return distance < radius ? target * (radius / distance) : target;
  }
};

// A quasi-static tool on a surface with friction.
template <typename Surface>
struct Rubbed {
  Surface surface;
  double static_friction = 0.6, dynamic_friction = 0.4;
  glm::dvec3 p{0.0}, t{0.0};
  bool sliding = false;

  void start(const glm::dvec3& at) {
    t = at;
    p = surface.proxy(at);
  }
  [[nodiscard]] double energy(const glm::dvec3& goal) const {
    return 0.5 * glm::dot(goal - p, surface.metric * (goal - p));
  }
  [[nodiscard]] glm::dvec3 force() const { return surface.metric * (p - t); }  // on the hand
  FrictionStep to(const glm::dvec3& target) {
    t = target;
    FrictionStep step{.target = t};
    if (surface.touches(p)) {
      step = friction_target(p, t, surface.metric, surface.normal(p), static_friction, dynamic_friction,
                             sliding);
    }
    p = surface.proxy(step.target);
    sliding = step.sliding;
    return step;
  }
};

glm::dmat3 random_metric(std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  glm::dmat3 m;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) m[i][j] = unit(random);
  return kStiffness * (glm::transpose(m) * m + glm::dmat3(0.3));
}

TEST(Friction, SticksBelowTheStaticConeAndSlidesOnTheDynamicOne) {
  for (const double mu_s : {0.05, 0.3, 0.6, 1.2}) {
    for (const double share : {0.5, 0.9, 1.0}) {
      Rubbed<Plane> rub{.surface = {}, .static_friction = mu_s, .dynamic_friction = share * mu_s};
      const double depth = 4e-3, step = 1e-6;
      rub.start({0.01, -0.02, -depth});
      const glm::dvec3 held = rub.p, way = glm::normalize(glm::dvec3(0.3, 1.0, 0.0));
      double broke = 0.0;
      for (int n = 1; n < 20000; ++n) {
        const glm::dvec3 t = glm::dvec3(0.01, -0.02, -depth) + (n * step) * way;
        const FrictionStep felt = rub.to(t);
        if (!felt.sliding) {
          ASSERT_EQ(broke, 0.0) << "a steady pull that slides goes on sliding";
          ASSERT_EQ(rub.p, held);
          continue;
        }
        if (broke == 0.0) broke = felt.tangential_N / felt.normal_N;
        const glm::dvec3 f = rub.force();
        ASSERT_NEAR(glm::length(glm::dvec3(f.x, f.y, 0.0)) / f.z, share * mu_s, 1e-9);
        ASSERT_GT(glm::dot(rub.p - held, way), 0.0);
      }
      EXPECT_NEAR(broke, mu_s, 0.01 * mu_s);
    }
  }
}

TEST(Friction, ComesToRestOnlyInTheDynamicConeAndHoldsThereAgain) {
  Rubbed<Plane> rub;
  const double depth = 2e-3;
  rub.start({0.0, 0.0, -depth});
  rub.to({0.65 * depth, 0.0, -depth});
  EXPECT_TRUE(rub.sliding);
  const glm::dvec3 rest = rub.p;
  rub.to({0.65 * depth, 0.0, -depth});  // the hand stays, so the pull is on the dynamic cone
  EXPECT_FALSE(rub.sliding);
  EXPECT_NEAR(rub.p.x, rest.x, 1e-15);
  rub.to({0.80 * depth, 0.0, -depth});  // 0.55 of the depth from the proxy, within the static cone
  EXPECT_FALSE(rub.sliding);
  rub.to({0.90 * depth, 0.0, -depth});  // 0.65 of the depth from the proxy
  EXPECT_TRUE(rub.sliding);
  rub.to({0.89 * depth, 0.0, -depth});  // the motion is reversed, so it comes to rest
  EXPECT_FALSE(rub.sliding);
}

TEST(Friction, WithAnyMetricTheSlideEndsOnTheCone) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  int slid = 0, jammed = 0, lifted = 0;
  for (int n = 0; n < 3000; ++n) {
    const Plane plane{.metric = random_metric(random)};
    const double mu = 0.05 + 0.4 * (unit(random) + 1.0);
    const glm::dvec3 p(unit(random), unit(random), 0.0),
        t = p + 0.01 * glm::dvec3(unit(random), unit(random), unit(random));
    const FrictionStep step = friction_target(p, t, plane.metric, up, mu, mu, true);
    const glm::dvec3 q = plane.proxy(step.target);
    ASSERT_TRUE(hybrid::friction_dissipates(p, q, t, plane.metric));
    if (!step.sliding) continue;
    if (step.target == p) {
      ++jammed;
      continue;
    }
    const glm::dvec3 pull = plane.metric * (t - q);
    const double pressed = -pull.z, held = glm::length(glm::dvec3(pull.x, pull.y, 0.0));
    if (step.target == t) {  // no force: the proxy lifts off or just touches
      ++lifted;
      ASSERT_LE(pressed, 1e-9);
      continue;
    }
    ++slid;
    ASSERT_GE(pressed, 0.0);
    ASSERT_NEAR(held, mu * pressed, 1e-8 * kStiffness * 0.01);
    ASSERT_LE(glm::dot(pull, p - q), 1e-12) << "friction acts against the slide";
  }
  EXPECT_GT(slid, 300);
  std::printf("random metrics: %d slid, %d lifted off, %d jammed\n", slid, lifted, jammed);
}

TEST(Friction, IsContinuousAtTheDynamicCone) {
  std::mt19937 random(8);
  for (int n = 0; n < 200; ++n) {
    const glm::dmat3 metric = random_metric(random), compliance = glm::inverse(metric);
    const double mu = 0.3, pressed = 2.0;
    const auto slide = [&](double excess) {
      const glm::dvec3 pull(mu * pressed * (1.0 + excess), 0.0, -pressed);
      const FrictionStep step = friction_target(glm::dvec3(0.0), compliance * pull, metric, up, mu, mu, true);
      const polygon::ContactPlane plane{.normal = up};
      return glm::length(polygon::minimise_on_planes(step.target, metric, std::span(&plane, 1), 1e-18).point);
    };
    const double a = glm::dot(up, compliance[0]) / glm::dot(up, compliance[2]);
    if (1.0 - mu * a < 0.2) continue;  // near jamming, a small change of the force causes a long travel
    EXPECT_EQ(slide(-1e-9), 0.0);
    EXPECT_LT(slide(1e-9), 1e-9);
    EXPECT_NEAR(slide(1e-4), 10.0 * slide(1e-5), 1e-3 * slide(1e-4));
  }
}

TEST(Friction, IsTheSameAtAnyScaleAndFarFromTheOrigin) {
  const glm::dmat3 metric(kStiffness);
  const glm::dvec3 p(0.013, 0.02, 0.0), t = p + glm::dvec3(0.003, 0.001, -0.004);
  const FrictionStep one = friction_target(p, t, metric, up, 0.5, 0.4, false);
  for (const double scale : {0x1p-30, 0x1p-10, 0x1p10, 0x1p30}) {
    const FrictionStep step = friction_target(scale * p, scale * t, metric, up, 0.5, 0.4, false);
    EXPECT_EQ(step.target, scale * one.target);
    EXPECT_EQ(step.sliding, one.sliding);
  }
  const glm::dvec3 far(1e6, -1e6, 0.0);
  const FrictionStep step = friction_target(p + far, t + far, metric, up, 0.5, 0.4, false);
  EXPECT_LT(glm::distance(step.target, one.target + far), 1e-8);
}

TEST(Friction, NothingToPressOnOrNothingToHold) {
  const glm::dmat3 metric(kStiffness);
  const glm::dvec3 away(0.01, 0.0, 0.002), into(0.01, 0.0, -0.002);
  EXPECT_EQ(friction_target(glm::dvec3(0.0), away, metric, up, 0.5, 0.4, true).target, away);
  EXPECT_FALSE(friction_target(glm::dvec3(0.0), away, metric, up, 0.5, 0.4, true).sliding);
  EXPECT_EQ(friction_target(glm::dvec3(0.0), into, metric, up, 0.0, 0.0, false).target, into);
  EXPECT_EQ(friction_target(glm::dvec3(0.0), into, metric, up, 0.5, 0.0, false).target, into);
  EXPECT_EQ(friction_target(into, into, metric, up, 0.5, 0.4, true).target, into);
}

// Moves the hand around closed paths. The proxy is fixed between two ticks, so the coupling is a spring, and
// its work is exact. The work that is not stored at the end is the friction loss, and must not be negative.
template <typename Surface>
void expect_no_energy_from_closed_paths(const Surface& surface, const glm::dvec3& middle, double reach) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  double least_spent = std::numeric_limits<double>::max(), most_ratio = 0.0;
  for (int path = 0; path < 200; ++path) {
    glm::dvec3 wave[4][2];
    for (auto& w : wave)
      for (auto& v : w) v = 0.5 * reach * glm::dvec3(unit(random), unit(random), unit(random));
    const auto at = [&](double s) {
      glm::dvec3 x = middle;
      for (int h = 0; h < 4; ++h) {
        const double a = 2.0 * std::numbers::pi * (h + 1) * s;
        x += wave[h][0] * std::cos(a) + wave[h][1] * std::sin(a);
      }
      return x;
    };
    const double mu = 0.5 * (unit(random) + 1.0);
    Rubbed<Surface> rub{.surface = surface, .static_friction = mu, .dynamic_friction = mu * 0.7};
    rub.start(at(0.0));
    const int ticks = 400;
    for (int n = 1; n <= ticks; ++n)
      rub.to(at(static_cast<double>(n) / ticks));  // the first round leads into the limit cycle
    const double before = rub.energy(rub.t);
    double work = 0.0, moved = 0.0;
    for (int n = 1; n <= ticks; ++n) {
      const glm::dvec3 next = at(static_cast<double>(n) / ticks);
      work += rub.energy(next) - rub.energy(rub.t);
      moved += std::fabs(rub.energy(next) - rub.energy(rub.t));
      const glm::dvec3 p = rub.p;
      rub.to(next);
      ASSERT_TRUE(hybrid::friction_dissipates(p, rub.p, next, surface.metric));
    }
    const double spent = work - (rub.energy(rub.t) - before);
    ASSERT_GE(spent, -1e-12 * moved);
    least_spent = std::min(least_spent, spent);
    most_ratio = std::max(most_ratio, spent / std::max(moved, 1e-300));
  }
  EXPECT_GT(most_ratio, 0.01) << "something was rubbed away";
  std::printf("closed paths: at least %.3g J spent each\n", least_spent);
}

TEST(Friction, NoClosedPathOnAPlaneGainsEnergy) {
  expect_no_energy_from_closed_paths(Plane{}, {0.0, 0.0, -3e-3}, 4e-3);
}
TEST(Friction, NoClosedPathOnAPlaneGainsEnergyWithTissueInTheCoupling) {
  std::mt19937 random(5);
  for (int n = 0; n < 5; ++n)
    expect_no_energy_from_closed_paths(Plane{random_metric(random)}, {0.0, 0.0, -3e-3}, 4e-3);
}
TEST(Friction, NoClosedPathOnASphereGainsEnergy) {
  expect_no_energy_from_closed_paths(Sphere{}, {0.0, 0.0, 0.046}, 4e-3);
}

TEST(Friction, OnASphereTheSlideConvergesToTheConeThere) {
  Rubbed<Sphere> rub{.surface = {}, .static_friction = 0.5, .dynamic_friction = 0.4};
  rub.start({0.0, 0.0, 0.045});
  for (int n = 1; n <= 400; ++n) {  // 20 mm/s along a circle at a depth of 5 mm
    const double a = n * 2e-5 / 0.045;
    rub.to(0.045 * glm::dvec3(std::sin(a), 0.0, std::cos(a)));
    if (!rub.sliding || n < 390) continue;
    const glm::dvec3 f = rub.force(), normal = Sphere::normal(rub.p);
    const double pressed = glm::dot(f, normal);
    EXPECT_NEAR(glm::length(f - pressed * normal) / pressed, 0.4, 0.004);
  }
  EXPECT_TRUE(rub.sliding);
}

TEST(Friction, SeveralSurfacesCountByTheirShare) {
  const hybrid::SurfaceFeel rough{
      .damping_N_s_per_m = 4.0, .static_friction = 0.8, .dynamic_friction = 0.6, .texture = nullptr};
  const hybrid::SurfaceFeel smooth;
  const hybrid::FeltSurface both[] = {{&rough, 1.0}, {&smooth, 3.0}};
  const hybrid::MixedFeel mixed = hybrid::mix_feel(both);
  EXPECT_DOUBLE_EQ(mixed.static_friction, 0.2);
  EXPECT_DOUBLE_EQ(mixed.dynamic_friction, 0.15);
  EXPECT_DOUBLE_EQ(mixed.damping_N_s_per_m, 1.0);
  EXPECT_EQ(hybrid::mix_feel({}).static_friction, 0.0);
  EXPECT_FALSE(smooth.any());
  EXPECT_TRUE(rough.any());
}

// ---- damping

TEST(Damping, ASteadyWayInIsTheRateTimesTheCoefficient) {
  for (const double noise : {0.0, 3e-5}) {
    hybrid::DampingState state;
    for (int n = 0; n < 60; ++n) {
      const double depth = 1e-4 * n;  // 0.1 m/s
      const double extra = hybrid::damping_force(state, kStiffness * depth, depth, 5.0, 1e-3, noise);
      EXPECT_NEAR(extra, n == 0 ? 0.0 : 0.5, 1e-9) << n;
    }
  }
}

TEST(Damping, EncoderStepsAreNotFelt) {
  const double step = 3e-5, dt = 1e-3;
  for (const double speed : {0.0, 0.0021, 0.0103, 0.0517, 0.2031}) {
    hybrid::DepthRate rate;
    double worst = 0.0;
    for (int n = 0; n < 400; ++n) {
      const double depth = step * std::round((1e-3 + speed * n * dt) / step);
      const double felt = rate.add(depth, dt, step);
      if (n > 20) worst = std::max(worst, std::fabs(felt - speed));
    }
    // For comparison: one encoder step per tick is 30 mm/s.
    EXPECT_LE(worst, 0.015) << speed;
    EXPECT_TRUE(speed > 0.0 || worst == 0.0);
    std::printf("steps of 0.03 mm at %.0f mm/s: the rate is off by at most %.1f mm/s\n", 1e3 * speed,
                1e3 * worst);
  }
}

TEST(Damping, AnImpactIsFeltInTheTickItHappens) {
  hybrid::DepthRate rate;
  for (int n = 0; n < 40; ++n) EXPECT_EQ(rate.add(1e-3, 1e-3, 3e-5), 0.0);
  EXPECT_GT(rate.add(1.5e-3, 1e-3, 3e-5), 0.4);
}

TEST(Damping, NeverPullsTheToolIn) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  hybrid::DampingState state;
  double depth = 2e-3;
  for (int n = 0; n < 20000; ++n) {
    depth = std::fabs(depth + 1e-3 * unit(random));
    const double spring = kStiffness * depth;
    const double extra = hybrid::damping_force(state, spring, depth, 50.0, 1e-3, 3e-5);
    ASSERT_GE(spring + extra, 0.0);
    ASSERT_TRUE(std::isfinite(extra));
  }
}

// After each suspension the damper must earn twice as much to resume (surface_feel.h). So in 1000 ticks the
// hand receives at most ten times the work of one tick.
TEST(Damping, FeedsNoOscillation) {
  const double dt = 1e-3, resolution = 3e-5;
  for (const double noise : {0.0, resolution}) {
    for (int n_th = 0; n_th < 42; ++n_th) {
      const double hertz = 3.0 * std::pow(1.13, n_th);  // up to 450 Hz
      for (const double amplitude : {2e-5, 1e-4, 1e-3}) {
        hybrid::DampingState state;
        double given = 0.0, one_tick = 0.0, before = 0.0, extra = 0.0;
        for (int n = 0; n < 1000; ++n) {
          double depth = 2e-3 + amplitude * std::sin(2.0 * std::numbers::pi * hertz * n * dt + 0.3);
          if (noise > 0.0) depth = noise * std::round(depth / noise);
          if (n > 0) given -= extra * (depth - before);
          one_tick = std::max(one_tick, std::fabs(extra * (depth - before)));
          extra = hybrid::damping_force(state, kStiffness * depth, depth, 5.0, dt, noise);
          before = depth;
        }
        EXPECT_LE(given, 10.0 * one_tick) << hertz << " Hz, " << amplitude << " m, noise " << noise;
      }
    }
  }
}

TEST(Damping, WhatIsNotFiniteIsForgotten) {
  hybrid::DampingState state;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(hybrid::damping_force(state, 1.0, nan, 5.0, 1e-3, 0.0), 0.0);
  EXPECT_EQ(hybrid::damping_force(state, 1.0, 1e-3, 5.0, 0.0, 0.0), 0.0);
  hybrid::end_damping(state);
  (void)hybrid::damping_force(state, 1.0, 1e-3, 5.0, 1e-3, 0.0);
  EXPECT_NEAR(hybrid::damping_force(state, 1.0, 1.1e-3, 5.0, 1e-3, 0.0), 0.5, 1e-9);
}

// ---- shading

// A flat face is shaded like the sphere of `radius` through its middle. The exact force has the direction
// from the sphere's centre to the device.
TEST(Shading, AFlatFaceFeelsLikeTheSphereItStandsFor) {
  const double radius = 0.05;
  double worst_deg = 0.0;
  for (const double depth : {5e-4, 2e-3, 5e-3}) {
    for (int column = -8; column <= 8; ++column) {
      const double x = 1.5e-3 * column;
      const glm::dvec3 goal(x, 0.4 * x, -depth);
      const Plane plane;
      glm::dvec3 p = plane.proxy(goal);
      for (int pass = 0; pass < 4; ++pass) {
        const glm::dvec3 shaded = glm::normalize(p + radius * up);
        p = Plane{.metric = hybrid::shading_metric(plane.metric, std::span(&shaded, 1))}.proxy(goal);
        ASSERT_GE(p.z, -1e-18);
      }
      const glm::dvec3 felt = glm::normalize(p - goal), exact = glm::normalize(goal + radius * up);
      worst_deg =
          std::max(worst_deg, std::acos(std::min(1.0, glm::dot(felt, exact))) * 180.0 / std::numbers::pi);
    }
  }
  EXPECT_LT(worst_deg, 0.05);
  std::printf("shading, 4 passes: off by at most %.4f degrees\n", worst_deg);
}

TEST(Shading, WithTissueInTheCouplingTheReactionHasTheShadedDirection) {
  std::mt19937 random(21);
  for (int n = 0; n < 200; ++n) {
    const Plane plane{.metric = random_metric(random)};
    const glm::dvec3 shaded = glm::normalize(glm::dvec3(0.2, -0.1, 1.0)), goal(0.003, 0.001, -0.004);
    const glm::dvec3 p =
        Plane{.metric = hybrid::shading_metric(plane.metric, std::span(&shaded, 1))}.proxy(goal);
    const glm::dvec3 reaction = plane.metric * (p - goal);
    EXPECT_NEAR(glm::dot(glm::normalize(reaction), shaded), 1.0, 1e-8);
  }
}

TEST(Shading, NormalsThatSpanEverythingOrNothingLeaveTheMetricsMinimumFree) {
  const std::array<glm::dvec3, 4> normals{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.6, 0, 0.8}}};
  const glm::dmat3 metric = glm::dmat3(1000.0, 0, 0, 0, 2000.0, 0, 0, 0, 500.0);
  for (const std::size_t count : {0U, 3U, 4U}) {
    const glm::dmat3 all = hybrid::shading_metric(metric, {normals.data(), count});
    for (int d = 0; d < 3; ++d) EXPECT_NEAR(glm::distance(all[d], metric[d]), 0.0, 1e-3 * metric[d][d]);
  }
  // A repeated normal counts once.
  const std::array<glm::dvec3, 2> twice{up, up};
  const glm::dmat3 once = hybrid::shading_metric(metric, {&up, 1}),
                   again = hybrid::shading_metric(metric, twice);
  for (int d = 0; d < 3; ++d) EXPECT_EQ(once[d], again[d]);
}

TEST(Shading, BeyondTheLimitTheNormalIsTurnedBackWithoutAJump) {
  EXPECT_EQ(hybrid::limit_shaded_normal({0.0, 0.0, 0.0}, up), up);
  EXPECT_EQ(hybrid::limit_shaded_normal({0.0, 0.0, -1.0}, up), up);
  EXPECT_EQ(hybrid::limit_shaded_normal(glm::dvec3(std::numeric_limits<double>::quiet_NaN()), up), up);
  glm::dvec3 before = up;
  for (int degree = 0; degree < 175; ++degree) {
    const double a = degree * std::numbers::pi / 180.0;
    const glm::dvec3 n = hybrid::limit_shaded_normal({std::sin(a), 0.0, std::cos(a)}, up);
    EXPECT_NEAR(glm::length(n), 1.0, 1e-12);
    EXPECT_GE(n.z, hybrid::kLeastShadedCosine - 1e-12);
    EXPECT_LT(glm::distance(n, before), 0.018);
    before = n;
  }
}

}  // namespace
