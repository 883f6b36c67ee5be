// SPDX-License-Identifier: GPL-3.0-or-later
// Maps a device's workspace into the scene.
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

// scene = scene_centre + scale · rotated(device − device_centre). A scale above 1 enlarges the hand's motion;
// forces are then divided by it, so that the hand feels no more stiffness than the scene has. A scale below 1
// leaves forces unchanged. Forces are never enlarged.
struct WorkspaceFit {
  double scale = 1.0;  // scene meters per device meter; > 0
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

// Maps the centre of the workspace (device frame) to that of `wanted` (scene frame). Without a given scale,
// the smallest scale of at least 1 is chosen for which the workspace covers `wanted`. Both boxes must be
// finite, and the workspace must have an extent on every axis.
WorkspaceFit fit_workspace(const Box& workspace, const Box& wanted, std::optional<double> scale) noexcept;
// Whether the workspace covers `wanted` on every axis.
bool covers(const WorkspaceFit& fit, const Box& workspace, const Box& wanted) noexcept;

}  // namespace device
