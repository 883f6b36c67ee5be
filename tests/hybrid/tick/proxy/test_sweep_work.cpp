// SPDX-License-Identifier: GPL-3.0-or-later
// The work of a sweep is bounded on any mesh and at any speed. A sweep that the bound ends leaves the proxy
// outside all objects, and later sweeps take it to its optimum.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <tuple>

#include "hybrid/base/flush_to_zero.h"
#include "hybrid/tick/proxy/proxy_sweep.h"
#include "hybrid/tick/proxy/rigid_proxy.h"
#include "polygon/surface/mesh_surface.h"
#include "polygon/surface/primitives.h"

namespace {

using glm::dvec3;
using polygon::Neighbourhood;

constexpr double kBall_m = 0.05;  // radius; the ball lies at the scene's origin
// Largest work of a sweep's last step: a survey that was too large, a second survey, and two renewals of each
// plane of the second.
constexpr std::uint32_t kLastStep = 6 * Neighbourhood::kCapacity;

// A ball of 20 * 4^level triangles and a tool, without a map.
class FineBall {
 public:
  FineBall(int level, double tool_radius_m) {
    hybrid::set_flush_to_zero();
    auto mesh = std::make_shared<const polygon::TriangleMesh>(polygon::make_ball_mesh(kBall_m, level));
    const auto& t = mesh->triangles.front();
    edge_m_ = glm::length(mesh->vertices[t[0]] - mesh->vertices[t[1]]);
    surface_ = polygon::make_mesh_surface(mesh, {.solid = true});
    world_.rigid.push_back({.name = "ball", .surface = surface_, .pose = {}, .drawn = {}});
    world_.tool = {.radius_m = tool_radius_m, .stiffness_N_per_m = 1000.0};
    world_.use_map = false;
    world_.set_scale(dvec3(-kBall_m), dvec3(kBall_m));
    state_ = std::make_unique<hybrid::WorldState>(world_, hybrid::OccupancyMap(1.0, dvec3(0.0)));
    state_->prepare(world_);
  }

  bool start(const dvec3& at) { return hybrid::start_proxy(world_, *state_, at); }
  hybrid::Sweep sweep(const dvec3& goal) {
    const hybrid::Sweep done = hybrid::sweep_proxy(world_, *state_, state_->proxy_m, goal, glm::dmat3(1000.0),
                                                   std::numeric_limits<double>::max());
    state_->proxy_m = done.point;
    return done;
  }
  [[nodiscard]] double clearance() const {
    polygon::NearPoint near;
    if (!surface_->nearest(state_->proxy_m, 1.0, near) || surface_->inside(state_->proxy_m)) return -1.0;
    return near.distance - radius();
  }
  [[nodiscard]] double radius() const { return world_.contact_radius_m(); }
  [[nodiscard]] std::uint32_t listed() const { return state_->rigid[0].near.size(); }
  [[nodiscard]] const hybrid::WorldState& state() const { return *state_; }
  [[nodiscard]] double edge_m() const { return edge_m_; }

 private:
  std::shared_ptr<const polygon::RigidSurface> surface_;
  hybrid::World world_;
  std::unique_ptr<hybrid::WorldState> state_;
  double edge_m_ = 0.0;
};

class SweepWork : public ::testing::TestWithParam<std::tuple<int, double>> {
 protected:
  FineBall ball_{std::get<0>(GetParam()), std::get<1>(GetParam())};

