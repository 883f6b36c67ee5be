// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/paths/path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>

namespace {

using device::LissajousPath;
using device::make_path;
using device::Path;
using device::PathDescription;
using device::PathError;
using device::PressPath;
using device::SlidePath;
using device::WaypointPath;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

void expect_near(const glm::dvec3& a, const glm::dvec3& b, double tolerance = 1e-12) {
  EXPECT_LE(glm::length(a - b), tolerance)
      << a.x << ' ' << a.y << ' ' << a.z << " is not " << b.x << ' ' << b.y << ' ' << b.z;
}

// Expects that a path never exceeds its speed, stays at its end points, and is finite at any time.
void expect_well_behaved(const Path& path, double speed_m_per_s) {
  const double step_s = path.duration_s() / 5000.0;
  for (int i = -100; i < 5100; ++i) {
    const glm::dvec3 a = path.position(i * step_s), b = path.position((i + 1) * step_s);
    ASSERT_LE(glm::length(b - a), speed_m_per_s * step_s * (1.0 + 1e-9) + 1e-15) << i;
  }
  const glm::dvec3 first = path.position(0.0), last = path.position(path.duration_s());
  EXPECT_EQ(path.position(-1.0), first);
  EXPECT_EQ(path.position(-kInfinity), first);
  EXPECT_EQ(path.position(kNaN), first);
  EXPECT_EQ(path.position(path.duration_s() + 1.0), last);
  EXPECT_EQ(path.position(kInfinity), last);
  EXPECT_TRUE(path.notes().empty());
}

TEST(Path, PressGoesThereHoldsAndComesBack) {
  const PressPath press{
      .from_m = {0, 0, 0.05}, .to_m = {0, 0, 0.01}, .speed_m_per_s = 0.1, .hold_s = 0.5, .repeat = 3};
  const auto path = make_path(press);
  EXPECT_NEAR(path->duration_s(), 3 * (0.4 + 0.5 + 0.4), 1e-12);
  for (int cycle = 0; cycle < 3; ++cycle) {
    const double t0 = cycle * 1.3;
    expect_near(path->position(t0), press.from_m);
    expect_near(path->position(t0 + 0.1), {0, 0, 0.04});
    expect_near(path->position(t0 + 0.4), press.to_m);
    expect_near(path->position(t0 + 0.65), press.to_m);
    expect_near(path->position(t0 + 0.9), press.to_m);
    expect_near(path->position(t0 + 1.2), {0, 0, 0.04});
  }
  expect_near(path->position(path->duration_s()), press.from_m);
  expect_well_behaved(*path, press.speed_m_per_s);
}

TEST(Path, SlideIsOneStrokeOverASurface) {
  const SlidePath slide{
      .from_m = {0, 0, 0}, .to_m = {0.03, 0.04, 0}, .lift_m = {0, 0, 0.02}, .speed_m_per_s = 0.1};
  const auto path = make_path(slide);
  EXPECT_NEAR(path->duration_s(), 0.2 + 0.5 + 0.2, 1e-12);
  expect_near(path->position(0.0), {0, 0, 0.02});
  expect_near(path->position(0.2), {0, 0, 0});
  expect_near(path->position(0.45), {0.015, 0.02, 0});
  expect_near(path->position(0.7), {0.03, 0.04, 0});
  expect_near(path->position(0.9), {0.03, 0.04, 0.02});
  expect_well_behaved(*path, slide.speed_m_per_s);
}

TEST(Path, WaypointsAreVisitedInTurnWithTheirHolds) {
  const WaypointPath waypoints{
      .points = {{{0, 0, 0}, 0.1}, {{0.1, 0, 0}, 0.0}, {{0.1, 0, 0}, 0.2}, {{0.1, 0.1, 0}, 0.3}},
      .speed_m_per_s = 0.5};
  const auto path = make_path(waypoints);
  EXPECT_NEAR(path->duration_s(), 0.1 + 0.2 + 0.2 + 0.2 + 0.3, 1e-12);
  expect_near(path->position(0.1), {0, 0, 0});
  expect_near(path->position(0.2), {0.05, 0, 0});
  expect_near(path->position(0.4), {0.1, 0, 0});
  expect_near(path->position(0.6), {0.1, 0.05, 0});
  expect_near(path->position(0.8), {0.1, 0.1, 0});
  expect_well_behaved(*path, waypoints.speed_m_per_s);
}

TEST(Path, OneWaypointIsAPlaceToStay) {
  const auto path = make_path(WaypointPath{.points = {{{1, 2, 3}, 0.0}}});
  EXPECT_EQ(path->duration_s(), 0.0);
  EXPECT_EQ(path->position(0.0), glm::dvec3(1, 2, 3));
  EXPECT_EQ(path->position(5.0), glm::dvec3(1, 2, 3));
}

TEST(Path, LissajousFollowsItsFormula) {
  const LissajousPath curve{.centre_m = {0.1, 0.2, 0.3},
                            .amplitude_m = {0.01, 0.02, 0.0},
                            .frequency_hz = {1.0, 2.5, 7.0},
                            .phase_rad = {0.0, 1.0, 2.0},
                            .duration_s = 2.0};
  const auto path = make_path(curve);
  const auto formula = [&](double t) {
    glm::dvec3 p;
    for (int i = 0; i < 3; ++i) {
      p[i] = curve.centre_m[i] +
             curve.amplitude_m[i] *
                 std::sin(2.0 * std::numbers::pi * curve.frequency_hz[i] * t + curve.phase_rad[i]);
    }
    return p;
  };
  for (int i = 0; i <= 145; ++i) expect_near(path->position(i * 0.0137), formula(i * 0.0137), 1e-14);
  expect_near(path->position(9.0), formula(2.0), 1e-14);
  expect_near(path->position(-1.0), formula(0.0), 1e-14);
  expect_well_behaved(*path, 2.0 * std::numbers::pi * std::hypot(0.01 * 1.0, 0.02 * 2.5));
}

TEST(Path, APressRepeatedABillionTimesCostsNothing) {
  const auto path = make_path(
      PressPath{.to_m = {0, 0, -0.01}, .speed_m_per_s = 0.1, .hold_s = 0.8, .repeat = 1'000'000'000});
  EXPECT_NEAR(path->duration_s(), 1e9, 1.0);
  expect_near(path->position(5e8 + 0.5), {0, 0, -0.01}, 1e-6);
}

TEST(Path, WhatCannotBeFollowedIsRefusedInWords) {
  const PathDescription refused[] = {
      PressPath{.to_m = {0, 0, 1}, .speed_m_per_s = 0.0},
      PressPath{.to_m = {0, 0, 1}, .speed_m_per_s = -1.0},
      PressPath{.to_m = {0, 0, 1}, .speed_m_per_s = kNaN},
      PressPath{.to_m = {0, 0, 1}, .speed_m_per_s = kInfinity},
      PressPath{.to_m = {0, 0, 1}, .speed_m_per_s = 1e-320},
      PressPath{.to_m = {0, kNaN, 1}},
      PressPath{.from_m = {kInfinity, 0, 0}},
      PressPath{.hold_s = -1.0},
      PressPath{.hold_s = kNaN},
      PressPath{.repeat = 0},
      PressPath{.repeat = -3},
      SlidePath{.lift_m = {0, 0, kNaN}},
      SlidePath{.from_m = {-1e308, 0, 0}, .to_m = {1e308, 0, 0}},
      WaypointPath{},
      WaypointPath{.points = {{{0, 0, 0}, -1.0}}},
      WaypointPath{.points = {{{0, 0, 0}, 0.0}}, .speed_m_per_s = 0.0},
      LissajousPath{.frequency_hz = {kInfinity, 0, 0}},
      LissajousPath{.duration_s = -1.0},
      LissajousPath{.duration_s = kNaN},
  };
  for (const PathDescription& description : refused) {
    try {
      make_path(description);
      ADD_FAILURE() << "accepted: case " << &description - refused;
    } catch (const PathError& error) {
      EXPECT_GT(std::string(error.what()).size(), 20U);
    }
  }
}

}  // namespace
