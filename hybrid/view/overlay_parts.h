// SPDX-License-Identifier: GPL-3.0-or-later
// The parts of the overlay, each drawn by a pen. Each says where it stands, so that the legend can keep off.
#pragma once

#include <optional>
#include <vector>

#include "hybrid/view/legend.h"
#include "hybrid/view/overlay.h"
#include "hybrid/view/text_painter.h"

namespace hybrid {

// Lower end of the heading (pixels).
float draw_heading(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot,
                   const OverlayContent& content);
// Empty where nothing has moved.
std::optional<PixelBox> draw_colour_scale(const Pen& pen, const DrawnScene& scene,
                                          const OverlayContent& content);
// A bar of a round length at the depth of the view's target.
std::optional<PixelBox> draw_scale_bar(const Pen& pen, const Camera& camera, const PixelRect& where);
void draw_inset_frame(const Pen& pen, const Snapshot& snapshot, const OverlayContent& content);
std::optional<PixelBox> draw_history(const Pen& pen, const OverlayContent& content);

// How large the force is, beside the arrow's tip; empty where there is no arrow.
struct ForceLabel {
  float x = 0.0F, y = 0.0F;
  std::string words;
};
std::optional<ForceLabel> force_label(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot,
                                      const Camera& camera, const PixelRect& where);
void draw_force_label(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera,
                      const PixelRect& where);

// Where the legend may not stand on what is there already.
struct Furniture {
  float below = 0.0F, above = 0.0F;      // room on the left side, between heading and scale bar or history
  std::optional<PixelBox> colour_scale;  // at the top right
};
// In that corner which covers neither tool nor arrow nor its label. `last` is where it stood, and stands now.
void draw_legend(const Pen& pen, const Furniture& furniture, const DrawnScene& scene,
                 const Snapshot& snapshot, const OverlayContent& content, std::optional<std::size_t>& last);

}  // namespace hybrid
