// SPDX-License-Identifier: GPL-3.0-or-later
// The ticks of the last seconds, for the window's charts. A pixel column stands for many ticks. It gets the
// least and the largest force among them, so that no spike is lost. Uses no graphics library.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <vector>

#include "hybrid/reference/live_reference.h"
#include "hybrid/snapshot/tick_sample.h"

namespace hybrid {

// The total force, its part from rigid or from soft objects, and further parts (TickResult). Damping includes
// texture. Limits and passivity: the force that these take away.
enum class ForceSeries : std::uint8_t { total, rigid, soft, friction, damping, limits, passivity };
inline constexpr std::size_t kForceSeries = 7;

struct ColumnRange {
  float least_N = 0.0F, most_N = 0.0F;
};

// Distribution of tick times, in bins whose limits have equal ratios.
struct TickTimes {
  static constexpr std::size_t kBins = 48;  // number of bins
  // lower limit of the first bin, upper limit of the last one
  static constexpr double kFirst_us = 1.0, kLast_us = 10'000.0;
  std::array<std::uint64_t, kBins> bins{};
  std::array<double, kStages> stage_us{};  // mean time of each stage
  std::uint64_t ticks = 0, late = 0;
  double p50_us = 0.0, p99_us = 0.0, most_us = 0.0;

  static std::size_t bin_of(double us) noexcept;
};

// The time at which the scene changed while it was felt, and the ticks before it that the history had.
struct ChangeMark {
  double t_s = 0.0;
  TickTimes before;
  double most_before_N = 0.0;  // largest force
};

class TickHistory {
 public:
  explicit TickHistory(double seconds) : seconds_(seconds) {}

  // Adds a tick. A time that is not later than the last one begins a new history.
  void add(const TickSample& sample);
  // Adds the force at rest of a tick. The times of such forces must increase.
  void add(const ForceAtRest& found);
  [[nodiscard]] const std::deque<ForceAtRest>& at_rest() const { return at_rest_; }
  void clear() {
    samples_.clear();
    at_rest_.clear();
    mark_.reset();
  }
  // Marks a change of the scene. It replaces an earlier mark.
  void mark(double t_s);
  [[nodiscard]] const std::optional<ChangeMark>& last_change() const { return mark_; }
  [[nodiscard]] bool empty() const { return samples_.empty(); }
  [[nodiscard]] double seconds() const { return seconds_; }
  [[nodiscard]] double end_s() const { return samples_.empty() ? 0.0 : samples_.back().t_s; }

  // The range of forces in each of `count` columns, the newest last. Empty: no tick is in the column.
  [[nodiscard]] std::vector<std::optional<ColumnRange>> columns(ForceSeries series, std::size_t count) const;
  // The parts of the force in each of `count` columns, from the tick with the largest force in the column.
  // Empty: no tick is in the column.
  using Parts = std::array<float, kForceParts>;
  [[nodiscard]] std::vector<std::optional<Parts>> parts(std::size_t count) const;
  // A number of the newest tick, and its range. Empty: there is no tick.
  struct NumberRange {
    double now = 0.0, least = 0.0, most = 0.0;
  };
  [[nodiscard]] std::optional<NumberRange> range(const std::function<double(const TickSample&)>& of) const;
  // Places of the device, about `count` at even times, from the oldest to the newest.
  [[nodiscard]] std::vector<glm::dvec3> path_m(std::size_t count) const;
  [[nodiscard]] double most_N(ForceSeries series) const;  // largest force
  [[nodiscard]] double most_N() const;                    // of all series
  [[nodiscard]] double most_N(ForceSeries series, double from_s, double to_s) const;
  [[nodiscard]] TickTimes times() const;
  // The times of the ticks from `from_s` on and before `to_s`.
  [[nodiscard]] TickTimes times(double from_s, double to_s) const;

 private:
  [[nodiscard]] std::size_t column_of(const TickSample& sample, std::size_t count) const;

  double seconds_;
  std::deque<TickSample> samples_;
  std::deque<ForceAtRest> at_rest_;
  std::optional<ChangeMark> mark_;
};

}  // namespace hybrid
