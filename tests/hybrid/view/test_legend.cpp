// SPDX-License-Identifier: GPL-3.0-or-later
// A soft object of several materials: the material under each vertex of its surface, the colours of its
// pixels, and the rows of the legend.
#include "hybrid/view/legend.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>

#include "hybrid/build/build_world.h"
#include "hybrid/snapshot/make_drawn_scene.h"
#include "hybrid/view/overlay.h"
#include "hybrid/view/palette.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"
#include "tests/hybrid/view/picture_fixture.h"

namespace {

using hybrid::Camera;
using hybrid::DrawnObject;
using hybrid::LegendRow;
using tests::Session;

using DrawnSceneOf = tests::SceneFile;
using MaterialPicture = tests::Picture;

// Only the soft ball. Its half at x > 0 is of fat, the other half of muscle.
Session two_halves() {
  Session s = tests::shell_and_ball();
  s.scene.objects.erase(s.scene.objects.begin());
  s.now.feel.erase(s.now.feel.begin());
  s.now.soft_moved_m.erase(s.now.soft_moved_m.begin());
  DrawnObject& ball = s.scene.objects[0];
  ball.materials = {"muscle", "fat"};
  for (const glm::dvec3& v : ball.surface.vertices) ball.vertex_material.push_back(v.x > 0.0 ? 1 : 0);
  return s;
}

Camera from_the_front(const Session& s) {
  Camera camera = tests::framed(s);
  camera.azimuth_rad = -0.5 * std::numbers::pi;  // the x axis points to the right
  camera.elevation_rad = 0.0;
  return camera;
}

// Distance between two colours without their brightness, because shading only scales a colour.
float hue_apart(const glm::vec3& a, const glm::vec3& b) {
  return glm::length(glm::normalize(a) - glm::normalize(b));
}

std::vector<std::string> names(const std::vector<LegendRow>& rows) {
  std::vector<std::string> all;
  for (const LegendRow& row : rows) all.push_back(row.name + row.more);
  return all;
}

bool has(const std::vector<LegendRow>& rows, const std::string& name) {
  const auto all = names(rows);
  return std::ranges::find(all, name) != all.end();
}

// As many objects as in a composed body: 25 bones, and tissue of 14 materials.
Session body() {
  Session s = two_halves();
  DrawnObject tissue = s.scene.objects[0];
  tissue.materials.clear();
  for (int m = 0; m < 14; ++m) tissue.materials.push_back("organ " + std::to_string(m));
  s.scene.objects.clear();
  for (int b = 0; b < 25; ++b)
    s.scene.objects.push_back({"bone " + std::to_string(b), false, tests::ball_mesh({0.0, 0.0, 0.0}, 0.01)});
  s.scene.objects.push_back(tissue);
  s.now.feel.assign(26, {});
  s.now.soft_moved_m.assign(26, {});
  return s;
}

TEST(MaterialColours, AreUnlikeOneAnotherAndOnesOwnInAScene) {
  Session s = body();
  const auto colours = hybrid::palette::of_materials(s.scene, 25);
  ASSERT_EQ(colours.size(), 14U);
  for (std::size_t a = 0; a < 10; ++a) {
    for (std::size_t b = 0; b < a; ++b)
      EXPECT_GT(glm::distance(colours[a], colours[b]), 0.15F) << a << " " << b;
  }
  for (std::size_t a = 10; a < 14; ++a) EXPECT_EQ(colours[a], hybrid::palette::other_material);
  // Adds an object with one of the same materials, and an object with a single material.
  s.scene.objects.push_back(s.scene.objects[25]);
  s.scene.objects.back().materials = {"skin", "organ 0"};
  s.scene.objects.push_back({"gel", true, tests::ball_mesh({0.0, 0.0, 0.0}, 0.01)});
  const auto first = hybrid::palette::of_materials(s.scene, 25);
  EXPECT_EQ(hybrid::palette::of_materials(s.scene, 26)[1], first[0]);
  const auto gel = hybrid::palette::of_materials(s.scene, 27);
  ASSERT_EQ(gel.size(), 1U);
  EXPECT_EQ(gel[0], hybrid::palette::of_object(s.scene, 27)) << "one material: the object's own colour";
  for (const glm::vec3& c : first) EXPECT_GT(glm::distance(c, gel[0]), 0.2F);
}

TEST_F(DrawnSceneOf, HasTheMaterialBeneathEachVertex) {
  const std::string text =
      "format = 1\nunits = \"mm\"\n[material.lean]\nyoung = 9000\n[material.fat]\nyoung = 3000\n" +
      tests::block + "layers = [{ thickness = 3, label = 3 }, { thickness = 7, label = 1 }]\n" +
      "materials = { \"1\" = \"lean\", \"3\" = \"fat\" }\n" + tests::path;
  const hybrid::Scene scene = load(text);
  const hybrid::BuiltScene built = hybrid::build_scene(scene);
  const hybrid::DrawnScene drawn = hybrid::drawn_scene(scene, built, "layers");
  ASSERT_EQ(drawn.objects.size(), 1U);
  const DrawnObject& block = drawn.objects[0];
  ASSERT_EQ(block.materials.size(), 2U);
  ASSERT_EQ(block.vertex_material.size(), block.surface.vertices.size());
  const voxel::Lattice& lattice = built.state->soft[0]->lattice();
  std::set<std::string> seen;
  for (std::size_t v = 0; v < block.surface.vertices.size(); ++v) {
    const std::string& name = block.materials[block.vertex_material[v]];
    seen.insert(name);
    // Where all filled voxels around a vertex have one material, the vertex must have that material.
    const glm::dvec3 at = built.world->soft[0].to_body(block.surface.vertices[v]) / lattice.spacing_m();
    std::set<int> labels;
    for (int c = 0; c < 8; ++c) {
      const glm::dvec3 low = glm::floor(at);
      const int label = lattice.label(lattice.at(static_cast<int>(low.x) + (c & 1),
                                                 static_cast<int>(low.y) + ((c >> 1) & 1),
                                                 static_cast<int>(low.z) + (c >> 2)));
      if (label != 0) labels.insert(label);
    }
    if (labels.size() == 1) {
      EXPECT_EQ(name, *labels.begin() == 1 ? "lean" : "fat");
    }
  }
  EXPECT_EQ(seen.size(), 2U);
}

// Thinning gives the remaining voxels new labels, which must map to the materials of the original tissue.
TEST_F(DrawnSceneOf, ThinnedTissueHasTheMaterialsItHad) {
  const std::string text =
      "format = 1\nunits = \"mm\"\n[material.lean]\nyoung = 9000\n[material.fat]\nyoung = 3000\n" +
      tests::block + "layers = [{ thickness = 4, label = 3 }, { thickness = 6, label = 1 }]\n" +
      "materials = { \"1\" = \"lean\", \"3\" = \"fat\" }\n";
  const hybrid::Scene whole = load(text + tests::path);
  const hybrid::Scene thinned = load(text + "thinning = { labels = [1], every = 2 }\n" + tests::path);
  const hybrid::BuiltScene built = hybrid::build_scene(whole), fewer = hybrid::build_scene(thinned);
  ASSERT_FALSE(fewer.world->soft[0].struts.empty());
  const DrawnObject a = hybrid::drawn_scene(whole, built, "whole").objects[0];
  const DrawnObject b = hybrid::drawn_scene(thinned, fewer, "thinned").objects[0];
  EXPECT_EQ(a.materials.size(), 2U);
  EXPECT_EQ(a.materials, b.materials);
  ASSERT_EQ(a.vertex_material.size(), b.vertex_material.size());
  // Borders between materials may differ, because a vertex takes the most frequent material around it and
  // removed voxels no longer count.
  std::size_t same = 0;
  for (std::size_t v = 0; v < a.vertex_material.size(); ++v)
    same += a.vertex_material[v] == b.vertex_material[v] ? 1U : 0U;
  EXPECT_GT(same, a.vertex_material.size() * 9 / 10);
}

TEST_F(DrawnSceneOf, OneMaterialCarriesNothing) {
  for (const char* materials :
       {"", "layers = [{ thickness = 4, label = 3 }, { thickness = 6, label = 1 }]\n"}) {
    const hybrid::Scene scene = load("format = 1\nunits = \"mm\"\n" + tests::block + materials + tests::path);
    const hybrid::BuiltScene built = hybrid::build_scene(scene);
    const hybrid::DrawnScene drawn = hybrid::drawn_scene(scene, built, "one");
    EXPECT_TRUE(drawn.objects[0].materials.empty());
    EXPECT_TRUE(drawn.objects[0].vertex_material.empty());
  }
  // A hidden core contributes no colour to the surface.
  const hybrid::Scene cube = hybrid::load_scene(tests::source_folder / "scenes" / "cube.toml");
  const hybrid::BuiltScene built = hybrid::build_scene(cube);
  EXPECT_TRUE(hybrid::drawn_scene(cube, built, "cube").objects[0].materials.empty());
}

TEST_F(MaterialPicture, ShowsEachMaterialInItsColour) {
  const Session s = two_halves();
  const Camera camera = from_the_front(s);
  DRAW_OR_SKIP(image, s, tests::small(camera));
  const auto colours = hybrid::palette::of_materials(s.scene, 0);
  const auto at = [&](double x) { return image.at(tests::seen_at(camera, {x, -0.06, -0.02})); };
  const glm::vec3 left = at(-0.03), right = at(0.03);
  EXPECT_LT(hue_apart(left, colours[0]), 0.08F);
  EXPECT_LT(hue_apart(right, colours[1]), 0.08F);
  EXPECT_GT(hue_apart(left, right), 0.25F);
}

TEST_F(MaterialPicture, OfOneMaterialIsAsItWas) {
  Session s = two_halves();
  s.scene.objects[0].materials.clear();
  s.scene.objects[0].vertex_material.clear();
  const Camera camera = from_the_front(s);
  DRAW_OR_SKIP(image, s, tests::small(camera));
  for (const double x : {-0.03, 0.03}) {
    EXPECT_LT(hue_apart(image.at(tests::seen_at(camera, {x, -0.06, -0.02})), hybrid::palette::soft[0]),
              0.08F);
  }
}

// With growing displacement the colour runs from the material's own colour to a ramp that is common to all
// tissues. At 0.04 of the scale the materials still differ.
TEST_F(MaterialPicture, RunsFromTheMaterialsOwnColourWithDisplacement) {
  Session s = two_halves();
  s.now.proxy_m = s.now.device_m = {0.0, 0.0, 0.12};
  s.now.force_N = {0.0, 0.0, 0.0};
  const auto& rest = s.scene.objects[0].surface.vertices;
  const auto moved_by = [&](float share) {
    for (std::size_t v = 0; v < rest.size(); ++v) {
      const bool top = rest[v].z > 0.05;
      s.now.soft_moved_m[0][v] = {0.0F, top ? -0.01F : -0.01F * share, 0.0F};
    }
  };
  const auto colours = hybrid::palette::of_materials(s.scene, 0);
  const Camera camera = from_the_front(s);
  for (const float share : {0.04F, 0.5F, 0.97F}) {
    moved_by(share);
    DRAW_OR_SKIP(image, s, tests::small(camera));
    for (const int side : {0, 1}) {
      const double x = side == 0 ? -0.03 : 0.03;
      const glm::vec3 seen = image.at(tests::seen_at(camera, {x, -0.06, -0.02}));
      EXPECT_LT(hue_apart(seen, hybrid::palette::of_displacement(colours[side], share)), 0.1F) << share;
    }
  }
}

TEST(Legend, ListsMaterialsUnderTheirObject) {
  Session s = two_halves();
  const auto rows = hybrid::legend_rows(s.scene, s.now, 20);
  ASSERT_EQ(rows.size(), 6U);
  const auto colours = hybrid::palette::of_materials(s.scene, 0);
  EXPECT_EQ(rows[0].name, "ball");
  EXPECT_EQ(rows[0].swatch.size(), 2U);
  for (std::size_t m = 0; m < 2; ++m) {
    EXPECT_EQ(rows[1 + m].name, s.scene.objects[0].materials[m]);
    EXPECT_TRUE(rows[1 + m].within);
    EXPECT_EQ(rows[1 + m].swatch, std::vector<glm::vec3>{colours[m]});
  }
  // The tool moves to the right half, where it touches fat.
  s.now.proxy_m = {0.05, 0.0, 0.06};
  const auto touching = hybrid::legend_rows(s.scene, s.now, 20);
  EXPECT_FALSE(touching[1].touched);
  EXPECT_TRUE(touching[2].touched);
}

TEST(Legend, CountsWhatDoesNotFit) {
  const Session s = body();
  for (const std::size_t most : {1U, 5U, 6U, 8U, 12U, 17U, 60U}) {
    const auto rows = hybrid::legend_rows(s.scene, s.now, most);
    EXPECT_LE(rows.size(), std::max<std::size_t>(most, 5));
    // Each material and each bone has its own row, or is counted in a row for several.
    std::size_t organs = 0, bones = 0, objects = 0;
    for (const LegendRow& row : rows) {
      const std::string& words = row.more.empty() ? row.name : row.more;
      const std::size_t and_at = words.find("and ");
      const std::size_t more = and_at == std::string::npos ? 0 : std::stoul(words.substr(and_at + 4));
      if (row.within) {
        organs += more > 0 ? more : 1;
      } else if (row.kind == "rigid") {
        bones += 1 + more;
      } else if (row.kind == "soft") {
        ++objects;
      } else {
        objects += more;
      }
    }
    EXPECT_EQ(bones, 25U) << most;
    EXPECT_EQ(objects, 1U) << most;
    EXPECT_TRUE(organs == 14 || (organs == 0 && most < 7)) << organs << " of " << most;
  }
  const auto rows = hybrid::legend_rows(s.scene, s.now, 17);
  EXPECT_TRUE(has(rows, "bone 0 and 24 more"));
  EXPECT_TRUE(has(rows, "and 4 more"));
  EXPECT_TRUE(has(rows, "organ 9"));
}

TEST(Legend, NamesWhatIsTouchedAmongMany) {
  Session s = body();
  s.now.feel[7] = {true, 0.5};
  s.now.feel[25] = {true, 1.0};
  std::ranges::fill(s.scene.objects[25].vertex_material, std::uint8_t{13});
  const auto rows = hybrid::legend_rows(s.scene, s.now, 14);
  EXPECT_EQ(rows[0].name, "bone 7");
  EXPECT_EQ(rows[0].force, "0.500 N");
  EXPECT_TRUE(has(rows, "organ 13"));
  EXPECT_TRUE(has(rows, "bone 0 and 23 more"));
}

TEST(Legend, ListsAFewObjectsInTheirOrder) {
  const Session s = tests::shell_and_ball();
  EXPECT_EQ(names(hybrid::legend_rows(s.scene, s.now, 17)),
            (std::vector<std::string>{"shell", "ball", "tool, as felt (proxy)", "tool, at the device",
                                      "force on the hand"}));
}

// The legend hides the tool nowhere in the scene's view. The tool is dark. Behind the legend's plate its
// pixel would be nearly white.
TEST_F(MaterialPicture, TheLegendLeavesTheSceneFree) {
  Session s = body();
  const Camera camera = from_the_front(s);
  s.now.force_N = {0.0, 0.0, 0.0};
  const hybrid::PixelRect& view = tests::small_layout.scene;
  for (const bool moved : {false, true}) {  // displaced tissue adds the colour scale to the legend
    if (moved)
      s.now.soft_moved_m[25].assign(s.scene.objects[25].surface.vertices.size(), {0.0F, 0.01F, 0.0F});
    for (const glm::dvec2& share : {glm::dvec2(0.06, 0.06), glm::dvec2(0.94, 0.06), glm::dvec2(0.06, 0.8),
                                    glm::dvec2(0.94, 0.94), glm::dvec2(0.5, 0.5)}) {
      const glm::dvec2 at = share * glm::dvec2(view.width, view.height);
      s.now.proxy_m = s.now.device_m =
          camera.point_at(at, view.width, view.height, camera.target_m + 0.1 * camera.toward_eye());
      DRAW_OR_SKIP(image, s, tests::small(camera));
      const glm::vec3 seen = image.at(tests::seen_at(camera, s.now.proxy_m));
      EXPECT_LT(seen.r + seen.g + seen.b, 1.2F) << "tool at " << at.x << ", " << at.y;
    }
  }
}

TEST(Legend, ListsThePairsThatPressOnEachOtherTheLargestForceFirst) {
  Session s = tests::shell_and_ball();
  s.now.presses = {{.soft = 1, .other = 0, .force_N = 0.2},
                   {.soft = 1, .other = 0},
                   {.soft = 1, .force_N = 0.7},
                   {.soft = 1, .other = 0, .force_N = 0.0}};
  const auto rows = hybrid::legend_rows(s.scene, s.now, 20);
  EXPECT_EQ(names(rows),
            (std::vector<std::string>{"shell", "ball", "forces between objects", "ball – its anchors",
                                      "ball – shell", "ball – shell", "tool, as felt (proxy)",
                                      "tool, at the device", "force on the hand"}))
      << "a pair without a force is left out";
  EXPECT_EQ(rows[3].force, hybrid::force_text(0.7));
  EXPECT_EQ(rows[4].force, hybrid::force_text(0.2));
  EXPECT_EQ(rows[5].force, "not known");
  EXPECT_EQ(rows[3].swatch, std::vector<glm::vec3>{hybrid::palette::of_object(s.scene, 1)});
  EXPECT_EQ(rows[4].swatch, (std::vector<glm::vec3>{hybrid::palette::of_object(s.scene, 1),
                                                    hybrid::palette::of_object(s.scene, 0)}));
}

TEST(Legend, CutsTheLongerNameOfAPair) {
  Session s = tests::shell_and_ball();
  s.scene.objects[1].name = "liver_and_spleen_and_11";
  s.now.presses = {{.soft = 1, .force_N = 0.7}, {.soft = 1, .other = 0, .force_N = 0.2}};
  const auto rows = hybrid::legend_rows(s.scene, s.now, 20);
  EXPECT_EQ(rows[3].name, "liver_and_… – its anchors");
  EXPECT_EQ(rows[4].name, "liver_and_spleen… – shell");
}

TEST(Legend, CountsPairsThatDoNotFitAndLeavesObjectsTheirRows) {
  Session s = tests::shell_and_ball();
  for (int p = 0; p < 9; ++p) s.now.presses.push_back({.soft = 1, .other = 0, .force_N = 1.0 + p});
  for (std::size_t most = 5; most < 20; ++most) {
    const auto rows = hybrid::legend_rows(s.scene, s.now, most);
    EXPECT_LE(rows.size(), most);
    EXPECT_TRUE(has(rows, "shell") && has(rows, "ball")) << most;
    const auto pairs = std::ranges::count(names(rows), std::string("ball – shell"));
    EXPECT_EQ(pairs > 0, most >= 8) << most;
    if (pairs > 0) {
      EXPECT_TRUE(has(rows, "and " + std::to_string(9 - pairs) + " more")) << most;
    }
  }
}

}  // namespace