  void go(const dvec3& goal) {
    const hybrid::Sweep sweep = ball_.sweep(goal);
    ASSERT_LE(sweep.work, hybrid::kMostSweepWork + kLastStep);
    ASSERT_LE(ball_.listed(), Neighbourhood::kCapacity);
    ASSERT_GE(ball_.clearance(), -1e-9 * kBall_m);
    cut_ += sweep.arrived ? 0 : 1;
  }
  // With the goal held still, the proxy must arrive at the nearest place of an ideal ball, up to the facets.
  void arrives(const dvec3& goal) {
    hybrid::Sweep sweep;
    for (int tick = 0; tick < 200 && (tick == 0 || !sweep.arrived); ++tick) sweep = ball_.sweep(goal);
    ASSERT_TRUE(sweep.arrived);
    const dvec3 nearest = glm::normalize(goal) * (kBall_m + ball_.radius());
    EXPECT_LE(glm::length(sweep.point - nearest),
              2.0 * ball_.edge_m() * (kBall_m + ball_.radius()) / glm::length(goal));
  }
  int cut_ = 0;
};

// The goal passes the ball's centre at a distance of 0.3 mm. The nearest place then goes half round the ball
// within a tick or two.
TEST_P(SweepWork, IsBoundedWhenTheGoalPassesTheMiddle) {
  const dvec3 along = glm::normalize(dvec3(1.0, 0.3, -0.2)),
              aside = 3e-4 * glm::normalize(dvec3(0.2, 0.0, 1.0));
  ASSERT_TRUE(ball_.start(-0.06 * along + aside));
  for (int k = 0; k <= 120; ++k) ASSERT_NO_FATAL_FAILURE(go((1e-3 * k - 0.06) * along + aside));
  EXPECT_EQ(ball_.state().faults, 0U);
  ASSERT_TRUE(ball_.start(-0.06 * along + aside));
  for (int k = 0; k <= 95; ++k) ASSERT_NO_FATAL_FAILURE(go((1e-3 * k - 0.06) * along + aside));
  arrives(0.035 * along + aside);
}

TEST_P(SweepWork, IsBoundedInTapsAtTwoMetersASecond) {
  for (int tap = 0; tap < 40; ++tap) {
    const dvec3 from = glm::normalize(dvec3(std::cos(2.4 * tap), std::sin(2.4 * tap), 0.05 * tap - 1.0));
    const dvec3 to = glm::normalize(from + 0.3 * dvec3(0.6, -0.5, 0.62));
    ASSERT_TRUE(ball_.start(0.07 * from));
    for (int k = 0; k <= 20; ++k)
      ASSERT_NO_FATAL_FAILURE(go(0.07 * from + 0.05 * k * (0.03 * to - 0.07 * from)));
    arrives(0.03 * to);
  }
  EXPECT_EQ(ball_.state().faults, 0U);
}

// Free space between two taps lets the range of a search grow. The landing must not list every element within
// this range.
TEST_P(SweepWork, LandsWithFewElements) {
  std::uint32_t most = 0;
  for (int tap = 0; tap < 40; ++tap) {
    const dvec3 from = glm::normalize(dvec3(std::cos(2.4 * tap), std::sin(2.4 * tap), 0.05 * tap - 1.0));
    ASSERT_TRUE(ball_.start(0.07 * from));
    for (int k = 1; k <= 13 && ball_.state().active_count == 0; ++k) {
      const hybrid::Sweep sweep = ball_.sweep((0.07 - 0.002 * k) * from);
      most = std::max(most, sweep.work);
    }
    ASSERT_GT(ball_.state().active_count, 0U);
  }
  // The unit of work is a listed element. A ball of 2 mm touches many triangles of the finest mesh at once.
  EXPECT_LE(most, (std::get<1>(GetParam()) > 0.0 ? 2 : 1) * Neighbourhood::kCapacity);
}

// At this speed no tick needs to be cut short, whatever the mesh.
TEST_P(SweepWork, SufficesForASlideAtOneMeterASecond) {
  const double depth = 0.045;
  ASSERT_TRUE(ball_.start(dvec3(0.0, 0.0, 0.07)));
  for (int k = 0; k <= 25; ++k) ASSERT_NO_FATAL_FAILURE(go(dvec3(0.0, 0.0, 0.07 - 1e-3 * k)));
  cut_ = 0;
  for (int k = 0; k < 1000; ++k) {
    const double angle = 1e-3 / depth * k;
    ASSERT_NO_FATAL_FAILURE(
        go(depth * dvec3(std::sin(angle), 0.3 * std::sin(0.31 * angle), std::cos(angle))));
  }
  EXPECT_EQ(cut_, 0);
  EXPECT_EQ(ball_.state().faults, 0U);
}

INSTANTIATE_TEST_SUITE_P(CoarseAndFine, SweepWork,
                         ::testing::Combine(::testing::Values(3, 6, 8), ::testing::Values(0.0, 2e-3)));

}  // namespace
