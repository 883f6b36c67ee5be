// SPDX-License-Identifier: GPL-3.0-or-later
// Reads a recorded trajectory from a CSV file, plain or gzip.
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

// Throws PathError, with file and line if there is one: file missing or unreadable, no columns t, x, y, z, no
// rows or too many, not a number, time running backwards. A sample that repeats the time of the one before
// replaces it. Empty lines and lines that begin with '#' are ignored.
Trajectory read_trajectory(const CsvPath& csv);

// A path along the trajectory. Throws PathError if it has no samples.
std::shared_ptr<const Path> make_path(Trajectory trajectory);

}  // namespace device
