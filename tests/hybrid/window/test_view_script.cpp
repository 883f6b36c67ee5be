// SPDX-License-Identifier: GPL-3.0-or-later
// Scripts that control the window: the effect of each command, and the refused lines.
#include "hybrid/window/view_script.h"

#include <gtest/gtest.h>

#include <set>
#include <stdexcept>

#include "hybrid/window/panel_words.h"
#include "hybrid/window/window_keys.h"

namespace {

using hybrid::Edit;
using hybrid::EditedQuantity;
using hybrid::ViewScript;
using hybrid::ViewVerb;

hybrid::DrawnScene drawn() {
  hybrid::DrawnScene scene;
  scene.objects.resize(2);
  scene.objects[0].name = "bone";
  scene.objects[1].name = "left lung";
  scene.objects[1].inside.materials = {"lobe", "large vessel"};
  scene.editable = {
      {.object = Edit::kTool,
       .quantity = EditedQuantity::coupling_stiffness,
       .range = {1.0, 2000.0},
       .in_scene = 800.0},
      {.object = 0, .quantity = EditedQuantity::texture_height, .range = {0.0, 1e-3}, .in_scene = 1e-4}};
  return scene;
}

std::string refusal_of_script(const std::string& text) {
  try {
    const ViewScript script(text, "tour.txt", drawn());
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return {};
}

TEST(ViewScript, PlaysEachActionOnceInItsTime) {
  ViewScript script(
      "# a tour\n0 select \"left lung\"\n\n0.5 edit bone texture-height 0.25  # mm\n0.5 hide bone\n1 clip y "
      "0.25\n"
      "2 drag 10 20 30 40 right\n2 quit",
      "tour.txt", drawn());
  ASSERT_EQ(script.size(), 8U) << "a clip is three actions";
  EXPECT_EQ(script.due(0.4).size(), 1U);
  EXPECT_EQ(script.due(0.4).size(), 0U);
  const auto at_half = script.due(0.5);
  ASSERT_EQ(at_half.size(), 2U);
  EXPECT_DOUBLE_EQ(at_half[0].numbers[0], 0.25e-3);
  EXPECT_EQ(at_half[0].object, 0U);
  hybrid::ViewState state;
  for (const auto& action : at_half) hybrid::act(state, action);
  ASSERT_EQ(state.edits.size(), 1U);
  EXPECT_EQ(state.edits[0].quantity, EditedQuantity::texture_height);
  EXPECT_FALSE(state.view.look_of(0).visible);
  EXPECT_TRUE(state.view.look_of(1).visible);
  for (const auto& action : script.due(5.0)) hybrid::act(state, action);
  EXPECT_TRUE(state.view.clip.on);
  EXPECT_EQ(state.view.clip.axis, 1);
  EXPECT_EQ(state.view.clip.share, 0.25);
  EXPECT_TRUE(state.quit);
}

TEST(ViewScript, RefusesWithTheLineAndWhatWouldDo) {
  const std::vector<std::pair<std::string, std::string>> wrong{
      {"0 pause on\n0.1 jump",
       "tour.txt:2: there is no command 'jump'; write a time and one of these: pause"},
      {"x pause", "tour.txt:1: 'x' is no number"},
      {"\n-1 pause", "tour.txt:2: '-1' is no number"},
      {"1 pause\n0.5 step", "tour.txt:2: the time is before"},
      {"0 hide skull", "tour.txt:1: there is no object 'skull'; the scene has bone, left lung"},
      {"0 edit tool stiffness 1e9",
       "tour.txt:1: '1e9' is no number that is allowed there; for example: edit"},
      {"0 edit tool damping 1",
       "tour.txt:1: 'tool' has no value 'damping' that can be edited; it has stiffness"},
      {"0 edit tool stiffness", "tour.txt:1: 'edit' has 2 arguments"},
      {"0 edit bone texture-height nan", "tour.txt:1: 'nan' is no number"},
      {"0 look up", "tour.txt:1: 'up' is not known there; for example: look contact"},
      {"0 clip w 0.5", "tour.txt:1: 'w' is no axis"},
      {"0 key f13", "tour.txt:1: there is no key 'f13'"},
      {"0 hide \"left lung\" fat",
       "tour.txt:1: 'left lung' has no material 'fat'; it has lobe, large vessel"},
      {"0 show bone marrow", "tour.txt:1: 'bone' has no material 'marrow'"},
      {"0 opacity \"left lung\" lobe", "tour.txt:1: 'lobe' is no number"},
      {"0 step 3", "tour.txt:1: 'step' has 1 arguments"},
      {"0", "tour.txt:1: there is no command;"}};
  for (const auto& [text, words] : wrong) {
    EXPECT_EQ(refusal_of_script(text).substr(0, words.size()), words);
  }
  EXPECT_EQ(refusal_of_script(""), "");
}

TEST(ViewScript, GivesMaterialsLooksThatFollowThemIntoAChangedScene) {
  ViewScript script(
      "0 opacity \"left lung\" lobe 0.3\n0 hide \"left lung\" \"large vessel\"\n0 opacity \"left lung\" 0.5\n"
      "0 wires\n1 show \"left lung\" \"large vessel\"\n1 opacity \"left lung\" lobe 1",
      "tour.txt", drawn());
  hybrid::ViewState state;
  for (const auto& action : script.due(0.0)) hybrid::act(state, action);
  EXPECT_EQ(state.view.material_look_of(1, "lobe"), (hybrid::Look{true, 0.3F}));
  EXPECT_FALSE(state.view.material_look_of(1, "large vessel").visible);
  EXPECT_EQ(state.view.look_of(1), (hybrid::Look{true, 0.5F}));
  EXPECT_FALSE(state.view.separates_materials(0));
  EXPECT_TRUE(state.view.wires);
  hybrid::DrawnScene other = drawn();
  std::swap(other.objects[0], other.objects[1]);
  hybrid::go_to_scene(state, drawn(), other);
  EXPECT_TRUE(state.view.separates_materials(0));
  EXPECT_EQ(state.view.material_look_of(0, "lobe"), (hybrid::Look{true, 0.3F}));
  hybrid::go_to_scene(state, other, drawn());
  for (const auto& action : script.due(1.0)) hybrid::act(state, action);
  EXPECT_FALSE(state.view.separates_materials(1)) << "one surface again";
}

TEST(ViewScript, MovesSlicesAndChoosesColours) {
  ViewScript script("0 slice y 0.4\n1 slice x 1\n2 slice y off\n3 grey on\n3 colour limits\n4 slice off",
                    "tour.txt", drawn());
  hybrid::ViewState state;
  const auto play_to = [&](double t_s) {
    for (const auto& action : script.due(t_s)) hybrid::act(state, action);
  };
  play_to(0.0);
  EXPECT_EQ(state.view.slices[1], (hybrid::SlicePlane{true, 0.4}));
  play_to(2.0);
  EXPECT_EQ(state.view.slices[0], (hybrid::SlicePlane{true, 1.0}));
  EXPECT_EQ(state.view.slices[1], (hybrid::SlicePlane{false, 0.4})) << "a slice keeps its place";
  EXPECT_FALSE(state.view.slices[2].on);
  play_to(3.0);
  EXPECT_TRUE(state.view.grey);
  EXPECT_EQ(state.view.colour, hybrid::TissueColour::limits);
  play_to(4.0);
  EXPECT_FALSE(state.view.sliced());
  EXPECT_NE(refusal_of_script("0 slice w 0.4").find("tour.txt:1: 'w' is no axis"), std::string::npos);
  EXPECT_NE(refusal_of_script("0 slice x 1.5").find("slice y 0.4"), std::string::npos);
  EXPECT_NE(refusal_of_script("0 slice x").find("slice y 0.4"), std::string::npos);
  EXPECT_NE(refusal_of_script("0 slice off 1"), "");
  EXPECT_NE(refusal_of_script("0 colour red").find("colour strain"), std::string::npos);
}

TEST(WindowKeys, SwitchSlicesAndColours) {
  hybrid::ViewState state;
  const auto press = [&](std::string_view key) {
    hybrid::act(state, *hybrid::action_of_key(key, false, state));
  };
  state.view.slices[1].share = 0.3;
  press("v");
  EXPECT_TRUE(state.view.slices[0].on && state.view.slices[1].on && state.view.slices[2].on);
  EXPECT_EQ(state.view.slices[1].share, 0.3);
  press("v");
  EXPECT_FALSE(state.view.sliced());
  const hybrid::TissueColour first = state.view.colour;
  std::set<hybrid::TissueColour> seen;
  for (std::size_t n = 0; n < hybrid::kTissueColours.size(); ++n) {
    seen.insert(state.view.colour);
    press("m");
  }
  EXPECT_EQ(seen.size(), hybrid::kTissueColours.size());
  EXPECT_EQ(state.view.colour, first);
}

TEST(WindowKeys, DoWhatTheButtonsDo) {
  hybrid::ViewState state;
  const auto press = [&state](std::string_view key, bool control = false) {
    const auto action = hybrid::action_of_key(key, control, state);
    if (action) hybrid::act(state, *action);
    return action.has_value();
  };
  EXPECT_TRUE(press("space"));
  EXPECT_TRUE(state.paused);
  EXPECT_TRUE(press("space"));
  EXPECT_FALSE(state.paused);
  EXPECT_TRUE(press("n"));
  EXPECT_TRUE(state.paused) << "one tick, then it waits";
  EXPECT_EQ(state.single_ticks, 1U);
  EXPECT_TRUE(press("3"));
  EXPECT_EQ(state.speed, 0.01);
  EXPECT_TRUE(press("]"));
  EXPECT_NEAR(state.view.clip.share, 0.52, 1e-12);
  EXPECT_FALSE(press("s")) << "saving over the scene's file needs control";
  EXPECT_FALSE(state.save_scene);
  EXPECT_TRUE(press("s", true));
  EXPECT_TRUE(state.save_scene);
  EXPECT_FALSE(press("tab"));
  EXPECT_TRUE(hybrid::is_key("tab"));
  EXPECT_FALSE(hybrid::is_key("q"));
}

TEST(ClipPlane, KeepsTheSideBeforeIt) {
  const hybrid::SceneBounds bounds{{0.1, 0.0, 0.0}, 0.05};
  hybrid::ClipPlane clip{.on = true, .axis = 0, .share = 0.75};
  EXPECT_NEAR(hybrid::clip_place_m(clip, bounds), 0.125, 1e-12);
  const auto side = [&](double x, const glm::dvec3& origin) {
    const auto plane = hybrid::clip_equation(clip, bounds, origin);
    return plane->x * static_cast<float>(x - origin.x) + plane->w;
  };
  for (const double origin : {0.0, 0.1}) {
    EXPECT_GT(side(0.12, {origin, 0, 0}), 0.0F);
    EXPECT_LT(side(0.13, {origin, 0, 0}), 0.0F);
  }
  clip.other_side = true;
  EXPECT_GT(side(0.13, {0, 0, 0}), 0.0F);
  clip.on = false;
  EXPECT_FALSE(hybrid::clip_equation(clip, bounds, {}).has_value());
}

TEST(ViewScript, ChangesOfTheSceneNameObjectsAndMaterials) {
  using Key = hybrid::SceneChange::Key;
  hybrid::DrawnScene scene = drawn();
  scene.objects[1].choices = {.tissue = true, .materials = {{.name = "lung tissue", .young_Pa = 2e3}}};
  ViewScript script(
      "0 model \"left lung\" rigid\n0 energy \"left lung\" trilinear\n0 spacing \"left lung\" 2.5\n"
      "0 young \"lung tissue\" 3000\n0 move bone 0 -1 2\n0 poisson \"lung tissue\" 0.45\n"
      "0 shortest \"lung tissue\" 0.5\n0 longest \"lung tissue\" 1.5\n0 shear \"lung tissue\" 0.2\n0 radius "
      "2.5",
      "tour.txt", scene);
  hybrid::ViewState state;
  for (const auto& action : script.due(0.0)) hybrid::act(state, action);
  ASSERT_EQ(state.changes.size(), 10U);
  EXPECT_EQ(state.changes[5].key, Key::poisson);
  EXPECT_EQ(state.changes[7].name, "lung tissue");
  EXPECT_EQ(state.changes[7].value.x, 1.5);
  EXPECT_EQ(state.changes[9].key, Key::radius);
  EXPECT_DOUBLE_EQ(state.changes[9].value.x, 2.5e-3);
  EXPECT_EQ(state.changes[0].key, Key::model);
  EXPECT_EQ(state.changes[0].value.x, 1.0);
  EXPECT_DOUBLE_EQ(state.changes[2].value.x, 2.5e-3);
  EXPECT_EQ(state.changes[3].name, "lung tissue");
  EXPECT_EQ(state.changes[3].value.x, 3000.0);
  EXPECT_DOUBLE_EQ(state.changes[4].value.z, 2e-3);
  for (const std::string bad :
       {"0 model bone rigid", "0 model \"left lung\" jelly", "0 young iron 3", "0 spacing \"left lung\" 0",
        "0 move bone 1 2", "0 energy \"left lung\"", "0 poisson \"lung tissue\" 0.5",
        "0 shortest \"lung tissue\" 1.1", "0 longest \"lung tissue\" 0.9", "0 shear bone 1", "0 radius -1"}) {
    EXPECT_THROW(ViewScript(bad, "tour.txt", scene), std::runtime_error) << bad;
  }
}

TEST(ViewScript, ComparesTwoModels) {
  using Key = hybrid::SceneChange::Key;
  hybrid::DrawnScene scene = drawn();
  scene.objects[1].choices.tissue = true;
  ViewScript script(
      "0 difference \"left lung\" as-is trilinear+4.5 3\n1 difference \"left lung\" six-link rigid 2.5 40\n"
      "2 difference off\n",
      "tour.txt", scene);
  hybrid::ViewState state;
  const auto play_to = [&](double t_s) {
    for (const auto& action : script.due(t_s)) hybrid::act(state, action);
    return state.comparison.value_or(hybrid::ModelComparison{.object = "none"});
  };
  hybrid::ModelComparison asked = play_to(0.0);
  EXPECT_EQ(state.view.colour, hybrid::TissueColour::difference);
  EXPECT_EQ(asked.object, "left lung");
  EXPECT_TRUE(asked.a.empty());
  ASSERT_EQ(asked.b.size(), 2U);
  EXPECT_EQ(asked.b[0].key, Key::energy);
  EXPECT_EQ(asked.b[0].value.x, 1.0);
  EXPECT_EQ(asked.b[1].key, Key::spacing);
  EXPECT_DOUBLE_EQ(asked.b[1].value.x, 4.5e-3);
  EXPECT_DOUBLE_EQ(asked.depth_m, 3e-3);
  EXPECT_GT(asked.places, 100U);
  asked = play_to(1.0);
  ASSERT_EQ(asked.a.size(), 1U);
  EXPECT_EQ(asked.a[0].value.x, 0.0);
  EXPECT_EQ(asked.b[0].key, Key::model);
  EXPECT_EQ(asked.places, 40U);
  EXPECT_EQ(play_to(2.0).object, "") << "the comparison ends";
  EXPECT_EQ(state.view.colour, hybrid::TissueColour::difference) << "its result stays";
  for (const std::string bad :
       {"0 difference bone as-is rigid 3", "0 difference \"left lung\" as-is jelly 3",
        "0 difference \"left lung\" as-is trilinear+ 3", "0 difference \"left lung\" as-is rigid 0",
        "0 difference \"left lung\" as-is", "0 difference", "0 difference \"left lung\" as-is rigid 3 0"}) {
    EXPECT_NE(refusal_of_script(bad), "") << bad;
    EXPECT_THROW(ViewScript(bad, "tour.txt", scene), std::runtime_error) << bad;
  }
}

TEST(ViewScript, WatchesNumbersAndStacksTheForce) {
  ViewScript script("0 watch \"device x\"\n0 watch tick\n0 stack on\n1 watch \"device x\"\n", "tour.txt",
                    drawn());
  hybrid::ViewState state;
  for (const auto& action : script.due(0.0)) hybrid::act(state, action);
  EXPECT_EQ(state.watched, (std::vector<std::string>{"device x", "tick"}));
  EXPECT_TRUE(state.stacked);
  for (const auto& action : script.due(1.0)) hybrid::act(state, action);
  EXPECT_EQ(state.watched, (std::vector<std::string>{"tick"})) << "no longer";
  EXPECT_NE(refusal_of_script("0 watch tock").find("it has "), std::string::npos);
}

TEST(ModelOptions, OfferWhatAnObjectAllows) {
  hybrid::DrawnObject lung;
  lung.name = "lung";
  lung.choices = {.tissue = true,
                  .other_model = true,
                  .other_energy = true,
                  .spacing_m = 2e-3,
                  .spacing_words = "2 mm",
                  .spacings = {{1e-3, "1 mm"}, {4e-3, "4 mm"}}};
  const auto words = [](const hybrid::DrawnObject& object) {
    std::string all;
    for (const hybrid::ModelOption& option : hybrid::model_options(object)) all += option.words + "; ";
    return all;
  };
  EXPECT_EQ(words(lung), "as it is: six-link, 2 mm; trilinear; 1 mm; 4 mm; as rigid; ");
  EXPECT_EQ(hybrid::model_options(lung)[1].changes[0].name, "lung");
  lung.choices.other_energy = lung.choices.other_model = false;
  EXPECT_EQ(words(lung), "as it is: six-link, 2 mm; 1 mm; 4 mm; ");
}

TEST(ViewState, LooksAndSelectionGoWithTheObjectsName) {
  hybrid::DrawnScene before = drawn(), after = drawn();
  std::swap(after.objects[0], after.objects[1]);
  hybrid::ViewState state;
  hybrid::act(state, {.verb = ViewVerb::select, .object = 1});
  hybrid::act(state, {.verb = ViewVerb::opacity, .numbers = {0.3}, .object = 1});
  hybrid::go_to_scene(state, before, after);
  EXPECT_EQ(state.selected, 0U);
  EXPECT_FLOAT_EQ(state.view.look_of(0).opacity, 0.3F);
  EXPECT_FLOAT_EQ(state.view.look_of(1).opacity, 1.0F);
  before = after;
  after.objects.erase(after.objects.begin());
  hybrid::go_to_scene(state, before, after);
  EXPECT_EQ(state.selected, Edit::kTool) << "the object is gone";
}

}  // namespace
