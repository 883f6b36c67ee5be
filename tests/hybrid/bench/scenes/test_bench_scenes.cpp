// SPDX-License-Identifier: GPL-3.0-or-later
// Results of `hybrid bench` of whole scenes: errors equal those of `run`, and rows have the names of their
// models. Times are not checked.
#include "hybrid/bench/scenes/bench_scenes.h"

#include <gmock/gmock.h>

#include <algorithm>

#include "hybrid/bench/reports/report_keys.h"
#include "hybrid/compare/compare.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"

namespace {

using hybrid::bench::SceneRow;
using testing::HasSubstr;

class BenchScenes : public tests::SceneFile {
 protected:
  std::filesystem::path gel() const {
    return write(
        "gel.toml",
        "format = 1\n[tool]\nradius = 4\nstiffness = 800\n[material.gel]\nyoung = 8000\n[[soft]]\n"
        "name = \"block\"\nformula = \"block\"\nsize = [24, 24, 10]\nspacing = 2\nmaterial = \"gel\"\n"
        "[path]\nkind = \"press\"\nfrom = [0, 0, 10]\nto = [0, 0, 6.5]\nhold = 0.1\nspeed = 40\n");
  }
  static const SceneRow& row(const std::vector<SceneRow>& rows, const std::string& model) {
    const auto found = std::ranges::find(rows, model, &SceneRow::model);
    if (found == rows.end()) throw std::runtime_error("no row " + model);
    return *found;
  }
};

void expect_known(const nlohmann::ordered_json& j, const std::string& prefix) {
  for (const auto& [key, value] : j.items()) {
    const std::string name = prefix + key;
    if (value.is_object()) {
      expect_known(value, name + ".");
      continue;
    }
    const auto known = hybrid::bench::keys_of("scenes");
    EXPECT_TRUE(std::ranges::any_of(known, [&](const auto& k) { return k.name == name; })) << name;
  }
}

TEST_F(BenchScenes, RowsOfASoftBlock) {
  const auto file = gel();
  std::vector<std::string> told;
  const auto rows = hybrid::bench::bench_scenes(
      {.scenes = {file}, .repeats = 3, .on_row = [&](const SceneRow& r) { told.push_back(r.model); }});
  EXPECT_THAT(told, testing::ElementsAre("as given", "six-link", "trilinear", "proxy"));
  EXPECT_THAT(row(rows, "six-link").left_out, HasSubstr("has this model already"));

  const SceneRow& given = row(rows, "as given");
  EXPECT_EQ(given.p99_ratio, 1.0);
  EXPECT_EQ(given.from_given.worst_jnd(), 0.0);
  EXPECT_EQ(given.repeats, 3);
  EXPECT_LE(given.p50_us.median, given.max_us.median);
  EXPECT_LE(given.p99_us.least, given.p99_us.median);
  EXPECT_LE(given.p99_us.median, given.p99_us.most);

  // The error is that of the session as `run` measures it.
  const hybrid::Scene scene = hybrid::on_ideal_device(hybrid::load_scene(file));
  hybrid::BuiltScene built = hybrid::build_scene(scene);
  hybrid::SessionOptions options;
  options.measure_error = true;
  options.async_relaxation = true;
  const auto played = hybrid::run_session(scene, built, options);
  EXPECT_GT(played.error.all.samples, 0);
  EXPECT_EQ(given.own_error.all.max_jnd, played.error.all.max_jnd);
  EXPECT_EQ(given.contact_ticks, played.contact_ticks);

  // As rigid, the block has no voxels, and is felt far too hard.
  const SceneRow& proxy = row(rows, "proxy");
  EXPECT_EQ(proxy.soft_voxels, 0U);
  EXPECT_EQ(proxy.own_error.all.samples, 0);
  EXPECT_GT(proxy.from_given.worst_jnd(), 10.0);

  for (const SceneRow& r : rows) expect_known(hybrid::bench::to_json(r), "");
  for (const SceneRow& r : rows) EXPECT_THAT(hybrid::bench::scenes_table_line(r), HasSubstr(r.model));
}

TEST_F(BenchScenes, ASceneThatCannotBePlayedIsARow) {
  const auto broken = write("broken.toml", "format = 1\nno_such_key = 2\n");
  const auto only = hybrid::bench::ScenesBenchOptions{.scenes = {broken}, .repeats = 1};
  EXPECT_THROW((void)hybrid::bench::bench_scenes(only), hybrid::SceneError);
  const auto rows = hybrid::bench::bench_scenes({.scenes = {broken, broken}, .repeats = 1});
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0].scene, "broken");
  EXPECT_THAT(rows[0].left_out, HasSubstr("no_such_key"));
}

TEST(BenchScenesNoise, IsSaid) {
  SceneRow quiet;
  quiet.p99_us = {.median = 100.0, .least = 95.0, .most = 105.0};
  SceneRow loud = quiet;
  loud.p99_us.most = 140.0;
  EXPECT_FALSE(hybrid::bench::noisy(quiet));
  EXPECT_TRUE(hybrid::bench::noisy(loud));
  EXPECT_THAT(hybrid::bench::scenes_summary({quiet, loud}), HasSubstr("in 1 of 2 rows"));
  EXPECT_THAT(hybrid::bench::scenes_summary({quiet}), testing::Not(HasSubstr("noisy")));
}

}  // namespace
