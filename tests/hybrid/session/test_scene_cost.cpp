// SPDX-License-Identifier: GPL-3.0-or-later
// The cost that `hybrid check` states. It is measured only where the path touches something.
#include "hybrid/session/scene_cost.h"

#include <gtest/gtest.h>

#include <string>

#include "tests/hybrid/fixtures/scene_file_fixture.h"

namespace {

using hybrid::SceneCost;

class Cost : public tests::SceneFile {
 protected:
  SceneCost of(const std::string& text) const {
    const hybrid::Scene scene = load("format = 1\n" + text);
    const hybrid::BuiltScene built = hybrid::build_scene(scene);
    const std::uint64_t before = hybrid::hash_state(hybrid::kHashBegin, *built.state);
    SceneCost cost = hybrid::measure_cost(scene, built);
    EXPECT_EQ(hybrid::hash_state(hybrid::kHashBegin, *built.state), before)
        << "the scene stays as it was built";
    return cost;
  }
};

const std::string two_presses =
    "[path]\nkind = \"waypoints\"\nspeed = 50\npoints = [[-3, 0, 30], [-3, 0, 4, 1], [-3, 0, 30], [3, 0, "
    "30], "
    "[3, 0, 4, 1], [3, 0, 30]]\n";

TEST_F(Cost, IsMeasuredAtEachPlaceOfContact) {
  for (const std::string& object : {tests::block, tests::ball}) {
    const SceneCost cost = of(object + two_presses);
    EXPECT_EQ(cost.places, 2);
    EXPECT_GT(cost.ticks, 100U);
    EXPECT_LE(cost.ticks, 500U);
    ASSERT_TRUE(cost.tick_us.has_value());
    EXPECT_GT(cost.tick_us->p50, 0.0);
    EXPECT_LE(cost.tick_us->p50, cost.tick_us->p99);
    EXPECT_GT(cost.held_bytes, 1'000'000U);
    EXPECT_GT(cost.load_s, 0.0);
    EXPECT_EQ(cost.period_us, 1000.0);
    EXPECT_NE(hybrid::in_words(cost).find("at 2 places of contact"), std::string::npos);
  }
}

TEST_F(Cost, OfManyPlacesIsMeasuredAtFour) {
  const SceneCost cost =
      of(tests::ball +
         "[path]\nkind = \"press\"\nfrom = [0, 0, 20]\nto = [0, 0, 3]\nspeed = 200\nhold = "
         "0.1\nrepeat = 20\n");
  EXPECT_EQ(cost.places, 4);
}

TEST_F(Cost, OfAPathThatTouchesNothingHasNoTicks) {
  const SceneCost cost = of(tests::block + "[path]\nkind = \"press\"\nfrom = [0, 0, 60]\nto = [0, 0, 40]\n");
  EXPECT_FALSE(cost.tick_us.has_value());
  EXPECT_EQ(cost.ticks, 0U);
  EXPECT_NE(hybrid::in_words(cost).find("touches nothing"), std::string::npos);
}

TEST_F(Cost, StatesTheMemoryOfTouchedTissueAndNoneForRigidObjects) {
  EXPECT_EQ(of(tests::ball + tests::path).touched_bytes, 0U);
  EXPECT_GT(of(tests::block + tests::path).touched_bytes, 0U);
}

}  // namespace
