// SPDX-License-Identifier: GPL-3.0-or-later
// Triple buffer: wait-free transfer of the latest value from one thread to another.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace hybrid {

// The writer fills back() and publishes it. The reader takes the latest value. Neither waits, and the slots
// keep their capacity, so neither needs to allocate. std::atomic<std::shared_ptr> is not used, because it is
// not always lock-free.
template <class T>
class TripleBuffer {
 public:
  // ---- writer ----
  [[nodiscard]] T& back() { return slots_[back_]; }
  void publish() noexcept {
    back_ = middle_.exchange(static_cast<std::uint8_t>(back_ | kFresh), std::memory_order_acq_rel) & kIndex;
  }

  // ---- reader ----
  // The latest published value; the same as before if none is newer.
  [[nodiscard]] const T& take() noexcept {
    if ((middle_.load(std::memory_order_relaxed) & kFresh) != 0) {
      front_ = middle_.exchange(front_, std::memory_order_acq_rel) & kIndex;
    }
    return slots_[front_];
  }

 private:
  // middle_ holds the number of a slot, for which kIndex is the mask. The bit kFresh is set until the slot is
  // read.
  static constexpr std::uint8_t kFresh = 4, kIndex = 3;
  std::array<T, 3> slots_{};
  std::atomic<std::uint8_t> middle_{1};
  std::uint8_t back_ = 0, front_ = 2;
};

}  // namespace hybrid
