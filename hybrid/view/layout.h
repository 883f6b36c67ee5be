// SPDX-License-Identifier: GPL-3.0-or-later
// The places of the parts of a frame: a heading, the scene below it, and beside the scene a column for the
// legend and the nearer view, so that neither covers the scene. Knows no graphics library.
#pragma once

#include <optional>

#include "hybrid/view/camera.h"

namespace hybrid {

// Rectangle of the frame (pixels, y down from the top).
struct PixelRect {
  int x = 0, y = 0, width = 0, height = 0;
};

// Height of body text in a frame of this height (pixels).
float text_height(int frame_height);

struct FrameLayout {
  PixelRect scene;
  PixelRect column;  // on the right; width 0 where the frame is too narrow for one
  PixelRect inset;   // square, at the lower end of the column or of the scene; width 0 without a column

  // Pixel of the frame at which a camera shows a point in the scene's rectangle; empty: behind the eye.
  [[nodiscard]] std::optional<glm::dvec2> pixel(const Camera& camera, const glm::dvec3& point_m) const;
  [[nodiscard]] double aspect() const;  // of the scene: width / height
};

// `help`: a line of help stands below the scene. `panel`: a window's panel fills the column, and the nearer
// view is a corner of the scene.
FrameLayout frame_layout(int width, int height, bool help, bool panel = false);

// A nearer view of the contact is worth its place from here on.
inline constexpr double kLeastNearer = 1.5;

// How many times larger a camera shows its target in one rectangle than another in the other one.
double times_nearer(const Camera& near, const PixelRect& inset, const Camera& whole, const PixelRect& scene);

}  // namespace hybrid
