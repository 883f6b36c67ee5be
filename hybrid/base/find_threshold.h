// SPDX-License-Identifier: GPL-3.0-or-later
// Where something that holds for little stops holding.
#pragma once

#include <optional>

namespace hybrid {

// Tries `from`, then values `factor` (> 1) apart, up to the first at which `holds` is false, and bisects
// between it and the one before until they are `precision` of it apart: the least such boundary, as far as
// the row can tell, and not just any. 0: it does not hold at `from`; empty: it holds at all below `to`.
template <class Holds>
std::optional<double> first_not_so(double from, double to, double factor, double precision, Holds&& holds) {
  if (!holds(from)) return 0.0;
  double low = from, high = from * factor;
  while (high < to && holds(high)) {
    low = high;
    high *= factor;
  }
  if (!(high < to)) return std::nullopt;
  while (high - low > precision * high) {
    const double middle = 0.5 * (low + high);
    (holds(middle) ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace hybrid
