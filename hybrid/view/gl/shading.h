// SPDX-License-Identifier: GPL-3.0-or-later
// The programs that shade surfaces, one for each kind of shading. A driver without a graphics card computes
// both sides of every condition in a shader, so no program has a condition for another kind.
#pragma once

#include <array>
#include <cstdint>

#include "hybrid/view/gl/gl_objects.h"

namespace hybrid {

enum class Shading : std::uint8_t {
  plain,     // lit; opaque, or with one alpha
  tissue,    // the same, with a colour scale
  slice,     // the same, with an image in place of lighting
  layer,     // rigid, as `plain`; alpha is dense at the rim and thin where the surface faces the eye
  unhiding,  // rigid, only in pixels where it hides no soft object and no tool
  glass,     // like glass
  depth,     // depth only
  // Copies the layer of rigid objects: opaque where it hides no soft object and no tool, else thin.
  cover
};
inline constexpr std::size_t kShadings = 8;

class ShadingPrograms {
 public:
  void create();
  void release();
  // `by_vertex`: lighting is computed at vertices and interpolated between them. Without a graphics card this
  // costs much less for triangles of a few pixels.
  [[nodiscard]] GlName of(Shading shading, bool by_vertex) const {
    return programs_[by_vertex ? 1 : 0][static_cast<std::size_t>(shading)];
  }

 private:
  std::array<std::array<GlName, kShadings>, 2> programs_{};
};

}  // namespace hybrid
