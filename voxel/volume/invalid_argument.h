// SPDX-License-Identifier: GPL-3.0-or-later
// Throws std::invalid_argument with a text put together from parts. Numbers have nine digits.
#pragma once

#include <sstream>
#include <stdexcept>

namespace voxel {

// Throws std::invalid_argument; its text is the parts, concatenated.
template <typename... Parts>
[[noreturn]] void refuse(const Parts&... parts) {
  std::ostringstream text;
  text.precision(9);
  (text << ... << parts);
  throw std::invalid_argument(text.str());
}

}  // namespace voxel
