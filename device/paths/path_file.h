// SPDX-License-Identifier: GPL-3.0-or-later
// Reads a recorded trajectory from columns of text (CSV), plain or gzip.
#pragma once

#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "device/paths/path.h"

namespace device {

struct Trajectory {
  std::vector<double> t_s;             // strictly ascending from 0; at least one
  std::vector<glm::dvec3> position_m;  // [sample] offset included
  std::vector<std::string> notes;      // repeated times, gaps, assumed units
};

// Reads as read_measured() does with `as_path` (trajectory_file.h), and adds the offset. Throws PathError
// with file and line, and for a unit or an offset out of range.
Trajectory read_trajectory(const CsvPath& csv);

// A path along the trajectory. Throws PathError if it has no samples.
std::shared_ptr<const Path> make_path(Trajectory trajectory);

}  // namespace device
