// SPDX-License-Identifier: GPL-3.0-or-later
// The arrows by which a user moves an object: along an axis of the scene, or in the plane of the view. Knows
// no graphics library.
#pragma once

#include <array>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>

#include "hybrid/view/camera.h"
#include "hybrid/view/layout.h"
#include "hybrid/window/view_state.h"

namespace hybrid {

// The box of an object at rest, along the scene's axes (m).
struct MovedBox {
  glm::dvec3 low_m{0.0}, high_m{0.0};
  [[nodiscard]] glm::dvec3 centre_m() const { return 0.5 * (low_m + high_m); }
};
[[nodiscard]] MovedBox box_of(const DrawnObject& object);

struct MoveHandles {
  static constexpr std::size_t kInView = 3;  // the handle that moves in the plane of the view

  MovedBox box;
  glm::dvec3 shift_m{0.0};            // of the present drag, or of the move that is being built
  std::optional<std::size_t> held{};  // axis or kInView; empty: no drag

  // Length of the arrows in the view (m).
  [[nodiscard]] static double length_m(const Camera& camera, const PixelRect& where, float em);
  // Tips of the three arrows, then the middle, in pixels of the frame; empty: behind the eye.
  [[nodiscard]] std::array<std::optional<glm::dvec2>, 4> pixels(const Camera& camera, const PixelRect& where,
                                                                float em) const;
  // The handle at a pixel of the frame.
  [[nodiscard]] std::optional<std::size_t> at(const Camera& camera, const PixelRect& where, float em,
                                              const glm::dvec2& pixel) const;
  // Follows a motion of the pointer (pixels). Nothing moves along an axis that points to the eye.
  void drag(const Camera& camera, const PixelRect& where, float em, const glm::dvec2& motion);
};

// Moves the selected object: handles, the drag of one of them, and the change of the scene that follows.
class ObjectMover {
 public:
  // Call once a frame. Handles are shown on the selected object, if the user wants them and the object may be
  // changed. After a drag they show the object's new place until the changed scene is there, or until no
  // scene is being built.
  void place(const ViewState& user, const DrawnScene& scene, bool building);
  [[nodiscard]] const MoveHandles* handles() const { return handles_ ? &*handles_ : nullptr; }

  // Takes the handle at this pixel of the frame. Returns whether there is one.
  bool take(const Camera& camera, const PixelRect& where, float em, const glm::dvec2& pixel);
  void drag(const Camera& camera, const PixelRect& where, float em, const glm::dvec2& motion);
  // The change that the drag asks for; empty: the object is where it was.
  [[nodiscard]] std::optional<SceneChange> let_go(const DrawnScene& scene);

 private:
  [[nodiscard]] bool is_built() const;

  std::optional<MoveHandles> handles_;
  std::uint32_t object_ = Edit::kTool;
  int frames_left_ = 0;  // number of frames in which the new place is shown although no scene is being built
};

}  // namespace hybrid
