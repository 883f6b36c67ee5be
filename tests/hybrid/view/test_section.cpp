// SPDX-License-Identifier: GPL-3.0-or-later
// The cut through an object that hides a material: the stored inside of a built scene, and the conditions and
// the place of the cut.
#include "hybrid/view/tissue/section.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <numbers>
#include <string>

#include "hybrid/build/build_world.h"
#include "hybrid/snapshot/make_drawn_scene.h"
#include "hybrid/view/legend.h"
#include "hybrid/view/palette.h"
#include "hybrid/view/scene_meshes.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"
#include "tests/hybrid/view/cored_block.h"
#include "tests/hybrid/view/picture_fixture.h"

namespace {

using hybrid::Camera;
using tests::Session;
using InsideOf = tests::SceneFile;
using CutPicture = tests::Picture;

// A block of 20 mm, with gel around a core of 10 mm. Its drawn surface is a ball, and a tool is above it.
Session cored() {
  Session s;
  s.scene.tool_radius_m = 3e-3;
  s.scene.objects.push_back({"block", true, tests::ball_mesh({0.0, 0.0, 0.0}, 0.017)});
  s.scene.objects[0].inside = tests::cored_block();
  s.now.proxy_m = s.now.device_m = {0.0, 0.0, 0.015};
  s.now.force_N = {0.0, 0.0, 1.0};
  s.now.feel = {{true, 1.0}};
  s.now.inside.resize(1);
  s.now.inside[0].used = true;  // without displacements, the block is at rest
  return s;
}

Camera from_the_front() {
  Camera camera;
  camera.distance_m = 0.1;
  camera.azimuth_rad = -0.5 * std::numbers::pi;
  camera.elevation_rad = 0.4;
  return camera;
}

TEST(DrawnInside, FindsTheMaterialOfAPoint) {
  const hybrid::DrawnInside inside = cored().scene.objects[0].inside;
  EXPECT_EQ(inside.material_at({0.0, 0.0, 0.0}), 1U);
  EXPECT_EQ(inside.material_at({4.9e-3, 0.0, 0.0}), 1U);
  EXPECT_EQ(inside.material_at({5.1e-3, 0.0, 0.0}), 0U);
  EXPECT_EQ(inside.material_at({9.9e-3, 0.0, 0.0}), 0U);
  EXPECT_FALSE(inside.material_at({10.1e-3, 0.0, 0.0}).has_value());
  EXPECT_FALSE(hybrid::DrawnInside{}.material_at({0.0, 0.0, 0.0}).has_value());
}

TEST(CutOf, LiesAlongTheForceAndFacesTheEye) {
  const Session s = cored();
  const auto cut = hybrid::choose_cut(s.scene, s.now, from_the_front(), 0);
  ASSERT_TRUE(cut.has_value());
  EXPECT_NEAR(glm::length(cut->normal - glm::dvec3(0.0, -1.0, 0.0)), 0.0, 1e-12);
  EXPECT_EQ(cut->point_m, s.now.proxy_m);
}

TEST(CutOf, IsOnlyThroughWhatIsPressedAndHidesSomething) {
  const Camera camera = from_the_front();
  Session s = cored();
  s.now.feel[0].contact = false;
  EXPECT_FALSE(hybrid::choose_cut(s.scene, s.now, camera, 0).has_value());
  s = cored();
  s.scene.objects[0].inside = {};
  EXPECT_FALSE(hybrid::choose_cut(s.scene, s.now, camera, 0).has_value());
  s = cored();
  s.now.inside.clear();
  EXPECT_FALSE(hybrid::choose_cut(s.scene, s.now, camera, 0).has_value());
  s = cored();
  s.now.force_N = camera.toward_eye();
  EXPECT_FALSE(hybrid::choose_cut(s.scene, s.now, camera, 0).has_value()) << "seen from its edge";
}

TEST(SectionOf, ShowsAsMuchOfEachMaterialAsThereIs) {
  const Session s = cored();
  const auto cut = hybrid::choose_cut(s.scene, s.now, from_the_front(), 0);
  ASSERT_TRUE(cut.has_value());
  const hybrid::Section section = hybrid::make_section(s.scene.objects[0], *cut);
  const auto colours = hybrid::palette::of_inside(s.scene, 0);
  const hybrid::SectionImage image = hybrid::paint_materials(section, colours);
  ASSERT_EQ(image.pixels.size(), section.materials.size());
  const double pixel_m2 = glm::length(section.right_m) * glm::length(section.up_m);
  double core = 0.0, all = 0.0;
  for (const auto& pixel : image.pixels) {
    if (pixel[3] == 0) continue;
    all += pixel_m2;
    if (std::abs(static_cast<float>(pixel[0]) / 255.0F - colours[1].r) < 0.01F) core += pixel_m2;
  }
  EXPECT_NEAR(all, 20e-3 * 20e-3, 0.03 * 4e-4);
  EXPECT_NEAR(core, 10e-3 * 10e-3, 0.06 * 1e-4);
  // The net covers all tissue, and its nodes move with tissue.
  double net = 0.0;
  for (std::size_t n = 0; n < section.indices.size(); n += 3) {
    const auto at = [&](std::size_t c) { return section.nodes_m[section.indices[n + c]]; };
    net += 0.5 * glm::length(glm::cross(at(1) - at(0), at(2) - at(0)));
    EXPECT_NEAR(at(0).y, 0.0, 1e-12);
  }
  EXPECT_GE(net, all);
  EXPECT_LT(net, 1.3 * all);
  for (const glm::dvec3& at : section.in_tissue)
    EXPECT_TRUE(s.scene.objects[0].inside.material_at(at).has_value());
}

TEST(SectionOf, MovesWithTheTissue) {
  const Session s = cored();
  const hybrid::Section section =
      hybrid::make_section(s.scene.objects[0], {{0.0, 2e-3, 0.0}, {0.0, 1.0, 0.0}});
  const std::vector<glm::vec3> moved_m(section.nodes_m.size(), {1e-3F, 2e-3F, 3e-3F});
  const glm::dvec3 origin_m(0.5, 0.0, 0.0);
  const auto free = hybrid::move_section(section, moved_m, {}, false, origin_m);
  const auto flat = hybrid::move_section(section, moved_m, {}, true, origin_m);
  ASSERT_EQ(free.vertices.size(), section.nodes_m.size());
  for (std::size_t n = 0; n < free.vertices.size(); ++n) {
    const glm::vec3 rest(section.nodes_m[n] - origin_m);
    EXPECT_NEAR(glm::distance(free.vertices[n].position, rest + moved_m[n]), 0.0F, 1e-6F);
    EXPECT_NEAR(flat.vertices[n].position.y, 2e-3F, 1e-7F);
  }
}

TEST_F(CutPicture, ShowsTheCoreInItsColour) {
  Session s = cored();
  Camera camera = from_the_front();
  const glm::vec3 core = hybrid::palette::of_inside(s.scene, 0)[1];
  const auto like_core = [&](const tests::Image& image) {
    const glm::vec3 seen = image.at(tests::seen_at(camera, {2e-3, 0.0, -2e-3}));
    return glm::dot(glm::normalize(seen), glm::normalize(core)) > 0.99F;
  };
  DRAW_OR_SKIP(cut, s, tests::small(camera));
  EXPECT_TRUE(like_core(cut));
  s.now.inside.clear();
  DRAW_OR_SKIP(whole, s, tests::small(camera));
  EXPECT_FALSE(like_core(whole));
  bool named = false;
  for (const auto& row : hybrid::legend_rows(cored().scene, cored().now, 20))
    named = named || row.name == "core (inside)";
  EXPECT_TRUE(named);
}

TEST_F(InsideOf, NamesAllMaterialsAndWhetherTheSurfaceHidesOne) {
  const std::string materials =
      "format = 1\nunits = \"mm\"\n[material.gel]\nyoung = 9000\n[material.hard]\nyoung = 90000\n" +
      tests::block + "material = \"gel\"\nmaterials = { \"2\" = \"hard\" }\n";
  const auto drawn = [&](const std::string& text) {
    const hybrid::Scene scene = load(materials + text + tests::path);
    const hybrid::BuiltScene built = hybrid::build_scene(scene);
    return hybrid::drawn_scene(scene, built, "a").objects[0];
  };
  const auto hidden =
      drawn("inclusions = [{ shape = \"box\", centre = [0, 0, 0], size = [10, 10, 4], label = 2 }]\n");
  ASSERT_EQ(hidden.inside.materials, (std::vector<std::string>{"gel", "hard"}));
  EXPECT_EQ(hidden.inside.material_at({0.0, 0.0, 0.0}), 1U);
  EXPECT_EQ(hidden.inside.material_at({9e-3, 0.0, 0.0}), 0U);
  EXPECT_TRUE(hidden.hides_material());
  EXPECT_FALSE(
      drawn("inclusions = [{ shape = \"box\", centre = [0, 0, 5], size = [10, 10, 6], label = 2 }]\n")
          .hides_material());
}

}  // namespace
