// SPDX-License-Identifier: GPL-3.0-or-later
// Arrays whose memory the operating system provides page by page, where they are written.
//
// Untouched elements are zero and cost address space only. Copies and memory counts skip untouched pages.
#pragma once

#include <sys/mman.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

namespace voxel {

// A fixed number of elements, zero at first. Element access has no indirection: the memory management unit
// does the page look-up.
template <class T>
class LazyArray {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  LazyArray() = default;
  // Throws std::bad_alloc when the address space is used up.
  explicit LazyArray(std::size_t count) : size_(count) {
    if (count == 0) return;
    void* at = ::mmap(nullptr, count * sizeof(T), PROT_READ | PROT_WRITE,
                      MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (at == MAP_FAILED) throw std::bad_alloc();
    // A huge page would take 2 MiB for one voxel. A kernel without huge pages refuses the call, which is no
    // error.
    (void)::madvise(at, count * sizeof(T), MADV_NOHUGEPAGE);
    data_ = static_cast<T*>(at);
  }
  LazyArray(LazyArray&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), size_(std::exchange(other.size_, 0)) {}
  LazyArray& operator=(LazyArray&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    return *this;
  }
  LazyArray(const LazyArray& other) : LazyArray(other.size_) { copy_from(other); }
  LazyArray& operator=(const LazyArray& other) {
    if (this != &other) *this = LazyArray(other);
    return *this;
  }
  ~LazyArray() {
    if (data_ != nullptr) ::munmap(data_, size_ * sizeof(T));
  }

  [[nodiscard]] T& operator[](std::size_t i) noexcept { return data_[i]; }
  [[nodiscard]] const T& operator[](std::size_t i) const noexcept { return data_[i]; }
  [[nodiscard]] T* data() noexcept { return data_; }
  [[nodiscard]] const T* data() const noexcept { return data_; }
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] T* begin() noexcept { return data_; }
  [[nodiscard]] T* end() noexcept { return data_ + size_; }
  [[nodiscard]] const T* begin() const noexcept { return data_; }
  [[nodiscard]] const T* end() const noexcept { return data_ + size_; }

  friend bool operator==(const LazyArray& a, const LazyArray& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end());
  }

  // Touches every page now, so that a tick does not pay for the page faults (about a microsecond each).
  void populate() noexcept;
  // Touches some chunks only: chunk n (values n·each to (n + 1)·each − 1) if wanted[n] is true. Values on the
  // same pages are touched too.
  void populate(std::size_t each, const std::vector<bool>& wanted) noexcept;
  // Bytes of pages that were written so far; pages that were only read take no memory.
  [[nodiscard]] std::size_t resident_bytes() const;
  // Copies `other`, which has the same size. Its untouched pages are skipped, so this array must be zero
  // there.
  void copy_from(const LazyArray& other) noexcept;

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

void populate(void* at, std::size_t bytes) noexcept;
// Returns the whole pages of a range to the system; they read as zeros afterwards. Use it for memory that
// nothing but its owner's destructor still needs.
void give_back(void* at, std::size_t bytes) noexcept;
// Number of bytes in [at, at + bytes) whose pages take memory of their own. Pages that were only read do not:
// they all map the one page of zeros.
[[nodiscard]] std::size_t resident_bytes(const void* at, std::size_t bytes);
// Copies the touched pages of `from`. Both are mappings of `bytes`; `to` contains zeros.
void copy_resident(void* to, const void* from, std::size_t bytes) noexcept;

// Allocator for vectors with a large capacity that is mostly unused. Large blocks are mappings of their own:
// malloc() may reuse freed blocks, whose pages already take memory.
template <class T>
struct LazyAllocator {
  using value_type = T;
  LazyAllocator() = default;
  template <class Other>
  LazyAllocator(const LazyAllocator<Other>&) noexcept {
  }  // NOLINT(google-explicit-constructor): an allocator's

  [[nodiscard]] T* allocate(std::size_t count) {
    if (count * sizeof(T) < kLeast) return std::allocator<T>().allocate(count);
    void* at = ::mmap(nullptr, count * sizeof(T), PROT_READ | PROT_WRITE,
                      MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (at == MAP_FAILED) throw std::bad_alloc();
    (void)::madvise(at, count * sizeof(T), MADV_NOHUGEPAGE);
    return static_cast<T*>(at);
  }
  void deallocate(T* at, std::size_t count) noexcept {
    if (count * sizeof(T) < kLeast) {
      std::allocator<T>().deallocate(at, count);
    } else {
      ::munmap(at, count * sizeof(T));
    }
  }
  template <class Other>
  bool operator==(const LazyAllocator<Other>&) const noexcept {
    return true;
  }

 private:
  static constexpr std::size_t kLeast = std::size_t{1} << 16U;  // bytes
};
template <class T>
using LazyVector = std::vector<T, LazyAllocator<T>>;

// Bytes of a vector's capacity that take memory; untouched capacity takes none.
template <class T, class Allocator>
[[nodiscard]] std::size_t resident_bytes(const std::vector<T, Allocator>& v) {
  return resident_bytes(v.data(), v.capacity() * sizeof(T));
}

template <class T>
std::size_t LazyArray<T>::resident_bytes() const {
  return data_ == nullptr ? 0 : voxel::resident_bytes(data_, size_ * sizeof(T));
}

template <class T>
void LazyArray<T>::populate() noexcept {
  if (data_ != nullptr) voxel::populate(data_, size_ * sizeof(T));
}

template <class T>
void LazyArray<T>::populate(std::size_t each, const std::vector<bool>& wanted) noexcept {
  const std::size_t parts = std::min(wanted.size(), size_ / each);
  for (std::size_t n = 0, end = 0; n < parts; n = end + 1) {
    for (end = n; end < parts && wanted[end];) ++end;
    if (end > n) voxel::populate(data_ + n * each, (end - n) * each * sizeof(T));
  }
}

template <class T>
void LazyArray<T>::copy_from(const LazyArray& other) noexcept {
  if (data_ != nullptr) copy_resident(data_, other.data_, size_ * sizeof(T));
}

}  // namespace voxel
