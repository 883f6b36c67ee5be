// SPDX-License-Identifier: GPL-3.0-or-later
// Where a simulated hand wants the tool to be, over time: press, slide, waypoints, Lissajous or a CSV
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

// From `from` move to `to` at `speed`, hold there `hold_s`, and back to `from` at `speed`; `repeat` times.
struct PressPath {
  glm::dvec3 from_m{0.0}, to_m{0.0};
  double speed_m_per_s = 0.05;
  double hold_s = 0.5;
  int repeat = 1;
};

// Down from `from` + `lift` to `from`, straight to `to`, up to `to` + `lift`: one stroke over a surface.
struct SlidePath {
  glm::dvec3 from_m{0.0}, to_m{0.0};
  glm::dvec3 lift_m{0.0};
  double speed_m_per_s = 0.05;
};

// Straight legs at `speed`; a waypoint's hold is spent there.
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

// Columns t, x, y, z of a CSV (also .gz), any rate, linear between samples; the first column of the header
// that begins with "t", "x", "y", "z" (e.g. t_s, x_mm). The unit is taken from the header's suffix (_m, _cm,
// _mm, _um; time _s, _ms, _us, _ns), else from `unit_m` (time: seconds). The first sample's time is taken as
// 0.
struct CsvPath {
  std::filesystem::path file;
  double unit_m = 1.0;
  glm::dvec3 offset_m{0.0};  // added to every sample
};

using PathDescription = std::variant<PressPath, SlidePath, WaypointPath, LissajousPath, CsvPath>;

// A path ready to be followed. position() is pure, allocates nothing and holds its ends before 0 and after
// duration.
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
  // What a reader should know: samples that repeat a time, gaps; empty when there is nothing to say.
  [[nodiscard]] virtual const std::vector<std::string>& notes() const noexcept = 0;
};

// Throws PathError: speed not positive, no points, values not finite, CSV missing or malformed (file:line),
// time running backwards.
std::unique_ptr<Path> make_path(const PathDescription& description);

}  // namespace device
