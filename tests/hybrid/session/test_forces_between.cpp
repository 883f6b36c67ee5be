// SPDX-License-Identifier: GPL-3.0-or-later
// The forces between objects balance at rest. On each soft object, the forces of the hand, rigid objects,
// other tissue and anchors sum to zero. Computing them does not change the state.
#include "hybrid/session/forces_between.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <sstream>

#include "hybrid/session/trace_file.h"
#include "tests/hybrid/fixtures/touch.h"

namespace {

struct HeldStill {
  const char* scene;
  glm::dvec3 above_m, pressed_m;
};

class ForcesBetweenAtRest : public testing::TestWithParam<HeldStill> {
 protected:
  static hybrid::Scene scene() {
    hybrid::Scene scene =
        hybrid::load_scene(std::string(HYBRID_SOURCE_DIR) + "/scenes/" + GetParam().scene + ".toml");
    return scene;
  }
};

TEST_P(ForcesBetweenAtRest, SumUpToNothing) {
  for (const bool async_relaxation : {false, true}) {
    tests::Touch touch(scene(), GetParam().above_m, async_relaxation);
    touch.go(GetParam().pressed_m, 4e-5, 3000);
    const std::uint64_t before = hybrid::hash_state(hybrid::kHashBegin, touch.state());
    const hybrid::ForcesBetween forces = hybrid::forces_between(touch.world(), touch.state());
    EXPECT_EQ(before, hybrid::hash_state(hybrid::kHashBegin, touch.state()));
    ASSERT_EQ(forces.balance.size(), touch.state().soft.size());
    double largest_N = 0.0;
    for (std::size_t o = 0; o < forces.balance.size(); ++o) {
      const hybrid::ForceBalance& balance = forces.balance[o];
      ASSERT_TRUE(balance.sum_N.has_value()) << touch.world().soft[o].name;
      EXPECT_LE(*balance.sum_N, std::max(0.01 * balance.largest_N, 1e-4)) << touch.world().soft[o].name;
      largest_N = std::max(largest_N, balance.largest_N);
    }
    EXPECT_GT(largest_N, 0.02);
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, ForcesBetweenAtRest,
                         testing::Values(HeldStill{"tissue-on-bone", {0.0, 0.0, 0.022}, {0.0, 0.0, 0.0135}},
                                         HeldStill{"cleft", {0.001, 0.0, 0.010}, {0.001, 0.0, -0.008}},
                                         HeldStill{"edge-of-bone", {0.010, 0.0, 0.012}, {0.010, 0.0, 0.002}},
                                         HeldStill{"edge-of-bone", {0.001, 0.0, 0.012}, {0.001, 0.0, 0.0015}},
                                         HeldStill{"two-soft", {0.0, 0.0, 0.035}, {0.006, 0.003, 0.016}},
                                         HeldStill{"layers", {-0.008, 0.0, 0.020}, {-0.008, 0.0, 0.004}}),
                         [](const auto& held) {
                           std::string name = held.param.scene;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name + "_" + std::to_string(held.index);
                         });

// A body that lies on tissue presses on it with its weight. The tissue presses on its anchors with the same
// force.
TEST(ForcesBetween, OfABodyAtRestAreItsWeight) {
  const hybrid::Scene scene =
      hybrid::load_scene(std::string(HYBRID_SOURCE_DIR) + "/scenes/dropped-weight.toml");
  const glm::dvec3 away_m = hybrid::scene_path(scene)->position(0.0);
  tests::Touch touch(scene, away_m);
  touch.go(away_m, 1e-3, 4000);
  const hybrid::ForcesBetween forces = hybrid::forces_between(touch.world(), touch.state());
  ASSERT_EQ(forces.pairs.size(), 2U);
  const hybrid::FreeBody& body = touch.world().rigid[0].motion.free_body();
  const glm::dvec3 weight_N = body.mass.mass_kg * body.gravity_m_per_s2;
  ASSERT_GT(glm::length(weight_N), 0.01);
  for (const hybrid::PairForce& f : forces.pairs) {
    ASSERT_TRUE(f.on_soft_N.has_value());
    const bool rigid = f.pair.kind == hybrid::ObjectPair::Kind::rigid;
    EXPECT_LE(glm::length(*f.on_soft_N - (rigid ? weight_N : -weight_N)), 0.01 * glm::length(weight_N));
  }
}

// Links at their limits may hide a force, which is then reported as unknown. If all forces are known, they
// must balance.
void expect_unknown_or_balanced(tests::Touch& touch) {
  const hybrid::ForcesBetween forces = hybrid::forces_between(touch.world(), touch.state());
  ASSERT_FALSE(forces.pairs.empty());
  const bool all_known = std::all_of(forces.pairs.begin(), forces.pairs.end(),
                                     [](const hybrid::PairForce& f) { return f.on_soft_N.has_value(); });
  const hybrid::ForceBalance& balance = forces.balance[0];
  EXPECT_GT(balance.largest_N, 0.1);
  ASSERT_EQ(balance.sum_N.has_value(), all_known);
  if (all_known) {
    EXPECT_LE(*balance.sum_N, 0.01 * balance.largest_N);
  }
}

class ForcesBetweenAtLimits : public tests::SceneFile {};

// A thin block is pressed deeper than its links allow. The springs alone would show less force than the
// anchors carry.
TEST_F(ForcesBetweenAtLimits, AreUnknownOrBalanced) {
  const hybrid::Scene scene = load(
      "format = 1\n[material.gel]\nyoung = 5000\npoisson = 0.3\nstretch = [0.7, 1.3]\nshear = 0.3\n"
      "[[soft]]\nname = \"block\"\nformula = \"block\"\nsize = [40, 40, 8]\nspacing = 2\nmaterial = \"gel\"\n"
      "anchors = { faces = [\"-z\"] }\n[tool]\nradius = 6\n" +
      tests::unlimited + tests::some_path);
  tests::Touch touch(scene, {0.0, 0.0, 0.02});
  touch.go({0.0, 0.0, 0.002}, 1e-4, 1000);
  ASSERT_FALSE(touch.state().soft[0]->carried_by_anchors_N().has_value());
  expect_unknown_or_balanced(touch);
}

// Tissue is squeezed between tool and bone.
TEST(ForcesBetween, ThatLimitsHideAreUnknown) {
  const hybrid::Scene scene =
      hybrid::load_scene(std::string(HYBRID_SOURCE_DIR) + "/scenes/tissue-on-bone.toml");
  tests::Touch touch(scene, {0.0, 0.0, 0.022});
  touch.go({0.0, 0.0, 0.006}, 4e-5, 3000);
  expect_unknown_or_balanced(touch);
}

// ---- the forces of every tick, in a trace ----

// The columns of a CSV file by name. An empty field is NaN.
std::map<std::string, std::vector<double>> columns_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  const auto fields_of = [](const std::string& line) {
    std::vector<std::string> fields{""};
    for (const char c : line) {
      if (c == ',') {
        fields.emplace_back();
      } else {
        fields.back() += c;
      }
    }
    return fields;
  };
  std::string line;
  std::getline(in, line);
  const std::vector<std::string> names = fields_of(line);
  std::map<std::string, std::vector<double>> columns;
  while (std::getline(in, line)) {
    const std::vector<std::string> fields = fields_of(line);
    EXPECT_EQ(fields.size(), names.size());
    for (std::size_t n = 0; n < names.size(); ++n)
      columns[names[n]].push_back(fields[n].empty() ? std::numeric_limits<double>::quiet_NaN()
                                                    : std::stod(fields[n]));
  }
  return columns;
}

class PairsInATrace : public tests::SceneFile {
 protected:
  // Plays the scene, and writes its trace.
  hybrid::SessionResult play(const hybrid::Scene& scene, std::optional<double> seconds = {}) {
    built_ = hybrid::build_scene(scene);
    hybrid::SessionResult result = hybrid::run_session(
        scene, built_,
        {.seconds = seconds, .between_samples = 1, .between_every_tick = true, .progress = {}});
    hybrid::save_trace(folder_ / "trace.csv", result.rows,
                       hybrid::pair_columns(*built_.world, result.between));
    columns_ = columns_of(folder_ / "trace.csv");
    return result;
  }
  hybrid::Scene shipped(const std::string& name) const {
    return hybrid::load_scene(tests::source_folder / "scenes" / (name + ".toml"));
  }
  hybrid::BuiltScene built_;
  std::map<std::string, std::vector<double>> columns_;
};

// Numbers in a trace have seven digits.
constexpr double kDigits = 1e-6;

TEST_F(PairsInATrace, AgreeWithTheReport) {
  for (const char* name : {"tissue-on-bone", "two-soft", "cube"}) {
    const hybrid::SessionResult result = play(shipped(name));
    ASSERT_FALSE(result.between.pairs.empty()) << name;
    EXPECT_EQ(result.between.samples, result.rows.size());
    const auto shown = hybrid::pair_columns(*built_.world, result.between);
    ASSERT_EQ(shown.size(), result.between.pairs.size());
    for (std::size_t n = 0; n < shown.size(); ++n) {
      const hybrid::PairCourse& pair = result.between.pairs[n];
      ASSERT_TRUE(columns_.contains(shown[n].name)) << shown[n].name;
      const std::vector<double>& column = columns_[shown[n].name];
      ASSERT_EQ(column.size(), result.rows.size());
      double most_N = 0.0;
      std::uint64_t unknown = 0, touching = 0;
      for (const double force_N : column) {
        unknown += std::isnan(force_N) ? 1 : 0;
        touching += force_N > 0.0 ? 1 : 0;
        if (force_N > most_N) most_N = force_N;
      }
      EXPECT_NEAR(most_N, pair.max_N, kDigits * pair.max_N) << shown[n].name;
      const auto at = static_cast<std::size_t>(std::llround(pair.max_t_s / result.dt_s));
      EXPECT_EQ(column[at], most_N) << shown[n].name;
      EXPECT_EQ(unknown, pair.samples - pair.known_samples) << shown[n].name;
      EXPECT_LE(touching, pair.known_samples);
      if (pair.end_on_soft_N) {
        EXPECT_NEAR(column.back(), glm::length(*pair.end_on_soft_N), kDigits * pair.max_N);
      }
    }
  }
}

TEST_F(PairsInATrace, ChangeNothingInTheSession) {
  const hybrid::SessionResult with = play(shipped("tissue-on-bone"));
  hybrid::BuiltScene built = hybrid::build_scene(shipped("tissue-on-bone"));
  const hybrid::SessionResult without =
      hybrid::run_session(shipped("tissue-on-bone"), built, {.seconds = {}, .progress = {}});
  EXPECT_EQ(with.state_hash, without.state_hash);
  EXPECT_TRUE(without.between.pairs.empty());
  EXPECT_TRUE(hybrid::pair_columns(*built.world, without.between).empty());
}

// A trace is also a path of the hand. The columns of forces must not be taken for a part of the path,
// whatever the objects' names.
TEST_F(PairsInATrace, AreNoPartOfThePathThatATraceIs) {
  hybrid::Scene scene = shipped("tissue-on-bone");
  scene.soft[0].name = "tool, position x";
  const hybrid::SessionResult result = play(scene);
  ASSERT_TRUE(columns_.contains("between_tool_ position x_anchors_N"));
  const auto path = device::make_path(device::CsvPath{.file = folder_ / "trace.csv"});
  for (std::size_t n = 0; n < result.rows.size(); n += 100)
    EXPECT_LE(glm::distance(path->position(result.rows[n].t_s), result.rows[n].device_m), 1e-9);
}

// A weight at rest on tissue presses on it with m g before the tool comes.
TEST_F(PairsInATrace, OfAWeightAtRestIsItsWeight) {
  const hybrid::SessionResult result = play(shipped("dropped-weight"), 1.4);
  const hybrid::FreeBody& body = built_.world->rigid[0].motion.free_body();
  const double weight_N = body.mass.mass_kg * glm::length(body.gravity_m_per_s2);
  ASSERT_EQ(result.contact_ticks, 0U);
  EXPECT_NEAR(columns_["between_block_weight_N"].back(), weight_N, 0.02 * weight_N);
  EXPECT_NEAR(columns_["between_block_anchors_N"].back(), weight_N, 0.02 * weight_N);
  EXPECT_EQ(columns_["between_block_weight_N"].front(), 0.0);
}

// A plate presses the whole face of a block without lateral contraction, against the anchors on the other
// side. Then stress and strain are uniform, and the force is E A d / L. The nodes of the lattice are the
// middles of voxels, so the elastic body is the box between the middles of the outermost voxels.
TEST_F(PairsInATrace, OfAPlateAndAnchorsAreThoseOfUniformCompression) {
  constexpr double young_Pa = 8000.0, side_m = 0.018, length_m = 0.018, depth_m = 0.001;
  const hybrid::Scene scene = load(
      "format = 1\n[material.gel]\nyoung = 8000\npoisson = 0\n"
      "[[rigid]]\nname = \"plate\"\nprimitive = \"box\"\nsize = [40, 40, 10]\nposition = [0, 0, 20]\n"
      "motion = \"path\"\n[rigid.path]\nkind = \"waypoints\"\nspeed = 10\n"
      "points = [[0, 0, 20], [0, 0, 14, 5]]\n"
      "[[soft]]\nname = \"block\"\nformula = \"block\"\nsize = [20, 20, 20]\nspacing = 2\n"
      "material = \"gel\"\nanchors = { faces = [\"-z\"] }\n[tool]\nradius = 3\n" +
      tests::unlimited + tests::some_path);
  play(scene, 3.0);
  const double exact_N = young_Pa * side_m * side_m * depth_m / length_m;
  EXPECT_NEAR(columns_["between_block_plate_N"].back(), exact_N, 0.01 * exact_N);
  EXPECT_NEAR(columns_["between_block_anchors_N"].back(), exact_N, 0.01 * exact_N);
}

// The picture's moment and the trace compute the forces at different places of the session.
TEST_F(PairsInATrace, AreThoseOfThePicture) {
  const hybrid::Scene scene =
      hybrid::load_scene(std::string(HYBRID_SOURCE_DIR) + "/scenes/edge-of-bone.toml");
  hybrid::BuiltScene built = hybrid::build_scene(scene);
  const hybrid::SessionResult result = hybrid::run_session(scene, built,
                                                           {.seconds = 0.5,
                                                            .between_samples = 1,
                                                            .between_every_tick = true,
                                                            .keep_picture = true,
                                                            .progress = {}});
  ASSERT_TRUE(result.moment.has_value());
  ASSERT_FALSE(result.moment->presses.empty());
  const auto tick = static_cast<std::size_t>(std::llround(result.moment->t_s / result.dt_s));
  const auto rigid = static_cast<std::uint32_t>(built.world->rigid.size());
  for (const hybrid::PairPress& press : result.moment->presses) {
    const auto same = [&](const hybrid::PairCourse& course) {
      using Kind = hybrid::ObjectPair::Kind;
      const std::uint32_t other = course.pair.kind == Kind::anchors ? hybrid::PairPress::kAnchors
                                  : course.pair.kind == Kind::soft  ? rigid + course.pair.other
                                                                    : course.pair.other;
      return press.soft == rigid + course.pair.soft && press.other == other;
    };
    const auto course = std::ranges::find_if(result.between.pairs, same);
    ASSERT_NE(course, result.between.pairs.end());
    const double traced_N = course->every_N.at(tick);
    EXPECT_EQ(press.force_N.has_value(), std::isfinite(traced_N));
    if (press.force_N) {
      EXPECT_EQ(*press.force_N, traced_N);
    }
  }
}

}  // namespace
