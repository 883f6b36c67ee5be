// SPDX-License-Identifier: GPL-3.0-or-later
// Whole sessions: the force of pressing and releasing tissue, and safe handling of broken input.
#include "hybrid/session/session.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/hybrid/fixtures/touch.h"

namespace {

using glm::dvec3;
using hybrid::SessionResult;
using hybrid::TickResult;
using tests::Touch;

hybrid::Scene cube(device::DeviceModel model) {
  hybrid::Scene scene = hybrid::load_scene(tests::source_folder / "scenes" / "cube.toml");
  scene.device_model = model;
  return scene;
}

constexpr double kTouched = 0.028;  // (m) height at which the ball of 8 mm touches the top at 20 mm

TEST(CubeSession, NothingIsFeltBeforeContact) {
  for (const auto model : {device::DeviceModel::ideal, device::DeviceModel::premium_1_5}) {
    const hybrid::Scene scene = cube(model);
    auto built = hybrid::build_scene(scene);
    const SessionResult result = hybrid::run_session(scene, built, {.seconds = 0.3, .progress = {}});
    int free = 0;
    for (const auto& row : result.rows) {
      if (row.device_m.z <= kTouched) break;
      EXPECT_EQ(row.force_N, dvec3(0.0)) << "at " << row.t_s << " s";
      EXPECT_EQ(row.proxy_m, row.device_m);
      EXPECT_EQ(row.contacts, 0U);
      ++free;
    }
    EXPECT_GT(free, 50);
    EXPECT_GT(result.contact_ticks, 100U);
  }
}

TEST(CubeSession, TheForceRisesWithTheDepth) {
  // The tool moves at 20 mm/s, to a depth of 6 mm.
  const hybrid::Scene scene = cube(device::DeviceModel::ideal);
  Touch touch(scene, {0, 0, 0.030});
  double most = 0.0, worst_drop = 0.0;
  touch.go({0, 0, 0.022}, 2e-5, 0, [&](const TickResult& felt) {
    const double force = tests::coupling(felt).z;
    EXPECT_GE(force, 0.0);
    worst_drop = std::max(worst_drop, most - force);
    most = std::max(most, force);
  });
  EXPECT_GT(most, 0.3);
  EXPECT_LE(worst_drop, 0.01 * most);
  std::printf("cube: %.3f N at 6 mm, largest drop on the way %.2e N\n", most, worst_drop);
}

TEST(CubeSession, TwoSecondsAfterItsReleaseItIsAtRestAgain) {
  const hybrid::Scene scene = cube(device::DeviceModel::premium_1_5);
  auto built = hybrid::build_scene(scene);
  const auto displacement = [&built] {
    const voxel::SoftObject& block = *built.state->soft[0];
    double most = 0.0;
    for (const voxel::VoxelId v : block.lattice().surface())
      most = std::max(most, glm::length(block.displacement(v)));
    return most;
  };
  // The path releases at 1.09 s and is out of contact by 1.15 s.
  const SessionResult pressed = hybrid::run_session(scene, built, {.seconds = 1.0, .progress = {}});
  const double deepest = displacement();
  ASSERT_GT(deepest, 3e-3);
  built = hybrid::build_scene(scene);
  const SessionResult result = hybrid::run_session(scene, built, {.seconds = 3.15, .progress = {}});
  EXPECT_LE(displacement(), 0.01 * deepest);
  EXPECT_GT(result.max_force_N, 0.3);
  EXPECT_LE(glm::length(result.rows.back().force_N), 0.01 * result.max_force_N);
  EXPECT_EQ(built.state->nonfinite, 0U);
  EXPECT_EQ(built.state->faults, 0U);
  EXPECT_EQ(pressed.rows.size(), 1000U);
  std::printf("cube: %.2f mm pressed, %.1e mm left 2 s after release\n", 1e3 * deepest, 1e3 * displacement());
}

TEST(CubeSession, CountsWhatItReports) {
  const hybrid::Scene scene = cube(device::DeviceModel::premium_1_5);
  auto built = hybrid::build_scene(scene);
  const SessionResult r = hybrid::run_session(scene, built, {.seconds = 0.5, .progress = {}});
  EXPECT_EQ(r.ticks, 500U);
  EXPECT_EQ(r.dt_s, 1e-3);
  ASSERT_EQ(r.rows.size(), 500U);
  EXPECT_EQ(r.tick_us.count(), 500U);
  EXPECT_EQ(r.recording.size(), 500U);
  for (const auto& stage : r.stage_us) EXPECT_EQ(stage.count(), 500U);
  std::uint64_t contact = 0;
  double most = 0.0, square = 0.0;
  for (std::size_t n = 0; n < r.rows.size(); ++n) {
    contact += r.rows[n].contacts != 0 ? 1 : 0;
    most = std::max(most, glm::length(r.rows[n].force_N));
    square += glm::dot(r.rows[n].force_N, r.rows[n].force_N);
    EXPECT_EQ(r.recording[n].device_m, r.rows[n].device_m);
  }
  EXPECT_EQ(r.contact_ticks, contact);
  EXPECT_DOUBLE_EQ(r.max_force_N, most);
  EXPECT_NEAR(r.rms_force_N, std::sqrt(square / 500.0), 1e-12);
  EXPECT_EQ(r.object_contact_ticks.at(0), contact);
}

class BadInput : public tests::SceneFile {
 protected:
  hybrid::Scene mixed() const {
    return load("format = 1\n" + tests::block +
                "[[rigid]]\nname = \"ball\"\nprimitive = \"ball\"\nradius = 4\nposition = [9, 0, 8]\n" +
                tests::some_path);
  }
};

TEST_F(BadInput, ThatIsNoNumberHoldsTheLastGoodOne) {
  Touch touch(mixed(), {0, 0, 0.03});
  touch.go({0, 0, 4e-3}, 1e-4, 300);
  const TickResult before = touch.at({0, 0, 4e-3});
  ASSERT_GT(before.force_N.z, 0.01);
  std::uint64_t bad = 0;
  for (const double wrong : {std::numeric_limits<double>::quiet_NaN(), HUGE_VAL, -HUGE_VAL}) {
    for (int axis = 0; axis < 3; ++axis) {
      dvec3 position(0, 0, 4e-3);
      position[axis] = wrong;
      const TickResult felt = touch.at(position);
      ++bad;
      EXPECT_EQ(felt.device_m, dvec3(0, 0, 4e-3));
      ASSERT_TRUE(tests::finite(felt.force_N) && tests::finite(felt.proxy_m));
      EXPECT_LE(glm::length(felt.force_N - before.force_N), 0.05 * glm::length(before.force_N));
    }
  }
  EXPECT_EQ(touch.state().nonfinite, bad);
  EXPECT_EQ(touch.state().faults, static_cast<std::uint32_t>(hybrid::fault_nonfinite_input));
  const TickResult after = touch.at({0, 0, 4e-3});
  EXPECT_LE(glm::length(after.force_N - before.force_N), 0.05 * glm::length(before.force_N));
}

TEST_F(BadInput, ADeviceThatStandsStillFeelsAForceThatStandsStill) {
  Touch touch(mixed(), {0, 0, 0.03});
  touch.go({0, 0, 4e-3}, 1e-4, 1000);
  double low = 1e9, high = 0.0;
  for (int n = 0; n < 500; ++n) {
    const double force = glm::length(tests::coupling(touch.at({0, 0, 4e-3})));
    low = std::min(low, force);
    high = std::max(high, force);
  }
  std::printf("still: %.5f to %.5f N\n", low, high);
  EXPECT_LE(high - low, 0.01 * high);
}

TEST_F(BadInput, ThatIsFarAwayOrComesAtOddTimesStaysFinite) {
  Touch touch(mixed(), {0, 0, 0.03});
  int n = 0;
  for (const double far : {1.0, -1.0, 1e3, 1e6, 1e12, 1e200, 1e-300, 0.0}) {
    for (const double dt : {1e-4, 1e-3, 1e-2, 0.1, 0.0, -1.0, std::nan("")}) {
      const TickResult felt = touch.at(dvec3(far * 0.3, n % 2 == 0 ? far : -far, far), dt);
      ASSERT_TRUE(tests::finite(felt.force_N)) << far << ' ' << dt;
      ASSERT_TRUE(tests::finite(felt.proxy_m)) << far << ' ' << dt;
      ASSERT_LE(glm::length(felt.force_N), touch.world().limits.max_force_N * (1.0 + 1e-12));
      ++n;
    }
  }
  // The scene can still be touched afterwards.
  for (int back = 0; back < 5000; ++back) touch.at({0, 0, 0.05});
  EXPECT_LE(glm::length(touch.at({0, 0, 0.05}).force_N), 1e-9);
  touch.go({0, 0, 4e-3}, 1e-4, 300);
  EXPECT_GT(touch.at({0, 0, 4e-3}).force_N.z, 0.01);
}

TEST_F(BadInput, APathThatStartsInsideSomethingRigidIsRefusedInWords) {
  const hybrid::Scene scene =
      load("format = 1\n" + tests::ball + "[path]\nkind = \"press\"\nfrom = [0, 0, 1]\nto = [0, 0, 20]\n");
  auto built = hybrid::build_scene(scene);
  try {
    (void)hybrid::run_session(scene, built, {.seconds = 0.1, .progress = {}});
    FAIL() << "not refused";
  } catch (const hybrid::SceneError& error) {
    EXPECT_NE(std::string(error.what()).find("inside something rigid"), std::string::npos) << error.what();
  }
}

}  // namespace
