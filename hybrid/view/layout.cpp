// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/layout.h"

#include <algorithm>
#include <cmath>

namespace hybrid {
namespace {

// Lengths are in heights of body text (em).
constexpr float kHeading = 4.4F;
constexpr float kHelp = 1.9F;     // height of the line of help
constexpr float kColumn = 25.0F;  // width of the column beside the scene
constexpr float kKey = 8.5F;      // width of the key of colours beside a panel
// Least width of the scene; if it would be narrower, there is no column.
constexpr float kLeastScene = 16.0F;
constexpr float kColumnShare = 1.0F / 3.0F;  // greatest width of the column (unit: the frame's width)
constexpr float kInsetShare = 0.46F;         // greatest height of the inset (unit: the column's height)
// Size of the inset beside a panel, as a share of the scene's shorter side.
constexpr float kInsetOfScene = 0.34F;

}  // namespace

float text_height(int frame_height) {
  return std::round(std::clamp(static_cast<float>(frame_height) / 58.0F, 13.0F, 64.0F));
}

std::optional<glm::dvec2> FrameLayout::pixel(const Camera& camera, const glm::dvec3& point_m) const {
  const auto at = camera.pixel(point_m, scene.width, scene.height);
  if (!at) return at;
  return *at + glm::dvec2(scene.x, scene.y);
}

double FrameLayout::aspect() const {
  return static_cast<double>(std::max(scene.width, 1)) / std::max(scene.height, 1);
}

FrameLayout frame_layout(int width, int height, bool help, bool panel, bool key) {
  const float em = text_height(height);
  const int top = std::min(static_cast<int>(kHeading * em), height / 4);
  const int bottom = help ? std::min(static_cast<int>(kHelp * em), height / 8) : 0;
  int column =
      std::min(static_cast<int>(kColumn * em), static_cast<int>(kColumnShare * static_cast<float>(width)));
  if (static_cast<float>(width - column) < kLeastScene * em) column = 0;
  const int key_width = panel && key && column > 0 ? static_cast<int>(kKey * em) : 0;
  FrameLayout layout;
  layout.scene = {0, top, width - column - key_width, std::max(height - top - bottom, 1)};
  layout.key = {layout.scene.width, top, key_width, layout.scene.height};
  layout.column = {width - column, top, column, layout.scene.height};
  const int margin = static_cast<int>(0.6F * em);
  const int side =
      std::min(column - margin, static_cast<int>(kInsetShare * static_cast<float>(layout.column.height)));
  if (column > 0 && panel) {
    const int corner = static_cast<int>(
        kInsetOfScene * static_cast<float>(std::min(layout.scene.width, layout.scene.height)));
    layout.inset = {layout.scene.width - corner - margin, top + layout.scene.height - corner - margin, corner,
                    corner};
  } else if (column > 0 && side > 0) {
    layout.inset = {width - margin - side, top + layout.column.height - margin - side, side, side};
  }
  return layout;
}

double times_nearer(const Camera& near, const PixelRect& inset, const Camera& whole, const PixelRect& scene) {
  const double inset_per_m = inset.height / near.view_height_m();
  const double scene_per_m = scene.height / whole.view_height_m();
  return inset_per_m / scene_per_m;
}

}  // namespace hybrid
