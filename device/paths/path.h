// SPDX-License-Identifier: GPL-3.0-or-later
// The target of a simulated hand over time: a press, slide, waypoints, Lissajous figure or recorded
// trajectory.
#pragma once

#include <filesystem>
#include <glm/vec3.hpp>
#include <memory>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

namespace device {

class PathError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// From `from` to `to` at `speed`, a stay of `hold_s`, and back to `from` at `speed`; `repeat` times.
struct PressPath {
  glm::dvec3 from_m{0.0}, to_m{0.0};
  double speed_m_per_s = 0.05;
  double hold_s = 0.5;
  int repeat = 1;
};

// From `from` + `lift` down to `from`, straight to `to`, up to `to` + `lift`: one stroke over a surface.
struct SlidePath {
  glm::dvec3 from_m{0.0}, to_m{0.0};
  glm::dvec3 lift_m{0.0};
  double speed_m_per_s = 0.05;
};

// Straight legs at `speed`, with a stay of hold_s at each waypoint.
struct Waypoint {
  glm::dvec3 position_m{0.0};
  double hold_s = 0.0;
};
struct WaypointPath {
  std::vector<Waypoint> points;  // at least one
  double speed_m_per_s = 0.05;
};

// centre + amplitude · sin(2π·frequency·t + phase), per axis.
struct LissajousPath {
  glm::dvec3 centre_m{0.0}, amplitude_m{0.0}, frequency_hz{0.0}, phase_rad{0.0};
  double duration_s = 10.0;
};

// Columns of a CSV file (also .gz) at any rate; the path is linear between samples. Quantities and units
// follow from the columns' names (column_names.h). Lengths without a unit are in `unit_m`, times in seconds.
// Time 0 is the first sample.
struct CsvPath {
  std::filesystem::path file;
  double unit_m = 1.0;
  glm::dvec3 offset_m{0.0};  // added to every sample
};

using PathDescription = std::variant<PressPath, SlidePath, WaypointPath, LissajousPath, CsvPath>;

// A path ready to be followed. position() is pure and allocates nothing. Before time 0 it returns the first
// point, and after the duration the last one.
class Path {
 public:
  Path() = default;
  Path(const Path&) = delete;
  Path& operator=(const Path&) = delete;
  Path(Path&&) = delete;
  Path& operator=(Path&&) = delete;
  virtual ~Path() = default;
  [[nodiscard]] virtual glm::dvec3 position(double t_s) const noexcept = 0;  // (unit: meter)
  [[nodiscard]] virtual double duration_s() const noexcept = 0;
  // Remarks for the user, such as repeated times or gaps; may be empty.
  [[nodiscard]] virtual const std::vector<std::string>& notes() const noexcept = 0;
};

// Throws PathError if the speed is not positive, there are no points, a value is not finite, the CSV is
// missing or malformed (file:line), or time runs backwards.
std::unique_ptr<Path> make_path(const PathDescription& description);

}  // namespace device
