// SPDX-License-Identifier: GPL-3.0-or-later
// The search for settings on a small scene: its errors equal those of `compare`, and an interrupted search
// continues where it stopped.
#include "hybrid/tune/tune.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "device/loop/stop_signal.h"
#include "hybrid/build/build_objects.h"
#include "hybrid/compare/compare.h"
#include "hybrid/compare/compare_scenes.h"
#include "hybrid/feel/just_noticeable.h"
#include "hybrid/session/session.h"
#include "hybrid/tick/tick.h"
#include "hybrid/tune/edit_scene.h"
#include "hybrid/tune/tune_page.h"
#include "hybrid/tune/tune_plot.h"
#include "hybrid/tune/tune_report.h"
#include "tests/hybrid/fixtures/equilibrium.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"

namespace {

using hybrid::Motion;
using hybrid::Scene;
using hybrid::TuneResult;
using testing::HasSubstr;

class Tune : public tests::SceneFile {
 protected:
  std::filesystem::path gel(const std::string& name, const std::string& spacing,
                            const std::string& to = "[0, 0, 6.5]") const {
    return write(name,
                 "format = 1\n[tool]\nradius = 4\nstiffness = 1500\n[material.gel]\nyoung = 8000\n[[soft]]\n"
                 "name = \"block\"\nformula = \"block\"\nsize = [24, 24, 10]\nspacing = " +
                     spacing + "\nmaterial = \"gel\"\n[path]\nkind = \"press\"\nfrom = [0, 0, 10]\nto = " +
                     to + "\nhold = 0.1\nspeed = 40\n");
  }
};

const std::vector<std::string> kBlock{"block"};

TEST_F(Tune, AnErrorIsWhatCompareSaysOfTheTwoFiles) {
  const std::vector scenes{hybrid::load_scene(gel("a.toml", "2")), hybrid::load_scene(gel("b.toml", "3"))};
  const auto compared = hybrid::compare_scenes(scenes, false, {}).scenes[1];
  const Scene a = hybrid::on_ideal_device(scenes[0]), b = hybrid::on_ideal_device(scenes[1]);
  const Motion motion = hybrid::scene_motion(a);
  const auto reference = hybrid::play_setting(a, kBlock, motion, {}).course;
  const auto other = hybrid::play_setting(b, kBlock, motion, {});
  const auto error = hybrid::felt_error(other.course, reference, hybrid::jnd_floor_N(a), 1.0 / a.rate_hz);
  EXPECT_GT(error.worst_jnd(), 0.0);
  EXPECT_NEAR(error.moving.p99_jnd, compared.moving.p99_jnd, 1e-9);
  EXPECT_NEAR(error.still.p99_jnd, compared.still.p99_jnd, 1e-9);
  EXPECT_NEAR(error.still.max_jnd, compared.still.max_jnd, 1e-9);
  EXPECT_EQ(error.moving.ticks, compared.moving.ticks);
  EXPECT_EQ(other.soft_voxels, compared.soft_voxels);
  EXPECT_GT(other.memory_bytes, 0U);
}

// In each pose a truth is at rest. Longer relaxation does not change its force. Each run gives the same
// truth.
TEST_F(Tune, ATruthIsAtRestInItsPoses) {
  const Scene scene = hybrid::on_ideal_device(hybrid::load_scene(gel("a.toml", "2")));
  const Motion motion = hybrid::scene_motion(scene);
  const auto session = hybrid::play_setting(scene, kBlock, motion, {}).course;
  const hybrid::Poses poses = hybrid::poses_along(session, 1e-3, false, 12);
  const auto truth = hybrid::play_to_rest(scene, kBlock, motion, poses, 10, {});
  EXPECT_EQ(hybrid::felt_error(truth.course,
                               hybrid::play_to_rest(scene, kBlock, motion, poses, 10, {}).course, 0.04, 1e-3)
                .worst_jnd(),
            0.0);
  EXPECT_LT(hybrid::felt_error(truth.halfway, truth.course, 0.04, 1e-3).worst_jnd(), 0.2);
  hybrid::BuiltScene built = hybrid::build_scene(scene);
  hybrid::begin_session(scene, *built.world, *built.state, truth.course.front().device_m);
  std::size_t held = 0;
  for (std::size_t t = 0; t < truth.course.size(); ++t) {
    const device::DeviceState at{.position_m = truth.course[t].device_m};
    (void)hybrid::haptic_tick(*built.world, *built.state, at, 1e-3);
    if (!poses.held[t] || !truth.course[t].soft) continue;
    const auto rest_N = tests::equilibrium_force(*built.world, *built.state);
    ASSERT_TRUE(rest_N);
    EXPECT_LT(hybrid::jnd_of(truth.course[t].force_N, *rest_N, 0.04), 0.2) << t;
    ++held;
  }
  EXPECT_GT(held, 6U);
}

TEST_F(Tune, PosesLieInContactsAndWhereTheDeviceStops) {
  // At 0.5 mm per tick, the device is free for 100 ticks and in contact for 100. It then stays in contact for
  // 50 ticks without motion, and moves away.
  hybrid::ForceCourse course;
  for (int t = 0; t < 400; ++t) {
    const double moved = t < 200 ? t : t < 250 ? 200 : t - 50;
    course.push_back({.device_m = {5e-4 * moved, 0.0, 0.0}, .soft = t >= 100 && t < 250});
  }
  const hybrid::Poses poses = hybrid::poses_along(course, 1e-3, false, 10);
  int moving = 0, stops = 0;
  for (std::size_t t = 0; t < course.size(); ++t) {
    EXPECT_EQ(poses.near[t], t >= 80 && t < 270) << t;
    if (!poses.held[t]) continue;
    EXPECT_TRUE(poses.near[t]);
    (t > 200 && t <= 250 ? stops : moving) += 1;
  }
  EXPECT_LE(moving, 10);
  EXPECT_GE(moving, 7);
  EXPECT_EQ(stops, 1);
  EXPECT_EQ(std::ranges::count(hybrid::every_nth(poses, 100).held, true), 2);
  // Bodies that move may move the tissue at any time, so no pose is a stop.
  const hybrid::Poses moved = hybrid::poses_along(course, 1e-3, true, 10);
  EXPECT_EQ(std::ranges::count(moved.stops, true), 0);
  EXPECT_EQ(std::ranges::count(moved.held, true), 10);
}

// Divided voxels fill the same body, so surfaces, materials and anchors stay in place.
TEST_F(Tune, ATruthHasTheScenesOwnShape) {
  const Scene scene =
      hybrid::read_scene(write("ball.toml",
                               "format = 1\n[material.gel]\nyoung = 8000\n[[soft]]\nname = \"ball\"\n"
                               "formula = \"ball\"\nsize = 20\nspacing = 3\nposition = [1, 2, 3]\n" +
                                   tests::path));
  const auto objects = hybrid::tunable_objects(scene);
  const auto volume = [&](int split) {
    std::vector<hybrid::BuildNote> notes;
    return hybrid::build_volume(hybrid::as_reference(scene, hybrid::own_setting(objects), split).soft.front(),
                                notes);
  };
  const auto own = volume(1), divided = volume(2);
  for (std::size_t d = 0; d < 3; ++d) {
    const auto axis = static_cast<int>(d);
    ASSERT_EQ(divided.dims[d], 2 * own.dims[d]);
    EXPECT_DOUBLE_EQ(divided.spacing_m[axis], 0.5 * own.spacing_m[axis]);
    EXPECT_NEAR(divided.origin_m[axis] - 0.5 * divided.spacing_m[axis],
                own.origin_m[axis] - 0.5 * own.spacing_m[axis], 1e-12);
  }
  for (int k = 0; k < divided.dims[2]; ++k) {
    for (int j = 0; j < divided.dims[1]; ++j) {
      for (int i = 0; i < divided.dims[0]; ++i)
        ASSERT_EQ(divided.labels[divided.index(i, j, k)], own.labels[own.index(i / 2, j / 2, k / 2)]);
    }
  }
}

hybrid::TruthPlan plan_of(const Scene& scene, const std::vector<hybrid::TunableObject>& objects, bool quick) {
  return {.as_read = scene, .objects = objects, .names = kBlock, .quick = quick};
}

void expect_equal(const TuneResult& a, const TuneResult& b, bool times) {
  ASSERT_EQ(a.settings.size(), b.settings.size());
  for (std::size_t n = 0; n < a.settings.size(); ++n) {
    EXPECT_TRUE(a.settings[n].setting == b.settings[n].setting);
    if (!times && !(a.settings[n].whole() && b.settings[n].whole())) continue;
    EXPECT_EQ(a.settings[n].error.moving.p99_jnd, b.settings[n].error.moving.p99_jnd);
    EXPECT_EQ(a.settings[n].error.still.p99_jnd, b.settings[n].error.still.p99_jnd);
    if (!times) continue;
    EXPECT_EQ(a.settings[n].left_out, b.settings[n].left_out);
    EXPECT_EQ(a.settings[n].tick_us.p999, b.settings[n].tick_us.p999);
    EXPECT_EQ(a.settings[n].pass_p999_us, b.settings[n].pass_p999_us);
  }
  if (!times) return;
  EXPECT_EQ(a.front, b.front);
  EXPECT_EQ(a.chosen, b.chosen);
  EXPECT_EQ(a.confirmation.error.still.p99_jnd, b.confirmation.error.still.p99_jnd);
}

TEST_F(Tune, ASearchThatWasEndedGoesOnAndGivesTheSame) {
  const Scene scene = hybrid::read_scene(gel("a.toml", "2"));
  hybrid::TuneOptions options{.quick = true, .cache = folder_ / "cache", .progress = {}};
  const auto kept = [&] {
    const auto files = std::filesystem::directory_iterator(options.cache);
    return std::distance(begin(files), end(files));
  };
  int messages = 0;
  options.progress = [&messages](const std::string&) {
    if (++messages > 120) throw device::StopAsked{15};
  };
  EXPECT_THROW((void)hybrid::tune(scene, options), device::StopAsked);
  const auto at_stop = kept();
  EXPECT_GT(at_stop, 3);
  options.progress = {};
  const TuneResult resumed = hybrid::tune(scene, options);
  const auto at_end = kept();
  EXPECT_GT(at_end, at_stop);
  expect_equal(resumed, hybrid::tune(scene, options), true);
  EXPECT_EQ(kept(), at_end);
  const auto objects = hybrid::tunable_objects(scene);
  const Motion motion = hybrid::scene_motion(hybrid::with_setting(scene, hybrid::own_setting(objects)));
  const hybrid::Step step = [](const std::string&, double, const auto& work) { work({}); };
  // A search with more poses has other keys, so it reuses no error of this search.
  EXPECT_NE(hybrid::measure_truth(plan_of(scene, objects, true), motion, {{}, scene}, step).key,
            hybrid::measure_truth(plan_of(scene, objects, false), motion, {{}, scene}, step).key);
  options.cache.clear();
  expect_equal(resumed, hybrid::tune(scene, options), false);

  // The result has all parts that a user sees: front, truth, confirmation, text, JSON and plot.
  EXPECT_GE(resumed.front.size(), 3U);
  EXPECT_LT(resumed.truth.error_jnd(), 2.0);
  EXPECT_TRUE(resumed.confirmation.not_done.empty()) << resumed.confirmation.not_done;
  EXPECT_GT(resumed.confirmation.error.still.ticks, 50U);
  EXPECT_THAT(hybrid::tune_words(resumed), HasSubstr("(as it is)"));
  const auto json = hybrid::tune_json(resumed);
  EXPECT_EQ(json.at("settings").size(), resumed.settings.size());
  EXPECT_EQ(json.at("front").size(), resumed.front.size());
  EXPECT_GT(hybrid::tune_svg(resumed, "a < b").size(), 2000U);
  const hybrid::Page page = hybrid::tune_page(resumed, "a < b");
  EXPECT_EQ(page.verdict, hybrid::tune_verdict(resumed));
  const auto whole = std::ranges::count_if(resumed.settings, &hybrid::TunedSetting::whole);
  EXPECT_EQ(hybrid::page_json(page)["tables"][0]["rows"].size(), static_cast<std::size_t>(whole));
  EXPECT_THAT(hybrid::to_html(page), HasSubstr("a &lt; b"));
}

TEST_F(Tune, AnotherSceneAnotherFileAndADamagedRecordAreNotFound) {
  const auto file = gel("a.toml", "2");
  const std::filesystem::path cache = folder_ / "cache";
  hybrid::EvaluationCache(cache, hybrid::read_scene(file)).keep("text", {{"value", 0.1}});
  const auto found = [&] { return hybrid::EvaluationCache(cache, hybrid::read_scene(file)).find("text"); };
  ASSERT_TRUE(found());
  EXPECT_EQ(found()->at("value"), 0.1);
  (void)gel("a.toml", "3");
  EXPECT_FALSE(found());
  (void)gel("a.toml", "2");
  EXPECT_TRUE(found());
  const auto record = std::filesystem::directory_iterator(cache)->path();
  std::filesystem::resize_file(record, std::filesystem::file_size(record) / 2);
  EXPECT_FALSE(found());
  std::ofstream(record) << R"({"key": 5, "record": {"value": 0.1}})";
  EXPECT_FALSE(found()) << "a key that is no text";
}

// A result with a single setting, whose error of 0.4 JND is within the bound.
TuneResult one_setting(double truth_error_jnd, double confirmed_jnd) {
  TuneResult result;
  result.settings.resize(1);
  result.settings[0].words = "2 mm six-link";
  result.settings[0].error.still = {.ticks = 10, .p99_jnd = 0.4};
  result.settings[0].tick_us.p999 = 100.0;
  result.front = {0};
  result.truth.rest.still = {.ticks = 10, .p99_jnd = truth_error_jnd};
  result.confirmation.error.still = {.ticks = 10, .p99_jnd = confirmed_jnd};
  return result;
}

TEST_F(Tune, AVerdictSaysFirstThatTheTruthIsTooUncertainForIt) {
  const std::string sure = hybrid::tune_verdict(one_setting(0.2, 0.5));
  EXPECT_THAT(sure, testing::StartsWith("2 mm six-link"));
  EXPECT_THAT(sure, testing::Not(HasSubstr("uncertain")));
  EXPECT_THAT(hybrid::tune_verdict(one_setting(0.8, 0.5)), HasSubstr("may lie on the other side of 1 JND"));
  EXPECT_THAT(hybrid::tune_verdict(one_setting(4.8, 0.5)),
              testing::StartsWith("The truth is itself uncertain by 4.80 JND, so no setting is shown"));
  EXPECT_THAT(hybrid::tune_verdict(one_setting(0.2, 1.9)), HasSubstr("off by 1.90 JND, more than the bound"));
}

TEST_F(Tune, AVerdictKeepsTheSceneApartFromItsSetting) {
  TuneResult result = one_setting(0.2, 0.5);
  EXPECT_THAT(hybrid::tune_verdict(result), testing::Not(HasSubstr("the scene's own voxels")));
  result.truth.spacing = hybrid::SettingError{};
  result.truth.spacing->still = {.ticks = 10, .p99_jnd = 2.3};
  EXPECT_THAT(hybrid::tune_verdict(result), testing::StartsWith("2 mm six-link"));
  EXPECT_THAT(hybrid::tune_verdict(result), HasSubstr("differ from ever finer ones by about 2.3 JND"));
  // The verdict does not call a setting enough that is only the most accurate within the time.
  result.settings[0].setting.objects = {{.object = "block", .proxy = true}};
  EXPECT_THAT(hybrid::tune_verdict(result), HasSubstr("A proxy is enough here"));
  result.choice.rule = hybrid::ChoiceRule::most_accurate_in_time;
  EXPECT_THAT(hybrid::tune_verdict(result), testing::Not(HasSubstr("is enough")));
}

// A shallow press into soft gel, and then, if `rigid`, one onto a rigid box beside it.
std::string gel_and_box(bool rigid) {
  std::string text =
      "format = 1\n[tool] # the tool\nradius = 4\nstiffness = 1500\n[material.gel]\nyoung = 12000\n[[soft]]\n"
      "name = \"block\"\nformula = \"block\"\nsize = [24, 24, 10]\nspacing = 2\nmaterial = \"gel\"\n";
  if (rigid)
    text += "[[rigid]]\nname = \"box\"\nprimitive = \"box\"\nsize = [20, 20, 10]\nposition = [40, 0, 0]\n";
  text += "[path]\nkind = \"waypoints\"\nspeed = 30\npoints = [[0, 0, 10], [0, 0, 7.2, 0.1], [0, 0, 10]";
  if (rigid) text += ", [40, 0, 10], [40, 0, 8.5, 0.1], [40, 0, 10]";
  return text + "]\n";
}

TEST_F(Tune, AProxyWithAFittedCouplingIsChosenWhereItIsEnough) {
  const auto file = write("gel.toml", gel_and_box(false));
  const Scene scene = hybrid::read_scene(file);
  const TuneResult result = hybrid::tune(scene, {.quick = true, .cache = {}, .progress = {}});
  const hybrid::TunedSetting& chosen = result.settings[result.chosen];
  ASSERT_TRUE(chosen.match) << chosen.words;
  EXPECT_TRUE(chosen.setting.objects[0].proxy);
  EXPECT_NEAR(*chosen.setting.coupling_N_per_m, chosen.match->stiffness_N_per_m,
              1e-3 * chosen.match->stiffness_N_per_m);
  EXPECT_THAT(hybrid::tune_verdict(result), HasSubstr("A proxy is enough here"));
  EXPECT_THAT(hybrid::tune_reason(result), HasSubstr("its coupling fits the truth's force up to"));

  // The written scene gives the same forces as the setting.
  std::ifstream in(file);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const std::string edited = hybrid::edited_scene(text, file, result.objects, chosen.setting, "why");
  EXPECT_THAT(edited, HasSubstr("[tool] # the tool\n"));
  EXPECT_THAT(edited, HasSubstr("model = \"proxy\""));
  EXPECT_THAT(edited, HasSubstr("# hybrid tune: why\nstiffness = "));
  const Scene written = hybrid::on_ideal_device(hybrid::load_scene(write("written.toml", edited)));
  const auto along = [&](const Scene& s) {
    return hybrid::play_setting(s, kBlock, hybrid::scene_motion(written), {}).course;
  };
  const auto played = along(written);
  const auto error = [&](const hybrid::ForceCourse& reference) {
    return hybrid::felt_error(played, reference, result.floor_N, 1.0 / scene.rate_hz).worst_jnd();
  };
  EXPECT_EQ(error(along(hybrid::with_setting(scene, chosen.setting))), 0.0);
  // A setting is played along the scene's path and a second motion. Its error is the larger of the two.
  EXPECT_FALSE(result.second_motion.empty());
  EXPECT_LE(error(result.truth.course), chosen.error.worst_jnd() + 1e-9);
  EXPECT_GT(error(result.truth.course), 0.0);
}

TEST_F(Tune, AFittedCouplingIsJudgedAtTheRigidObjectsToo) {
  const Scene scene = hybrid::read_scene(write("both.toml", gel_and_box(true)));
  const TuneResult result = hybrid::tune(scene, {.quick = true, .cache = {}, .progress = {}});
  const auto fitted =
      std::ranges::find_if(result.settings, [](const auto& s) { return s.match.has_value(); });
  ASSERT_NE(fitted, result.settings.end());
  EXPECT_LT(fitted->at_soft.worst_jnd(), 1.0);
  EXPECT_GT(fitted->error.worst_jnd(), 5.0);
  EXPECT_FALSE(result.settings[result.chosen].match);
  EXPECT_THAT(hybrid::tune_verdict(result), HasSubstr("where its coupling meets others, too"));
}

TEST_F(Tune, APathThatTouchesNothingSoftIsRefused) {
  const Scene scene = hybrid::read_scene(gel("a.toml", "2", "[0, 0, 9.8]"));
  try {
    (void)hybrid::tune(scene, {.quick = true, .cache = {}, .progress = {}});
    ADD_FAILURE() << "accepted";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("touches nothing soft"));
  }
}

