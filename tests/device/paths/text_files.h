// SPDX-License-Identifier: GPL-3.0-or-later
// Reads small texts as path files and as measured trajectories.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "device/paths/path_file.h"
#include "device/paths/trajectory_file.h"

namespace tests {

inline std::filesystem::path write_text(const std::string& bytes, const std::string& name = "a file.csv") {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / ("hybrid text " + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  std::ofstream(folder / name, std::ios::binary) << bytes;
  return folder / name;
}

inline device::Trajectory path_of(const std::string& bytes) {
  return device::read_trajectory({.file = write_text(bytes), .unit_m = 1e-3});
}

inline device::MeasuredTrajectory measured_of(const std::string& bytes, device::MeasuredFile with = {}) {
  with.file = write_text(bytes);
  return device::read_measured(with);
}

// The message with which `read` refuses; empty if it does not refuse.
template <typename Read>
std::string refusal_of(const Read& read) {
  try {
    (void)read();
  } catch (const device::PathError& error) {
    return error.what();
  }
  return "";
}
inline std::string path_refusal(const std::string& bytes) {
  return refusal_of([&] { return path_of(bytes); });
}
inline std::string measured_refusal(const std::string& bytes, const device::MeasuredFile& with = {}) {
  return refusal_of([&] { return measured_of(bytes, with); });
}

}  // namespace tests
