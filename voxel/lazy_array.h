// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <sys/mman.h>

#include <algorithm>
#include <cstddef>
#include <new>
#include <type_traits>
#include <utility>

namespace voxel {

// A fixed number of zeros that take memory only where something was written (a page at a time, by the
// operating system): untouched tissue costs address space and nothing else. A table of bricks in our own
// hands was rejected: one more indirection in every inner loop, for what the memory unit does anyway.
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
    // Huge pages would take 2 MiB for one voxel. Not every kernel has them, so a refusal is no error.
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

  // Gives every page its memory now: what a first touch of each takes (about a microsecond) is then not taken
  // from a tick.
  void populate() noexcept;
  // Memory that the pages written so far take (unit: byte).
  [[nodiscard]] std::size_t resident_bytes() const;
  // Copies what `other`, of the same size, holds; pages that hold nothing stay untouched.
  void copy_from(const LazyArray& other) noexcept;

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

void populate(void* at, std::size_t bytes) noexcept;
// How many bytes of `bytes` from `at` (a mapping) are in memory.
[[nodiscard]] std::size_t resident_bytes(const void* at, std::size_t bytes);
// Copies only pages of `from` that are in memory. Both are mappings of `bytes`.
void copy_resident(void* to, const void* from, std::size_t bytes) noexcept;

template <class T>
std::size_t LazyArray<T>::resident_bytes() const {
  return data_ == nullptr ? 0 : voxel::resident_bytes(data_, size_ * sizeof(T));
}

template <class T>
void LazyArray<T>::populate() noexcept {
  if (data_ != nullptr) voxel::populate(data_, size_ * sizeof(T));
}

template <class T>
void LazyArray<T>::copy_from(const LazyArray& other) noexcept {
  if (data_ != nullptr) copy_resident(data_, other.data_, size_ * sizeof(T));
}

}  // namespace voxel
