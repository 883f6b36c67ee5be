// SPDX-License-Identifier: GPL-3.0-or-later
// The session of a window: edits between ticks, pause, single ticks, slow motion, and a recording whose
// replay ends in the same state.
#include "hybrid/session/player.h"

#include <gtest/gtest.h>

#include <fstream>
#include <glm/geometric.hpp>
#include <sstream>
#include <thread>

#include "hybrid/snapshot/make_drawn_scene.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"

namespace {

using enum hybrid::EditedQuantity;
using hybrid::Edit;
using hybrid::PlayRequest;

class PlayerOf : public tests::SceneFile {
 protected:
  void SetUp() override {
    SceneFile::SetUp();
    text_ =
        "format = 1\n" + tests::block + tests::ball + "position = [12, 0, 8]\nfriction = 0.4\n" + tests::path;
    scene_ = load(text_);
    built_ = hybrid::build_scene(scene_);
    drawn_ = hybrid::drawn_scene(scene_, built_, "test");
    player_ = std::make_unique<hybrid::Player>(scene_, built_, drawn_, nullptr);
  }
  void steps(int periods, const PlayRequest& request = {}) {
    for (int n = 0; n < periods; ++n) player_->step(request);
  }
  void expect_replays() {
    hybrid::save_recording(folder_ / "a.rec", player_->recording(text_));
    const hybrid::ReplayResult result = hybrid::replay(hybrid::load_recording(folder_ / "a.rec"), {});
    EXPECT_TRUE(result.equal) << "parts at tick " << result.first_difference;
    EXPECT_EQ(result.ticks, player_->ticks());
  }

