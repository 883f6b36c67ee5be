// SPDX-License-Identifier: GPL-3.0-or-later
// Measured trajectories: the position of a probe and the force on it. Reads columns of text (CSV), and the
// .traj files of E. Ruffaldi, D. Morris, T. Edmunds, F. Barbagli, D. K. Pai, "Standardized Evaluation of
// Haptic Rendering Systems", Haptics Symposium 2006.
//
// The layout of .traj could not be checked against an original file (device/README.md, Replay). Columns
// without names are in mm, N and s. Their number decides which quantities they hold, and a note says so. A
// header, a comment that names the columns, or `columns` overrides this.
#pragma once

#include <cstddef>
#include <filesystem>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "device/paths/path.h"

namespace device {

// Time steps longer than ten median steps.
struct Gaps {
  std::vector<std::size_t> before;  // index of the sample before each gap
  double limit_s = 0.0, longest_s = 0.0;
  std::size_t longest_before = 0;
};

struct MeasuredFile {
  std::filesystem::path file{};
  std::string columns{};    // names such as "t_s,x_mm,y_mm,z_mm,fx_N,fy_N,fz_N"; empty: from the file
  std::string force{};      // prefix that selects one of several forces: "giver" for giver_fx, giver_fy, …
  double unit_m = 1e-3;     // unit of lengths whose column states none
  double rate_hz = 1000.0;  // rate of samples without a time
  bool on_object = false;   // true: the file has forces on the object; their sign is changed
  bool needs_force = true;  // false: positions suffice, and force_N stays empty
  bool as_path = false;     // true: times and column names must be given; they have no default
};

struct MeasuredTrajectory {
  std::vector<double> t_s;             // strictly ascending from 0; at least one
  std::vector<glm::dvec3> position_m;  // [sample]
  std::vector<glm::dvec3> force_N;     // [sample] on the hand; empty if only the magnitude was measured
  std::vector<double> strength_N;      // [sample] magnitude; empty unless only this was measured
  Gaps gaps;
  std::vector<std::string> notes;  // assumptions, gaps, repeated times
};

// A sample that repeats the time of the sample before it replaces that sample. Throws PathError, with
// file, line and remedy, for a missing file, missing or ambiguous columns, unknown units, no rows or too
// many, a field that is no number, time that runs backwards, or more than a day.
MeasuredTrajectory read_measured(const MeasuredFile& measured);

// Sets `before`, the index of the sample before t_s, and `share`, the fraction of the time step to the next
// sample. Outside of the recording the first or the last sample is returned. False: t_s lies in a gap, where
// nothing was measured.
bool measured_at(const MeasuredTrajectory& trajectory, double t_s, std::size_t& before,
                 double& share) noexcept;

}  // namespace device
