// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/lazy_array.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>

namespace voxel {
namespace {

constexpr std::size_t kPagesAtOnce = 4096;

std::size_t page_bytes() {
  static const auto bytes = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  return bytes;
}

// Calls `visit(offset, bytes, resident)` for pieces of the mapping of at most kPagesAtOnce pages, with one
// byte a page that says whether it is in memory. Where the system cannot tell, all of them are.
template <class Visit>
void look(const void* at, std::size_t bytes, const Visit& visit) {
  std::array<unsigned char, kPagesAtOnce> resident{};
  const std::size_t page = page_bytes();
  for (std::size_t offset = 0; offset < bytes; offset += kPagesAtOnce * page) {
    const std::size_t piece = std::min(bytes - offset, kPagesAtOnce * page);
    auto* begin = const_cast<char*>(static_cast<const char*>(at)) + offset;
    if (::mincore(begin, piece, resident.data()) != 0) resident.fill(1);
    visit(offset, piece, resident);
  }
}

}  // namespace

void populate(void* at, std::size_t bytes) noexcept {
  const auto page = static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
  auto* bytes_at = static_cast<volatile std::uint8_t*>(at);
  for (std::size_t n = 0; n < bytes; n += page) bytes_at[n] = bytes_at[n];
}

std::size_t resident_bytes(const void* at, std::size_t bytes) {
  std::size_t sum = 0;
  const std::size_t page = page_bytes();
  look(at, bytes, [&](std::size_t, std::size_t piece, const auto& resident) {
    for (std::size_t p = 0; p * page < piece; ++p) {
      if ((resident[p] & 1U) != 0) sum += std::min(page, piece - p * page);
    }
  });
  return sum;
}

void copy_resident(void* to, const void* from, std::size_t bytes) noexcept {
  const std::size_t page = page_bytes();
  look(from, bytes, [&](std::size_t offset, std::size_t piece, const auto& resident) {
    for (std::size_t p = 0; p * page < piece; ++p) {
      if ((resident[p] & 1U) == 0) continue;
      const std::size_t start = offset + p * page;
      std::memcpy(static_cast<char*>(to) + start, static_cast<const char*>(from) + start,
                  std::min(page, piece - p * page));
    }
  });
}

}  // namespace voxel
