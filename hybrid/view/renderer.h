// SPDX-License-Identifier: GPL-3.0-or-later
// Draws a scene and a snapshot with OpenGL 3.3. Picture and window use this one implementation; each brings
// its own context, which must be current on the calling thread for every call here.
// Hidden things: rigid objects are opaque, except in front of a soft object, the tool, or the neighbourhood
// of the tool. There only their nearest surface is drawn, thin in the middle and dense at its rim. The tool
// and the arrow show faintly through tissue.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "hybrid/snapshot/snapshot.h"
#include "hybrid/view/camera.h"
#include "hybrid/view/gl_objects.h"
#include "hybrid/view/layout.h"
#include "hybrid/view/view_settings.h"

namespace hybrid {

// Samples per pixel: always four (fine), or one if the context draws without a graphics card (fast).
enum class Samples : std::uint8_t { fine, fast };

class Renderer {
 public:
  // Uploads the static meshes. Throws std::runtime_error: context older than 3.3, out of memory, mesh too
  // large for one draw call. Keeps no reference to the scene; later calls take it again.
  explicit Renderer(const DrawnScene& scene, Samples samples);
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;
  Renderer(Renderer&&) = delete;
  Renderer& operator=(Renderer&&) = delete;
  ~Renderer();

  void set_font(const FontAtlas& atlas);
  // Frees what was made in the context, which goes on with another renderer. This one draws no more.
  void release();

  // How the following frames show the scene.
  void set_view(const ViewSettings& view);
  // Starts a frame of this many pixels (1 to 8192 each; throws std::runtime_error otherwise) and uploads the
  // snapshot's moving vertices. `scene` must be the scene that the renderer was made from.
  void begin(const DrawnScene& scene, const Snapshot& snapshot, int width, int height);
  // Draws the scene into a part of the frame, over its content.
  void draw(const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera, const PixelRect& where);
  // Draws the overlay and ends the frame. Throws std::runtime_error on an OpenGL error anywhere in the frame.
  void finish(const OverlayMesh& overlay);

  // Copies the finished frame to the context's default framebuffer (a window).
  void present(int width, int height);
  // Returns the finished frame: rows from the top, three bytes (RGB) a pixel.
  [[nodiscard]] std::vector<std::uint8_t> read_rgb();

  // Displacement at the end of the colour scale (unit: meter): a round number that never falls, so that
  // colours keep their meaning from frame to frame.
  [[nodiscard]] double displacement_scale_m() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace hybrid
