// SPDX-License-Identifier: GPL-3.0-or-later
// The outlines of slices, by which a user drags them. Uses no graphics library.
#pragma once

#include <array>
#include <glm/vec2.hpp>
#include <optional>
#include <span>
#include <vector>

#include "hybrid/view/camera.h"
#include "hybrid/view/layout.h"
#include "hybrid/view/view_settings.h"

namespace hybrid {

inline constexpr float kSliceHandle = 0.75F;  // radius of a handle (em)

struct SliceFrame {
  std::size_t axis = 0;
  std::array<glm::dvec3, 4> corners_m{};  // in order around the slice

  // Each axis has its handle at a corner of its own.
  [[nodiscard]] const glm::dvec3& handle_m() const { return corners_m[2]; }
};
// The outlines lie a little outside the soft objects.
[[nodiscard]] std::vector<SliceFrame> slice_frames(const SoftBox& box, const ViewSettings& view);

// The axis of the slice whose handle is at a pixel of the frame; empty: none. `where`: of the view.
[[nodiscard]] std::optional<std::size_t> slice_at(std::span<const SliceFrame> frames, const Camera& camera,
                                                  const PixelRect& where, const glm::dvec2& pixel, float em);

// The change of a slice's share that follows a motion of the pointer (pixels). 0 if the axis points to the
// eye.
[[nodiscard]] double dragged_share(const SliceFrame& frame, const SoftBox& box, const Camera& camera,
                                   const PixelRect& where, const glm::dvec2& motion);

}  // namespace hybrid
