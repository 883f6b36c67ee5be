// SPDX-License-Identifier: GPL-3.0-or-later
// A session that goes on in a changed scene feels like a session that was in that scene from the beginning.
// Its clock and edits go on, and its recording replays to the same state.
#include <gtest/gtest.h>

#include <atomic>
#include <fstream>
#include <future>
#include <glm/geometric.hpp>
#include <sstream>
#include <thread>

#include "hybrid/build/choose_model.h"
#include "hybrid/scene/read_scene_text.h"
#include "hybrid/session/player.h"
#include "hybrid/snapshot/make_drawn_scene.h"
#include "tests/hybrid/fixtures/equilibrium.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"

namespace {

using hybrid::Edit;
using hybrid::PlayRequest;

// A scene, built and ready to be played.
struct Built {
  std::string text;
  hybrid::Scene scene;
  hybrid::BuiltScene built;
  hybrid::DrawnScene drawn;
};

class ChangedScene : public tests::SceneFile {
 protected:
  static std::string text_of(const std::string& keys, double young = 8000.0,
                             const std::string& more = tests::ball + "position = [12, 0, 8]\n") {
    return "format = 1\n[device]\nmodel = \"ideal\"\n" + tests::block + "material = \"gel\"\n" + keys +
           "[material.gel]\nyoung = " + std::to_string(young) + "\n" + more +
           "[path]\nkind = \"press\"\nfrom = [0, 0, 20]\nto = [0, 0, 4]\nspeed = 100\nhold = 5\n";
  }
  static std::string with_gel(const std::string& keys) {
    const std::string header = "[material.gel]\n";
    std::string text = text_of({});
    return text.insert(text.find(header) + header.size(), keys);
  }
  std::unique_ptr<Built> build(const std::string& text) const {
    auto out = std::make_unique<Built>();
    out->text = text;
    out->scene = hybrid::read_scene_text(text, folder_ / "scene.toml");
    hybrid::choose_models(out->scene);
    out->built = hybrid::build_scene(out->scene);
    out->drawn = hybrid::drawn_scene(out->scene, out->built, "test");
    return out;
  }
  void begin(const std::string& text) {
    (void)write("scene.toml", text);
    first_ = text;
    now_ = build(text);
    player_ = std::make_unique<hybrid::Player>(now_->scene, now_->built, now_->drawn, nullptr);
  }
  hybrid::ChangeEffect change(const std::string& text) {
    auto next = build(text);
    hybrid::ChangeMade made = player_->change_scene(next->scene, next->built, next->drawn, text);
    made.effect.forces = hybrid::compare_at_rest(now_->built, *next->built.world, *made.after,
                                                 hybrid::jnd_floor_N(next->scene), std::atomic<bool>(false));
    now_ = std::move(next);
    return made.effect;
  }
  void steps(int periods, const PlayRequest& request = {}) {
    for (int n = 0; n < periods; ++n) player_->step(request);
  }
  // The force at rest of a session that was in this scene from the beginning.
  double force_from_the_beginning(const std::string& text, int ticks) const {
    const auto whole = build(text);
    hybrid::Player player(whole->scene, whole->built, whole->drawn, nullptr);
    for (int n = 0; n < ticks; ++n) player.step({});
    const auto force = tests::equilibrium_force(*whole->built.world, *whole->built.state);
    return force ? glm::length(*force) : -1.0;
  }
  void expect_replays() {
    const auto file = folder_ / "a.rec";
    hybrid::save_recording(file, player_->recording(first_));
    const hybrid::ReplayResult result = hybrid::replay(hybrid::load_recording(file), {});
    EXPECT_TRUE(result.equal) << "parts at tick " << result.first_difference;
    EXPECT_EQ(result.ticks, player_->ticks());
  }

