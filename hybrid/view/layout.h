// SPDX-License-Identifier: GPL-3.0-or-later
// The parts of a frame and their places: a heading, the scene below it, and beside the scene a column. The
// column holds the legend and the nearer view, so that neither covers the scene. Uses no graphics library.
#pragma once

#include <optional>

#include "hybrid/view/camera.h"
#include "hybrid/view/gl/pixel_rect.h"

namespace hybrid {

// Height of body text in a frame of this height (pixels).
float text_height(int frame_height);

struct FrameLayout {
  PixelRect scene;
  PixelRect column;  // on the right; width 0 if the frame is too narrow for a column
  PixelRect key;     // between scene and panel: the meaning of tissue colours; width 0: none
  // A square at the lower end of the column, or of the scene if there is a panel. Without a column its width
  // is 0.
  PixelRect inset;

  // Pixel of the frame at which a camera shows a point in the scene's rectangle; empty if behind the eye.
  [[nodiscard]] std::optional<glm::dvec2> pixel(const Camera& camera, const glm::dvec3& point_m) const;
  [[nodiscard]] double aspect() const;  // of the scene: width / height
};

// `help`: a line of help is below the scene. `panel`: a window's panel fills the column, and the nearer view
// is in a corner of the scene. `key`: beside a panel there is a key of colours.
FrameLayout frame_layout(int width, int height, bool help, bool panel = false, bool key = false);

// The nearer view of the contact is drawn only if it is at least this many times nearer.
inline constexpr double kLeastNearer = 1.5;

// Ratio of two scales, each at its camera's target: of `near` in the inset, and of `whole` in the scene's
// rectangle.
double times_nearer(const Camera& near, const PixelRect& inset, const Camera& whole, const PixelRect& scene);

}  // namespace hybrid
