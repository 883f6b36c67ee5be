// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/loop/workspace_fit.h"

#include <algorithm>
#include <glm/common.hpp>

namespace device {
namespace {

// Size of the workspace along the scene's axes.
glm::dvec3 turned_size(const Box& workspace) noexcept {
  return glm::abs(device_to_scene_axes(workspace.high_m - workspace.low_m));
}

}  // namespace

WorkspaceFit fit_workspace(const Box& workspace, const Box& wanted, std::optional<double> scale) noexcept {
  WorkspaceFit fit;
  fit.device_centre_m = 0.5 * (workspace.low_m + workspace.high_m);
  fit.scene_centre_m = 0.5 * (wanted.low_m + wanted.high_m);
  const glm::dvec3 needed = (wanted.high_m - wanted.low_m) / turned_size(workspace);
  fit.scale = scale.value_or(std::max({1.0, needed.x, needed.y, needed.z}));
  return fit;
}

bool covers(const WorkspaceFit& fit, const Box& workspace, const Box& wanted) noexcept {
  constexpr double kRounding = 1.0 + 1e-12;
  const glm::dvec3 half = 0.5 * fit.scale * kRounding * turned_size(workspace);
  for (int axis = 0; axis < 3; ++axis) {
    if (wanted.low_m[axis] < fit.scene_centre_m[axis] - half[axis]) return false;
    if (wanted.high_m[axis] > fit.scene_centre_m[axis] + half[axis]) return false;
  }
  return true;
}

}  // namespace device
