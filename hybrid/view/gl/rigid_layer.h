// SPDX-License-Identifier: GPL-3.0-or-later
// The layer of rigid objects: the nearest rigid surface at each pixel of a view. It is drawn again only if
// the view or a rigid object has moved. Objects that must not be hidden are in front of the layer or behind
// it, pixel by pixel.
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec4.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "hybrid/view/gl/gl_objects.h"

namespace hybrid {

// All that the layer depends on.
struct LayerKey {
  glm::mat4 clip{0.0F};                                    // clip_from_scene
  glm::vec4 clip_plane{0.0F};                              // the view's
  std::vector<std::pair<std::size_t, glm::mat4>> drawn{};  // objects and their places

  friend bool operator==(const LayerKey&, const LayerKey&) = default;
};
struct RigidLayer {
  GlLayer layer;
  LayerKey key;
};

// Rounds `radius` up to the next value of a geometric series that begins with `least`. So the range of depths
// takes few values, and a moving tool seldom changes the depths of the other objects.
[[nodiscard]] double rounded_up(double radius, double least);

// a and b of `change = b (depth + a)²`: the increase of the depth (0 to 1) of a point that moves away from
// the eye by a small length. The matrix is that of a perspective projection and a rigid transform.
[[nodiscard]] glm::vec2 depth_further(const glm::dmat4& clip_from_scene, double by_m);

}  // namespace hybrid
