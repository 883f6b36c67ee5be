// SPDX-License-Identifier: GPL-3.0-or-later
// A bounded queue from one thread to one other thread. Neither side waits, locks or allocates.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

namespace hybrid {

// A full queue refuses new values and counts them. The reader sees all accepted values, in order.
template <class T>
class SpscRing {
 public:
  static_assert(std::is_trivially_copyable_v<T>, "a value is copied without calls");

  explicit SpscRing(std::size_t capacity) : slots_(capacity + 1) {}

  // ---- writer ----
  bool push(const T& value) noexcept {
    const std::size_t at = written_.load(std::memory_order_relaxed), next = after(at);
    if (next == read_.load(std::memory_order_acquire)) {
      refused_.fetch_add(1, std::memory_order_relaxed);
      return false;
    }
    slots_[at] = value;
    written_.store(next, std::memory_order_release);
    return true;
  }

  // ---- reader ----
  bool pop(T& value) noexcept {
    const std::size_t at = read_.load(std::memory_order_relaxed);
    if (at == written_.load(std::memory_order_acquire)) return false;
    value = slots_[at];
    read_.store(after(at), std::memory_order_release);
    return true;
  }

  // Number of values that were refused so far. Either side may call it.
  [[nodiscard]] std::uint64_t refused() const noexcept { return refused_.load(std::memory_order_relaxed); }

 private:
  [[nodiscard]] std::size_t after(std::size_t slot) const noexcept {
    return slot + 1 == slots_.size() ? 0 : slot + 1;
  }
  std::vector<T> slots_;  // one slot stays empty, which tells a full queue from an empty one
  alignas(64) std::atomic<std::size_t> written_{0};
  alignas(64) std::atomic<std::size_t> read_{0};
  alignas(64) std::atomic<std::uint64_t> refused_{0};
};

}  // namespace hybrid
