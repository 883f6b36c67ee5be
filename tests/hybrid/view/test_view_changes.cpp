// SPDX-License-Identifier: GPL-3.0-or-later
// Frames that draw only the changes show the same as frames that draw everything.
#include "hybrid/view/view_changes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "hybrid/view/camera.h"
#include "hybrid/view/picture.h"
#include "tests/hybrid/view/picture_fixture.h"

namespace {

using hybrid::PictureMaker;
using tests::Session;

// Share of the pixels in which a colour differs by more than a tenth.
double share_that_differs(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
  std::size_t count = 0;
  for (std::size_t i = 0; i + 2 < std::min(a.size(), b.size()); i += 3) {
    int most = 0;
    for (std::size_t c = 0; c < 3; ++c) most = std::max(most, std::abs(int{a[i + c]} - int{b[i + c]}));
    count += most > 25 ? 1U : 0U;
  }
  return a.size() == b.size() ? 3.0 * static_cast<double>(count) / static_cast<double>(a.size()) : 1.0;
}

hybrid::PictureOptions quick(const Session& s) {
  hybrid::PictureOptions options = tests::small(tests::framed(s));
  options.width = 480;
  options.height = 360;
  return options;
}

// The tool presses the ball at `at`, to a depth of `deep` (m).
void press(Session& s, const glm::dvec3& at, double deep) {
  const glm::dvec3 inwards = -glm::normalize(at);
  s.now.proxy_m = at + deep * inwards;
  s.now.device_m = s.now.proxy_m + 2e-3 * inwards;
  s.now.force_N = -3.0 * inwards;
  std::vector<glm::vec3>& moved = s.now.soft_moved_m[1];
  for (std::size_t v = 0; v < moved.size(); ++v) {
    const double away = glm::distance(s.scene.objects[1].surface.vertices[v], at);
    moved[v] = glm::vec3(deep * 4e-3 / (4e-3 + away) * inwards);
  }
}

// The frames of one maker, and each frame by a maker of its own. Each maker makes its own context current, so
// the first maker is destroyed before the others are made.
struct Frames {
  std::vector<std::vector<std::uint8_t>> in_turn, anew;
};
struct Shot {
  hybrid::Snapshot now;
  hybrid::PictureOptions options;
};
std::optional<Frames> frames_of(const hybrid::DrawnScene& scene, const std::vector<Shot>& shots,
                                std::string& why_not) {
  Frames frames;
  try {
    PictureMaker maker(scene, 360);
    for (const Shot& shot : shots) frames.in_turn.push_back(maker.draw(shot.now, shot.options));
  } catch (const std::runtime_error& error) {
    if (std::string(error.what()).find("needs EGL") == std::string::npos) throw;
    why_not = error.what();
    return {};
  }
  for (const Shot& shot : shots) frames.anew.push_back(PictureMaker(scene, 360).draw(shot.now, shot.options));
  return frames;
}

TEST(ViewChanges, APressThatMovesShowsTheSameAsFramesDrawnAnew) {
  Session s = tests::shell_and_ball();
  hybrid::PictureOptions options = quick(s);
  options.inset = true;
  std::vector<Shot> shots;
  for (int n = 0; n < 12; ++n) {
    const double turn = 0.04 * n;
    press(s, 0.07 * glm::dvec3(0.3 * std::sin(turn), 0.3 * std::cos(turn), std::sqrt(0.91)), 1e-3 * n);
    shots.push_back({s.now, options});
  }
  std::string why_not;
  const auto frames = frames_of(s.scene, shots, why_not);
  if (!frames) GTEST_SKIP() << why_not;
  for (std::size_t n = 0; n < shots.size(); ++n) {
    const double error = share_that_differs(frames->in_turn[n], frames->anew[n]);
    EXPECT_LT(error, 5e-4) << n;
    // Successive frames differ, so the comparison is not empty.
    if (n == 0) continue;
    EXPECT_GT(share_that_differs(frames->anew[n], frames->anew[n - 1]), 4.0 * error) << n;
  }
}

TEST(ViewChanges, AToolThatMovesInAirLeavesNoTraceOnAnyPixel) {
  Session s = tests::shell_and_ball();
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-0.09, 0.09);
  std::vector<Shot> shots;
  for (int n = 0; n < 12; ++n) {
    s.now.proxy_m = {place(random), place(random), place(random)};
    s.now.device_m = n % 3 == 0 ? s.now.proxy_m : s.now.proxy_m + glm::dvec3(5e-3, 0.0, 0.0);
    s.now.force_N = n % 2 == 0 ? glm::dvec3(0.0) : glm::dvec3(place(random), place(random), 1.0);
    shots.push_back({s.now, quick(tests::shell_and_ball())});
  }
  std::string why_not;
  const auto frames = frames_of(s.scene, shots, why_not);
  if (!frames) GTEST_SKIP() << why_not;
  for (std::size_t n = 0; n < shots.size(); ++n) EXPECT_EQ(frames->in_turn[n], frames->anew[n]) << n;
}

