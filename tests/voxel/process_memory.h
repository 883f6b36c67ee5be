// SPDX-License-Identifier: GPL-3.0-or-later
// What the process takes of the machine's memory, as the system counts it.
#pragma once

#include <malloc.h>
#include <sys/mman.h>

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

// Why what is said of memory that was only read is skipped.
inline constexpr const char* kReadingTakes = "this system gives memory to what was only read";

// Some kernels give a page that was only read memory of its own, where others show the one page of zeros that
// all of them share. There what is read costs as much as what is written, and no bound on it holds.
inline bool reading_takes_memory() {
  constexpr std::size_t kBytes = std::size_t{4} << 20U, kPage = 4096;
  void* const at = ::mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (at == MAP_FAILED) return false;
  (void)::madvise(at, kBytes, MADV_NOHUGEPAGE);
  const std::size_t before = own_bytes();
  const volatile char* const bytes = static_cast<const char*>(at);
  for (std::size_t n = 0; n < kBytes; n += kPage) (void)bytes[n];
  const bool takes = own_bytes() > before + kBytes / 2;
  ::munmap(at, kBytes);
  return takes;
}

}  // namespace tests
