// SPDX-License-Identifier: GPL-3.0-or-later
// Changes of a scene during a session: the changes that an object allows, and the text after them.
#include "hybrid/tune/scene_choices.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "hybrid/build/choose_model.h"
#include "hybrid/scene/read_scene_text.h"
#include "hybrid/snapshot/make_drawn_scene.h"

namespace {

using Key = hybrid::SceneChange::Key;
using hybrid::SceneChange;

const std::string kText =
    "format = 1\nunits = \"mm\"\n# of the gel\n[material.gel]\nyoung = 8000 # Pa\n[material.fat]\npoisson = "
    "0.4\n"
    "[[soft]]\nname = \"block\"\nformula = \"block\"\nsize = [20, 20, 10]\nspacing = 2 # mm\nmaterial = "
    "\"gel\"\n"
    "[[soft]]\nname = \"pad\"\nformula = \"block\"\nsize = [20, 20, 10]\nspacing = 2\nposition = [60, 0, 0]\n"
    "material = \"fat\"\nlayers = [{ thickness = 4, label = 2 }]\nmaterials = { \"2\" = \"gel\" }\nmodel = "
    "\"proxy\"\n"
    "[[rigid]]\nname = \"ball\"\nprimitive = \"ball\"\nradius = 4\nposition = [12, 0, 8]\n"
    "[path]\nkind = \"press\"\nfrom = [0, 0, 20]\nto = [0, 0, 9]\n";

hybrid::Scene read(const std::string& text) {
  return hybrid::read_scene_text(text, "scene.toml");
}
hybrid::DrawnScene drawn(const std::string& text) {
  hybrid::Scene scene = read(text);
  hybrid::choose_models(scene);
  const hybrid::BuiltScene built = hybrid::build_scene(scene);
  hybrid::DrawnScene out = hybrid::drawn_scene(scene, built, "test");
  hybrid::add_choices(read(text), out);
  return out;
}
const hybrid::ObjectChoices& choices_of(const hybrid::DrawnScene& scene, const std::string& name) {
  return std::ranges::find(scene.objects, name, &hybrid::DrawnObject::name)->choices;
}
std::string changed(const std::string& text, const std::vector<SceneChange>& changes) {
  return hybrid::changed_text(text, "scene.toml", changes);
}

TEST(SceneChoices, AreThoseOfTheScene) {
  const hybrid::DrawnScene scene = drawn(kText);
  const hybrid::ObjectChoices& block = choices_of(scene, "block");
  EXPECT_TRUE(block.tissue && block.other_model && block.other_energy);
  EXPECT_FALSE(block.as_rigid || block.trilinear);
  EXPECT_DOUBLE_EQ(block.spacing_m, 2e-3);
  ASSERT_EQ(block.materials.size(), 1U);
  EXPECT_EQ(block.materials[0].young_Pa, 8000.0);
  EXPECT_EQ(block.materials[0].shared_with, "pad");
  for (const hybrid::SpacingChoice& other : block.spacings) {
    const double voxels = 20e-3 / other.spacing_m;
    EXPECT_NEAR(voxels, std::round(voxels), 1e-4) << "its edges stay whole numbers of voxels";
  }
  EXPECT_GE(block.spacings.size(), 3U);
  const hybrid::ObjectChoices& pad = choices_of(scene, "pad");
  EXPECT_TRUE(pad.tissue && pad.as_rigid) << "an object that is felt as rigid may become soft again";
  EXPECT_EQ(pad.materials.size(), 2U);
  EXPECT_FALSE(choices_of(scene, "ball").tissue);
}

TEST(SceneChoices, ChangeOneValueAndKeepEverythingElse) {
  const std::vector<std::pair<SceneChange, std::string>> cases{
      {{Key::young, "gel", {12000, 0, 0}}, "young = 12000 # Pa"},
      {{Key::young, "fat", {3000, 0, 0}}, "[material.fat]\nyoung = 3000\npoisson = 0.4"},
      {{Key::poisson, "fat", {0.45, 0, 0}}, "poisson = 0.45"},
      {{Key::shortest, "gel", {0.7, 0, 0}}, "stretch = [0.7, 1.6]"},
      {{Key::longest, "fat", {1.2, 0, 0}}, "stretch = [0.4, 1.2]"},
      {{Key::shear, "gel", {0.25, 0, 0}}, "shear = 0.25"},
      {{Key::radius, "", {3e-3, 0, 0}}, "[tool]\nradius = 3"},
      {{Key::model, "block", {1, 0, 0}}, "name = \"block\"\nmodel = \"proxy\""},
      {{Key::model, "pad", {0, 0, 0}}, "model = \"voxels\""},
      {{Key::energy, "block", {1, 0, 0}}, "energy = \"trilinear\""},
      {{Key::spacing, "block", {1e-3, 0, 0}}, "spacing = 1 # mm"},
      {{Key::move, "ball", {-2e-3, 0, 1e-3}}, "position = [10, 0, 9]"},
      {{Key::move, "block", {5e-3, 0, 0}}, "position = [5, 0, 0]"}};
  for (const auto& [change, written] : cases) {
    const std::string text = changed(kText, {change});
    EXPECT_NE(text.find(written), std::string::npos) << text;
    EXPECT_NE(text.find("# of the gel"), std::string::npos);
    EXPECT_NO_THROW((void)read(text));
    EXPECT_FALSE(in_words(change).empty());
  }
  const std::string both =
      changed(kText, {{Key::spacing, "block", {1e-3, 0, 0}}, {Key::young, "gel", {500, 0, 0}}});
  EXPECT_EQ(read(both).materials.at("gel").young_Pa, 500.0);
  EXPECT_EQ(choices_of(drawn(both), "block").spacing_m, 1e-3);
}

TEST(SceneChoices, TheLimitsOfALengthAreSetOneByOne) {
  const std::string text = changed(kText, {{Key::shortest, "gel", {0.8, 0, 0}},
                                           {Key::longest, "gel", {1.1, 0, 0}},
                                           {Key::radius, "", {1.5e-3, 0, 0}}});
  const hybrid::Material gel = read(text).materials.at("gel");
  EXPECT_EQ(gel.stretch_min, 0.8);
  EXPECT_EQ(gel.stretch_max, 1.1);
  const hybrid::DrawnScene scene = drawn(text);
  EXPECT_DOUBLE_EQ(scene.tool_choices.radius_m, 1.5e-3);
  EXPECT_TRUE(scene.tool_choices.open);
  EXPECT_EQ(choices_of(scene, "block").materials[0].longest, 1.1);
  // A material that cannot stretch may not slip: the text is made, and reading it says why it is refused.
  const std::string stiff = changed(kText, {{Key::shear, "gel", {0, 0, 0}}});
  EXPECT_THROW((void)read(stiff), hybrid::SceneError);
}

TEST(SceneChoices, AMeshIsAddedUnderAFreeName) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "a \"b\"";
  std::filesystem::create_directories(folder);
  const std::filesystem::path ball = folder / "ball.stl", skull = folder / "skull.obj.gz";
  for (const std::filesystem::path& mesh : {ball, skull})
    std::ofstream(mesh) << "a scene's reader only looks for it";
  const std::string once = hybrid::text_with_mesh(kText, "scene.toml", ball);
  EXPECT_NE(once.find("# of the gel"), std::string::npos);
  const std::string twice = hybrid::text_with_mesh(once, "scene.toml", skull);
  const hybrid::Scene scene = read(twice);
  ASSERT_EQ(scene.rigid.size(), 3U);
  EXPECT_EQ(scene.rigid[1].name, "ball 2") << "the scene has a ball";
  EXPECT_EQ(std::get<hybrid::MeshSource>(scene.rigid[1].source).file, ball);
  EXPECT_EQ(scene.rigid[2].name, "skull");
  EXPECT_THROW((void)hybrid::text_with_mesh(kText, "scene.toml", "/data/a\nb.stl"), std::runtime_error);
  std::filesystem::remove_all(folder);
}

TEST(SceneChoices, WhatCannotBeChangedIsSaid) {
  const auto refusal = [](const SceneChange& change) -> std::string {
    try {
      (void)changed(kText, {change});
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return {};
  };
  EXPECT_THAT(refusal({Key::young, "bone", {1e4, 0, 0}}), testing::HasSubstr("bone"));
  EXPECT_THAT(refusal({Key::model, "ball", {1, 0, 0}}), testing::HasSubstr("one model"));
  EXPECT_THAT(refusal({Key::move, "moon", {1, 0, 0}}), testing::HasSubstr("moon"));
}

}  // namespace