  std::string first_;
  std::unique_ptr<Built> now_;
  std::unique_ptr<hybrid::Player> player_;
};

const std::string kTrilinear = "energy = \"trilinear\"\n", kRigid = "model = \"proxy\"\n";

TEST_F(ChangedScene, FeelsAsIfItHadBeenThatSceneFromTheBeginning) {
  const std::string finer = "spacing = 1\n";
  std::string fine = text_of({});
  fine.replace(fine.find("spacing = 2\n"), finer.size(), finer);
  const std::string larger_tool = text_of({}) + "[tool]\nradius = 3\n";
  for (const std::string& text : {text_of({}, 24000.0), text_of(kTrilinear), text_of(kRigid), fine,
                                  with_gel("poisson = 0.1\n"), larger_tool}) {
    begin(text_of({}));
    steps(400);
    const double before = glm::length(player_->felt().force_N);
    const auto effect = change(text);
    EXPECT_TRUE(effect.forces->at_rest);
    EXPECT_GT(effect.forces->before_N, 0.02);
    EXPECT_NEAR(effect.forces->before_N, force_from_the_beginning(first_, 400), 0.01 * before);
    const double wanted = force_from_the_beginning(text, 400);
    EXPECT_NEAR(effect.forces->after_N, wanted, 0.01 * wanted) << text;
    steps(100);
    EXPECT_NEAR(glm::length(player_->felt().force_N), wanted, 0.02 * wanted) << text;
    expect_replays();
  }
}

// There is no force at rest to compare with where links are at their limits, so whole sessions are compared.
TEST_F(ChangedScene, NarrowerLimitsFeelAsFromTheBeginningAndReplay) {
  const std::string narrow = with_gel("stretch = [0.9, 1.1]\nshear = 0.1\n");
  begin(narrow);
  steps(900);
  const double wanted = glm::length(player_->felt().force_N);
  begin(text_of({}));
  steps(400);
  const double wide = glm::length(player_->felt().force_N);
  (void)change(narrow);
  steps(500);
  EXPECT_GT(wanted, 1.1 * wide) << "the limits are felt";
  EXPECT_NEAR(glm::length(player_->felt().force_N), wanted, 0.05 * wanted);
  expect_replays();
}

TEST_F(ChangedScene, ClockAndEditsGoOnAndOtherForcesDoNotJump) {
  begin(text_of({}));
  player_->edit({0, Edit::kTool, hybrid::EditedQuantity::coupling_stiffness, 450.0});
  player_->edit({0, 0, hybrid::EditedQuantity::static_friction, 0.7});
  player_->edit({0, 1, hybrid::EditedQuantity::tissue_factor, 2.0});
  steps(400);
  const glm::dvec3 force = player_->felt().force_N;
  const auto effect = change(text_of({}) + "# the same scene\n");
  EXPECT_EQ(player_->ticks(), 400U);
  EXPECT_EQ(player_->state().tick, 400U);
  EXPECT_EQ(player_->scene_number(), 1U);
  EXPECT_EQ(player_->state().edited.coupling_N_per_m, 450.0);
  EXPECT_EQ(player_->state().edited.feel.at(0)->static_friction, 0.7);
  EXPECT_EQ(player_->state().edited.tissue_factor.at(0), 2.0);
  EXPECT_LT(effect.forces->difference_jnd, 0.2);
  steps(1);
  EXPECT_LT(glm::length(player_->felt().force_N - force), 0.02 * glm::length(force));
  expect_replays();
}

TEST_F(ChangedScene, ForcesComparedWhileTheSessionGoesOnAreThoseOfTheMomentOfTheChange) {
  begin(text_of({}));
  steps(400);
  auto next = build(text_of({}, 24000.0));
  const hybrid::ChangeMade made = player_->change_scene(next->scene, next->built, next->drawn, next->text);
  const double floor_N = hybrid::jnd_floor_N(next->scene);
  const auto compare = [&](const std::atomic<bool>& stop) {
    return hybrid::compare_at_rest(now_->built, *next->built.world, *made.after, floor_N, stop);
  };
  const auto at_once = compare(std::atomic<bool>(false));
  const std::atomic<bool> go_on(false), stop(true);
  auto beside = std::async(std::launch::async, [&] { return compare(go_on); });
  steps(300, {.dragging = true, .goal_m = player_->felt().device_m + glm::dvec3(0.0, 0.0, 5e-3)});
  const auto later = beside.get();
  ASSERT_TRUE(at_once && later);
  EXPECT_EQ(later->before_N, at_once->before_N);
  EXPECT_EQ(later->after_N, at_once->after_N);
  EXPECT_GT(later->difference_jnd, 1.0);
  EXPECT_FALSE(compare(stop)) << "it ends when it is told to";
  expect_replays();
  player_.reset();
}

TEST_F(ChangedScene, ChangesAndEditsBetweenTheSameTicksReplayInTheirOrder) {
  begin(text_of({}));
  player_->relax_at_once();
  steps(250);
  player_->edit({0, 1, hybrid::EditedQuantity::tissue_factor, 3.0});
  (void)change(text_of(kRigid));
  player_->edit({0, 1, hybrid::EditedQuantity::static_friction, 0.5});  // the block is rigid number 1 now
  (void)change(text_of(kRigid + kTrilinear));
  steps(100, {.dragging = true, .goal_m = {3e-3, 0.0, 4e-3}});
  (void)change(text_of({}));
  (void)change(text_of(kTrilinear, 16000.0));
  steps(100);
  (void)change(text_of({}));
  const hybrid::Recording recording = player_->recording(first_);
  EXPECT_EQ(recording.changes.size(), 5U);
  EXPECT_EQ(recording.edits.size(), 2U);
  EXPECT_EQ(recording.changes[0].edits_before, 1U);
  expect_replays();
}

TEST_F(ChangedScene, ALiveSessionReplays) {
  begin(text_of({}));
  auto relaxation = player_->go_live(60.0);
  steps(300);
  relaxation.reset();
  (void)change(text_of({}, 16000.0));
  relaxation = player_->relaxation_thread(60.0);
  steps(300, {.dragging = true, .goal_m = {3e-3, 0.0, 4e-3}});
  relaxation.reset();
  expect_replays();
}

TEST_F(ChangedScene, AToolThatIsInTheNewObjectIsPutOutsideIt) {
  begin(text_of({}));
  steps(400);
  const std::string in_the_way = tests::ball + "position = [0, 0, 3]\n";
  (void)change(text_of({}, 8000.0, in_the_way));
  steps(10);
  const glm::dvec3 proxy = player_->felt().proxy_m;
  const double apart = glm::distance(proxy, glm::dvec3(0.0, 0.0, 3e-3));
  EXPECT_GE(apart, 4e-3 + now_->built.world->tool.radius_m - 1e-9);
  EXPECT_LT(apart, 4.2e-3 + now_->built.world->tool.radius_m);
  expect_replays();
}

TEST_F(ChangedScene, WithMovingObjectsIsRefusedAndTheSessionGoesOn) {
  begin(text_of({}));
  steps(300);
  const std::string moving =
      tests::ball + "position = [30, 0, 8]\nmotion = { spin = { axis = [0, 0, 1], rate = 1 } }\n";
  const glm::dvec3 force = player_->felt().force_N;
  EXPECT_THROW((void)change(text_of({}, 8000.0, moving)), std::runtime_error);
  EXPECT_EQ(player_->scene_number(), 0U);
  steps(1);
  EXPECT_LT(glm::length(player_->felt().force_N - force), 0.05);
  expect_replays();
}

TEST_F(ChangedScene, ADamagedRecordingIsRefused) {
  begin(text_of({}));
  steps(20);
  (void)change(text_of(kTrilinear));
  steps(5);
  player_->edit({0, Edit::kTool, hybrid::EditedQuantity::coupling_stiffness, 450.0});
  steps(5);
  const auto file = folder_ / "a.rec";
  hybrid::save_recording(file, player_->recording(first_));
  std::ifstream in(file, std::ios::binary);
  std::ostringstream whole;
  whole << in.rdbuf();
  const std::string bytes = whole.str();
  const std::size_t changes = bytes.size() - sizeof(Edit) - now_->text.size() - 32;
  for (std::size_t size = changes; size < bytes.size() - sizeof(Edit); ++size) {
    (void)write("b.rec", bytes.substr(0, size));
    EXPECT_THROW((void)hybrid::load_recording(folder_ / "b.rec"), std::runtime_error) << size;
  }
  // Each field in turn is out of its range: the count, the tick, the earlier edits, the size of the text.
  for (std::size_t at = changes; at < changes + 32; at += 8) {
    std::string bad = bytes;
    bad[at + 7] = '\x40';
    (void)write("b.rec", bad);
    EXPECT_THROW((void)hybrid::load_recording(folder_ / "b.rec"), std::runtime_error) << at - changes;
  }
}

}  // namespace
