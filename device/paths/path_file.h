// SPDX-License-Identifier: GPL-3.0-or-later
// Reads a recorded trajectory from a CSV file, plain or compressed by gzip.
#pragma once

#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "device/paths/path.h"

namespace device {

struct Trajectory {
  std::vector<double> t_s;             // strictly rising, begins at 0; at least one
  std::vector<glm::dvec3> position_m;  // one a time, offset included
  std::vector<std::string> notes;      // repeated times, gaps, a unit that had to be assumed
};

// Throws PathError, with file and line where there is one, when the file is missing, not readable, not a CSV
// with the columns t, x, y, z, has no rows or too many, a number that is none, or time running backwards. A
// sample that repeats the time of the one before replaces it. Empty lines and lines that begin with '#' are
// left out.
Trajectory read_trajectory(const CsvPath& csv);

// Along a trajectory at hand. Throws PathError: no samples.
std::shared_ptr<const Path> make_path(Trajectory trajectory);

}  // namespace device
