// SPDX-License-Identifier: GPL-3.0-or-later
// An axis of a panel: the position of a value on the page, and the ticks with their texts.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hybrid {

// `symmetric` is linear from −1 to 1. Beyond that each power of ten is as long as the part from 0 to 1.
enum class Scale : std::uint8_t { linear, logarithmic, symmetric };

using Intervals = std::vector<std::pair<double, double>>;  // each has a beginning and an end; in rising order

// Can a figure show this value? It must be finite, and differences of such values must not overflow.
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
  static constexpr double kSqueezed_px = 30.0;  // length on the page of each squeezed interval

  Axis() = default;
  // page_to < page_from: the axis is reversed. Only intervals of a linear axis may be squeezed. They must be
  // in order, apart, and within the values.
  Axis(Scale scale, const ValueRange& values, double page_from, double page_to, Intervals squeezed = {});

  // Position on the page (pixels). Not finite for a value without a position, such as 0 on a logarithmic
  // axis.
  [[nodiscard]] double page(double value) const;
  // About `wanted` round values on the axis, none of them in a squeezed interval.
  [[nodiscard]] std::vector<double> ticks(int wanted) const;
  [[nodiscard]] const ValueRange& values() const { return values_; }
  [[nodiscard]] const Intervals& squeezed() const { return squeezed_; }

 private:
  Scale scale_ = Scale::linear;
  ValueRange values_{0.0, 1.0};
  double page_from_ = 0.0, page_to_ = 1.0;
  Intervals squeezed_;
};

// The coordinate in which an axis of this scale is linear. Not finite for a value without a position.
double scaled(Scale scale, double value);

// Round numbers at a pitch of 1, 2 or 5 · 10^n within [from, to], about `wanted` of them and at most 64.
std::vector<double> nice_ticks(double from, double to, int wanted);

// Text of a tick, with as many decimals as the pitch needs, and with commas between thousands. Values that a
// session measures (10⁻¹² to 10¹⁵) never get an exponent.
std::string tick_text(double value, double step);

// A value with its unit. The prefix is chosen so that the number is short: "10 ns", "1 µs", and "500 µs" for
// 0.5 ms.
std::string quantity_text(double value, std::string_view unit);

}  // namespace hybrid
