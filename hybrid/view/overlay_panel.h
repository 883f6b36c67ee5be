// SPDX-License-Identifier: GPL-3.0-or-later
// A panel that fills the overlay's column in place of the legend, drawn with the overlay's ImGui context.
#pragma once

#include "hybrid/snapshot/snapshot.h"
#include "hybrid/view/layout.h"
#include "hybrid/view/text_painter.h"

namespace hybrid {

class OverlayPanel {
 public:
  OverlayPanel() = default;
  OverlayPanel(const OverlayPanel&) = delete;
  OverlayPanel& operator=(const OverlayPanel&) = delete;
  OverlayPanel(OverlayPanel&&) = delete;
  OverlayPanel& operator=(OverlayPanel&&) = delete;
  virtual ~OverlayPanel() = default;

  // Call before ImGui's NewFrame(). Gives ImGui the pointer and the keys.
  virtual void take_input() = 0;
  // Call between NewFrame() and Render().
  virtual void draw(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot,
                    const PixelRect& where) = 0;
};

}  // namespace hybrid
