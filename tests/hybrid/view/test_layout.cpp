// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/layout.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <vector>

#include "hybrid/view/palette.h"
#include "tests/hybrid/view/picture_fixture.h"

namespace {

using hybrid::Camera;
using hybrid::frame_layout;
using hybrid::PixelRect;
using tests::Session;

bool overlap(const PixelRect& a, const PixelRect& b) {
  return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
}
bool inside(const PixelRect& a, int width, int height) {
  return a.x >= 0 && a.y >= 0 && a.x + a.width <= width && a.y + a.height <= height;
}

TEST(Layout, KeepsTheColumnOffTheScene) {
  for (const auto& [width, height] :
       {std::pair{1280, 960}, {960, 720}, {640, 480}, {1920, 1080}, {900, 1600}}) {
    for (const bool help : {false, true}) {
      const auto layout = frame_layout(width, height, help);
      EXPECT_TRUE(inside(layout.scene, width, height));
      EXPECT_TRUE(inside(layout.column, width, height));
      EXPECT_TRUE(inside(layout.inset, width, height));
      EXPECT_GT(layout.column.width, 0) << width;
      EXPECT_GT(layout.inset.width, 60);
      EXPECT_EQ(layout.inset.width, layout.inset.height);
      EXPECT_FALSE(overlap(layout.scene, layout.column)) << width;
      EXPECT_FALSE(overlap(layout.scene, layout.inset)) << width;
      EXPECT_GE(layout.scene.width, width / 2);
    }
  }
}

TEST(Layout, GivesANarrowFrameToTheScene) {
  for (const auto& [width, height] : {std::pair{64, 64}, {1, 1}, {200, 8000}}) {
    const auto layout = frame_layout(width, height, true);
    EXPECT_EQ(layout.column.width, 0);
    EXPECT_EQ(layout.inset.width, 0);
    EXPECT_EQ(layout.scene.width, width);
    EXPECT_GE(layout.scene.height, 1);
    EXPECT_TRUE(inside(layout.scene, width, height));
  }
}

TEST(Layout, MeasuresHowMuchNearerAViewIs) {
  Camera far, near;
  far.distance_m = 1.0;
  near.distance_m = 0.25;
  const PixelRect scene{0, 0, 900, 800}, inset{0, 0, 400, 400};
  // The camera is four times nearer, but the view has half as many pixel rows.
  EXPECT_NEAR(hybrid::times_nearer(near, inset, far, scene), 2.0, 1e-12);
  EXPECT_NEAR(hybrid::times_nearer(far, scene, far, scene), 1.0, 1e-12);
}

// The scene measures 160 mm. A tool of 8 mm gets an inset that shows it larger. A tool of 80 mm gets none.
using InsetPicture = tests::Picture;
TEST_F(InsetPicture, IsThereOnlyIfItIsNearer) {
  for (const double radius : {4e-3, 4e-2}) {
    Session s = tests::shell_and_ball();
    s.scene.tool_radius_m = radius;
    const Camera whole = tests::framed(s);
    const Camera near = hybrid::frame_contact(s.scene, s.now, whole);
    const auto& layout = tests::small_layout;
    const double nearer = hybrid::times_nearer(near, layout.inset, whole, layout.scene);
    EXPECT_EQ(nearer >= hybrid::kLeastNearer, radius < 1e-2) << nearer;
    auto options = tests::small(whole);
    options.inset = true;
    const auto image = draw(s, options);
    if (!why_not_.empty()) GTEST_SKIP() << why_not_;
    const glm::dvec2 middle(layout.inset.x + 0.5 * layout.inset.width,
                            layout.inset.y + 0.5 * layout.inset.height);
    const bool drawn = glm::length(image.at(middle) - hybrid::palette::background) > 0.1F;
    EXPECT_EQ(drawn, radius < 1e-2);
  }
}

TEST(FirstView, FramesTheWholePath) {
  Session s = tests::shell_and_ball();
  const std::vector<glm::dvec3> path{{0.0, 0.0, 0.4}, {0.3, 0.0, 0.1}, {0.0, -0.5, 0.0}};
  for (const double aspect : {0.7, 1.0, 1.8}) {
    const Camera camera = hybrid::frame_scene(s.scene, s.now, aspect, path);
    const auto within = [&](const glm::dvec3& at) {
      const auto pixel = camera.pixel(at, aspect, 1.0);
      return pixel && pixel->x > 0.0 && pixel->x < aspect && pixel->y > 0.0 && pixel->y < 1.0;
    };
    for (const glm::dvec3& at : path) {
      for (const glm::dvec3& side : {camera.right(), -camera.right(), camera.up(), -camera.up()})
        EXPECT_TRUE(within(at + s.scene.tool_radius_m * side)) << aspect;
    }
    for (const glm::dvec3& vertex : s.scene.objects[0].surface.vertices) ASSERT_TRUE(within(vertex));
  }
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<glm::dvec3> broken{{nan, 0.0, 0.0}};
  EXPECT_TRUE(std::isfinite(hybrid::frame_scene(s.scene, s.now, 1.0, broken).distance_m));
}

}  // namespace
