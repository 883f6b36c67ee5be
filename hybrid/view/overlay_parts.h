// SPDX-License-Identifier: GPL-3.0-or-later
// The parts of the overlay. Each part returns its box, so that the legend can keep off.
#pragma once

#include <optional>
#include <vector>

#include "hybrid/view/legend.h"
#include "hybrid/view/overlay.h"
#include "hybrid/view/text_painter.h"

namespace hybrid {

// Returns the lower end of the heading (pixels).
float draw_heading(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot,
                   const OverlayContent& content);
// Empty when nothing has moved.
std::optional<PixelBox> draw_colour_scale(const Pen& pen, const DrawnScene& scene,
                                          const OverlayContent& content);
// Draws a bar of a round length, at the depth of the view's target.
std::optional<PixelBox> draw_scale_bar(const Pen& pen, const Camera& camera, const PixelRect& where);
void draw_inset_frame(const Pen& pen, const Snapshot& snapshot, const OverlayContent& content);
std::optional<PixelBox> draw_history(const Pen& pen, const OverlayContent& content);

// Text for the size of the force, beside the arrow's tip; empty without an arrow.
struct ForceLabel {
  float x = 0.0F, y = 0.0F;
  std::string words;
};
std::optional<ForceLabel> force_label(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot,
                                      const Camera& camera, const PixelRect& where);
void draw_force_label(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera,
                      const PixelRect& where);

// Regions that other parts occupy; the legend keeps off them.
struct Furniture {
  float below = 0.0F,
        above = 0.0F;  // free range on the left side, between the heading and the scale bar or history
  std::optional<PixelBox> colour_scale;  // at the top right
};
// Draws the legend in the corner that covers neither the tool nor the arrow nor its label. `last` is the
// corner's index from the last frame; it is updated.
void draw_legend(const Pen& pen, const Furniture& furniture, const DrawnScene& scene,
                 const Snapshot& snapshot, const OverlayContent& content, std::optional<std::size_t>& last);

}  // namespace hybrid
