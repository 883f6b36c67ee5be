// SPDX-License-Identifier: GPL-3.0-or-later
// Edited values in a scene's text. Only the values change, and the text reads as the edited scene.
#include "hybrid/session/scene_text.h"

#include <gtest/gtest.h>

#include "tests/hybrid/fixtures/scene_file_fixture.h"

namespace {

using enum hybrid::EditedQuantity;
using hybrid::ValueInScene;

class SceneText : public tests::SceneFile {
 protected:
  hybrid::EditedText written(const std::string& text, const std::vector<ValueInScene>& values,
                             double unit_m = 1e-3) const {
    return hybrid::write_values(text, "a.toml", unit_m, values);
  }
};

const std::string kHead =
    "# Größe: 1/2 µm\nformat = 1\n[tool] # the hand's\nradius = 2\nstiffness =   600 # N/m\n";
const std::string kPlate =
    "\n[[rigid]]   # first\nname = \"plate\"\nprimitive = \"box\"\nsize = [20, 20, 10]\nfriction = [0.6, "
    "0.4]   # at "
    "rest, sliding\n[[rigid]]\nname = \"bumps\"\nprimitive = \"box\"\nsize = [20, 20, 10]\nposition = [40, "
    "0, 0]\n"
    "[rigid.texture]\npattern = \"bumps\"\nsize = 6\nheight = 0.4 # mm\n";
const std::string kPath = "[path]\nkind = \"press\"\nfrom = [0, 0, 20]\nto = [0, 0, 3]\n";

TEST_F(SceneText, OnlyTheValuesChange) {
  const std::string text = kHead + kPlate + kPath;
  const auto edited = written(text, {{"", coupling_stiffness, 455.5, 600.0},
                                     {"", max_force, 8.0, 8.0},
                                     {"plate", static_friction, 0.6, 0.6},
                                     {"plate", dynamic_friction, 0.25, 0.4},
                                     {"bumps", texture_height, 1.5e-4, 4e-4}});
  std::string expected = text;
  const auto swap = [&expected](const std::string& from, const std::string& to) {
    expected.replace(expected.find(from), from.size(), to);
  };
  swap("stiffness =   600", "stiffness =   455.5");
  swap("[0.6, 0.4]", "[0.6, 0.25]");
  swap("height = 0.4 ", "height = 0.15 ");
  EXPECT_EQ(edited.text, expected);
  EXPECT_EQ(edited.changed.size(), 3U);
  EXPECT_TRUE(edited.left.empty());
  const hybrid::Scene scene = load(edited.text);
  EXPECT_EQ(scene.tool.stiffness_N_per_m, 455.5);
  EXPECT_EQ(scene.rigid[0].feel.dynamic_friction, 0.25);
  EXPECT_NEAR(scene.rigid[1].feel.texture->mapping.height_m, 1.5e-4, 1e-18);
}

TEST_F(SceneText, WithoutEditsItIsTheSameText) {
  const std::string text = kHead + kPlate + kPath;
  EXPECT_EQ(written(text, {{"", coupling_stiffness, 600.0, 600.0}}).text, text);
}

TEST_F(SceneText, AKeyThatTheSceneLacksIsAdded) {
  const std::string plate =
      "[[rigid]] # rough\r\nname = \"plate\"\r\nprimitive = \"box\"\r\nsize = [20, 20, 10]\r\n";
  const auto edited = written("format = 1\n" + plate + kPath, {{"", coupling_stiffness, 500.0, 1000.0},
                                                               {"", max_force, 4.0, 8.5},
                                                               {"plate", static_friction, 0.5, 0.0},
                                                               {"plate", dynamic_friction, 0.5, 0.0},
                                                               {"plate", damping, 2.0, 0.0}});
  const hybrid::Scene scene = load(edited.text);
  EXPECT_EQ(scene.tool.stiffness_N_per_m, 500.0);
  EXPECT_EQ(scene.safety.max_force_N, 4.0);
  EXPECT_EQ(scene.rigid[0].feel.static_friction, 0.5);
  EXPECT_EQ(scene.rigid[0].feel.dynamic_friction, 0.5);
  EXPECT_EQ(scene.rigid[0].feel.damping_N_s_per_m, 2.0);
  EXPECT_NE(edited.text.find("# rough\r\n"), std::string::npos);
  EXPECT_EQ(edited.left.size(), 0U);
}

// A value that has no place of its own in the text is not written, and the reason is reported.
TEST_F(SceneText, WhatHasNoPlaceIsLeft) {
  const std::string text =
      "format = 1\ntool.radius = 2\nrigid = [{ name = \"a\", primitive = \"ball\", radius = 4, "
      "friction = { static = 0.4 } }]\n" +
      kPath;
  const auto edited = written(text, {{"", coupling_stiffness, 500.0, 1000.0},
                                     {"a", static_friction, 0.6, 0.4},
                                     {"a", dynamic_friction, 0.4, 0.4},
                                     {"gone", damping, 1.0, 0.0},
                                     {"block", tissue_factor, 2.0, 1.0}});
  EXPECT_EQ(edited.text, text);
  ASSERT_EQ(edited.left.size(), 4U);
  EXPECT_EQ(edited.left[0], "tool: stiffness (its place in the text was not found)");
  EXPECT_EQ(edited.left[1], "a: static-friction (it is written as a table)");
  EXPECT_EQ(edited.left[2], "gone: damping (its table is not in the scene's text)");
  EXPECT_NE(edited.left[3].find("may share a material"), std::string::npos);
}

// If a table on one line lacks a key, the key is added behind one of its values.
TEST_F(SceneText, AKeyIsAddedWithinALine) {
  const std::string text =
      "format = 1\ntool = { radius = 2 } # one\nrigid = [{ primitive = \"ball\", name = \"a\" }, # two\n]\n";
  const auto edited = written(text, {{"", coupling_stiffness, 500.0, 1000.0}, {"a", damping, 1.0, 0.0}});
  EXPECT_EQ(edited.text,
            "format = 1\ntool = { radius = 2, stiffness = 500 } # one\n"
            "rigid = [{ primitive = \"ball\", name = \"a\", damping = 1 }, # two\n]\n");
}

// Values in tables that are written on one line change too.
TEST_F(SceneText, ValuesWithinALineChange) {
  const std::string text =
      "format = 1\nunits = \"m\"\ntool = { radius = 0.002, stiffness = 1e3 } # one line\n";
  const auto edited = written(text, {{"", coupling_stiffness, 750.0, 1000.0}}, 1.0);
  EXPECT_EQ(edited.text,
            "format = 1\nunits = \"m\"\ntool = { radius = 0.002, stiffness = 750 } # one line\n");
}

}  // namespace
