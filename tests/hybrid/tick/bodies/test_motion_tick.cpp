// SPDX-License-Identifier: GPL-3.0-or-later
// Moving bodies in the whole tick. They push and carry the tool, and free bodies never gain more energy than
// they are given.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "tests/hybrid/fixtures/equilibrium.h"
#include "tests/hybrid/fixtures/feel_scene.h"

namespace {

using namespace tests;  // NOLINT(google-build-using-namespace): these tests use the whole fixture

class Motion : public Feel {
 protected:
  static RigidDescription along(RigidDescription object, const dvec3& way, double speed) {
    object.motion = hybrid::PathMotion{
        .path = device::WaypointPath{.points = {{dvec3(0.0)}, {way}}, .speed_m_per_s = speed}, .spin = {}};
    return object;
  }
  static RigidDescription turning(RigidDescription object, const dvec3& axis, double rate) {
    object.motion =
        hybrid::PathMotion{.path = {},
                           .spin = hybrid::SpinDescription{
                               .axis = axis, .about_m = object.pose.position_m, .rate_rad_per_s = rate}};
    return object;
  }
  static RigidDescription free(RigidDescription object, double mass_kg, double drag = 0.0) {
    object.motion = hybrid::FreeMotion{.mass_kg = mass_kg,
                                       .density_kg_per_m3 = {},
                                       .inertia_kg_m2 = {},
                                       .centre_m = {},
                                       .drag_N_s_per_m = drag,
                                       .angular_drag_N_m_s = 1e-4 * drag};
    return object;
  }
  RigidDescription belt() const {
    return rigid("belt", hybrid::BoxPrimitive{{0.6, 0.1, 0.02}}, {0, 0, -0.01});
  }
  static double tangent(const TickResult& felt) {
    return std::hypot(felt.force_N.x, felt.force_N.y) / felt.force_N.z;
  }
};

// The device stays still, pressed 3 mm deep, while the belt moves under it.
TEST_F(Motion, ABeltCarriesTheToolToTheStaticConeAndThenSlidesAtTheDynamicOne) {
  for (const double speed : {0.005, 0.1, 1.0}) {
    for (const bool triangles : {false, true}) {
      RigidDescription object = belt();
      if (triangles) object = mesh("belt", polygon::make_box_mesh({0.3, 0.05, 0.01}, 12), {0, 0, -0.01});
      Touch touch(scene_of({along(rough(object), {0.25, 0, 0}, speed)}, kRadius), {0, 0, 0.01});
      touch.at({0, 0, kRadius - 3e-3});
      double breakaway = 0.0, low = 1e9, high = 0.0, carried = 0.0;
      bool slid = false;
      const double before = touch.state().proxy_m.x;
      const int ticks = static_cast<int>(std::min(0.24 / speed, 2.0) * 1e3);
      for (int n = 1; n <= ticks; ++n) {
        const TickResult felt = touch.at({0, 0, kRadius - 3e-3});
        EXPECT_NEAR(felt.force_N.z, 3.0, 1e-9);
        if (touch.state().stuck && !slid) {
          breakaway = tangent(felt);
          carried = std::max(carried, std::fabs(felt.proxy_m.x - before - speed * n * 1e-3));
        } else {
          slid = true;
          EXPECT_TRUE(touch.state().sliding) << "at tick " << n << ": it does not stick and slip by turns";
          low = std::min(low, felt.force_N.x / felt.force_N.z);
          high = std::max(high, felt.force_N.x / felt.force_N.z);
        }
      }
      std::printf(
          "belt%s at %g m/s: carried to tan %.4f of %.1f, off the belt by %.1e m; then slides at %.6f to "
          "%.6f of %.1f\n",
          triangles ? " of triangles" : "", speed, breakaway, kStatic, carried, kDynamic, low, high);
      EXPECT_LE(breakaway, kStatic * (1.0 + 1e-9));
      EXPECT_GE(breakaway, kStatic - speed * 1e-3 * kToolStiffness / 3.0 - 1e-9) << "to within a tick's way";
      EXPECT_LE(carried, 1e-12);
      EXPECT_NEAR(low, kDynamic, 0.01 * kDynamic);
      EXPECT_NEAR(high, kDynamic, 0.01 * kDynamic);
      EXPECT_EQ(touch.state().faults, 0U);
    }
  }
}

TEST_F(Motion, ATurntableCarriesTheToolRoundAndAWheelToo) {
  struct Case {
    const char* name;
    RigidDescription object;
    dvec3 axis, from;  // axis of rotation, and the device's position when pressed
  };
  const std::vector<Case> cases{
      {"turntable",
       mesh("table", polygon::make_box_mesh({0.06, 0.06, 0.01}, 9), {0, 0, -0.01}),
       {0, 0, 1},
       {0.03, 0.01, kRadius - 3e-3}},
      {"wheel", ball(), {0, 1, 0}, (kBall - 1e-3) * glm::normalize(dvec3(0.3, 0.2, 1.0))}};
  for (const Case& c : cases) {
    const double rate = 1.5;
    Touch touch(scene_of({turning(rough(c.object), c.axis, rate)}, kRadius), {0, 0, 0.09});
    double worst = 0.0, force = 0.0;
    dvec3 held(0.0);
    for (int n = 0; n < 4000; ++n) {
      // The device rotates with the body.
      const glm::dquat turn = glm::angleAxis(rate * 1e-3 * (n + 1), c.axis);
      const dvec3 above = c.from + dvec3(0, 0, n < 20 ? 5e-3 : 0.0);
      const TickResult felt = touch.at(turn * above);
      const dvec3 in_body = glm::inverse(turn) * felt.proxy_m;
      if (n == 30) {
        held = in_body;
        force = glm::length(felt.force_N);
      }
      if (n > 30) worst = std::max(worst, glm::length(in_body - held));
    }
    std::printf("%s: the tool is carried round %.1f times at %.2f N, off by at most %.1e m\n", c.name,
                4.0 * rate / (2.0 * glm::pi<double>()), force, worst);
    EXPECT_GT(force, 2.5);
    EXPECT_LE(worst, 1e-12);
    EXPECT_TRUE(touch.state().stuck);
    EXPECT_EQ(touch.state().faults, 0U);
  }
}

TEST_F(Motion, AWheelUnderAStandingToolRubsAtTheDynamicCone) {
  for (const double rate : {0.05, 2.0, 20.0}) {  // the last is 1 m/s at the rim
    Touch touch(scene_of({turning(rough(ball()), {0, 1, 0}, rate)}, kRadius), {0, 0, 0.09});
    touch.go({0, 0, 0.06}, 1e-3);
    std::vector<double> rubbed;
    touch.go({0, 0, kBall - 1e-3}, 1e-3, 3000, [&](const TickResult& felt) {
      if (touch.state().sliding)
        rubbed.push_back(
            std::tan(glm::radians(degrees_between(felt.force_N, contact_normal(touch.state())))));
    });
    ASSERT_GT(rubbed.size(), 1000U);
    std::sort(rubbed.begin(), rubbed.end());
    std::printf("wheel at %g rad/s: rubs at tan %.5f (p1) %.5f (p50) %.5f (p99)\n", rate,
                rubbed[rubbed.size() / 100], rubbed[rubbed.size() / 2], rubbed[rubbed.size() * 99 / 100]);
    EXPECT_NEAR(rubbed[rubbed.size() / 100], kDynamic, 0.01 * kDynamic);
    EXPECT_NEAR(rubbed[rubbed.size() * 99 / 100], kDynamic, 0.01 * kDynamic);
    EXPECT_GT(touch.state().proxy_m.x, 0.0) << "drawn the way the wheel turns";
  }
}

TEST_F(Motion, ABodyThatStandsOnItsPathFeelsAsAFixedOne) {
  RigidDescription fixed = rough(ball());
  fixed.feel.shading = true;
  fixed.feel.damping_N_s_per_m = 1.0;
  Touch a(scene_of({fixed}, kRadius), {0, 0, 0.09}),
      b(scene_of({along(fixed, {0, 0, 0}, 0.1)}, kRadius), {0, 0, 0.09});
  double worst = 0.0;
  for (int n = 0; n < 4000; ++n) {
    const double angle = 5e-4 * n;
    const dvec3 device = (0.054 - 6e-3 * std::sin(3.0 * angle)) *
                         dvec3(std::sin(angle), 0.1 * std::cos(angle), std::cos(angle));
    worst = std::max(worst, glm::length(a.at(device).force_N - b.at(device).force_N));
  }
  std::printf("a body that stands on its path: the force is off a fixed one's by at most %.1e N\n", worst);
  EXPECT_LE(worst, 1e-4);
}

// The hand's work is at least the body's energy, because friction and drag only lose energy.
TEST_F(Motion, AFreeBodyHasNoMoreEnergyThanTheHandGave) {
  for (const double mass : {0.001, 0.05, 2.0}) {
    for (const bool friction : {false, true}) {
      for (const double off_centre : {0.0, 8e-3}) {
        RigidDescription puck = rigid("puck", hybrid::BoxPrimitive{{0.03, 0.03, 0.01}});
        if (friction) puck = rough(puck);
        Touch touch(scene_of({free(puck, mass)}, kRadius), {-0.04, off_centre, 0});
        Work work;
        double most = 0.0, excess = -1e9;
        // The hand pushes for 0.1 s with a lateral oscillation, then stops.
        for (int n = 0; n < 1000; ++n) {
          const double t = std::min(1e-3 * n, 0.1);
          const TickResult felt = touch.at({-0.025 + 0.25 * t, off_centre + 2e-3 * std::sin(40.0 * t), 0});
          ASSERT_TRUE(finite(felt.force_N));
          work.add(felt);
          most = std::max(most, glm::length(felt.force_N));
          const double energy = hybrid::kinetic_energy_J(touch.world().rigid[0].motion.free_body(),
                                                         touch.state().rigid[0].free);
          const double stored = 0.5 * glm::dot(felt.force_N, felt.force_N) / kToolStiffness;
          excess = std::max(excess, energy + stored + work.gained_J());
        }
        const auto& free_state = touch.state().rigid[0].free;
        const double energy = hybrid::kinetic_energy_J(touch.world().rigid[0].motion.free_body(), free_state);
        std::printf(
            "puck of %g kg%s%s: %.4g mJ in, %.4g mJ in its motion at %.3f m/s, %.1f rad/s; at most %.2f N; "
            "never more than put in by %.2g mJ\n",
            mass, friction ? ", rough" : "", off_centre > 0 ? ", off its centre" : "", -1e3 * work.gained_J(),
            1e3 * energy, glm::length(free_state.velocity_m_per_s), glm::length(free_state.spin_rad_per_s),
            most, 1e3 * excess);
        EXPECT_GT(free_state.velocity_m_per_s.x, 0.0);
        EXPECT_LE(energy, -work.gained_J() + 1e-12);
        EXPECT_EQ(touch.state().faults, 0U);
      }
    }
  }
}

// The hand pushes a heavy body steadily, and feels its drag.
TEST_F(Motion, APuckPushedSteadilyFeelsItsDrag) {
  const double drag = 20.0, speed = 0.05;
  RigidDescription puck = free(rigid("puck", hybrid::BoxPrimitive{{0.03, 0.03, 0.01}}), 0.05, drag);
  Touch touch(scene_of({puck}, kRadius), {-0.04, 0, 0});
  TickResult felt;
  for (int n = 0; n < 3000; ++n) felt = touch.at({-0.02 + speed * 1e-3 * n, 0, 0});
  std::printf("puck with drag: %.4f N of %.4f N\n", -felt.force_N.x, drag * speed);
  // The body gives way within the tick. So the force that pushes it at the end of the tick is K v dt less
  // than the felt force.
  EXPECT_NEAR(-felt.force_N.x, drag * speed, 1.01 * kToolStiffness * speed * 1e-3);
  EXPECT_GE(-felt.force_N.x, drag * speed - 1e-9);
}

// The reference for the tick's force is the equilibrium of the present state, with the bodies at rest.
TEST_F(Motion, TheEquilibriumOfACopyIsWhatIsFeltNow) {
  RigidDescription wheel = turning(rough(ball()), {0, 1, 0}, 1.0);
  wheel.feel.shading = true;
  Touch touch(scene_of({wheel}, kRadius), {0, 0, 0.09});
  touch.go({0, 0, 0.06}, 1e-3);
  for (const int ticks : {20, 500}) {  // first sticking, then sliding
    const TickResult felt = touch.go({0, 0, kBall - 1e-3}, 1e-3, ticks);
    const std::uint64_t before = hybrid::hash_state(0, touch.state());
    const double time_s = touch.state().clock.now_s();
    const auto equilibrium = tests::equilibrium_force(touch.world(), touch.state());
    ASSERT_TRUE(equilibrium.has_value());
    EXPECT_LE(glm::length(*equilibrium - felt.force_N), 1e-3) << ticks;
    EXPECT_EQ(hybrid::hash_state(0, touch.state()), before) << "the state itself is not touched";
    EXPECT_EQ(touch.state().clock.now_s(), time_s);
    EXPECT_EQ(touch.state().sliding, ticks > 100);
  }
}

TEST_F(Motion, AllOfItAtOnceIsFiniteAtAnyTickLength) {
  for (const double dt : {1e-4, 1e-3, 1e-2}) {
    RigidDescription wheel = turning(rough(ball(2)), {0.3, 1, 0.2}, 3.0);
    std::get<hybrid::PathMotion>(wheel.motion).spin->axis = glm::normalize(dvec3(0.3, 1, 0.2));
    wheel.feel.shading = true;
    wheel.feel.damping_N_s_per_m = 3.0;
    wheel.feel.texture = hybrid::TextureDescription{};
    wheel.feel.texture->mapping = {.size_m = 4e-3, .height_m = 4e-4};
    RigidDescription puck =
        free(rough(rigid("puck", hybrid::BoxPrimitive{{0.03, 0.03, 0.02}}, {0, 0, 0.075})), 0.02, 0.5);
    RigidDescription table = rough(rigid("table", hybrid::PlanePrimitive{0.3}, {0, 0, -0.06}));
    Touch touch(scene_of({wheel, puck, table}, kRadius), {0.09, 0, 0});
    double most = 0.0;
    for (int n = 0; n < 20'000; ++n) {
      const double t = 1e-3 * n;
      const TickResult felt =
          touch.at({0.08 * std::sin(3.1 * t), 0.06 * std::sin(4.3 * t + 1.0), 0.09 * std::cos(2.3 * t)}, dt);
      ASSERT_TRUE(finite(felt.force_N) && finite(felt.proxy_m)) << n;
      most = std::max(most, glm::length(felt.force_N));
    }
    const auto& free_state = touch.state().rigid[1].free;
    std::printf("everything that moves, ticks of %g ms: at most %.1f N, puck at %.2f m/s, faults %u\n",
                1e3 * dt, most, glm::length(free_state.velocity_m_per_s), touch.state().faults);
    EXPECT_TRUE(finite(free_state.centre_m));
    EXPECT_EQ(touch.state().nonfinite, 0U);
    EXPECT_EQ(touch.state().faults & hybrid::fault_nonfinite_body, 0U);
  }
}

}  // namespace
