// SPDX-License-Identifier: GPL-3.0-or-later
// Finds the part of a view that differs from the frame before. Only this part is drawn, so that the cost of a
// frame depends on the part of the scene that moved. The rest of the view keeps its pixels.
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "hybrid/view/gl/pixel_rect.h"
#include "hybrid/view/scene_meshes.h"
#include "hybrid/view/view_settings.h"

namespace hybrid {

// A projection to a view of `pixels` samples, whose lower left corner is (0, 0).
struct Projection {
  glm::mat4 clip{1.0F};                       // clip_from_scene
  glm::vec3 right{0.0F}, up{0.0F}, to{0.0F};  // axes of the camera; `to`: towards the eye
  PixelRect pixels;
};
struct Ball {
  glm::vec3 centre{0.0F};
  float radius = 0.0F;
};
// A rectangle that contains the ball's image; the whole view if the ball reaches the eye's plane.
[[nodiscard]] PixelRect covered_by(const Ball& ball, const Projection& projection);

// Maps a part of a view to the whole view, in clip coordinates. Parts of meshes outside the result are
// outside the part.
[[nodiscard]] glm::mat4 whole_from_part(const PixelRect& part, const PixelRect& view);

// If any of these differs, the whole view is drawn.
struct ViewKey {
  glm::mat4 clip{0.0F};
  ViewSettings settings;
  ColourScale scale;
  std::vector<glm::mat4> placed{};       // [object]
  std::vector<std::uint64_t> numbers{};  // of all slices and materials, as uploaded
  bool cut = false;                      // an object is cut, by a plane that follows the tool

  friend bool operator==(const ViewKey&, const ViewKey&) = default;
};
[[nodiscard]] ViewKey view_key(const SceneMeshes& meshes, const glm::mat4& clip, const ViewSettings& settings,
                               const ColourScale& scale);

// Tool, device point and arrow.
struct ShownTool {
  glm::dvec3 proxy_m{0.0}, device_m{0.0}, force_N{0.0};
  PixelRect covers{};  // all of them in the view

  [[nodiscard]] bool is_as(const ShownTool& other) const {
    return proxy_m == other.proxy_m && device_m == other.device_m && force_N == other.force_N;
  }
};

// The contents of a view's textures.
class ShownView {
 public:
  // The part to draw in this frame; empty: none. Call once in each frame in which the view is shown. The
  // caller draws the part. `meshes` have taken the frame's snapshot.
  [[nodiscard]] PixelRect next(const ViewKey& key, const ShownTool& tool, const SceneMeshes& meshes,
                               const Projection& projection);
  // The textures are lost: the next frame draws the whole view.
  void forget() { known_ = false; }

 private:
  [[nodiscard]] float tolerance_px(const SceneMeshes& meshes, const Projection& projection) const;

  bool known_ = false;
  ViewKey key_;
  ShownTool tool_;
  std::vector<std::vector<PartMove>> stale_;  // [object][part] greatest motion since it was drawn
};

}  // namespace hybrid