  std::string text_;
  hybrid::Scene scene_;
  hybrid::BuiltScene built_;
  hybrid::DrawnScene drawn_;
  std::unique_ptr<hybrid::Player> player_;
};

TEST_F(PlayerOf, AnEditedSessionReplaysToTheSameState) {
  for (const bool apart : {false, true}) {
    if (apart) {
      built_ = hybrid::build_scene(scene_);
      player_ = std::make_unique<hybrid::Player>(scene_, built_, drawn_, nullptr);
      player_->relax_at_once();
    }
    steps(300);
    EXPECT_TRUE(player_->edit({0, Edit::kTool, coupling_stiffness, 450.0}));
    steps(40);
    player_->edit({0, 1, tissue_factor, 4.0});
    player_->edit({0, 0, static_friction, 0.9});
    player_->edit({0, 0, tissue_factor, 4.0});  // a rigid object has no tissue factor
    steps(100, {.dragging = true, .goal_m = {3e-3, 0.0, 4e-3}});
    steps(150);
    const hybrid::Recording recording = player_->recording(text_);
    ASSERT_EQ(recording.edits.size(), 3U) << "what had no effect is left out";
    EXPECT_EQ(recording.edits[0].tick, 300U);
    EXPECT_EQ(recording.edits[1].tick, 340U);
    expect_replays();
    hybrid::Snapshot snapshot;
    player_->snapshot(snapshot);
    for (std::size_t n = 0; n < drawn_.editable.size(); ++n) {
      if (drawn_.editable[n].quantity == coupling_stiffness) {
        EXPECT_EQ(snapshot.values[n], 450.0);
      }
    }
  }
}

TEST_F(PlayerOf, ALiveSessionWithItsThreadsReplaysToTheSameState) {
  {
    const auto relaxation = player_->go_live(60.0);
    std::jthread servo([this] { steps(800); });
    for (int n = 0; n < 40; ++n) {
      player_->edit({0, Edit::kTool, coupling_stiffness, 500.0 + 10.0 * n});
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }
  steps(1);
  EXPECT_EQ(player_->recording(text_).edits.size() + player_->refused_edits(), 40U);
  expect_replays();
}

TEST_F(PlayerOf, ThePartsOfTheForceAddUpToIt) {
  player_->edit({0, Edit::kTool, max_force, 0.3});
  steps(400);
  steps(200, {.dragging = true, .goal_m = {8e-3, 0.0, 6e-3}});
  hybrid::TickSample sample;
  int in_contact = 0, limited = 0;
  while (player_->samples().pop(sample)) {
    float sum_N = 0.0F;
    for (const float part_N : sample.along_N) sum_N += part_N;
    // The limits shorten a force and may turn it a little.
    EXPECT_NEAR(sum_N, sample.total_N, 0.02F + 0.02F * sample.total_N) << sample.t_s;
    in_contact += sample.contacts != 0 ? 1 : 0;
    limited += sample.along_N[static_cast<std::size_t>(hybrid::ForcePart::limits)] < -0.05F ? 1 : 0;
    EXPECT_FLOAT_EQ(glm::length(sample.force_N), sample.total_N);
  }
  EXPECT_GT(in_contact, 200);
  EXPECT_GT(limited, 0);
}

TEST_F(PlayerOf, MoreEditsThanFitAreRefusedAndCounted) {
  const std::size_t most = hybrid::Player::kEditsWaiting;
  for (std::size_t n = 0; n < most + 10; ++n)
    EXPECT_EQ(player_->edit({0, Edit::kTool, coupling_stiffness, 500.0}), n < most);
  EXPECT_EQ(player_->refused_edits(), 10U);
  steps(1);
  EXPECT_TRUE(player_->edit({0, Edit::kTool, coupling_stiffness, 500.0}));
}

TEST_F(PlayerOf, PausesTicksOnceAndSlowsDown) {
  steps(10);
  EXPECT_EQ(player_->ticks(), 10U);
  steps(10, {.paused = true});
  EXPECT_EQ(player_->ticks(), 10U);
  player_->edit({0, Edit::kTool, coupling_stiffness, 450.0});
  steps(10, {.paused = true, .single_ticks = 3});
  EXPECT_EQ(player_->ticks(), 13U);
  EXPECT_TRUE(player_->edited()) << "an edit in a pause is shown";
  steps(1000, {.speed = 0.1, .single_ticks = 3});
  EXPECT_NEAR(static_cast<double>(player_->ticks()), 113.0, 1.0);
  steps(1000, {.speed = 0.01, .single_ticks = 3});
  EXPECT_NEAR(static_cast<double>(player_->ticks()), 123.0, 1.0);
  steps(10, {.hold = 7});
  EXPECT_EQ(player_->held(), 7U);
  expect_replays();
  hybrid::TickSample sample;
  std::uint64_t samples = 0;
  while (player_->samples().pop(sample)) ++samples;
  EXPECT_EQ(samples, player_->ticks()) << "one for each tick";
}

// From one kept state the session goes on in two ways. Each way replays to its own end.
TEST_F(PlayerOf, GoesBackToAKeptStateAndOnAnotherWay) {
  for (const int relaxation : {0, 1, 2}) {
    built_ = hybrid::build_scene(scene_);
    player_ = std::make_unique<hybrid::Player>(scene_, built_, drawn_, nullptr);
    std::unique_ptr<hybrid::RelaxationThread> thread;
    if (relaxation == 1) player_->relax_at_once();
    if (relaxation == 2) thread = player_->go_live(60.0);
    steps(150);
    player_->edit({0, Edit::kTool, coupling_stiffness, 450.0});
    steps(150);
    thread.reset();
    player_->keep_state();
    if (relaxation == 2) thread = player_->relaxation_thread(60.0);
    const glm::dvec3 there = player_->felt().device_m;
    player_->edit({0, Edit::kTool, coupling_stiffness, 900.0});
    steps(200, {.dragging = true, .goal_m = {4e-3, 0.0, 3e-3}});
    for (const bool aside : {true, false}) {
      thread.reset();
      player_->go_back(0);
      if (relaxation == 2) thread = player_->relaxation_thread(60.0);
      EXPECT_EQ(player_->ticks(), 300U);
      EXPECT_EQ(player_->felt().device_m, there);
      EXPECT_EQ(player_->recording(text_).edits.size(), 1U) << "later edits are forgotten";
      const glm::dvec3 force = player_->felt().force_N;
      steps(1);
      EXPECT_LT(glm::distance(player_->felt().device_m, there), 0.2e-3) << "the hand goes on from there";
      EXPECT_LT(glm::distance(player_->felt().force_N, force), 0.02);
      steps(100, {.dragging = aside, .goal_m = {-4e-3, 0.0, 4e-3}});
      thread.reset();
      expect_replays();
      if (relaxation == 2) thread = player_->relaxation_thread(60.0);
    }
  }
}

TEST_F(PlayerOf, KeepsTheLastMinuteOncePerSecond) {
  for (int n = 0; n < 130; ++n) {
    steps(500);
    player_->keep_state();
  }
  ASSERT_GE(player_->kept().size(), 60U);
  EXPECT_LE(player_->kept().size(), 61U);
  const auto& kept = player_->kept();
  for (std::size_t n = 1; n < kept.size(); ++n) EXPECT_EQ(kept[n].ticks - kept[n - 1].ticks, 1000U);
  EXPECT_GT(kept.front().bytes, 10'000U);
  hybrid::Snapshot snapshot;
  player_->snapshot_of(kept[30], snapshot);
  EXPECT_EQ(snapshot.tick, kept[30].ticks);
  EXPECT_EQ(snapshot.device_m, kept[30].felt.device_m);
  EXPECT_THROW(player_->go_back(99), std::runtime_error);
  player_->go_back(30);
  EXPECT_EQ(player_->kept().size(), 31U) << "the future is forgotten";
  steps(10);
  expect_replays();
}

}  // namespace
