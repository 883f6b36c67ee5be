// SPDX-License-Identifier: GPL-3.0-or-later
// The questions of a view to a session, and the slices, values, scales and grey values made of the answers.
#include "hybrid/view/tissue_view.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <thread>

#include "hybrid/build/build_world.h"
#include "hybrid/snapshot/make_drawn_scene.h"
#include "hybrid/view/palette.h"
#include "hybrid/view/slice_frames.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"
#include "tests/hybrid/view/cored_block.h"
#include "tests/hybrid/view/picture_fixture.h"
#include "voxel/volume/write_volume.h"

namespace {

using hybrid::TissueColour;
using hybrid::ViewSettings;
using TissueOfScan = tests::SceneFile;
using SlicedPicture = tests::Picture;

// The cored block as the only object. Its drawn surface is the ball through its corners.
tests::Session block() {
  tests::Session s;
  s.scene.tool_radius_m = 3e-3;
  s.scene.objects.push_back({"block", true, tests::ball_mesh({0.0, 0.0, 0.0}, 0.0173)});
  for (glm::dvec3& v : s.scene.objects[0].surface.vertices) v = glm::clamp(v, -0.01, 0.01);
  s.scene.objects[0].inside = tests::cored_block();
  s.now.soft_moved_m.resize(1);
  s.now.soft_moved_m[0].resize(s.scene.objects[0].surface.vertices.size());
  s.now.proxy_m = s.now.device_m = {0.0, 0.0, 0.03};
  return s;
}

// Answers a view's questions. All tissue moves by a linear map.
void answer(hybrid::Snapshot& now, const hybrid::AskedPoints& asked, const glm::dmat3& gradient) {
  now.asked.number = asked.number;
  now.asked.moved_m.assign(asked.at_rest_m.size(), {});
  for (std::size_t o = 0; o < asked.at_rest_m.size(); ++o) {
    for (const glm::dvec3& at : asked.at_rest_m[o]) now.asked.moved_m[o].emplace_back(gradient * at);
  }
}

glm::dmat3 stretched(double by) {
  glm::dmat3 gradient(0.0);
  gradient[2][2] = by;
  return gradient;
}

TEST(TissueViewOf, AsksForNothingThatItDoesNotShow) {
  const tests::Session s = block();
  hybrid::TissueView tissue(s.scene, glm::dvec3(0.0));
  for (const TissueColour colour : {TissueColour::material, TissueColour::displacement}) {
    ViewSettings view;
    view.colour = colour;
    tissue.set(view);
    EXPECT_EQ(tissue.asked(), nullptr);
    EXPECT_TRUE(tissue.slices(0).empty());
  }
}

TEST(TissueViewOf, MovesSlicesWithTheTissueAndKeepsThemUntilTheAnswerComes) {
  tests::Session s = block();
  hybrid::TissueView tissue(s.scene, glm::dvec3(0.0));
  ViewSettings view;
  view.slices[0] = {true, 0.5};
  tissue.set(view);
  ASSERT_NE(tissue.asked(), nullptr);
  ASSERT_EQ(tissue.slices(0).size(), 1U);
  answer(s.now, *tissue.asked(), stretched(-0.1));
  tissue.take(s.now);
  const hybrid::TissueSlice slice = tissue.slices(0)[0];
  for (std::size_t n = 0; n < slice.section.nodes_m.size(); ++n) {
    const glm::dvec3 moved = stretched(-0.1) * slice.section.in_tissue[n];
    EXPECT_NEAR(glm::distance(glm::dvec3(slice.mesh.vertices[n].position), slice.section.nodes_m[n] + moved),
                0.0, 1e-7);
    EXPECT_NEAR(slice.mesh.vertices[n].value, glm::length(moved), 1e-7);
  }
  s.now.asked.number += 1;  // an answer to another question
  tissue.take(s.now);
  EXPECT_EQ(tissue.slices(0)[0].moved_number, slice.moved_number);
  view.slices[0].share = 0.25;
  tissue.set(view);
  EXPECT_NEAR(tissue.slices(0)[0].section.plane.point_m.x, -0.005, 1e-9);
}

TEST(TissueViewOf, ColoursSurfaceAndSlicesByStrain) {
  tests::Session s = block();
  hybrid::TissueView tissue(s.scene, glm::dvec3(0.0));
  ViewSettings view;
  view.slices[1] = {true, 0.5};
  view.colour = TissueColour::strain;
  tissue.set(view);
  ASSERT_NE(tissue.asked(), nullptr);
  answer(s.now, *tissue.asked(), stretched(-0.03));
  tissue.take(s.now);
  ASSERT_EQ(tissue.values(0).size(), s.scene.objects[0].surface.vertices.size());
  for (const float value : tissue.values(0)) EXPECT_NEAR(value, 0.03F, 1e-5F);
  for (const auto& vertex : tissue.slices(0)[0].mesh.vertices) EXPECT_NEAR(vertex.value, 0.03F, 1e-5F);
  EXPECT_DOUBLE_EQ(tissue.scale().end, 0.05);
  answer(s.now, *tissue.asked(), stretched(-0.002));
  tissue.take(s.now);
  EXPECT_DOUBLE_EQ(tissue.scale().end, 0.05) << "a scale does not fall";
  view.colour = TissueColour::limits;  // needs the same points
  const std::uint64_t number = tissue.asked()->number;
  tissue.set(view);
  EXPECT_EQ(tissue.asked()->number, number);
  EXPECT_DOUBLE_EQ(tissue.scale().end, 1.0);
  EXPECT_NEAR(tissue.values(0)[0], 0.002F / 0.6F, 1e-4F);
}

TEST(TissueViewOf, ColoursTheSurfaceByADifferenceOfModels) {
  tests::Session s = block();
  const std::size_t count = s.scene.objects[0].surface.vertices.size();
  hybrid::TissueView tissue(s.scene, glm::dvec3(0.0));
  ViewSettings view;
  view.colour = TissueColour::difference;
  tissue.set(view);
  tissue.take(s.now);
  EXPECT_EQ(tissue.scale().end, 0.0) << "nothing is compared";
  EXPECT_NE(tissue.in_words(), "");
  hybrid::FeltDifference found{.comparison = 1, .number = 1, .jnd = std::vector<float>(count, 0.3F)};
  found.jnd[0] = std::numeric_limits<float>::quiet_NaN();
  s.now.difference = std::make_shared<hybrid::FeltDifference>(found);
  tissue.take(s.now);
  ASSERT_EQ(tissue.values(0).size(), count);
  EXPECT_EQ(tissue.values(0)[0], 0.0F) << "not known";
  EXPECT_EQ(tissue.values(0)[1], 0.3F);
  EXPECT_EQ(tissue.scale().end, 1.0) << "nothing is felt";
  EXPECT_EQ(tissue.in_words(), "");
  const std::uint64_t number = tissue.values_number(0);
  tissue.take(s.now);
  EXPECT_EQ(tissue.values_number(0), number) << "the same result";
  const auto show = [&](std::uint64_t comparison, float jnd) {
    found.comparison = comparison;
    ++found.number;
    found.jnd.assign(count, jnd);
    s.now.difference = std::make_shared<hybrid::FeltDifference>(found);
    tissue.take(s.now);
    return tissue.scale().end;
  };
  EXPECT_EQ(show(1, 4.0F), 5.0);
  EXPECT_EQ(show(1, 2.0F), 5.0) << "a scale does not fall within a comparison";
  EXPECT_EQ(show(2, 1.5F), 2.0);
  view.colour = TissueColour::displacement;
  tissue.set(view);
  EXPECT_TRUE(tissue.values(0).empty()) << "displacements again";
  s.now.difference.reset();
  view.colour = TissueColour::difference;
  tissue.set(view);
  tissue.take(s.now);
  EXPECT_EQ(tissue.values(0)[1], 0.0F);
  EXPECT_EQ(tissue.scale().end, 0.0);
}

TEST(TissueViewOf, MovesTheSurfacesOfMaterialsWithLooksOfTheirOwn) {
  tests::Session s = block();
  hybrid::TissueView tissue(s.scene, glm::dvec3(0.0));
  ViewSettings view;
  view.material_looks.resize(1);
  view.material_looks[0]["gel"].opacity = 0.5F;
  tissue.set(view);
  ASSERT_NE(tissue.asked(), nullptr);
  ASSERT_EQ(tissue.materials(0).size(), 2U);
  const std::uint64_t both = tissue.asked()->number;
  view.material_looks[0]["gel"].visible = false;
  tissue.set(view);
  ASSERT_EQ(tissue.materials(0).size(), 1U) << "the gel is hidden";
  EXPECT_NE(tissue.asked()->number, both) << "other points";
  const hybrid::MaterialSurface& core = tissue.materials(0)[0];
  EXPECT_EQ(core.material, 1U);
  // Voxels 5 to 14 of 1 mm: the core ends 5 mm from the middle, and smoothing moves a vertex within its cell.
  for (const glm::dvec3& at : core.at_rest_m) {
    const double out = std::max({std::abs(at.x), std::abs(at.y), std::abs(at.z)});
    EXPECT_GT(out, 4.4e-3);
    EXPECT_LT(out, 5.6e-3);
  }
  answer(s.now, *tissue.asked(), stretched(-0.1));
  tissue.take(s.now);
  ASSERT_EQ(core.mesh.vertices.size(), core.at_rest_m.size());
  for (std::size_t v = 0; v < core.at_rest_m.size(); ++v) {
    const glm::dvec3 moved = stretched(-0.1) * core.at_rest_m[v];
    EXPECT_NEAR(glm::distance(glm::dvec3(core.mesh.vertices[v].position), core.at_rest_m[v] + moved), 0.0,
                1e-7);
    EXPECT_NEAR(core.mesh.vertices[v].value, glm::length(moved), 1e-7);
  }
  view.colour = TissueColour::strain;
  tissue.set(view);
  answer(s.now, *tissue.asked(), stretched(-0.03));
  tissue.take(s.now);
  for (const auto& vertex : tissue.materials(0)[0].mesh.vertices) EXPECT_NEAR(vertex.value, 0.03F, 1e-5F);
  view.material_looks.clear();
  tissue.set(view);
  EXPECT_TRUE(tissue.materials(0).empty());
}

TEST(SliceFrames, AreGrabbedAtTheirHandleAndFollowThePointer) {
  const tests::Session s = block();
  const hybrid::SoftBox box = hybrid::soft_box(s.scene);
  hybrid::Camera camera;
  camera.distance_m = 0.2;
  camera.azimuth_rad = 0.6;
  camera.elevation_rad = 0.5;
  const hybrid::PixelRect where{100, 50, 800, 600};
  hybrid::FrameLayout layout;
  layout.scene = where;
  ViewSettings view;
  for (auto& slice : view.slices) slice = {true, 0.5};
  const auto frames = hybrid::slice_frames(box, view);
  ASSERT_EQ(frames.size(), 3U);
  for (const hybrid::SliceFrame& frame : frames) {
    const glm::dvec2 handle = *layout.pixel(camera, frame.handle_m());
    EXPECT_EQ(hybrid::slice_at(frames, camera, where, handle, 16.0F), frame.axis);
    EXPECT_FALSE(hybrid::slice_at(frames, camera, where, handle + glm::dvec2(60.0, 0.0), 16.0F).has_value());
    // The pointer moves to the place of a handle that is a little further along the axis.
    ViewSettings further = view;
    further.slices[frame.axis].share = 0.56;
    const glm::dvec2 there = *layout.pixel(camera, hybrid::slice_frames(box, further)[frame.axis].handle_m());
    EXPECT_NEAR(hybrid::dragged_share(frame, box, camera, where, there - handle), 0.06, 0.012);
  }
  camera.elevation_rad = 0.0;
  camera.azimuth_rad = 0.0;
  camera.distance_m = 1e6;  // looks along x
  EXPECT_EQ(hybrid::dragged_share(frames[0], box, camera, where, {30.0, 10.0}), 0.0);
}

TEST_F(SlicedPicture, ShowsTheInsideThroughThePaleSurface) {
  tests::Session s = block();
  hybrid::Camera camera;
  camera.distance_m = 0.08;
  camera.azimuth_rad = -0.5 * std::numbers::pi;
  camera.elevation_rad = 0.2;
  hybrid::PictureOptions options = tests::small(camera);
  const auto at_core = [&](const tests::Image& image) {
    return image.at(tests::seen_at(camera, {2e-3, 0.0, 0.0}));
  };
  DRAW_OR_SKIP(whole, s, options);
  options.view.slices[1] = {true, 0.5};
  DRAW_OR_SKIP(sliced, s, options);
  // The core's colour shows, mixed with the pale surface.
  const auto colours = hybrid::palette::of_inside(s.scene, 0);
  EXPECT_LT(glm::distance(at_core(sliced), colours[1]), glm::distance(at_core(whole), colours[1]) - 0.1F);
}

TEST_F(SlicedPicture, ShowsAMaterialWithoutTheOneAroundIt) {
  tests::Session s = block();
  hybrid::Camera camera;
  camera.distance_m = 0.08;
  camera.azimuth_rad = -0.5 * std::numbers::pi;
  camera.elevation_rad = 0.2;
  hybrid::PictureOptions options = tests::small(camera);
  const auto colour_at = [&](const tests::Image& image, const glm::dvec3& at_m) {
    return image.at(tests::seen_at(camera, at_m));
  };
  const glm::dvec3 middle(0.0), rim(8e-3, 0.0, 0.0);
  const auto colours = hybrid::palette::of_inside(s.scene, 0);
  DRAW_OR_SKIP(whole, s, options);
  options.view.material_looks.resize(1);
  hybrid::Look& gel = options.view.material_looks[0]["gel"];
  gel.visible = false;
  DRAW_OR_SKIP(alone, s, options);
  EXPECT_LT(glm::distance(colour_at(alone, rim), hybrid::palette::background), 0.01F);
  EXPECT_LT(glm::distance(colour_at(alone, middle), colours[1]), 0.2F);
  EXPECT_GT(glm::distance(colour_at(whole, middle), colours[1]), 0.2F);
  gel = {.visible = true, .opacity = 0.4F};
  options.view.material_looks[0]["core"].opacity = 0.5F;
  DRAW_OR_SKIP(both, s, options);
  EXPECT_GT(glm::distance(colour_at(both, rim), hybrid::palette::background), 0.05F);
  // The translucent core is seen through the translucent gel: nearer to its colour than the gel beside it.
  EXPECT_LT(glm::distance(colour_at(both, middle), colours[1]),
            glm::distance(colour_at(both, rim), colours[1]) - 0.05F);
}

TEST_F(SlicedPicture, DrawsEdgesOverSurfacesOnDemand) {
  tests::Session s = block();
  hybrid::Camera camera;
  camera.distance_m = 0.08;
  hybrid::PictureOptions options = tests::small(camera);
  DRAW_OR_SKIP(plain, s, options);
  options.view.wires = true;
  DRAW_OR_SKIP(wired, s, options);
  std::size_t darker = 0, lighter = 0, beside = 0;
  for (int y = 100; y < 600; ++y) {
    for (int x = 10; x < 620; ++x) {
      const glm::vec3 before = plain.at({x, y}), now = wired.at({x, y});
      const float change = now.r + now.g + now.b - before.r - before.g - before.b;
      darker += change < -0.1F ? 1U : 0U;
      lighter += change > 0.1F ? 1U : 0U;
      beside += before == hybrid::palette::background && now != before ? 1U : 0U;
    }
  }
  EXPECT_GT(darker, 1000U);
  EXPECT_EQ(lighter, 0U);
  EXPECT_LT(beside, 200U) << "lines at the rim may touch a pixel beside the surface";
}

TEST_F(TissueOfScan, ShowsTheGreyValuesOfTheFile) {
  voxel::LabelVolume volume{
      .dims = {12, 10, 8}, .spacing_m = {1e-3, 2e-3, 1.5e-3}, .origin_m = {3e-3, -2e-3, 1e-3}, .labels = {}};
  for (int k = 0; k < 8; ++k) {
    for (int j = 0; j < 10; ++j) {
      for (int i = 0; i < 12; ++i)
        volume.labels.push_back(static_cast<std::uint8_t>(20 + 10 * i + j + 3 * k));
    }
  }
  voxel::save_volume(folder_ / "scan.nii.gz", volume);
  const hybrid::Scene scene = load(
      "format = 1\nunits = \"mm\"\n[[soft]]\nname = \"tissue\"\nvolume = \"scan.nii.gz\"\nrange = [30, 255]\n"
      "position = [1, 2, 3]\nrotation = [0, 0, 90]\n" +
      tests::path);
  const hybrid::BuiltScene built = hybrid::build_scene(scene);
  const hybrid::DrawnScene drawn = hybrid::drawn_scene(scene, built, "a");
  ASSERT_TRUE(drawn.objects[0].scan.has_value());
  const hybrid::ScanVolume scan = hybrid::read_scan(drawn.objects[0]);
  const hybrid::DrawnInside& inside = drawn.objects[0].inside;
  for (const glm::ivec3& v : {glm::ivec3(2, 3, 4), glm::ivec3(11, 0, 7), glm::ivec3(5, 9, 1)}) {
    const float value = static_cast<float>(20 + 10 * v.x + v.y + 3 * v.z);
    EXPECT_NEAR(scan.at(inside.from_voxels(v)), value, 1e-3F);
    EXPECT_NEAR(scan.at(inside.from_voxels(glm::dvec3(v) - glm::dvec3(0.5, 0.0, 0.0))), value - 5.0F, 1e-3F);
  }
  EXPECT_TRUE(std::isfinite(scan.at({1e9, -1e9, 0.0})));

  hybrid::TissueView tissue(drawn, glm::dvec3(0.0));
  ViewSettings view;
  view.slices[2] = {true, 0.5};
  view.grey = true;
  tissue.set(view);
  EXPECT_NE(tissue.in_words().find("scan.nii.gz"), std::string::npos);
  const auto is_grey = [&] {
    return std::ranges::all_of(tissue.slices(0)[0].image.pixels, [](const hybrid::VertexColour& pixel) {
      return pixel[0] == pixel[1] && pixel[1] == pixel[2];
    });
  };
  for (int n = 0; n < 500 && !is_grey(); ++n) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    tissue.set(view);
  }
  EXPECT_TRUE(is_grey());
  EXPECT_EQ(tissue.in_words(), "");
  view.grey = false;
  tissue.set(view);
  EXPECT_FALSE(is_grey());

  std::filesystem::remove(folder_ / "scan.nii.gz");
  hybrid::TissueView without(drawn, glm::dvec3(0.0));
  view.grey = true;
  for (int n = 0; n < 500 && !without.in_words().starts_with("slices show"); ++n) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    without.set(view);
  }
  EXPECT_NE(without.in_words().find("cannot be read"), std::string::npos);
}

}  // namespace
