// SPDX-License-Identifier: GPL-3.0-or-later
// The ticks of the last seconds for the window's charts. A pixel column stands for many ticks: it gets the
// least and the largest force among them, so that no spike is lost. Knows no graphics library.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "hybrid/snapshot/tick_sample.h"

namespace hybrid {

// Which part of the force.
enum class ForceSeries : std::uint8_t { total, rigid, soft };
inline constexpr std::size_t kForceSeries = 3;

struct ColumnRange {
  float least_N = 0.0F, most_N = 0.0F;
};

// Tick times in bins of equal ratio.
struct TickTimes {
  static constexpr std::size_t kBins = 48;
  static constexpr double kFirst_us = 1.0, kLast_us = 10'000.0;
  std::array<std::uint64_t, kBins> bins{};
  std::array<double, kStages> stage_us{};  // means
  std::uint64_t ticks = 0, late = 0;
  double p50_us = 0.0, p99_us = 0.0, most_us = 0.0;

  static std::size_t bin_of(double us) noexcept;
};

class TickHistory {
 public:
  explicit TickHistory(double seconds) : seconds_(seconds) {}

  // A time that is not later than the last one begins a new history.
  void add(const TickSample& sample);
  void clear() { samples_.clear(); }
  [[nodiscard]] bool empty() const { return samples_.empty(); }
  [[nodiscard]] double seconds() const { return seconds_; }
  [[nodiscard]] double end_s() const { return samples_.empty() ? 0.0 : samples_.back().t_s; }

  // The range of each of `count` columns, the newest last; empty: no tick in it.
  [[nodiscard]] std::vector<std::optional<ColumnRange>> columns(ForceSeries series, std::size_t count) const;
  [[nodiscard]] double most_N() const;  // of all series
  [[nodiscard]] TickTimes times() const;

 private:
  double seconds_;
  std::deque<TickSample> samples_;
};

}  // namespace hybrid
