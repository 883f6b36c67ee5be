// SPDX-License-Identifier: GPL-3.0-or-later
// Measured trajectories: the position of a probe and the force on it. Reads columns of text (CSV), and the
// .traj files of E. Ruffaldi, D. Morris, T. Edmunds, F. Barbagli, D. K. Pai, "Standardized Evaluation of
// Haptic Rendering Systems", Haptics Symposium 2006.
//
// The layout of .traj could not be checked against an original file (device/README.md, Replay). Unnamed
// columns of numbers, in mm, N and s, are interpreted by their count, and a note says how. A header, a
// comment that names the columns, or `columns` overrides that.
#pragma once

#include <cstddef>
#include <filesystem>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "device/paths/path.h"

namespace device {

// Time steps longer than ten median steps, each by the index of the sample before it.
struct Gaps {
  std::vector<std::size_t> before;
  double limit_s = 0.0, longest_s = 0.0;
  std::size_t longest_before = 0;
};

struct MeasuredFile {
  std::filesystem::path file{};
  std::string columns{};    // "t_s,x_mm,y_mm,z_mm,fx_N,fy_N,fz_N"; empty: from the file
  std::string force{};      // of several forces, its prefix: "giver" for giver_fx, giver_fy, giver_fz
  double unit_m = 1e-3;     // of lengths whose column states none
  double rate_hz = 1000.0;  // of samples without a time
  bool on_object = false;   // the forces are those on the object; their sign is changed
  bool needs_force = true;  // false: positions suffice, and force_N stays empty
  bool as_path = false;     // times and names are needed; they have no default
};

struct MeasuredTrajectory {
  std::vector<double> t_s;             // strictly ascending from 0; at least one
  std::vector<glm::dvec3> position_m;  // [sample]
  std::vector<glm::dvec3> force_N;     // [sample] on the hand; empty if only the magnitude was measured
  std::vector<double> strength_N;      // [sample] magnitude alone
  Gaps gaps;
  std::vector<std::string> notes;  // assumptions, gaps, repeated times
};

// Throws PathError with file and line, and names what to state if the columns are not clear: no file, no
// columns of what is needed, unknown units, no rows or too many, no number, time running backwards, more than
// a day. A sample that repeats the time of the one before replaces it.
MeasuredTrajectory read_measured(const MeasuredFile& measured);

// Sets the sample before t_s and the share of the way to the next one; the end points apply outside. False
// inside a gap, where nothing was measured.
bool measured_at(const MeasuredTrajectory& trajectory, double t_s, std::size_t& before,
                 double& share) noexcept;

}  // namespace device
