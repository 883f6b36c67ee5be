// SPDX-License-Identifier: GPL-3.0-or-later
// What the process takes of the machine's memory, as the system counts it.
#pragma once

#include <malloc.h>

#include <cstddef>
#include <fstream>
#include <string>

namespace tests {

// What a sanitizer keeps beside all memory is counted, too.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kMemoryIsOurs = false;
#else
inline constexpr bool kMemoryIsOurs = true;
#endif

// Of its own, that is: no file, and no page of zeros that was only read. 0 where the system does not say.
inline std::size_t own_bytes() {
  malloc_trim(0);  // what was freed is nobody's
  std::ifstream in("/proc/self/status");
  for (std::string line; std::getline(in, line);) {
    if (line.rfind("RssAnon:", 0) == 0) return 1024 * std::stoul(line.substr(8));
  }
  return 0;
}

}  // namespace tests
