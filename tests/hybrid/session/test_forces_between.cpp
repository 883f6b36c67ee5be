// SPDX-License-Identifier: GPL-3.0-or-later
// The forces between objects balance at rest. On each soft object, the forces of the hand, rigid objects,
// other tissue and anchors sum to zero. Computing them does not change the state.
#include "hybrid/session/forces_between.h"

#include <algorithm>
#include <glm/geometric.hpp>

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

}  // namespace
