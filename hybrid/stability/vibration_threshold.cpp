// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/stability/vibration_threshold.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace hybrid {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

// |X(k)|², by Goertzel's recurrence.
double line_power(std::span<const double> x, std::size_t k) {
  const double c = 2.0 * std::cos(kTwoPi * static_cast<double>(k) / static_cast<double>(x.size()));
  double last = 0.0, before = 0.0;
  for (const double sample : x) {
    const double now = sample + c * last - before;
    before = last;
    last = now;
  }
  return std::max(0.0, last * last + before * before - c * last * before);
}

}  // namespace

double vibration_threshold_m(double frequency_hz) noexcept {
  // Amplitude below kKnee_hz; the threshold falls up to kFlat_hz, and is used up to kEnd_hz.
  constexpr double kLow_m = 25e-6, kKnee_hz = 30.0, kFlat_hz = 300.0, kEnd_hz = 1000.0;
  if (!(frequency_hz <= kEnd_hz)) return std::numeric_limits<double>::infinity();
  const double octaves = std::log2(std::clamp(frequency_hz, kKnee_hz, kFlat_hz) / kKnee_hz);
  return kLow_m * std::pow(10.0, -12.0 / 20.0 * octaves);
}

Vibration strongest_vibration(std::span<const double> motion_m, double rate_hz) {
  const std::size_t n = motion_m.size();
  Vibration strongest;
  if (n < 16) return strongest;
  // Fits a line by least squares to all samples.
  const double middle = 0.5 * static_cast<double>(n - 1);
  double mean = 0.0, moment = 0.0, spread = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    const double at = static_cast<double>(i) - middle;
    mean += motion_m[i] / static_cast<double>(n);
    moment += at * motion_m[i];
    spread += at * at;
  }
  std::vector<double> windowed(n);
  for (std::size_t i = 0; i < n; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(n);
    const double away = motion_m[i] - mean - moment / spread * (static_cast<double>(i) - middle);
    windowed[i] = away * (0.5 - 0.5 * std::cos(kTwoPi * share));
  }
  // With Hann's window, a sinusoid of amplitude a has |X|² = (a·n/4)² at its line and a quarter of that at
  // each neighbour. The sum is 1.5 times the first, within 1 %, also for a frequency between two lines.
  const double scale = 4.0 / (static_cast<double>(n) * std::sqrt(1.5));
  const auto last =
      std::min<std::size_t>(n / 2, static_cast<std::size_t>(1000.0 * static_cast<double>(n) / rate_hz));
  double before = line_power(windowed, 3), here = line_power(windowed, 4);
  for (std::size_t k = 4; k <= last; ++k) {
    const double after = line_power(windowed, k + 1);
    const double frequency = static_cast<double>(k) * rate_hz / static_cast<double>(n);
    const double amplitude = scale * std::sqrt(before + here + after);
    const double felt = amplitude / vibration_threshold_m(frequency);
    // Only peaks of the spectrum count: on the upper flank of a peak the threshold falls faster than the
    // power.
    const bool peak = here >= before && here >= after;
    if (peak && felt > strongest.felt) strongest = {frequency, amplitude, felt};
    before = here;
    here = after;
  }
  return strongest;
}

}  // namespace hybrid
