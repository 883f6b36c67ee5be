// SPDX-License-Identifier: GPL-3.0-or-later
// How what is asked for wrongly is refused.
#pragma once

#include <sstream>
#include <stdexcept>

namespace voxel {

// Throws std::invalid_argument with the parts, one after another, as its text.
template <typename... Parts>
[[noreturn]] void refuse(const Parts&... parts) {
  std::ostringstream text;
  text.precision(9);
  (text << ... << parts);
  throw std::invalid_argument(text.str());
}

}  // namespace voxel
