// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <charconv>
#include <cmath>
#include <cstring>
#include <system_error>

namespace voxel {

// The number at the start of a text, after blanks, with a point whatever the locale; `end` is behind it. As
// std::strtod() in the C locale: without a number `end` is `at`, and beyond the range of a double the number
// is infinite.
inline double number_at(const char* at, const char** end) {
  const char* first = at;
  while (*first == ' ' || (*first >= '\t' && *first <= '\r')) ++first;
  if (*first == '+' && first[1] != '-') ++first;
  double value = 0.0;
  const auto [last, error] = std::from_chars(first, first + std::strlen(first), value);
  *end = error == std::errc::invalid_argument ? at : last;
  return error == std::errc::result_out_of_range ? HUGE_VAL : value;
}

}  // namespace voxel
