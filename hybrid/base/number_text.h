// SPDX-License-Identifier: GPL-3.0-or-later
// Numbers as text with a decimal point, independent of the locale.
#pragma once

#include <array>
#include <charconv>
#include <string>

namespace hybrid {

namespace detail {
inline std::string number_text(double value, std::chars_format format, int precision) {
  std::array<char, 512> text{};  // a double has at most 309 digits before the point
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value, format, precision).ptr;
  return {text.data(), end};
}
}  // namespace detail

// A number with `decimals` decimals: "1.250" with three.
inline std::string with_decimals(double value, int decimals) {
  return detail::number_text(value, std::chars_format::fixed, decimals);
}

// A number with at most `digits` digits, for example "1.25". Very large and small numbers: "1.25e+06".
inline std::string with_digits(double value, int digits) {
  return detail::number_text(value, std::chars_format::general, digits);
}

}  // namespace hybrid
