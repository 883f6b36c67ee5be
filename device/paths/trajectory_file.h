// SPDX-License-Identifier: GPL-3.0-or-later
// Measured trajectories: where a probe was, and the force it met. CSV with force columns, and the .traj files
// of E. Ruffaldi, D. Morris, T. Edmunds, F. Barbagli, D. K. Pai, "Standardized Evaluation of Haptic Rendering
// Systems", Haptics Symposium 2006.
//
// The layout of .traj could not be checked against a copy (device/README.md, Replay): rows of numbers between
// blanks, in mm, N and s, are taken by their count, and what they were taken for is said; a header, a
// comment that names the columns, or `columns` overrides it.
#pragma once

#include <filesystem>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "device/paths/line_reader.h"
#include "device/paths/path.h"

namespace device {

struct MeasuredFile {
  std::filesystem::path file{};
  std::string columns{};    // "t_s,x_mm,y_mm,z_mm,fx_N,fy_N,fz_N"; empty: as the file says
  std::string force{};      // of several forces the one so named: "giver" for giver_fx, giver_fy, giver_fz
  double unit_m = 1e-3;     // of lengths whose column names none
  double rate_hz = 1000.0;  // of samples without a time
  bool on_object = false;   // the forces are those on the object, and turned round
  bool needs_force = true;  // else positions alone are taken, and force_N stays empty
};

struct MeasuredTrajectory {
  std::vector<double> t_s;             // strictly rising, begins at 0; at least one
  std::vector<glm::dvec3> position_m;  // one a time
  std::vector<glm::dvec3> force_N;     // one a time, on the hand; empty where only its strength was measured
  std::vector<double> strength_N;      // one a time, then
  Gaps gaps;
  std::vector<std::string> notes;  // what had to be assumed; gaps, repeated times
};

// Throws PathError, with file and line where there is one, and what to state where the columns are not clear.
MeasuredTrajectory read_measured(const MeasuredFile& measured);

// Linear between samples; holds its ends. Not in a gap: empty there, as nothing was measured.
bool measured_at(const MeasuredTrajectory& trajectory, double t_s, std::size_t& before,
                 double& share) noexcept;

}  // namespace device
