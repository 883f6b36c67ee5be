// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/plot/axis.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "hybrid/base/number_text.h"

namespace hybrid {
namespace {

constexpr double kOffAxis = std::numeric_limits<double>::quiet_NaN();

std::vector<double> decade_ticks(double from, double to, int wanted) {
  const int low = static_cast<int>(std::floor(std::log10(from) + 1e-9));
  const int high = static_cast<int>(std::ceil(std::log10(to) - 1e-9));
  // Numbers between the powers of ten are shown only if there are few decades, or fewer than two powers. A
  // single tick would give no scale. With many decades, some powers are left out too.
  const double first = std::ceil(std::log10(from) - 1e-9), last = std::floor(std::log10(to) + 1e-9);
  const bool between = 3.0 * std::log10(to / from) <= wanted || last < first + 1.0;
  const int stride = std::max(1, (high - low) / std::max(wanted, 1));
  std::vector<double> ticks;
  for (int power = low; power <= high; power += stride) {
    for (const double digit : {1.0, 2.0, 5.0}) {
      const double tick = digit * std::pow(10.0, power);
      if ((digit > 1.0 && !between) || tick < from * (1.0 - 1e-9) || tick > to * (1.0 + 1e-9)) continue;
      ticks.push_back(tick);
    }
  }
  return ticks;
}

std::vector<double> symmetric_ticks(const ValueRange& values, int wanted) {
  const double most = std::max(std::abs(values.from), std::abs(values.to));
  std::vector<double> ticks{0.0};
  const auto add = [&](double size) {
    for (const double tick : {-size, size}) {
      if (tick >= values.from && tick <= values.to) ticks.push_back(tick);
    }
  };
  // Both signs share the available ticks.
  const bool between = scaled(Scale::symmetric, most) * 4.0 <= wanted;
  for (double power = 1.0; power <= most * (1.0 + 1e-9) && ticks.size() < 64; power *= 10.0) {
    add(power);
    if (between) {
      add(2.0 * power);
      add(5.0 * power);
    }
  }
  std::sort(ticks.begin(), ticks.end());
  return ticks;
}

std::string with_commas(std::string digits) {
  const std::size_t begin = digits[0] == '-' ? 1 : 0;
  const std::size_t point = std::min(digits.find('.'), digits.size());
  // Up to four digits need no comma.
  if (point - begin < 5) return digits;
  for (std::size_t at = point; at > begin + 3;) digits.insert(at -= 3, ",");
  return digits;
}

}  // namespace

bool plottable(double v) {
  return std::isfinite(v) && std::abs(v) < 1e150;
}

double scaled(Scale scale, double value) {
  switch (scale) {
    case Scale::logarithmic:
      return value > 0.0 ? std::log10(value) : kOffAxis;
    case Scale::symmetric: {
      const double size = std::abs(value);
      return size <= 1.0 ? value : std::copysign(1.0 + std::log10(size), value);
    }
    case Scale::linear:
      break;
  }
  return value;
}

Axis::Axis(Scale scale, const ValueRange& values, double page_from, double page_to, Intervals squeezed)
    : scale_(scale),
      values_(values),
      page_from_(page_from),
      page_to_(page_to),
      squeezed_(std::move(squeezed)) {}

double Axis::page(double value) const {
  if (!plottable(value)) return kOffAxis;
  const double from = scaled(scale_, values_.from), to = scaled(scale_, values_.to);
  if (squeezed_.empty())
    return page_from_ + (scaled(scale_, value) - from) / (to - from) * (page_to_ - page_from_);
  double out = 0.0;  // total length of the squeezed intervals
  for (const auto& [a, b] : squeezed_) out += b - a;
  const double room = std::abs(page_to_ - page_from_) - kSqueezed_px * static_cast<double>(squeezed_.size());
  const double per_value = room / (to - from - out);
  double at = (std::min(value, squeezed_.front().first) - from) * per_value;
  for (std::size_t n = 0; n < squeezed_.size(); ++n) {
    const auto& [a, b] = squeezed_[n];
    const double next =
        n + 1 < squeezed_.size() ? squeezed_[n + 1].first : std::numeric_limits<double>::infinity();
    at += std::clamp((value - a) / (b - a), 0.0, 1.0) * kSqueezed_px;
    if (value > b) at += (std::min(value, next) - b) * per_value;
  }
  return page_from_ + std::copysign(at, page_to_ - page_from_);
}

std::vector<double> Axis::ticks(int wanted) const {
  if (scale_ == Scale::logarithmic) return decade_ticks(values_.from, values_.to, wanted);
  if (scale_ == Scale::symmetric) return symmetric_ticks(values_, wanted);
  double shown = values_.to - values_.from;
  for (const auto& [a, b] : squeezed_) shown -= b - a;
  // The pitch of the ticks is that of an axis without the squeezed intervals.
  const std::vector<double> pitch = nice_ticks(0.0, shown, wanted);
  if (pitch.size() < 2) return nice_ticks(values_.from, values_.to, wanted);
  const double step = pitch[1] - pitch[0];
  std::vector<double> ticks;
  for (double n = std::ceil(values_.from / step - 1e-9); ticks.size() < 64; ++n) {
    const double tick = n * step;
    if (tick > values_.to + 1e-9 * step) break;
    const auto next =
        std::ranges::find_if(squeezed_, [&](const auto& s) { return tick >= s.first && tick <= s.second; });
    if (next == squeezed_.end()) {
      ticks.push_back(tick);
    } else {
      n = std::max(n, std::floor(next->second / step));
    }
  }
  return ticks;
}

std::vector<double> nice_ticks(double from, double to, int wanted) {
  std::vector<double> ticks;
  if (!plottable(from) || !plottable(to) || !(to > from) || wanted < 1) return ticks;
  const double rough = (to - from) / wanted;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  double step = 10.0 * power;
  for (const double nice : {5.0, 2.0, 1.0}) {
    if (nice * power >= rough * (1.0 - 1e-9)) step = nice * power;
  }
  const double first = std::ceil(from / step - 1e-9);
  for (int i = 0; i < 64; ++i) {
    const double tick = (first + i) * step;
    if (tick > to + 1e-9 * step) break;
    ticks.push_back(tick);
  }
  return ticks;
}

std::string tick_text(double value, double step) {
  constexpr int kMostDecimals = 12;  // digits after the point
  const double size = std::max(std::abs(value), std::abs(step));
  if (std::abs(value) < 1e-9 * std::abs(step)) return "0";
  std::string digits;
  if (size >= 1e15 || (step != 0.0 && std::abs(step) < 1e-12)) {
    digits = with_digits(value, 4);
  } else {
    int decimals = step != 0.0 ? 0 : 3;
    for (double rest = std::abs(step);
         decimals < kMostDecimals && std::abs(rest - std::round(rest)) > 1e-6 * rest;) {
      rest *= 10.0;
      ++decimals;
    }
    digits = with_commas(with_decimals(value, decimals));
  }
  return digits[0] == '-' ? "−" + digits.substr(1) : digits;
}

std::string quantity_text(double value, std::string_view unit) {
  struct Prefix {
    double size;
    const char* name;
  };
  static constexpr std::array<Prefix, 7> prefixes{
      {{1e6, "M"}, {1e3, "k"}, {1.0, ""}, {1e-3, "m"}, {1e-6, "µ"}, {1e-9, "n"}, {1e-12, "p"}}};
  const double size = std::abs(value);
  Prefix chosen = prefixes[2];
  for (const Prefix& prefix : prefixes) {
    chosen = prefix;
    if (size >= prefix.size * (1.0 - 1e-9)) break;
  }
  if (size == 0.0) chosen = prefixes[2];
  const std::string digits = with_digits(value / chosen.size, 6);
  const std::string sign = digits[0] == '-' ? "−" : "";
  return sign + digits.substr(sign.empty() ? 0 : 1) + " " + chosen.name + std::string(unit);
}

}  // namespace hybrid
