// SPDX-License-Identifier: GPL-3.0-or-later
// Finds the threshold at which a predicate of one number becomes false.
#pragma once

#include <optional>

namespace hybrid {

// Tests `from`, then values growing by `factor` (> 1) until the predicate is false, and bisects the last
// interval to a relative width of `precision`. This finds the lowest threshold that the sequence can resolve.
// Returns 0 if the predicate is false at `from`, and nothing if it is true at all tested values below `to`.
template <class Predicate>
std::optional<double> find_threshold(double from, double to, double factor, double precision,
                                     Predicate&& predicate) {
  if (!predicate(from)) return 0.0;
  double low = from, high = from * factor;
  while (high < to && predicate(high)) {
    low = high;
    high *= factor;
  }
  if (!(high < to)) return std::nullopt;
  while (high - low > precision * high) {
    const double middle = 0.5 * (low + high);
    (predicate(middle) ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace hybrid
