// SPDX-License-Identifier: GPL-3.0-or-later
// The words on a picture: title, time, legend, colour scale, scale bar, labels, and in the window a strip of
// force and a line of help. The only part of the project that knows Dear ImGui; it uses its draw lists and
// its font (text_painter.cpp), and no backend: what it makes is triangles in pixels. Its parts are in
// overlay_parts.h.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hybrid/view/camera.h"
#include "hybrid/view/renderer.h"
#include "hybrid/snapshot/snapshot.h"

namespace hybrid {

struct ForceSample {
  double t_s = 0.0;
  double force_N = 0.0;
};

struct OverlayContent {
  int width = 0, height = 0;  // of the picture (pixels)
  Camera camera;
  struct Inset {  // a second, nearer view of the contact
    Camera camera;
    PixelRect where;
  };
  std::optional<Inset> inset;
  double displacement_scale_m = 0.0;  // 0: nothing soft, no colour scale
  // Of the window only:
  std::vector<ForceSample> history;  // in order of time
  std::string help;                  // one line; empty: none
  bool paused = false;
};

class Overlay {
 public:
  // Sizes text for a picture of this height.
  explicit Overlay(int height);
  Overlay(const Overlay&) = delete;
  Overlay& operator=(const Overlay&) = delete;
  Overlay(Overlay&&) = delete;
  Overlay& operator=(Overlay&&) = delete;
  ~Overlay();

  [[nodiscard]] FontAtlas font() const;  // lives as long as the overlay
  [[nodiscard]] OverlayMesh build(const DrawnScene& scene, const Snapshot& snapshot,
                                  const OverlayContent& content);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// "12 mm", "0.5 µm", "3 m": at most three digits, in the unit a person would say.
std::string length_text(double length_m);

// "1.20 N": three digits where there are so many, to a thousandth of a newton.
std::string force_text(double force_N);

// A number in a printf format that has one %g or %f.
std::string number_text(double value, const char* format);

// Largest of 1, 2, 5 · 10^n that is at most `value`; 0 when value is not positive or not finite.
double round_down(double value);

}  // namespace hybrid
