// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>

namespace voxel {

// Has what lies there fetched into the cache, to be read or written in a moment.
inline void fetch_lines(const void* at, std::size_t bytes) noexcept {
  constexpr std::size_t kLine = 64;  // bytes
  const auto* first = static_cast<const char*>(at);
  for (std::size_t i = 0; i < bytes; i += kLine) __builtin_prefetch(first + i, 1);
}

}  // namespace voxel
