// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <sstream>
#include <stdexcept>

namespace polygon {

// Throws std::invalid_argument, naming `what`, unless `value` (m) is finite and positive, or 0 if allowed.
inline void require_size(const char* what, double value, bool zero_allowed = false) {
  if (std::isfinite(value) && (value > 0.0 || (zero_allowed && value == 0.0))) return;
  std::ostringstream text;
  text << what << " is " << value << " m; it must be finite and " << (zero_allowed ? ">= 0" : "> 0");
  throw std::invalid_argument(text.str());
}

}  // namespace polygon
