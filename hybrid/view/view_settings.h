// SPDX-License-Identifier: GPL-3.0-or-later
// Settings of the view in a window. None of them changes the forces.
#pragma once

#include <functional>
#include <glm/vec4.hpp>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hybrid/view/camera.h"
#include "hybrid/view/tissue/tissue_field.h"

namespace hybrid {

// How an object, or one material of a soft object, is drawn.
struct Look {
  bool visible = true;
  float opacity = 1.0F;  // 0 to 1

  [[nodiscard]] bool shows() const { return visible && opacity > 0.0F; }
  [[nodiscard]] bool is_opaque() const { return visible && opacity >= 1.0F; }
  friend bool operator==(const Look&, const Look&) = default;
};

// A plane across the scene, perpendicular to an axis. The part beyond the plane along the axis is left out.
struct ClipPlane {
  bool on = false;
  int axis = 0;             // 0: x, 1: y, 2: z
  double share = 0.5;       // place along the axis within the scene's bounding ball, 0 to 1
  bool other_side = false;  // the part before the plane is left out instead

  friend bool operator==(const ClipPlane&, const ClipPlane&) = default;
};

// A plane through all soft objects, perpendicular to an axis. The plane cuts the tissue at rest. The
// tissue on the cut is drawn at its present place.
struct SlicePlane {
  bool on = false;
  double share = 0.5;  // place along the axis within SoftBox, 0 to 1

  friend bool operator==(const SlicePlane&, const SlicePlane&) = default;
};

// The smallest box along the scene's axes that contains all soft objects at rest (m).
struct SoftBox {
  glm::dvec3 low_m{0.0}, high_m{0.0};
  bool empty = true;

  // Coordinate of a slice along its axis.
  [[nodiscard]] double place_m(std::size_t axis, double share) const {
    const auto d = static_cast<int>(axis);
    return low_m[d] + share * (high_m[d] - low_m[d]);
  }
};
[[nodiscard]] SoftBox soft_box(const DrawnScene& scene);
[[nodiscard]] bool has_soft(const DrawnScene& scene);

struct ViewSettings {
  std::vector<Look> looks;  // [object]; further objects have the default
  // [object] looks of its materials, by name, within the object's look. Materials that are not listed have
  // the default. If any is listed, the object is drawn as the surfaces of its materials.
  std::vector<std::map<std::string, Look, std::less<>>> material_looks;
  bool wires = false;  // edges of all surfaces' triangles
  ClipPlane clip;
  std::array<SlicePlane, 3> slices;  // [axis]
  bool grey = false;                 // slices show the scan's grey values, where there is a scan
  TissueColour colour = TissueColour::displacement;
  bool dark = false;
  bool inset = true;  // a nearer view of the contact

  [[nodiscard]] Look look_of(std::size_t object) const {
    return object < looks.size() ? looks[object] : Look{};
  }
  [[nodiscard]] Look material_look_of(std::size_t object, std::string_view material) const;
  [[nodiscard]] bool separates_materials(std::size_t object) const {
    return object < material_looks.size() && !material_looks[object].empty();
  }
  [[nodiscard]] bool sliced() const { return slices[0].on || slices[1].on || slices[2].on; }

  friend bool operator==(const ViewSettings&, const ViewSettings&) = default;
};

// Coefficients of the plane, relative to `origin_m`. Its positive side is drawn. Empty: nothing is clipped.
[[nodiscard]] std::optional<glm::vec4> clip_equation(const ClipPlane& clip, const SceneBounds& bounds,
                                                     const glm::dvec3& origin_m);
// Coordinate of the plane along its axis (m).
[[nodiscard]] double clip_place_m(const ClipPlane& clip, const SceneBounds& bounds);

}  // namespace hybrid
