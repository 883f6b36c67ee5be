// SPDX-License-Identifier: GPL-3.0-or-later
// The proxy on meshes that are hard for it, moved slowly, fast and by jumps. Exact kernels that share no code
// with the proxy check four things. The proxy is never inside, never passes through, is never nearer
// than its radius, and is at an optimum.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <glm/geometric.hpp>
#include <random>
#include <string>

#include "tests/hybrid/fixtures/exact_proxy_world.h"
#include "tests/hybrid/fixtures/hostile_meshes.h"

namespace {

using glm::dvec3;
using tests::ExactProxyWorld;
using tests::HostileMesh;

enum class Gait { stroke, dash, jump };

// The device's path, in one of three gaits. A stroke goes from vertex to vertex, mostly under the surface, at
// up to 0.2 mm per tick. A dash goes between random places at 1 mm per tick. The third gait jumps between
// random places.
class Walk {
 public:
  Walk(const polygon::TriangleMesh& mesh, Gait gait, std::uint64_t seed)
      : random_(seed), mesh_(mesh), gait_(gait) {}

  [[nodiscard]] const dvec3& at() const { return at_; }
  const dvec3& next() {
    if (hold_ > 0) {
      --hold_;
      return at_;
    }
    if (glm::length(to_ - at_) < 1e-12) choose();
    const dvec3 way = to_ - at_;
    const double length = glm::length(way);
    at_ = length <= step_ ? to_ : at_ + way * (step_ / length);
    return at_;
  }

 private:
  double between(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random_); }
  dvec3 anywhere() {
    const double x = between(-1, 1), y = between(-1, 1), z = between(-1, 1);
    return {x, y, z};
  }
  void choose() {
    if (between(0, 1) < 0.3) hold_ = 3;
    switch (gait_) {
      case Gait::stroke: {
        step_ = std::pow(10.0, between(-5.0, -3.7));
        const dvec3& v = mesh_.vertices[static_cast<std::size_t>(
            between(0.0, static_cast<double>(mesh_.vertices.size()) - 1.0))];
        const dvec3 goal = v * between(0.8, 0.99) + 2e-3 * anywhere();
        const double far = glm::length(goal - at_);
        to_ = far > 0.02 ? at_ + (goal - at_) * (0.02 / far) : goal;
        if (glm::length(at_) > 0.075) {  // outside, so it jumps back to the surface
          to_ = 1.1 * v;
          step_ = 2e-2;
        }
        break;
      }
      case Gait::dash:
        step_ = 1e-3;
        to_ = 0.06 * anywhere();
        break;
      case Gait::jump:
        step_ = 10.0;
        to_ = anywhere() * (between(0, 1) < 0.1 ? 1.0 : 0.07);
        hold_ += 2;
        break;
    }
  }

  std::mt19937_64 random_;
  const polygon::TriangleMesh& mesh_;
  Gait gait_;
  dvec3 at_{0.12, 0.01, 0.02}, to_ = at_;
  double step_ = 0.0;
  int hold_ = 0;
};

class Hostile : public ::testing::TestWithParam<std::size_t> {};

TEST_P(Hostile, NeverInsideNeverThroughAndAtAnOptimum) {
  const HostileMesh hard = tests::hostile_meshes(1)[GetParam()];
  const char* longer = std::getenv("HYBRID_TRUTH_TICKS");  // sets a longer walk, for runs by hand
  const int ticks = longer != nullptr ? std::stoi(longer) : 120;
  double worst = 0.0, clearance = 1.0, way_clearance = 1.0;
  int bounded = 0;  // number of ticks in which the proxy reached its bound on steps
  for (const double radius : {0.0, 2e-3}) {
    for (const Gait gait : {Gait::stroke, Gait::dash, Gait::jump}) {
      SCOPED_TRACE(hard.name + ", radius " + std::to_string(radius) + ", gait " +
                   std::to_string(static_cast<int>(gait)));
      ExactProxyWorld world({{hard.mesh, hard.solid}}, {.tool_radius_m = radius});
      Walk walk(hard.mesh, gait, 77);
      ASSERT_TRUE(world.start(walk.at()));
      for (int tick = 0; tick < ticks; ++tick) {
        const dvec3 goal = walk.next();
        const hybrid::RigidStep step = world.step(goal);
        ASSERT_TRUE(std::isfinite(glm::length(step.proxy_m)));
        EXPECT_FALSE(world.inside(step.proxy_m)) << "tick " << tick;
        clearance = std::min(clearance, world.clearance(step.proxy_m));
        if (tick % 5 == 0) {
          EXPECT_FALSE(world.trail_crosses()) << "tick " << tick;
          const double on_the_way = world.trail_clearance();
          EXPECT_GE(on_the_way, -1e-12) << "tick " << tick;
          way_clearance = std::min(way_clearance, on_the_way);
        }
        bounded += step.arrived || step.free ? 0 : 1;
        if (tick % 3 != 0 || step.free || !step.arrived) continue;
        const polygon::NearestOptimum optimum = world.optimum(0, goal, 1e-3);
        EXPECT_TRUE(optimum.found) << "tick " << tick;
        worst = std::max(worst, optimum.error_m);
      }
      EXPECT_EQ(world.state().faults, 0U);
    }
  }
  EXPECT_LE(worst, 1e-6);
  EXPECT_LE(bounded, 6 * ticks / 200);
  EXPECT_GE(clearance, -1e-12);
  std::printf(
      "%s: at most %.1e m from an optimum; nearer than its radius by %.1e m, on the way by %.1e m; %d ticks "
      "cut\n",
      hard.name.c_str(), worst, std::max(0.0, -clearance), std::max(0.0, -way_clearance), bounded);
}

INSTANTIATE_TEST_SUITE_P(Meshes, Hostile, ::testing::Range<std::size_t>(0, 16),
                         [](const ::testing::TestParamInfo<std::size_t>& mesh) {
                           std::string name = tests::hostile_meshes(1)[mesh.param].name;
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

}  // namespace
