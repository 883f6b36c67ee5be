// SPDX-License-Identifier: GPL-3.0-or-later
// Latency histogram: durations of any number of ticks in constant memory.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace hybrid {

struct Percentiles {
  double p50 = 0.0, p99 = 0.0, p999 = 0.0, max = 0.0;
};

// Counts values in bins of 1/64 of an octave. So a percentile is within 0.8 % of the exact one, and the
// maximum is exact. A list of a day's ticks at 1 kHz would take 0.7 GB.
class LatencyHistogram {
 public:
  // Allocates nothing. Negative values and NaN count as 0.
  void add(double time_us) noexcept {
    ++bins_[bin_of(time_us)];
    ++count_;
    max_ = std::max(max_, time_us);
  }
  void add(const LatencyHistogram& other) noexcept {
    for (std::size_t b = 0; b < bins_.size(); ++b) bins_[b] += other.bins_[b];
    count_ += other.count_;
    max_ = std::max(max_, other.max_);
  }
  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }
  [[nodiscard]] Percentiles percentiles() const noexcept { return {at(0.5), at(0.99), at(0.999), max_}; }

 private:
  static constexpr int kPerOctave = 64, kFirstOctave = -10, kOctaves = 44;  // 1 ns to 4 hours

  static std::size_t bin_of(double time_us) noexcept {
    if (!(time_us > std::ldexp(1.0, kFirstOctave))) return 0;
    const double bin = (std::log2(time_us) - kFirstOctave) * kPerOctave;
    return static_cast<std::size_t>(std::min(bin, kPerOctave * double{kOctaves} - 1.0));
  }
  [[nodiscard]] double at(double share) const noexcept {
    if (count_ == 0) return 0.0;
    const auto rank = std::min(static_cast<std::uint64_t>(share * static_cast<double>(count_)), count_ - 1);
    std::uint64_t below = 0;
    for (std::size_t b = 0; b < bins_.size(); ++b) {
      below += bins_[b];
      if (below > rank)
        return std::min(max_, std::exp2((static_cast<double>(b) + 0.5) / kPerOctave + kFirstOctave));
    }
    return max_;
  }

  std::vector<std::uint64_t> bins_ = std::vector<std::uint64_t>(std::size_t{kPerOctave} * kOctaves, 0);
  std::uint64_t count_ = 0;
  double max_ = 0.0;
};

}  // namespace hybrid
