// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/paths/path_file.h"

#include <cmath>
#include <utility>

#include "device/paths/trajectory_file.h"

namespace device {

Trajectory read_trajectory(const CsvPath& csv) {
  if (!(csv.unit_m > 0.0) || !std::isfinite(csv.unit_m)) {
    throw PathError(csv.file.string() + ": its unit must be a positive number of meters");
  }
  MeasuredTrajectory read =
      read_measured({.file = csv.file, .unit_m = csv.unit_m, .needs_force = false, .as_path = true});
  for (glm::dvec3& position_m : read.position_m) position_m += csv.offset_m;
  return {
      .t_s = std::move(read.t_s), .position_m = std::move(read.position_m), .notes = std::move(read.notes)};
}

}  // namespace device
