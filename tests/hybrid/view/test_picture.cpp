// SPDX-License-Identifier: GPL-3.0-or-later
// Checks single pixels, for example that the tool has its colour and that tissue is visible through bone.
// Without EGL, the cases that draw are skipped.
#include "hybrid/view/picture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "hybrid/view/camera.h"
#include "hybrid/view/gl/unit_shapes.h"
#include "hybrid/view/overlay.h"
#include "hybrid/view/palette.h"
#include "polygon/surface/primitives.h"
#include "tests/hybrid/view/picture_fixture.h"

namespace {

using hybrid::Camera;
using hybrid::DrawnScene;
using hybrid::Snapshot;

using tests::ball_mesh;
using tests::Image;
using tests::Picture;
using tests::Session;
using tests::shell_and_ball;
using tests::small;

float redness(const glm::vec3& c) {
  return c.r - 0.5F * (c.g + c.b);
}

TEST(CameraTest, ProjectsAndPicksBack) {
  Camera camera;
  camera.target_m = {0.1, -0.2, 0.3};
  camera.distance_m = 0.7;
  camera.azimuth_rad = 0.8;
  camera.elevation_rad = 0.4;
  const auto centre = camera.pixel(camera.target_m, 640, 480);
  ASSERT_TRUE(centre.has_value());
  EXPECT_NEAR(centre->x, 320.0, 1e-9);
  EXPECT_NEAR(centre->y, 240.0, 1e-9);
  const glm::dvec3 point(0.15, -0.1, 0.25);
  const auto pixel = camera.pixel(point, 640, 480);
  ASSERT_TRUE(pixel.has_value());
  const glm::dvec3 back = camera.point_at(*pixel, 640, 480, point);
  EXPECT_NEAR(glm::length(back - point), 0.0, 1e-12);
  // The renderer's matrix gives the same pixel.
  const glm::dvec4 clip = camera.clip_from_scene(640.0 / 480.0, {1.0, 2.0, 3.0}, camera.target_m, 0.3) *
                          glm::dvec4(point - glm::dvec3(1.0, 2.0, 3.0), 1.0);
  EXPECT_NEAR(320.0 * (1.0 + clip.x / clip.w), pixel->x, 1e-6);
  EXPECT_NEAR(240.0 * (1.0 - clip.y / clip.w), pixel->y, 1e-6);
  EXPECT_FALSE(camera.pixel(camera.eye_m() + camera.toward_eye(), 640, 480).has_value());
}

TEST(CameraTest, FramesTheWholeSceneWhereverItLies) {
  for (const glm::dvec3& at : {glm::dvec3(0.0), glm::dvec3(1e6, -1e6, 3e5)}) {
    const Session s = shell_and_ball(at);
    const Camera camera = hybrid::frame_scene(s.scene, s.now, 1.0);
    double widest = 0.0;
    for (const glm::dvec3& vertex : s.scene.objects[0].surface.vertices) {
      const auto pixel = camera.pixel(vertex, 1.0, 1.0);
      ASSERT_TRUE(pixel.has_value());
      widest = std::max({widest, std::abs(pixel->x - 0.5), std::abs(pixel->y - 0.5)});
    }
    EXPECT_LE(widest, 0.5);
    EXPECT_GE(widest, 0.25) << "the scene fills its picture";
    // The tool presses from above, so the camera looks from above.
    EXPECT_GT(camera.elevation_rad, 0.0);
  }
}

TEST(CameraTest, BoundsOfNothingAreUsable) {
  const hybrid::SceneBounds bounds = hybrid::bounds_of(DrawnScene{});
  EXPECT_GT(bounds.radius_m, 0.0);
  Snapshot broken;
  broken.proxy_m.x = std::numeric_limits<double>::quiet_NaN();
  broken.device_m = broken.force_N = broken.proxy_m;
  const Camera camera = hybrid::frame_scene(DrawnScene{}, broken);
  EXPECT_TRUE(std::isfinite(camera.distance_m));
  EXPECT_GT(camera.distance_m, 0.0);
}

TEST(DrawGeometry, NormalsOfABallPointOutward) {
  const auto mesh = ball_mesh({1e6, 0.0, 0.0}, 0.05);
  for (const auto& draw :
       {hybrid::make_draw_mesh(mesh, {1e6, 0.0, 0.0}), hybrid::make_moving_mesh(mesh, {1e6, 0.0, 0.0})}) {
    ASSERT_EQ(draw.indices.size(), 3 * mesh.triangles.size());
    std::size_t known = 0;
    for (const auto& vertex : draw.vertices) {
      if (std::abs(vertex.position.z) > 0.0495F) continue;  // triangles at the poles have no area
      ++known;
      EXPECT_GT(glm::dot(vertex.normal, glm::normalize(vertex.position)), 0.98F);
    }
    EXPECT_GT(known, draw.vertices.size() * 8 / 10);
  }
}

TEST(DrawGeometry, ABoxKeepsItsEdgesSharp) {
  polygon::TriangleMesh box;
  for (int i = 0; i < 8; ++i)
    box.vertices.emplace_back((i & 1) != 0 ? 1 : 0, (i & 2) != 0 ? 1 : 0, (i & 4) != 0 ? 1 : 0);
  box.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                   {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  for (const auto& vertex : hybrid::make_draw_mesh(box, {0.0, 0.0, 0.0}).vertices) {
    EXPECT_NEAR(std::abs(vertex.normal.x) + std::abs(vertex.normal.y) + std::abs(vertex.normal.z), 1.0F,
                1e-5F);
  }
}

TEST(DrawGeometry, LeavesOutWhatCannotBeDrawn) {
  polygon::TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {std::numeric_limits<double>::quiet_NaN(), 0, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 1, 3}, {0, 1, 99}, {0, 0, 0}};
  EXPECT_EQ(hybrid::make_draw_mesh(mesh, {0, 0, 0}).indices.size(), 6U);
  EXPECT_EQ(hybrid::make_moving_mesh(mesh, {0, 0, 0}).indices.size(), 6U);
}

TEST(DrawGeometry, DisplacementIsTheDistanceFromRest) {
  const auto mesh = ball_mesh({0.0, 0.0, 0.0}, 1.0, 2.0, 8);
  auto draw = hybrid::make_moving_mesh(mesh, {0.0, 0.0, 0.0});
  std::vector<glm::vec3> moved(mesh.vertices.size(), {0.3F, 0.0F, 0.4F});
  moved[3].x = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NEAR(hybrid::move_vertices(draw, mesh.vertices, moved, {0.0, 0.0, 0.0}), 0.5F, 1e-6F);
  EXPECT_NEAR(glm::length(glm::dvec3(draw.vertices[10].position) - mesh.vertices[10]), 0.5, 1e-6);
  EXPECT_EQ(draw.vertices[3].value, 0.0F);
  EXPECT_NEAR(draw.vertices[10].value, 0.5F, 1e-6F);
}

TEST(LengthText, SaysWhatAPersonWould) {
  EXPECT_EQ(hybrid::length_text(0.012), "12 mm");
  EXPECT_EQ(hybrid::length_text(0.0), "0 mm");
  EXPECT_EQ(hybrid::length_text(2.5), "2.5 m");
  EXPECT_EQ(hybrid::length_text(5e-6), "5 µm");
  EXPECT_EQ(hybrid::round_down(0.0123), 0.01);
  EXPECT_NEAR(hybrid::round_down(79.0), 50.0, 1e-12);
  EXPECT_EQ(hybrid::round_down(-1.0), 0.0);
}

TEST_F(Picture, ShowsToolTissueAndForceWhereTheyAre) {
  const Session s = shell_and_ball();
  const Camera camera = tests::framed(s);
  DRAW_OR_SKIP(image, s, small(camera));
  ASSERT_EQ(image.width, 960);
  ASSERT_EQ(image.height, 720);
  const auto pixel = [&](const glm::dvec3& at) { return tests::seen_at(camera, at); };
  // The tool is dark, unlike the pale one at the device's position. The sampled point is on the tool's upper
  // side, toward the eye.
  const glm::vec3 tool = image.at(pixel(s.now.proxy_m + camera.right() * 5e-3 + glm::dvec3(0.0, 0.0, 3e-3)));
  EXPECT_LT(tool.r + tool.g + tool.b, 1.2F);
  // The force arrow is blue half-way up.
  const glm::dvec3 tip =
      s.now.proxy_m + glm::dvec3(0.0, 0.0, 8e-3 + 0.3 * camera.view_height_m() * 3.0 / 8.5);
  const glm::vec3 arrow = image.at(pixel(0.5 * (tip + s.now.proxy_m + glm::dvec3(0.0, 0.0, 8e-3))));
  EXPECT_GT(arrow.b, arrow.r + 0.2F);
  // An empty corner has the background's colour.
  EXPECT_LT(glm::length(image.at({959.0, 360.0}) - hybrid::palette::background), 0.02F);
}

TEST_F(Picture, SeesThroughBoneThatHidesTissueAndOnlyThere) {
  // Here the shell around the soft ball is closed.
  const Session closed = shell_and_ball({0.0, 0.0, 0.0}, 2.0);
  Camera camera = tests::framed(closed);
  camera.elevation_rad = 0.0;
  DRAW_OR_SKIP(image, closed, small(camera));
  const glm::vec3 middle = image.at(tests::seen_at(camera, {0.0, 0.0, -0.01}));
  // At the side of the ball, between tissue and shell, the shell's own colour shows.
  const glm::vec3 side = image.at(tests::seen_at(camera, camera.right() * 0.0755));
  EXPECT_GT(redness(middle), 0.10F) << "tissue is pink";
  EXPECT_LT(redness(side), 0.12F) << "bone is not";
  EXPECT_GT(redness(middle), redness(side) + 0.05F);
  // Without the soft object the same shell is opaque.
  Session alone = closed;
  alone.scene.objects.resize(1);
  alone.now.soft_moved_m.resize(1);
  alone.now.proxy_m = alone.now.device_m = {0.0, 0.0, 0.2};
  camera = tests::framed(alone);
  DRAW_OR_SKIP(bone, alone, small(camera));
  EXPECT_LT(redness(bone.at(tests::seen_at(camera, {0.0, 0.0, -0.01}))), 0.12F);
}

TEST_F(Picture, ColoursDisplacement) {
  const Session s = shell_and_ball();
  Camera camera = tests::framed(s);
  camera.elevation_rad = 0.9;
  DRAW_OR_SKIP(image, s, small(camera));
  // The colour scale ends at 20 mm. The tissue is displaced by 6 mm at 16 mm beside the tool's axis, and
  // hardly at 45 mm beside the axis.
  const glm::dvec3 beside =
      camera.right() * 0.016 + glm::dvec3(0.0, 0.0, std::sqrt(0.0049 - 0.000256) - 0.0063);
  const glm::vec3 own = hybrid::palette::of_object(s.scene, 1);
  const auto like = [&](const glm::dvec3& at, const glm::vec3& colour) {
    return glm::dot(glm::normalize(image.at(tests::seen_at(camera, at))), glm::normalize(colour));
  };
  EXPECT_GT(like(beside, hybrid::palette::of_displacement(own, 0.3F)), 0.98F);
  EXPECT_GT(like(camera.right() * 0.045 + glm::dvec3(0.0, 0.0, 0.0536), own), 0.99F);
  EXPECT_LT(like(beside, own), 0.95F);
}

// A bar has a face in the same plane as a block of tissue. The bar must be drawn whole, although rounding
// could put either in front.
TEST_F(Picture, DrawsABodyWholeOnTheTissueThatItLiesOn) {
  Session s;
  s.scene.tool_radius_m = 2e-3;
  s.scene.objects.push_back({"bar", false, polygon::make_box_mesh({0.01, 0.01, 0.005}, 8)});
  s.scene.objects.push_back({"block", true, polygon::make_box_mesh({0.03, 0.03, 0.015}, 16)});
  // The front faces of bar and block are both at y = −0.03.
  for (glm::dvec3& v : s.scene.objects[0].surface.vertices) v += glm::dvec3(0.0, -0.02, 0.0);
  s.now.proxy_m = s.now.device_m = {0.0, 0.0, 0.1};
  s.now.feel.resize(2);
  Camera camera = tests::framed(s);
  camera.azimuth_rad = -0.4 * std::numbers::pi;
  camera.elevation_rad = 0.2;
  DRAW_OR_SKIP(image, s, small(camera));
  const glm::vec3 bone = hybrid::palette::of_object(s.scene, 0);
  int whole = 0, all = 0;
  for (double x = -0.008; x <= 0.008; x += 5e-4) {
    for (double z = -0.003; z <= 0.003; z += 5e-4, ++all) {
      const glm::vec3 seen = image.at(tests::seen_at(camera, {x, -0.03, z}));
      whole += glm::dot(glm::normalize(seen), glm::normalize(bone)) > 0.99F ? 1 : 0;
    }
  }
  EXPECT_EQ(whole, all);
}

TEST_F(Picture, IsTheSameTwiceAndFarFromTheOrigin) {
  const Session s = shell_and_ball();
  const Camera camera = tests::framed(s);
  DRAW_OR_SKIP(once, s, small(camera));
  DRAW_OR_SKIP(twice, s, small(camera));
  EXPECT_EQ(once.rgb, twice.rgb);
  const Session far = shell_and_ball({1e6, 1e6, -1e6});
  DRAW_OR_SKIP(here, s, small(tests::framed(s)));
  DRAW_OR_SKIP(there, far, small(tests::framed(far)));
  double sum = 0.0;
  for (std::size_t i = 0; i < here.rgb.size(); ++i) sum += std::abs(int{here.rgb[i]} - int{there.rgb[i]});
  EXPECT_LT(sum / static_cast<double>(here.rgb.size()), 1.0);
}

// A bar on the left is turned and moved to the right.
TEST_F(Picture, DrawsARigidObjectWhereItIsAtThatMoment) {
  for (const glm::dvec3& at : {glm::dvec3(0.0), glm::dvec3(1e6, -1e6, 1e6)}) {
    Session s;
    s.scene.tool_radius_m = 2e-3;
    s.scene.max_force_N = 8.5;
    s.scene.objects.push_back({"bar", false, polygon::make_box_mesh({0.03, 0.005, 0.005}, 1)});
    for (glm::dvec3& v : s.scene.objects[0].surface.vertices) v += at + glm::dvec3(-0.05, 0.0, 0.0);
    s.now.proxy_m = s.now.device_m = at + glm::dvec3(0.0, 0.0, 0.08);
    s.now.feel.resize(1);
    Camera above;
    above.target_m = at;
    above.distance_m = 0.4;
    above.elevation_rad = 1.4;
    above.azimuth_rad = -0.5 * std::numbers::pi;
    const auto shown = [&](const Image& image, const glm::dvec3& p) {
      const glm::vec3 colour = image.at(tests::seen_at(above, at + p));
      return glm::length(colour - hybrid::palette::background) > 0.1F;
    };
    DRAW_OR_SKIP(rest, s, small(above));
    // Turned by 90 degrees about its own centre and moved 100 mm to the right, the bar has its length along
    // y.
    s.now.rigid_place = {{.moved = true,
                          .about_m = at + glm::dvec3(-0.05, 0.0, 0.0),
                          .shift_m = {0.1, 0.0, 0.0},
                          .turn = glm::angleAxis(0.5 * std::numbers::pi, glm::dvec3(0.0, 0.0, 1.0))}};
    DRAW_OR_SKIP(moved, s, small(above));
    for (const double along : {-0.028, -0.01, 0.01, 0.028}) {
      EXPECT_TRUE(shown(rest, {-0.05 + along, 0.0, 0.005}));
      EXPECT_FALSE(shown(moved, {-0.05 + along, 0.0, 0.005})) << "gone from where it was";
      EXPECT_TRUE(shown(moved, {0.05, along, 0.005}));
      EXPECT_FALSE(shown(rest, {0.05, along, 0.005}));
    }
    EXPECT_FALSE(shown(moved, {0.07, 0.0, 0.005})) << "no more along x";
  }
}

// An object that moves far from its start must stay within the view, and must not be clipped.
TEST_F(Picture, FollowsARigidObjectThatLeaves) {
  Session s;
  s.scene.tool_radius_m = 2e-3;
  s.scene.objects.push_back({"ball", false, ball_mesh({0.0, 0.0, 0.0}, 0.02)});
  s.scene.objects.push_back({"other", false, ball_mesh({0.1, 0.0, 0.0}, 0.02)});
  s.now.proxy_m = s.now.device_m = {0.0, 0.0, 0.05};
  s.now.rigid_place.resize(2);
  s.now.rigid_place[1] = {.moved = true, .about_m = {0.1, 0.0, 0.0}, .shift_m = {0.9, 0.5, -0.3}};
  const Camera camera = tests::framed(s);
  const glm::dvec3 there(1.0, 0.5, -0.3);
  const auto pixel = tests::small_layout.pixel(camera, there);
  ASSERT_TRUE(pixel.has_value());
  EXPECT_GT(std::min(pixel->x, pixel->y), 0.0);
  EXPECT_LT(std::max(pixel->x / 960, pixel->y / 720), 1.0);
  DRAW_OR_SKIP(image, s, small(camera));
  EXPECT_GT(glm::length(image.at(*pixel) - hybrid::palette::background), 0.05F);
}

TEST_F(Picture, DrawsNothingAndBrokenSnapshots) {
  Session empty;
  DRAW_OR_SKIP(nothing, empty, {});
  EXPECT_EQ(nothing.width, 1280);
  Session broken = shell_and_ball();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  broken.now.proxy_m = broken.now.device_m = broken.now.force_N = {nan, nan, nan};
  broken.now.soft_moved_m[1].resize(3);  // a size that does not match the mesh
  broken.now.rigid_place.resize(9);      // more poses than objects
  broken.now.rigid_place[0] = {.moved = true, .shift_m = {nan, nan, nan}};
  broken.now.feel.clear();
  broken.scene.title = std::string(500, 'W');
  broken.scene.objects[0].name = "100 %s %n Gehörgang \xff\xfe";
  broken.scene.objects.push_back({"nothing", true, {}});
  DRAW_OR_SKIP(drawn, broken, {});
  EXPECT_EQ(drawn.height, 960);
}

TEST_F(Picture, RefusesWhatItCannotDraw) {
  const Session s = shell_and_ball();
  hybrid::PictureOptions options;
  for (const int size : {0, -5, 100'000}) {
    options.width = size;
    try {
      draw(s, options);
      if (!why_not_.empty()) GTEST_SKIP() << why_not_;
      ADD_FAILURE() << "drawn at a width of " << size;
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find("8192"), std::string::npos) << error.what();
    }
  }
  try {
    hybrid::save_picture("/nonexistent-folder/a.png", s.scene, s.now, small(Camera{}));
    ADD_FAILURE() << "written into a folder that is not there";
  } catch (const std::runtime_error& error) {
    const std::string words = error.what();
    EXPECT_TRUE(words.find("/nonexistent-folder/a.png") != std::string::npos ||
                words.find("needs EGL") != std::string::npos);
  }
}

}  // namespace
