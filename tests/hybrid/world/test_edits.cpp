// SPDX-License-Identifier: GPL-3.0-or-later
// Edits of a running session: their ranges, and their effect. An edited value is felt like the same value in
// the scene file.
#include "hybrid/world/edits.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "hybrid/build/choose_model.h"
#include "hybrid/session/session.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"

namespace {

using enum hybrid::EditedQuantity;
using hybrid::Edit;

class Edits : public tests::SceneFile {
 protected:
  // A scene whose tool slides over a rough plate with a relief and then presses a block of tissue.
  std::string scene(const std::string& tool, const std::string& feel) const {
    return "format = 1\n[device]\nmodel = \"ideal\"\n[safety]\nmax_force = 5\n[tool]\nradius = 2\n" + tool +
           tests::block +
           "[[rigid]]\nname = \"plate\"\nprimitive = \"box\"\nsize = [20, 20, 10]\nposition = "
           "[30, 0, 0]\n" +
           feel +
           "[path]\nkind = \"waypoints\"\nspeed = 60\npoints = [[30, 0, 20], [28, 0, 6], [34, 2, 6], [30, 0, "
           "20], [0, 0, 20], [0, 0, 4, 0.3]]\n";
  }
  static constexpr const char* kFeel =
      "friction = [0.4, 0.3]\ndamping = 1\ntexture = { pattern = \"bumps\", size = 3, height = 0.2 }\n";
  hybrid::SessionResult felt(const std::string& text, std::vector<Edit> edits = {}) const {
    const hybrid::Scene loaded = load(text);
    hybrid::BuiltScene built = hybrid::build_scene(loaded);
    hybrid::SessionOptions options;
    options.edits = std::move(edits);
    return hybrid::run_session(loaded, built, options);
  }
};

TEST_F(Edits, TheGreatestForceIsNeverAboveTheDevices) {
  const std::string object = tests::block + "[path]\nkind = \"press\"\nfrom = [0, 0, 20]\nto = [0, 0, 4]\n";
  const auto most = [&](const std::string& device, const std::string& max_force) {
    const hybrid::Scene loaded = load("format = 1\n[device]\nmodel = \"" + device + "\"\n[safety]\n" +
                                      max_force + "[tool]\nradius = 2\nstiffness = 800\n" + object);
    const hybrid::BuiltScene built = hybrid::build_scene(loaded);
    EXPECT_EQ(built.world->limits.max_force_N, hybrid::greatest_force_N(loaded));
    const double least_above = std::nextafter(hybrid::greatest_force_N(loaded), 1e9);
    EXPECT_FALSE(hybrid::apply_edit(*built.world, *built.state,
                                    {0, Edit::kTool, hybrid::EditedQuantity::max_force, least_above}));
    return built.world->limits.max_force_N;
  };
  EXPECT_EQ(most("touch", ""), 3.3);
  EXPECT_EQ(most("touch", "max_force = 2\n"), 2.0);
  EXPECT_EQ(most("touch", "max_force = 10000\n"), 3.3);
  EXPECT_EQ(most("ideal", "max_force = 10000\n"), 1e4) << "it has no limit of its own";
  EXPECT_EQ(most("ideal", ""), device::ForceLimits{}.max_force_N);
}

TEST_F(Edits, BeforeTheFirstTickTheyGiveTheScenesThatSayTheSame) {
  const std::uint64_t plain = felt(scene("stiffness = 800\n", kFeel)).state_hash;
  EXPECT_EQ(
      felt(scene("stiffness = 1000\n", kFeel), {{0, Edit::kTool, coupling_stiffness, 800.0}}).state_hash,
      plain);
  const std::string other =
      "friction = [0.7, 0.5]\ndamping = 2\ntexture = { pattern = \"bumps\", size = 3, height = 0.1 }\n";
  const hybrid::SessionResult in_scene = felt(scene("stiffness = 800\n", other));
  const hybrid::SessionResult edited =
      felt(scene("stiffness = 800\n", kFeel), {{0, 0, static_friction, 0.7},
                                               {0, 0, dynamic_friction, 0.5},
                                               {0, 0, damping, 2.0},
                                               {0, 0, texture_height, 1e-4}});
  ASSERT_EQ(in_scene.rows.size(), edited.rows.size());
  for (std::size_t n = 0; n < edited.rows.size(); ++n)
    ASSERT_LE(glm::length(edited.rows[n].force_N - in_scene.rows[n].force_N), 1e-9) << n;
  EXPECT_NE(in_scene.state_hash, plain);
}

// Young's modulus and the stiffness of the coupling are doubled. The tool then moves as before, and the force
// doubles, because the lattice is linear.
TEST_F(Edits, StifferTissueAndCouplingGiveForcesInProportion) {
  const hybrid::SessionResult one = felt(scene("stiffness = 300\n", ""));
  const hybrid::SessionResult two =
      felt(scene("stiffness = 300\n", ""),
           {{0, Edit::kTool, coupling_stiffness, 600.0}, {0, 1, tissue_factor, 2.0}});
  const hybrid::TraceRow& a = one.rows.back();
  const hybrid::TraceRow& b = two.rows.back();
  ASSERT_GT(a.soft_N, 0.02);
  EXPECT_NEAR(b.soft_N, 2.0 * a.soft_N, 1e-3 * a.soft_N);
  EXPECT_LE(glm::length(a.proxy_m - b.proxy_m), 1e-6);
}

TEST_F(Edits, TheForceLimitHoldsFromItsTickOn) {
  const hybrid::SessionResult result =
      felt(scene("stiffness = 2000\n", kFeel), {{0, Edit::kTool, max_force, 1.0}});
  EXPECT_LE(result.max_force_N, 1.0 + 1e-9);
  EXPECT_GT(result.max_force_N, 0.99);
}

TEST_F(Edits, AreRefusedOutOfTheScenesRange) {
  const hybrid::Scene loaded = load(scene("stiffness = 800\n", "friction = 0.4\n"));
  const hybrid::BuiltScene built = hybrid::build_scene(loaded);
  const auto takes = [&](std::uint32_t object, hybrid::EditedQuantity quantity, double value) {
    return hybrid::apply_edit(*built.world, *built.state, {0, object, quantity, value});
  };
  EXPECT_TRUE(takes(Edit::kTool, coupling_stiffness, 1e-6));
  EXPECT_FALSE(takes(Edit::kTool, coupling_stiffness, 0.0));
  EXPECT_FALSE(takes(Edit::kTool, coupling_stiffness, std::nan("")));
  EXPECT_TRUE(takes(Edit::kTool, max_force, 5.0));
  EXPECT_FALSE(takes(Edit::kTool, max_force, 5.1)) << "above the scene's limit";
  EXPECT_FALSE(takes(0, static_friction, 10.1));
  EXPECT_FALSE(takes(0, texture_height, 1e-4)) << "it has no texture";
  EXPECT_FALSE(takes(0, tissue_factor, 2.0)) << "it is rigid";
  EXPECT_FALSE(takes(1, damping, 2.0)) << "it is soft";
  EXPECT_FALSE(takes(2, tissue_factor, 2.0)) << "there is no such object";
  EXPECT_TRUE(takes(0, static_friction, 0.2));
  EXPECT_EQ(hybrid::edited_value(*built.world, *built.state, 0, dynamic_friction), 0.2);
  EXPECT_TRUE(takes(0, dynamic_friction, 0.3));
  EXPECT_EQ(hybrid::edited_value(*built.world, *built.state, 0, static_friction), 0.3);
}

// Young's modulus of tissue that meets free bodies or other tissue cannot be edited. Not only the force on
// the tool would have to change, but also the forces on these objects.
TEST_F(Edits, TissueThatMeetsFreeBodiesOrTissueKeepsItsStiffness) {
  const std::string free =
      "[[rigid]]\nname = \"weight\"\nprimitive = \"ball\"\nradius = 4\nposition = [0, 0, "
      "12]\nmotion = \"free\"\ndensity = 1000\n";
  for (const bool with : {false, true}) {
    const hybrid::Scene loaded = load("format = 1\n" + tests::block + (with ? free : "") + tests::path);
    const hybrid::BuiltScene built = hybrid::build_scene(loaded);
    EXPECT_EQ(hybrid::edit_range(*built.world, *built.state, with ? 1 : 0, tissue_factor).has_value(), !with);
  }
}

}  // namespace
