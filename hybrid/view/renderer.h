// SPDX-License-Identifier: GPL-3.0-or-later
// Draws a scene and a snapshot with OpenGL 3.3. Pictures and windows both use it. Each has its own context,
// which must be current on the calling thread for every call here. Rigid objects are opaque, except in front
// of a soft object, of the tool, or of the tool's neighbourhood. There only their nearest surface is drawn,
// thin in the middle and dense at its rim. The tool and the arrow show faintly through tissue.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "hybrid/snapshot/snapshot.h"
#include "hybrid/view/camera.h"
#include "hybrid/view/gl/gl_objects.h"
#include "hybrid/view/layout.h"
#include "hybrid/view/tissue_view.h"
#include "hybrid/view/view_settings.h"

namespace hybrid {

// Samples per pixel. fine: always four. fast: one if the context draws without a graphics card.
enum class Samples : std::uint8_t { fine, fast };

class Renderer {
 public:
  // Uploads the static meshes. Throws std::runtime_error: the context is older than 3.3, there is too little
  // memory, or a mesh is too large for one draw call. Keeps no reference to the scene: later calls take it
  // again.
  explicit Renderer(const DrawnScene& scene, Samples samples);
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;
  Renderer(Renderer&&) = delete;
  Renderer& operator=(Renderer&&) = delete;
  ~Renderer();

  void set_font(const FontAtlas& atlas);
  // Frees all OpenGL objects of this renderer, which must not draw any more. Another renderer may go on to
  // use the context.
  void release();

  // Sets how the following frames show the scene.
  void set_view(const ViewSettings& view);
  // Starts a frame and uploads the snapshot's moving vertices. Width and height are 1 to 8192 pixels;
  // otherwise throws std::runtime_error. `tissue` has taken the snapshot. `scene` must be the scene that the
  // renderer was made from. A frame whose views and overlay are as before costs no drawing. In other frames
  // only the changed part of each view is drawn (view_changes.h).
  void begin(const DrawnScene& scene, const Snapshot& snapshot, const TissueView& tissue, int width,
             int height);
  // Draws the scene into a part of the frame, over its content. A frame has two such views at most.
  void draw(const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera, const PixelRect& where);
  // Draws the overlay and ends the frame. Returns false if the frame is the same as the one before. Throws
  // std::runtime_error on an OpenGL error anywhere in the frame.
  bool finish(const OverlayMesh& overlay);

  // Copies the finished frame to the context's default framebuffer (a window).
  void present(int width, int height);
  // Returns the finished frame: rows from the top, three bytes (RGB) a pixel.
  [[nodiscard]] std::vector<std::uint8_t> read_rgb();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace hybrid
