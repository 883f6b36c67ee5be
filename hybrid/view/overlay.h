// SPDX-License-Identifier: GPL-3.0-or-later
// The text and charts on a picture: title, time, legend, colour scale, scale bar and labels. In a window
// there are also a panel and a help line. The overlay uses Dear ImGui without a backend: the output is
// triangles in pixels. Its parts are in overlay_parts.h. Only this class, text_painter.cpp and the window's
// panel use ImGui.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hybrid/snapshot/snapshot.h"
#include "hybrid/view/camera.h"
#include "hybrid/view/gl/gl_objects.h"
#include "hybrid/view/layout.h"
#include "hybrid/view/overlay_panel.h"
#include "hybrid/view/slice_frames.h"
#include "hybrid/view/tissue_view.h"

namespace hybrid {

struct OverlayContent {
  int width = 0, height = 0;  // of the picture (pixels)
  FrameLayout layout;
  Camera camera;
  struct Inset {  // second, nearer view of the contact, in the layout's inset
    Camera camera;
    double nearer = 1.0;  // times_nearer()
  };
  std::optional<Inset> inset;
  ColourScale scale;             // of tissue
  bool names_materials = false;  // beside a panel: the key names materials
  std::vector<SliceFrame> slices;
  // Only in a window:
  OverlayPanel* panel = nullptr;  // in place of the legend; null: the legend
  std::string help;               // one line; empty: none
  std::string notice;             // a message of a few lines; empty: none
  bool paused = false, dark = false;
};

class Overlay {
 public:
  // `height`: of the picture (pixels). It determines the size of the text.
  explicit Overlay(int height);
  Overlay(const Overlay&) = delete;
  Overlay& operator=(const Overlay&) = delete;
  Overlay(Overlay&&) = delete;
  Overlay& operator=(Overlay&&) = delete;
  ~Overlay();

  [[nodiscard]] FontAtlas font() const;  // valid as long as the overlay lives
  [[nodiscard]] OverlayMesh build(const DrawnScene& scene, const Snapshot& snapshot,
                                  const OverlayContent& content);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// "12 mm", "0.5 µm", "3 m": at most three digits, in the unit that suits the size.
std::string length_text(double length_m);

// "1.20 N": three significant digits, at most three decimals.
std::string force_text(double force_N);

// Largest of 1, 2, 5 · 10^n that is at most `value`; 0 when the value is not positive or not finite.
double round_down(double value);

}  // namespace hybrid
