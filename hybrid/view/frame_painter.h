// SPDX-License-Identifier: GPL-3.0-or-later
// Paints one whole frame: the scene, the inset of the contact, and the overlay's text. Picture and window
// show the same frame.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "hybrid/snapshot/snapshot.h"
#include "hybrid/view/camera.h"
#include "hybrid/view/overlay.h"
#include "hybrid/view/renderer.h"

namespace hybrid {

struct FrameOptions {
  int width = 0, height = 0;  // (pixels)
  bool inset = true;          // draw a nearer view of the contact if it is kLeastNearer times nearer
  std::string help, notice;   // one line below the scene; a message above it; empty: none
  bool paused = false;
  ViewSettings view;
  OverlayPanel* panel = nullptr;  // in place of the legend; null: the legend
};

// Needs a current OpenGL context as long as it lives. Keeps a reference to the scene.
class FramePainter {
 public:
  FramePainter(const DrawnScene& scene, Samples samples, int height);

  // The points whose displacements the snapshot of a frame with these settings should carry; null: none.
  [[nodiscard]] const std::shared_ptr<const AskedPoints>& asked(const ViewSettings& view) {
    tissue_.set(view);
    return tissue_.asked();
  }
  // Draws the frame off screen. Call present() or read_rgb() afterwards. Returns false if the frame is the
  // same as the one before.
  bool paint(const Snapshot& snapshot, const Camera& camera, const FrameOptions& options);
  // Frees all objects in the context. This painter must not paint any more.
  void release() { renderer_.release(); }
  void present(int width, int height) { renderer_.present(width, height); }
  [[nodiscard]] std::vector<std::uint8_t> read_rgb() { return renderer_.read_rgb(); }

 private:
  const DrawnScene& scene_;
  TissueView tissue_;
  Renderer renderer_;
  void choose_fonts(int height);

  std::optional<Overlay> overlay_;
  float em_ = 0.0F;  // height of the overlay's body text (pixels)
  SoftBox box_;
};

}  // namespace hybrid