TEST_F(Tune, LessWorkIsTriedWhereItHasAnEffect) {
  const auto objects = hybrid::tunable_objects(
      hybrid::read_scene(write("s.toml", "format = 1\n" + tests::block + tests::path)));
  hybrid::Setting own = hybrid::own_setting(objects);
  const auto voxels = hybrid::settings_with_less_work(own, false);
  ASSERT_EQ(voxels.size(), 2U);
  for (const auto& setting : voxels) {
    EXPECT_LT(setting.objects[0].work, 1.0);
    EXPECT_EQ(setting.objects[0].patch, own.objects[0].patch);
  }
  EXPECT_EQ(hybrid::settings_with_less_work(own, true).size(), 3U);
  EXPECT_THAT(hybrid::in_words(voxels[0], 1e-3), HasSubstr("six-link, work 0.5"));
  EXPECT_THAT(hybrid::as_toml(voxels[0]), HasSubstr("work = 0.5\n"));
  // The truth does all of the work, although the scene has `work = 0.5`.
  EXPECT_EQ(hybrid::as_reference(hybrid::read_scene(write(
                                     "s.toml", "format = 1\n" + tests::block + "work = 0.5\n" + tests::path)),
                                 voxels[0])
                .soft[0]
                .work,
            1.0);
  own.objects[0].proxy = true;
  EXPECT_TRUE(hybrid::settings_with_less_work(own, true).empty());
}

TEST_F(Tune, SettingsBesideOneChangeOneObject) {
  const std::string two = tests::block +
                          "position = [0, 0, 0]\n[[soft]]\nname = \"other\"\nformula = \"ball\"\n" +
                          "size = 20\nspacing = 2\nposition = [60, 0, 0]\n";
  const auto objects =
      hybrid::tunable_objects(hybrid::read_scene(write("s.toml", "format = 1\n" + two + tests::path)));
  ASSERT_EQ(objects.size(), 2U);
  const auto own = hybrid::own_setting(objects);
  const auto beside = hybrid::settings_beside(objects, own);
  EXPECT_EQ(beside.size(), 8U);  // for each object: coarser, finer, the other energy, rigid
  for (const auto& setting : beside)
    EXPECT_EQ((setting.objects[0] == own.objects[0]) + (setting.objects[1] == own.objects[1]), 1);
  for (const auto& setting : hybrid::common_settings(objects, false))
    EXPECT_EQ(setting.objects[0].energy, setting.objects[1].energy);
}

}  // namespace
