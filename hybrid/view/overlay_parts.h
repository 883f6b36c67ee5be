// SPDX-License-Identifier: GPL-3.0-or-later
// The parts of the overlay.
#pragma once

#include "hybrid/view/legend.h"
#include "hybrid/view/overlay.h"
#include "hybrid/view/text_painter.h"

namespace hybrid {

// Is there anything to feel? A window that offers scenes shows none.
[[nodiscard]] bool shows_a_session(const DrawnScene& scene);

void draw_heading(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot,
                  const OverlayContent& content);
// Draws a bar of a round length. The length holds at the depth of the view's target.
void draw_scale_bar(const Pen& pen, const Camera& camera, const PixelRect& where);
// Draws the inset's frame, and a ring and a line that show its place in the scene.
void draw_inset_frame(const Pen& pen, const Snapshot& snapshot, const OverlayContent& content);
// Draws the size of the force beside the arrow's tip. Draws nothing without an arrow.
void draw_force_label(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera,
                      const PixelRect& where);

// Draws a message at the top of the scene, in as many lines as it needs.
void draw_notice(const Pen& pen, const std::string& words, const PixelRect& where);

// Draws the column beside the scene: the legend, and below it the colour scale of tissue. Both are
// above the inset. Parts without room are left out. Legend rows without room are counted in a last row.
void draw_column(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot,
                 const OverlayContent& content);
void draw_colour_scale(const Pen& pen, const PixelRect& where, const ColourScale& scale);
// Draws the key between scene and panel: the colour scale upright, and names of materials.
void draw_colour_key(const Pen& pen, const DrawnScene& scene, const OverlayContent& content);
// Draws the outlines of slices and their handles, but not over the inset.
void draw_slice_frames(const Pen& pen, const OverlayContent& content);
inline constexpr float kColourScaleHeight = 5.0F;  // (em)

}  // namespace hybrid
