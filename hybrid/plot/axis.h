// SPDX-License-Identifier: GPL-3.0-or-later
// An axis of a panel: the place of a value on the page, and the ticks with their texts.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hybrid {

// symmetric: linear from −1 to 1, and each further power of ten is as long as the part from 0 to 1.
enum class Scale : std::uint8_t { linear, logarithmic, symmetric };

using Intervals = std::vector<std::pair<double, double>>;  // from, to; in order

// True for a value that a figure can show: finite, and its differences do not overflow.
bool plottable(double v);

struct ValueRange {
  double from = std::numeric_limits<double>::infinity();
  double to = -std::numeric_limits<double>::infinity();
  void add(double v) {
    if (!plottable(v)) return;
    from = v < from ? v : from;
    to = v > to ? v : to;
  }
  [[nodiscard]] bool empty() const { return !(from <= to); }
};

class Axis {
 public:
  static constexpr double kSqueezed_px = 30.0;  // length of each squeezed interval on the page

  Axis() = default;
  // The page may run against the values (page_to < page_from). Intervals of a linear axis may be squeezed:
  // in order, apart, within the values.
  Axis(Scale scale, const ValueRange& values, double page_from, double page_to, Intervals squeezed = {});

  // Place on the page (pixels); not finite for a value that has no place, as 0 on a logarithmic axis.
  [[nodiscard]] double page(double value) const;
  // About `wanted` round values on the axis, none of them within a squeezed interval.
  [[nodiscard]] std::vector<double> ticks(int wanted) const;
  [[nodiscard]] const ValueRange& values() const { return values_; }
  [[nodiscard]] const Intervals& squeezed() const { return squeezed_; }

 private:
  Scale scale_ = Scale::linear;
  ValueRange values_{0.0, 1.0};
  double page_from_ = 0.0, page_to_ = 1.0;
  Intervals squeezed_;
};

// The coordinate in which an axis of this scale is linear; not finite where the scale has no place.
double scaled(Scale scale, double value);

// Round numbers at a pitch of 1, 2 or 5 · 10^n within [from, to], about `wanted` of them and at most 64.
std::vector<double> nice_ticks(double from, double to, int wanted);

// Text of a tick, with as many decimals as the pitch needs, and commas between thousands. Never an exponent
// for what a session measures (10⁻¹² to 10¹⁵).
std::string tick_text(double value, double step);

// A value with its unit, the prefix chosen so that the number is short: "10 ns", "1 µs", "0.5 ms" is "500
// µs".
std::string quantity_text(double value, std::string_view unit);

}  // namespace hybrid
