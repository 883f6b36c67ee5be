// SPDX-License-Identifier: GPL-3.0-or-later
// Where a device's workspace lies in the scene.
#pragma once

#include <glm/vec3.hpp>
#include <optional>

namespace device {

struct Box {
  glm::dvec3 low_m{0.0}, high_m{0.0};
};

// From the device's frame (x right, y up, z towards the user) to the scene's (x right, y away from the user,
// z up): a quarter turn about x.
inline glm::dvec3 device_to_scene_axes(const glm::dvec3& v) noexcept {
  return {v.x, -v.z, v.y};
}
inline glm::dvec3 scene_to_device_axes(const glm::dvec3& v) noexcept {
  return {v.x, v.z, -v.y};
}

// scene = scene_centre + scale · turned(device − device_centre). A scale above 1 makes the hand's motion
// larger in the scene; forces are then made smaller by it, so that the hand feels no more stiffness than the
// scene has. A scale below 1 leaves forces as they are. They are never made larger.
struct WorkspaceFit {
  double scale = 1.0;  // > 0; scene meters a device meter
  glm::dvec3 device_centre_m{0.0}, scene_centre_m{0.0};

  [[nodiscard]] glm::dvec3 position(const glm::dvec3& in_device_m) const noexcept {
    return scene_centre_m + scale * device_to_scene_axes(in_device_m - device_centre_m);
  }
  [[nodiscard]] glm::dvec3 velocity(const glm::dvec3& in_device) const noexcept {
    return scale * device_to_scene_axes(in_device);
  }
  [[nodiscard]] glm::dvec3 force(const glm::dvec3& in_scene_N) const noexcept {
    return scene_to_device_axes(scale > 1.0 ? in_scene_N / scale : in_scene_N);
  }
};

// Centre to centre. Without a scale the least is taken, 1 or more, with which the workspace (device frame)
// covers what is wanted (scene frame). Both boxes are finite, and the workspace has an extent on every axis.
WorkspaceFit fit_workspace(const Box& workspace, const Box& wanted, std::optional<double> scale) noexcept;
// The workspace covers what is wanted, on every axis.
bool covers(const WorkspaceFit& fit, const Box& workspace, const Box& wanted) noexcept;

}  // namespace device
