// SPDX-License-Identifier: GPL-3.0-or-later
// Explicit prefetch of memory.
#pragma once

#include <cstddef>

namespace voxel {

// Prefetches a range of memory into the cache, for reading or writing soon.
inline void prefetch_range(const void* at, std::size_t bytes) noexcept {
  constexpr std::size_t kLine = 64;  // bytes
  const auto* first = static_cast<const char*>(at);
  for (std::size_t i = 0; i < bytes; i += kLine) __builtin_prefetch(first + i, 1);
}

}  // namespace voxel
