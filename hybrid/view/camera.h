// SPDX-License-Identifier: GPL-3.0-or-later
// The camera of pictures and windows, and the automatic choice of a view.
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <span>

#include "hybrid/snapshot/snapshot.h"

namespace hybrid {

// A camera that orbits a target in the scene's frame, with +z up. All values are finite, and distance_m > 0.
struct Camera {
  glm::dvec3 target_m{0.0};
  double distance_m = 1.0;     // eye to target
  double azimuth_rad = 0.0;    // of the eye about the target, from +x towards +y
  double elevation_rad = 0.0;  // of the eye above the horizontal plane, within ±89°
  double fov_y_rad = 0.6;      // full vertical angle of view

  [[nodiscard]] glm::dvec3 toward_eye() const;  // unit vector
  [[nodiscard]] glm::dvec3 eye_m() const;
  [[nodiscard]] glm::dvec3 right() const;  // unit vector
  [[nodiscard]] glm::dvec3 up() const;     // unit vector

  // Height that the view covers at the target (unit: meter).
  [[nodiscard]] double view_height_m() const;

  // Pixel (x right, y down) of a point in a view of width × height; empty when the point lies behind the eye.
  [[nodiscard]] std::optional<glm::dvec2> pixel(const glm::dvec3& point_m, double width, double height) const;

  // Point seen at a pixel, in the plane through `through_m` that faces the camera.
  [[nodiscard]] glm::dvec3 point_at(const glm::dvec2& pixel, double width, double height,
                                    const glm::dvec3& through_m) const;

  // Projection · view, for points relative to `origin_m`. The depth range covers a ball of `radius_m` about
  // `centre_m`. Relative points keep the precision of floats, however far the scene is from its own origin.
  [[nodiscard]] glm::dmat4 clip_from_scene(double aspect, const glm::dvec3& origin_m,
                                           const glm::dvec3& centre_m, double radius_m) const;
};

// Ball that contains every finite vertex of the scene at rest; its radius is always positive. With a snapshot
// it contains the rigid objects at their present poses, and the tool at the proxy and at the device.
struct SceneBounds {
  glm::dvec3 centre_m{0.0};
  double radius_m = 1.0;
};
SceneBounds bounds_of(const polygon::TriangleMesh& surface);
SceneBounds bounds_of(const DrawnScene& scene, const Snapshot* snapshot = nullptr);

// View of the whole scene and of the tool anywhere on `path_m`. The direction is chosen so that little lies
// between eye and tool. It is at an angle to the force, so that the tool's depth shows. `aspect` is width /
// height.
Camera frame_scene(const DrawnScene& scene, const Snapshot& snapshot, double aspect = 4.0 / 3.0,
                   std::span<const glm::dvec3> path_m = {});

// Turns the camera to look along an axis (0: x, 1: y, 2: z) from the axis's positive side. Along z, x points
// to the right.
void look_along(Camera& camera, int axis);

// View close to the tool, some tool radii high, in the direction of `overview`.
Camera frame_contact(const DrawnScene& scene, const Snapshot& snapshot, const Camera& overview);

}  // namespace hybrid
