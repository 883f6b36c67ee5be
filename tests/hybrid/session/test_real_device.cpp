// SPDX-License-Identifier: GPL-3.0-or-later
// Sessions on a PHANToM. A test double of the driver's library stands in for the device.
#include "hybrid/session/real_device.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <glm/geometric.hpp>
#include <sstream>

#include "hybrid/session/recording.h"
#include "hybrid/session/session.h"
#include "tests/device/phantom/phantom_rig.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"

namespace {

using testing::HasSubstr;

class RealDevice : public tests::SceneFile {
 protected:
  // A ball of 20 mm under the hand. The hand moves 20 mm up and down about a point 38 mm above the scene's
  // centre.
  RealDevice() {
    rig_.hd->y_mm = 38;
    rig_.hd->swing_mm = 20;
  }
  std::filesystem::path scene_file(const std::string& device = "model = \"phantom\"\n") const {
    return write("ball.toml",
                 "format = 1\n[[rigid]]\nname = \"ball\"\nprimitive = \"ball\"\nradius = 20\n[tool]\n"
                 "radius = 2\nstiffness = 400\n[device]\n" +
                     device + "[path]\nkind = \"press\"\nfrom = [0, 0, 22]\nto = [0, 0, -22]\n");
  }
  struct Played {
    hybrid::SessionResult result;
    hybrid::Scene scene;
    std::string placed;
  };
  Played play(const std::filesystem::path& file, std::optional<double> seconds) const {
    Played played{{}, hybrid::load_scene(file), ""};
    const auto device = hybrid::open_real_device(played.scene, rig_.options());
    hybrid::BuiltScene built = hybrid::build_scene(played.scene);
    played.placed = hybrid::place_real_device(played.scene, *built.world, *device);
    hybrid::await_free_tool(played.scene, *built.world, *built.state, *device, {}, 0.1);
    played.result = hybrid::run_session(played.scene, built,
                                        {.seconds = seconds, .real_device = device.get(), .progress = {}});
    return played;
  }
  static hybrid::Recording recording(const Played& played) {
    std::ifstream in(played.scene.file, std::ios::binary);
    std::ostringstream text;
    text << in.rdbuf();
    return {.scene_file = played.scene.file,
            .scene_text = text.str(),
            .dt_s = played.result.dt_s,
            .device = hybrid::scene_limits(played.scene),
            .state_hash = played.result.state_hash,
            .start_m = played.result.start_m,
            .ticks = played.result.recording};
  }

