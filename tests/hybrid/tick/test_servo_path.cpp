// SPDX-License-Identifier: GPL-3.0-or-later
// After the build, a tick allocates nothing, takes no lock, waits for no thread, throws nothing, and neither
// reads nor writes a file. This program counts all such calls while its thread is watched.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "hybrid/base/flush_to_zero.h"
#include "hybrid/session/player.h"
#include "hybrid/session/session.h"
#include "hybrid/snapshot/make_drawn_scene.h"
#include "hybrid/tick/tissue/async_relaxation.h"
#include "hybrid/world/edits.h"
#include "tests/hybrid/fixtures/counted_calls.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"
#include "tests/shared_data.h"

namespace {

using tests::calls;
using tests::Calls;
using tests::watched;

constexpr int kTicks = 10'000;
std::vector<hybrid::EditableValue> values;

TEST(ServoPath, TheCountersCount) {
  std::mutex mutex;
  calls = {};
  watched = true;
  const auto something = std::make_unique<int>(1);
  const std::size_t by_new = calls.allocations;
  void* const memory = std::malloc(10);
  const std::size_t by_malloc = calls.allocations - by_new;
  mutex.lock();
  mutex.unlock();
  std::this_thread::yield();
  try {
    throw 1;
  } catch (int) {
  }
  if (::write(-1, "", 0) == 0) ADD_FAILURE() << "there is no such file";
  watched = false;
  std::free(memory);
  EXPECT_GE(by_new, 1U) << *something;
  if (COUNTS_CALLS == 0) GTEST_SKIP() << "skipped: a sanitizer brings its own functions";
  EXPECT_EQ(by_malloc, 1U);
  EXPECT_EQ(calls.locks, 1U);
  EXPECT_EQ(calls.waits, 1U);
  EXPECT_EQ(calls.throws, 1U);
  EXPECT_EQ(calls.files, 1U);
}

// Edits the scene's values in turn. Each is set a little above or below its value in the scene.
void edit_in_turns(const hybrid::BuiltScene& built, std::uint64_t tick) {
  if (tick % 10 != 0 || values.empty()) return;
  const hybrid::EditableValue& value = values[tick / 10 % values.size()];
  const double changed = std::min(value.in_scene * (tick % 20 == 0 ? 0.9 : 1.1), value.range.high);
  hybrid::apply_edit(*built.world, *built.state, {tick, value.object, value.quantity, changed});
}

void watch_ticks(const hybrid::Scene& scene, const hybrid::BuiltScene& built, bool asynchronous,
                 bool edited = false) {
  values = hybrid::editable_values(*built.world, *built.state);
  const auto device = hybrid::scene_device(scene, hybrid::scene_path(scene));
  hybrid::set_flush_to_zero();
  hybrid::begin_session(scene, *built.world, *built.state, device->read().position_m);
  // The tick itself does the other thread's work here, so that this work is watched too.
  if (asynchronous) hybrid::start_async_relaxation(*built.state, hybrid::Arrival::counted);
  const double dt = 1.0 / scene.rate_hz;
  std::size_t felt_ticks = 0;
  calls = {};
  watched = true;
  for (int tick = 0; tick < kTicks; ++tick) {
    if (edited) edit_in_turns(built, static_cast<std::uint64_t>(tick));
    const hybrid::TickResult felt = hybrid::haptic_tick(*built.world, *built.state, device->read(), dt);
    device->write(felt.force_N, dt);
    felt_ticks += felt.contacts != 0 ? 1 : 0;
  }
  watched = false;
  EXPECT_EQ(calls, Calls{});
  EXPECT_GT(felt_ticks, 500U) << "the path is meant to touch something";
  EXPECT_EQ(built.state->nonfinite, 0U);
  EXPECT_EQ(built.state->faults, 0U);
}

class ServoPathOf : public ::testing::TestWithParam<const char*> {
 protected:
  static void watch(bool asynchronous);
};

TEST_P(ServoPathOf, AllItsTicks) {
  watch(false);
}

TEST_P(ServoPathOf, AllItsTicksRelaxedApart) {
  watch(true);
}

void ServoPathOf::watch(bool asynchronous) {
  std::unique_ptr<hybrid::Scene> scene;
  try {
    scene = std::make_unique<hybrid::Scene>(
        hybrid::load_scene(std::filesystem::path(HYBRID_SOURCE_DIR) / "scenes" / GetParam()));
  } catch (const hybrid::SceneError& error) {
    // The head is the only scene that needs a file from outside the repository.
    NEED_DATA(std::string(GetParam()) != "head.toml", error.what());
    throw;
  }
  const hybrid::BuiltScene built = hybrid::build_scene(*scene);
  if (asynchronous && built.state->soft.empty()) GTEST_SKIP() << "skipped: nothing soft in it";
  watch_ticks(*scene, built, asynchronous);
}

// Features that no shipped scene has.
class ServoPathIn : public tests::SceneFile {
 protected:
  static std::string scene(const std::string& soft) {
    return "format = 1\n[material.gel]\nyoung = 10000\npoisson = 0.3\nstretch = [0.9, 1.1]\nshear = 0.1\n"
           "[material.plate]\nyoung = 10000\npoisson = 0.3\nstretch = [1, 1]\nshear = 0\n"
           "[[soft]]\nname = \"block\"\nformula = \"block\"\nmaterial = \"gel\"\n" +
           soft +
           "[tool]\nradius = 8\n[path]\nkind = \"waypoints\"\nspeed = 100\npoints = [[0, 0, 50], [0, 0, 36], "
           "[12, 5, 34], [12, 5, 50], [-9, 3, 36, 0.2], [-9, 3, 50], [0, 0, 36, 8]]\n";
  }
};

TEST_F(ServoPathIn, AllTicksOfAContactOnACompositeGrid) {
  const hybrid::Scene grid = load(scene("size = [64, 64, 64]\nspacing = 1\n"));
  const hybrid::BuiltScene built = hybrid::build_scene(grid);
  ASSERT_TRUE(built.state->soft[0]->uses_patches());
  watch_ticks(grid, built, true);
}

TEST_F(ServoPathIn, AllTicksBetweenEdits) {
  const hybrid::Scene felt =
      load("format = 1\n" + tests::block +
           "[[rigid]]\nname = \"plate\"\nprimitive = \"box\"\nsize = [20, 20, 10]\nposition = [30, 0, 0]\n"
           "friction = 0.4\ndamping = 1\ntexture = { pattern = \"bumps\", size = 3, height = 0.3 }\n"
           "[path]\nkind = \"waypoints\"\nspeed = 60\npoints = [[0, 0, 20], [0, 0, 5, 1], [30, 0, 20], [28, "
           "0, 4], "
           "[34, 2, 4, 2]]\n");
  for (const bool asynchronous : {false, true})
    watch_ticks(felt, hybrid::build_scene(felt), asynchronous, true);
}

// The session of a window takes edits and requests, records, and passes on every tick.
TEST_F(ServoPathIn, AllTicksOfAPlayer) {
  const hybrid::Scene pressed =
      load("format = 1\n" + tests::block + tests::ball + "position = [12, 0, 8]\n" + tests::path);
  hybrid::BuiltScene built = hybrid::build_scene(pressed);
  const hybrid::DrawnScene drawn = hybrid::drawn_scene(pressed, built, "");
  hybrid::Player player(pressed, built, drawn, nullptr);
  player.relax_at_once();
  calls = {};
  watched = true;
  for (std::uint32_t n = 0; n < 3000; ++n) {
    if (n % 7 == 0)
      player.edit({0, hybrid::Edit::kTool, hybrid::EditedQuantity::coupling_stiffness, 500.0 + 0.1 * n});
    player.step({.dragging = n > 1500,
                 .paused = n % 50 == 49,
                 .speed = n < 1000 ? 0.5 : 1.0,
                 .restarts = n / 1000,
                 .goal_m = {2e-3, 0.0, 4e-3}});
  }
  watched = false;
  EXPECT_EQ(calls, Calls{});
  EXPECT_GT(player.samples().refused() + player.ticks(), 2000U);
}

TEST_F(ServoPathIn, AllTicksOfAPartWithoutSlack) {
  const hybrid::Scene layers =
      load(scene("size = [64, 64, 64]\nspacing = 4\nlabel = 1\nlayers = [{ thickness = 52, label = 1 }, { "
                 "thickness = 12, label = 2 }]\nmaterials = { \"2\" = \"plate\" }\n"));
  for (const bool asynchronous : {false, true}) {
    const hybrid::BuiltScene built = hybrid::build_scene(layers);
    ASSERT_EQ(built.state->soft[0]->lattice().block_count(), 1U);
    watch_ticks(layers, built, asynchronous);
  }
}

INSTANTIATE_TEST_SUITE_P(ShippedScenes, ServoPathOf,
                         ::testing::Values("cube.toml", "sheet.toml", "ball-and-block.toml", "two-soft.toml",
                                           "head.toml", "thin-sheet.toml", "convex-edge.toml",
                                           "textured-plate.toml", "moving.toml", "wall.toml", "tissue.toml",
                                           "edge-of-bone.toml", "tissue-on-bone.toml", "cleft.toml",
                                           "pushed-tissue.toml", "dropped-weight.toml", "layers.toml"),
                         [](const auto& scene) {
                           std::string name = scene.param;
                           name.resize(name.find('.'));
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

// The list must contain every shipped scene.
TEST(ServoPath, KnowsEveryShippedScene) {
  std::size_t scenes = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::filesystem::path(HYBRID_SOURCE_DIR) / "scenes")) {
    scenes += entry.path().extension() == ".toml" ? 1 : 0;
  }
  EXPECT_EQ(scenes, 17U) << "add the new scene to the list above";
}

}  // namespace
