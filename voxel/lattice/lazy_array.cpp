// SPDX-License-Identifier: GPL-3.0-or-later
// Residency of pages: touching, returning, counting and copying them (Linux, /proc/self/pagemap).
#include "voxel/lattice/lazy_array.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>

namespace voxel {
namespace {

constexpr std::size_t kPagesAtOnce = 4096;  // entries of the page map that are read at once

std::size_t page_bytes() {
  static const auto bytes = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  return bytes;
}

// Page table entries of this process. The file is opened for each query, because a descriptor inherited
// through fork() would still describe the parent.
class PageMap {
 public:
  // mincore() is unsuitable: it counts pages that were only read and omits pages that are swapped out, so
  // copies would lose the contents of swapped pages.
  using Entries = std::array<std::uint64_t, kPagesAtOnce>;
  // bits of an entry of /proc/self/pagemap
  static constexpr std::uint64_t kPresent = 1ULL << 63U, kSwapped = 1ULL << 62U, kMappedOnce = 1ULL << 56U;

  PageMap() : file_(::open("/proc/self/pagemap", O_RDONLY | O_CLOEXEC)) {}
  PageMap(const PageMap&) = delete;
  PageMap& operator=(const PageMap&) = delete;
  ~PageMap() {
    if (file_ >= 0) ::close(file_);
  }

  // False: the system gives no information.
  [[nodiscard]] bool read(std::size_t first, std::size_t count, Entries& out) const noexcept {
    const auto bytes = static_cast<ssize_t>(count * sizeof(std::uint64_t));
    const auto from = static_cast<off_t>(first * sizeof(std::uint64_t));
    return file_ >= 0 && ::pread(file_, out.data(), count * sizeof(std::uint64_t), from) == bytes;
  }

 private:
  int file_;
};

bool all_zero(const char* at, std::size_t bytes) {
  return bytes == 0 || (at[0] == 0 && std::memcmp(at, at + 1, bytes - 1) == 0);
}

// Calls `visit(offset, bytes)` for the pages of the range that take memory of their own, or for the parts of
// such pages in the range. Reading an untouched page maps the shared page of zeros. Page table entries do not
// distinguish this page from one that is shared with a child process. So a shared page is visited only if it
// contains anything but zeros. Without information from the system all pages are treated like shared ones,
// and written pages of zeros are skipped.
template <class Visit>
void for_resident(const void* at, std::size_t bytes, const Visit& visit) {
  const PageMap map;
  PageMap::Entries entries{};
  const std::size_t page = page_bytes(), begin = reinterpret_cast<std::uintptr_t>(at), end = begin + bytes;
  for (std::size_t first = begin / page; first * page < end; first += kPagesAtOnce) {
    const std::size_t count = std::min(kPagesAtOnce, (end - 1) / page + 1 - first);
    const bool told = map.read(first, count, entries);
    for (std::size_t p = 0; p < count; ++p) {
      const std::uint64_t entry = entries[p];
      if (told && (entry & (PageMap::kPresent | PageMap::kSwapped)) == 0) continue;
      const std::size_t from = std::max(begin, (first + p) * page) - begin,
                        to = std::min(end, (first + p + 1) * page) - begin;
      const bool own = told && (entry & (PageMap::kSwapped | PageMap::kMappedOnce)) != 0;
      if (own || !all_zero(static_cast<const char*>(at) + from, to - from)) visit(from, to - from);
    }
  }
}

}  // namespace

void populate(void* at, std::size_t bytes) noexcept {
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  auto* bytes_at = static_cast<volatile std::uint8_t*>(at);
  if (bytes == 0) return;
  for (std::size_t n = 0; n < bytes; n += page) bytes_at[n] = bytes_at[n];
  bytes_at[bytes - 1] = bytes_at[bytes - 1];  // a range that starts within a page may end in one more page
}

void give_back(void* at, std::size_t bytes) noexcept {
  const std::size_t page = page_bytes(), begin = reinterpret_cast<std::uintptr_t>(at);
  const std::size_t from = (begin + page - 1) / page * page - begin,
                    to = (begin + bytes) / page * page - begin;
  if (to > from && to <= bytes) (void)::madvise(static_cast<char*>(at) + from, to - from, MADV_DONTNEED);
}

std::size_t resident_bytes(const void* at, std::size_t bytes) {
  std::size_t sum = 0;
  if (bytes > 0) for_resident(at, bytes, [&](std::size_t, std::size_t held) { sum += held; });
  return sum;
}

void copy_resident(void* to, const void* from, std::size_t bytes) noexcept {
  if (bytes == 0) return;
  for_resident(from, bytes, [&](std::size_t offset, std::size_t held) {
    std::memcpy(static_cast<char*>(to) + offset, static_cast<const char*>(from) + offset, held);
  });
}

}  // namespace voxel
