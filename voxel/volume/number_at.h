// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <charconv>
#include <cmath>
#include <cstring>
#include <system_error>

namespace voxel {

// Reads the number at the start of a text, after blanks. The decimal mark is a point in every locale. Sets
// `end` behind the number, or to `at` if there is none. A number outside the range of a double gives
// +infinity, even if it is negative or too small.
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
