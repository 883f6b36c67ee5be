// SPDX-License-Identifier: GPL-3.0-or-later
// An allocator for large arrays with random access, on pages of 2 MB if the system has them. With pages of 4
// kB nearly every access also misses the TLB. In a virtual machine the page walk then goes through two page
// tables.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <new>

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace hybrid {

template <class T>
struct HugePages {
  using value_type = T;
  HugePages() = default;
  template <class Other>
  HugePages(const HugePages<Other>&) noexcept {}  // NOLINT(google-explicit-constructor): as allocators need

  [[nodiscard]] T* allocate(std::size_t count) {
    const std::size_t bytes = count * sizeof(T);
    if (bytes < kLeast) return static_cast<T*>(::operator new(bytes, kSmall));
    void* at = ::operator new(bytes, kLarge);
#ifdef MADV_HUGEPAGE
    // Whole pages only: memory behind the array belongs to others. The system may refuse the advice.
    (void)::madvise(at, bytes / kPage * kPage, MADV_HUGEPAGE);
#endif
    return static_cast<T*>(at);
  }
  void deallocate(T* at, std::size_t count) noexcept {
    ::operator delete(at, count * sizeof(T) < kLeast ? kSmall : kLarge);
  }
  template <class Other>
  bool operator==(const HugePages<Other>&) const noexcept {
    return true;
  }

 private:
  // Bytes of a huge page, and of the smallest array that gets such pages.
  static constexpr std::size_t kPage = std::size_t{1} << 21, kLeast = 2 * kPage;
  // Alignment of smaller and of larger arrays.
  static constexpr std::align_val_t kSmall{alignof(T) < 64 ? 64 : alignof(T)}, kLarge{kPage};
};

}  // namespace hybrid