TEST(ViewChanges, SettingsViewsAndSizesComeAndGoWithoutATrace) {
  const Session s = tests::shell_and_ball();
  std::vector<hybrid::PictureOptions> all(6, quick(s));
  all[1].inset = true;
  all[2].view.dark = true;
  all[3].view.looks = {{.visible = false}, {.visible = true, .opacity = 0.4F}};
  all[4].width = 400;
  all[5].camera->azimuth_rad += 0.5;
  std::vector<Shot> shots;
  for (const std::size_t n : {0U, 1U, 0U, 2U, 3U, 1U, 4U, 5U, 0U}) shots.push_back({s.now, all[n]});
  std::string why_not;
  const auto frames = frames_of(s.scene, shots, why_not);
  if (!frames) GTEST_SKIP() << why_not;
  for (std::size_t n = 0; n < shots.size(); ++n) EXPECT_EQ(frames->in_turn[n], frames->anew[n]) << n;
}

TEST(ViewChanges, ARectangleContainsTheImageOfItsBall) {
  hybrid::Camera camera{
      .target_m = glm::dvec3(0.0), .distance_m = 1.0, .azimuth_rad = 0.4, .elevation_rad = 0.3};
  const hybrid::PixelRect view{0, 0, 640, 480};
  const hybrid::Projection projection{
      .clip = glm::mat4(camera.clip_from_scene(640.0 / 480.0, glm::dvec3(0.0), glm::dvec3(0.0), 1.0)),
      .right = glm::vec3(camera.right()),
      .up = glm::vec3(camera.up()),
      .to = glm::vec3(camera.toward_eye()),
      .pixels = view};
  std::mt19937 random(3);
  std::uniform_real_distribution<float> one(-1.0F, 1.0F);
  int inside = 0;
  for (int n = 0; n < 300; ++n) {
    const hybrid::Ball ball{0.4F * glm::vec3(one(random), one(random), one(random)),
                            0.1F * std::abs(one(random))};
    const hybrid::PixelRect covered = hybrid::covered_by(ball, projection);
    const glm::vec3 at =
        ball.centre + ball.radius * glm::normalize(glm::vec3(one(random), one(random), one(random)) + 1e-6F);
    const auto pixel = camera.pixel(glm::dvec3(at), 640.0, 480.0);
    if (!pixel || pixel->x < 0.0 || pixel->x >= 640.0 || pixel->y < 0.0 || pixel->y >= 480.0) continue;
    ++inside;
    const double up = 480.0 - pixel->y;
    EXPECT_TRUE(pixel->x >= covered.x && pixel->x <= covered.x + covered.width);
    EXPECT_TRUE(up >= covered.y && up <= covered.y + covered.height);
    EXPECT_TRUE(view.contains(covered));
  }
  EXPECT_GT(inside, 100);
}

}  // namespace
