// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <system_error>

namespace voxel {

// Reads the number at the start of a text, after blanks. The decimal mark is a point in every locale. Sets
// `end` behind the number, or to `at` if there is none. As in strtod(), a number too large for a double gives
// ±infinity, and a number too small gives 0.
inline double number_at(const char* at, const char** end) {
  const char* first = at;
  while (*first == ' ' || (*first >= '\t' && *first <= '\r')) ++first;
  if (*first == '+' && first[1] != '-') ++first;
  double value = 0.0;
  const auto [last, error] = std::from_chars(first, first + std::strlen(first), value);
  *end = error == std::errc::invalid_argument ? at : last;
  if (error != std::errc::result_out_of_range) return value;
  const char* exponent = std::find_if(first, last, [](char c) { return c == 'e' || c == 'E'; });
  const bool is_negative = *first == '-';
  const char leading = is_negative ? first[1] : *first;
  const bool is_small = exponent != last ? exponent[1] == '-' : leading == '0' || leading == '.';
  return is_small ? 0.0 : is_negative ? -HUGE_VAL : HUGE_VAL;
}

}  // namespace voxel