  tests::PhantomRig rig_;
};

TEST_F(RealDevice, ABallIsFeltThroughIt) {
  const Played played = play(scene_file(), 3.0);
  EXPECT_EQ(played.result.ticks, 3000U);
  EXPECT_EQ(played.result.end, device::ServoEnd::finished);
  EXPECT_EQ(played.result.device_name, "Touch (serial 0042)");
  EXPECT_TRUE(played.result.device_messages.empty()) << tests::all(played.result.device_messages);
  EXPECT_EQ(played.scene.opened_limits->max_force_N, 3.3);
  EXPECT_THAT(played.placed, HasSubstr("at scale 1"));
  EXPECT_EQ(rig_.hd->misuse, 0U);
  // After all ramps, the force is K times the depth under the ball's top, along the device's y. It is at most
  // the device's force limit.
  double most = 0.0;
  for (std::size_t i = 1000; i + 1 < rig_.hd->forces.size(); ++i) {
    const double y_mm = 38.0 + 20.0 * std::sin(2.0 * M_PI * 1e-3 * static_cast<double>(i));
    const double expected = std::clamp(0.4 * (22.0 - y_mm), 0.0, 3.3);
    ASSERT_NEAR(rig_.hd->forces[i].newton[1], expected, 1e-6) << i;
    ASSERT_NEAR(rig_.hd->forces[i].newton[0], 0.0, 1e-9);
    ASSERT_NEAR(rig_.hd->forces[i].newton[2], 0.0, 1e-9);
    most = std::max(most, expected);
  }
  EXPECT_GT(most, 1.5);
  EXPECT_EQ(rig_.given_N(rig_.hd->forces.size() - 1), 0.0);
}

TEST_F(RealDevice, ASessionThatLosesItIsKeptAndPlaysAgain) {
  rig_.hd->error = 0x302;
  rig_.hd->error_at = 1750;  // in the middle of a press
  rig_.hd->error_ticks = FakeHd::never;
  const Played played = play(scene_file(), 3.0);
  EXPECT_EQ(played.result.end, device::ServoEnd::lost);
  EXPECT_EQ(played.result.ticks, 1750U);
  EXPECT_EQ(played.result.rows.size(), 1750U);
  EXPECT_EQ(played.result.recording.size(), 1750U);
  EXPECT_THAT(tests::all(played.result.device_messages), HasSubstr("check the cable"));
  EXPECT_GT(rig_.at_tick_N(1749), 1.0);
  EXPECT_EQ(rig_.at_tick_N(1750), 0.0);

  const auto again = hybrid::replay(recording(played), {});
  EXPECT_TRUE(again.equal) << "parts at tick " << again.first_difference;
}

// Faults of the device are recorded inputs like positions.
TEST_F(RealDevice, ASessionWithWarmMotorsPlaysAgain) {
  rig_.hd->error = 0x200;
  rig_.hd->error_at = 700;
  rig_.hd->error_ticks = 20;
  rig_.hd->late_at = 1760;
  rig_.hd->late_s = 0.03;
  const Played played = play(scene_file("model = \"phantom\"\nrate = 2000\n"), 1.5);
  EXPECT_EQ(played.result.ticks, 3000U);
  EXPECT_EQ(played.result.recording[705].fault, device::DeviceFault::warm_motors);
  EXPECT_THAT(tests::all(played.result.device_messages), HasSubstr("HD_WARM_MOTORS"));
  const auto again = hybrid::replay(recording(played), {});
  EXPECT_TRUE(again.equal) << "parts at tick " << again.first_difference;
}

TEST_F(RealDevice, WithoutItTheSceneSaysWhatToDo) {
  hybrid::Scene scene = hybrid::load_scene(scene_file());
  rig_.hd->failing_inits = -1;
  try {
    (void)hybrid::open_real_device(scene, rig_.options());
    FAIL();
  } catch (const hybrid::SceneError& e) {
    EXPECT_THAT(e.what(), HasSubstr("ball.toml:10:1: "));
    EXPECT_THAT(e.what(), HasSubstr("switch the device on"));
    EXPECT_THAT(e.what(), HasSubstr("model = \"premium-1.5\""));
  }
}

TEST_F(RealDevice, AToolInsideARigidObjectIsAskedOut) {
  rig_.hd->y_mm = 5;
  rig_.hd->swing_mm = 0;
  try {
    (void)play(scene_file(), 0.1);
    FAIL();
  } catch (const hybrid::SceneError& e) {
    EXPECT_THAT(e.what(), HasSubstr("inside something rigid; move it into free space"));
  }
  EXPECT_TRUE(rig_.hd->forces.empty());
}

TEST_F(RealDevice, ASceneThatIsTooLargeIsToldAndFitted) {
  const std::string large =
      "format = 1\n[[rigid]]\nname = \"box\"\nprimitive = \"box\"\nsize = [100, 300, 50]\n"
      "[path]\nkind = \"press\"\nfrom = [0, 0, 40]\nto = [0, 0, 20]\n[device]\nmodel = "
      "\"phantom\"\n";
  EXPECT_THAT(play(write("large.toml", large), 0.01).placed,
              HasSubstr("out of its reach: [device] scale = 4.35"));
  // The scale is 300 mm plus the tool's 2 mm on each side, divided by the workspace's depth of 70 mm.
  EXPECT_THAT(play(write("large.toml", large + "scale = \"fit\"\n"), 0.01).placed,
              HasSubstr("at scale 4.34"));
}

TEST_F(RealDevice, TheCommandLineMayChooseAnother) {
  hybrid::Scene scene = hybrid::load_scene(scene_file());
  hybrid::use_device(scene, "touch");
  EXPECT_FALSE(scene.real_device.has_value());
  EXPECT_EQ(hybrid::open_real_device(scene, rig_.options()), nullptr);
  EXPECT_EQ(scene.device_model, device::DeviceModel::touch);
  hybrid::use_device(scene, "phantom");
  EXPECT_TRUE(scene.real_device.has_value());
}

}  // namespace
