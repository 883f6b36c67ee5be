// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/paths/path.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <glm/trigonometric.hpp>
#include <utility>

#include "device/paths/line_reader.h"
#include "device/paths/path_file.h"

namespace device {
namespace {

void require_finite(const glm::dvec3& v, const char* what) {
  if (std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z)) return;
  throw PathError(std::string("path: ") + what + " is not a finite number in every component");
}

void require_speed(double speed_m_per_s) {
  if (speed_m_per_s > 0.0 && std::isfinite(speed_m_per_s)) return;
  throw PathError("path: its speed is " + short_number(speed_m_per_s) +
                  " m/s; a speed must be a number above 0");
}

void require_duration(double hold_s) {
  if (hold_s >= 0.0 && std::isfinite(hold_s)) return;
  throw PathError("path: a hold of " + short_number(hold_s) + " s; it must be a number not below 0");
}

// Positions at ascending times, with linear interpolation, repeated `repeat` times. A repeated polyline must
// end where it begins.
class PolylinePath final : public Path {
 public:
  explicit PolylinePath(Trajectory trajectory, int repeat = 1)
      : trajectory_(std::move(trajectory)), cycle_s_(trajectory_.t_s.back()), duration_s_(cycle_s_ * repeat) {
    if (!std::isfinite(duration_s_)) {
      throw PathError("path: it would take longer than can be counted; raise the speed, or shorten it");
    }
  }

  [[nodiscard]] glm::dvec3 position(double t_s) const noexcept override {
    const std::vector<double>& times = trajectory_.t_s;
    const std::vector<glm::dvec3>& positions = trajectory_.position_m;
    if (!(t_s > 0.0)) return positions.front();  // also for NaN
    if (t_s >= duration_s_) return positions.back();
    const double in_cycle_s = std::fmod(t_s, cycle_s_);
    const auto after = std::upper_bound(times.begin(), times.end(), in_cycle_s);
    if (after == times.end()) return positions.back();
    // i is at least 1, because the first time is 0.
    const auto i = static_cast<std::size_t>(after - times.begin());
    const double share = (in_cycle_s - times[i - 1]) / (times[i] - times[i - 1]);
    return positions[i - 1] + (positions[i] - positions[i - 1]) * share;
  }
  [[nodiscard]] double duration_s() const noexcept override { return duration_s_; }
  [[nodiscard]] const std::vector<std::string>& notes() const noexcept override { return trajectory_.notes; }

 private:
  Trajectory trajectory_;
  double cycle_s_;
  double duration_s_;
};

class LissajousCurve final : public Path {
 public:
  explicit LissajousCurve(const LissajousPath& description) : curve_(description) {}

  [[nodiscard]] glm::dvec3 position(double t_s) const noexcept override {
    const double t = t_s > 0.0 ? std::min(t_s, curve_.duration_s) : 0.0;
    return curve_.centre_m +
           curve_.amplitude_m * glm::sin(glm::two_pi<double>() * curve_.frequency_hz * t + curve_.phase_rad);
  }
  [[nodiscard]] double duration_s() const noexcept override { return curve_.duration_s; }
  [[nodiscard]] const std::vector<std::string>& notes() const noexcept override { return notes_; }

 private:
  LissajousPath curve_;
  std::vector<std::string> notes_;
};

// Builds a polyline from straight legs and holds. Legs without duration are left out, so that times ascend
// strictly.
class PolylineBuilder {
 public:
  PolylineBuilder(const glm::dvec3& start_m, double speed_m_per_s) : speed_(speed_m_per_s) {
    require_finite(start_m, "a position");
    require_speed(speed_m_per_s);
    polyline_.t_s.push_back(0.0);
    polyline_.position_m.push_back(start_m);
  }
  PolylineBuilder& move_to(const glm::dvec3& to_m) {
    require_finite(to_m, "a position");
    return add(glm::length(to_m - polyline_.position_m.back()) / speed_, to_m);
  }
  PolylineBuilder& hold(double hold_s) {
    require_duration(hold_s);
    return add(hold_s, polyline_.position_m.back());
  }
  [[nodiscard]] std::unique_ptr<Path> build(int repeat = 1) {
    return std::make_unique<PolylinePath>(std::move(polyline_), repeat);
  }

 private:
  PolylineBuilder& add(double lasts_s, const glm::dvec3& position_m) {
    const double t_s = polyline_.t_s.back() + lasts_s;
    if (t_s > polyline_.t_s.back()) {
      polyline_.t_s.push_back(t_s);
      polyline_.position_m.push_back(position_m);
    } else {
      polyline_.position_m.back() = position_m;  // a leg without duration
    }
    return *this;
  }

  double speed_;
  Trajectory polyline_;
};

std::unique_ptr<Path> make(const PressPath& press) {
  if (press.repeat < 1)
    throw PathError("path: repeat is " + std::to_string(press.repeat) + "; it must be 1 or more");
  return PolylineBuilder(press.from_m, press.speed_m_per_s)
      .move_to(press.to_m)
      .hold(press.hold_s)
      .move_to(press.from_m)
      .build(press.repeat);
}

std::unique_ptr<Path> make(const SlidePath& slide) {
  return PolylineBuilder(slide.from_m + slide.lift_m, slide.speed_m_per_s)
      .move_to(slide.from_m)
      .move_to(slide.to_m)
      .move_to(slide.to_m + slide.lift_m)
      .build();
}

std::unique_ptr<Path> make(const WaypointPath& waypoints) {
  if (waypoints.points.empty()) throw PathError("path: it has no points; give at least one");
  PolylineBuilder builder(waypoints.points.front().position_m, waypoints.speed_m_per_s);
  for (const Waypoint& point : waypoints.points) builder.move_to(point.position_m).hold(point.hold_s);
  return builder.build();
}

std::unique_ptr<Path> make(const LissajousPath& curve) {
  require_finite(curve.centre_m, "the centre");
  require_finite(curve.amplitude_m, "the amplitude");
  require_finite(curve.frequency_hz, "the frequency");
  require_finite(curve.phase_rad, "the phase");
  require_finite(curve.centre_m + glm::abs(curve.amplitude_m), "the farthest point");
  require_finite(curve.frequency_hz * (glm::two_pi<double>() * curve.duration_s), "frequency times duration");
  require_duration(curve.duration_s);
  return std::make_unique<LissajousCurve>(curve);
}

std::unique_ptr<Path> make(const CsvPath& csv) {
  require_finite(csv.offset_m, "the offset");
  return std::make_unique<PolylinePath>(read_trajectory(csv));
}

}  // namespace

std::unique_ptr<Path> make_path(const PathDescription& description) {
  return std::visit([](const auto& path) { return make(path); }, description);
}

std::shared_ptr<const Path> make_path(Trajectory trajectory) {
  if (trajectory.t_s.empty() || trajectory.t_s.size() != trajectory.position_m.size()) {
    throw PathError("path: a trajectory without samples");
  }
  return std::make_shared<PolylinePath>(std::move(trajectory));
}

}  // namespace device
