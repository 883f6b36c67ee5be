// SPDX-License-Identifier: GPL-3.0-or-later
// A scene to draw, and its picture as pixels. Without EGL, tests that draw are skipped.
#pragma once

#include <gtest/gtest.h>
#include <png.h>

#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "hybrid/view/camera.h"
#include "hybrid/view/layout.h"
#include "hybrid/view/picture.h"

namespace tests {

// A ball meshed by latitude and longitude, without the part above z = `cut` radii.
inline polygon::TriangleMesh ball_mesh(const glm::dvec3& centre, double radius, double cut = 2.0,
                                       std::uint32_t rows = 48) {
  polygon::TriangleMesh mesh;
  const std::uint32_t columns = 2 * rows;
  for (std::uint32_t r = 0; r <= rows; ++r) {
    for (std::uint32_t c = 0; c < columns; ++c) {
      const double polar = std::numbers::pi * (static_cast<double>(r) / rows - 0.5);
      const double turn = 2.0 * std::numbers::pi * c / columns;
      mesh.vertices.push_back(centre + radius * glm::dvec3(std::cos(polar) * std::cos(turn),
                                                           std::cos(polar) * std::sin(turn),
                                                           std::sin(polar)));
    }
  }
  for (std::uint32_t r = 0; r < rows; ++r) {
    if (std::sin(std::numbers::pi * (static_cast<double>(r + 1) / rows - 0.5)) > cut) continue;
    for (std::uint32_t c = 0; c < columns; ++c) {
      const std::uint32_t a = r * columns + c;
      const std::uint32_t b = r * columns + (c + 1) % columns;
      mesh.triangles.push_back({a, b, b + columns});
      mesh.triangles.push_back({a, b + columns, a + columns});
    }
  }
  return mesh;
}

// A hollow shell that is open on top, with a soft ball inside. A tool presses the top of the ball.
struct Session {
  hybrid::DrawnScene scene;
  hybrid::Snapshot now;
};
inline Session shell_and_ball(const glm::dvec3& at = {0.0, 0.0, 0.0}, double cut = 0.7) {
  Session s;
  s.scene.title = "shell and ball";
  s.scene.tool_radius_m = 8e-3;
  s.scene.max_force_N = 8.5;
  s.scene.objects.push_back({"shell", false, ball_mesh(at, 0.08, cut)});
  s.scene.objects.push_back({"ball", true, ball_mesh(at, 0.07)});
  s.now.t_s = 1.5;
  s.now.proxy_m = at + glm::dvec3(0.0, 0.0, 0.066);
  s.now.device_m = s.now.proxy_m - glm::dvec3(0.0, 0.0, 3e-3);
  s.now.force_N = {0.0, 0.0, 3.0};
  s.now.feel = {{false, 0.0}, {true, 3.0}};
  s.now.soft_moved_m.resize(2);
  for (const glm::dvec3& rest : s.scene.objects[1].surface.vertices) {
    const double away = std::hypot(rest.x - at.x, rest.y - at.y);
    const double down = rest.z > at.z ? 0.012 * std::exp(-away * away / 4e-4) : 0.0;
    s.now.soft_moved_m[1].emplace_back(0.0F, 0.0F, static_cast<float>(-down));
  }
  return s;
}

struct Image {
  int width = 0, height = 0;
  std::vector<unsigned char> rgb;
  [[nodiscard]] glm::vec3 at(const glm::dvec2& pixel) const {
    const auto x = static_cast<std::size_t>(pixel.x);
    const auto y = static_cast<std::size_t>(pixel.y);
    const std::size_t i = (y * static_cast<std::size_t>(width) + x) * 3;
    return glm::vec3(rgb[i], rgb[i + 1], rgb[i + 2]) / 255.0F;
  }
};
inline Image load(const std::filesystem::path& file) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  Image image;
  if (png_image_begin_read_from_file(&png, file.c_str()) == 0) return image;
  png.format = PNG_FORMAT_RGB;
  image.rgb.resize(PNG_IMAGE_SIZE(png));
  image.width = static_cast<int>(png.width);
  image.height = static_cast<int>(png.height);
  png_image_finish_read(&png, nullptr, image.rgb.data(), 0, nullptr);
  return image;
}

class Picture : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    file_ =
        std::filesystem::temp_directory_path() / ("hybrid-picture-" + std::string(test->name()) + "-" +
                                                  std::to_string(std::hash<const void*>{}(this)) + ".png");
  }
  void TearDown() override {
    std::error_code ignored;
    std::filesystem::remove(file_, ignored);
  }
  // Draws the picture. If this machine cannot draw, sets `why_not_` and returns an empty image.
  Image draw(const Session& s, const hybrid::PictureOptions& options) {
    try {
      hybrid::save_picture(file_, s.scene, s.now, options);
    } catch (const std::runtime_error& error) {
      if (std::string(error.what()).find("needs EGL") == std::string::npos) throw;
      why_not_ = error.what();
      return {};
    }
    return load(file_);
  }
  std::filesystem::path file_;
  std::string why_not_;
};

#define DRAW_OR_SKIP(image, session, options)        \
  const tests::Image image = draw(session, options); \
  if (!why_not_.empty()) GTEST_SKIP() << why_not_

// The layout of the small picture. `seen_at` gives the pixel that shows a point, `framed` a camera that shows
// the whole scene.
inline const hybrid::FrameLayout small_layout = hybrid::frame_layout(960, 720, false);
inline glm::dvec2 seen_at(const hybrid::Camera& camera, const glm::dvec3& point_m) {
  return small_layout.pixel(camera, point_m).value_or(glm::dvec2(0.0));
}
inline hybrid::Camera framed(const Session& s) {
  return hybrid::frame_scene(s.scene, s.now, small_layout.aspect());
}

inline hybrid::PictureOptions small(const hybrid::Camera& camera) {
  hybrid::PictureOptions options;
  options.width = 960;
  options.height = 720;
  options.camera = camera;
  options.inset = false;
  return options;
}

}  // namespace tests
