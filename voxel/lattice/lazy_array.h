// SPDX-License-Identifier: GPL-3.0-or-later
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
  // The same of those parts of `each` values, one after the other, that are `wanted`, and of what shares a
  // page with them.
  void populate(std::size_t each, const std::vector<bool>& wanted) noexcept;
  // Memory that what was written so far takes (unit: byte); what was only read takes none.
  [[nodiscard]] std::size_t resident_bytes() const;
  // Copies what `other`, of the same size, holds; pages that hold nothing stay untouched.
  void copy_from(const LazyArray& other) noexcept;

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

void populate(void* at, std::size_t bytes) noexcept;
// What is there is not needed any more, but for its destructor: whole pages go back to the system, and read
// as zeros.
void give_back(void* at, std::size_t bytes) noexcept;
// How many of `bytes` from `at` on take memory of their own. A page that was only read does not: all such
// pages are the same one, of zeros.
[[nodiscard]] std::size_t resident_bytes(const void* at, std::size_t bytes);
// Copies only pages of `from` that hold anything. Both are mappings of `bytes`, `to` of zeros.
void copy_resident(void* to, const void* from, std::size_t bytes) noexcept;

// For vectors that have room for the most there can ever be, and mostly hold next to nothing: theirs is
// address space of their own. From the C library they get, once larger ones were freed, what those had
// written to.
template <class T>
struct LazyRoom {
  using value_type = T;
  LazyRoom() = default;
  template <class Other>
  LazyRoom(const LazyRoom<Other>&) noexcept {}  // NOLINT(google-explicit-constructor): an allocator's

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
  bool operator==(const LazyRoom<Other>&) const noexcept {
    return true;
  }

 private:
  static constexpr std::size_t kLeast = std::size_t{1} << 16U;  // bytes
};
template <class T>
using LazyVector = std::vector<T, LazyRoom<T>>;

// Of what a vector has room for, what takes memory: room that is reserved and not used does not.
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
