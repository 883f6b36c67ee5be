// SPDX-License-Identifier: GPL-3.0-or-later
// Avoids denormal numbers, which slow a processor down.
#pragma once

namespace hybrid {

// Switches flush-to-zero on for the calling thread.
void set_flush_to_zero() noexcept;
// Switches flush-to-zero on during the life of the object, for a thread that belongs to a driver.
class ScopedFlushToZero {
 public:
  ScopedFlushToZero() noexcept;
  ~ScopedFlushToZero();
  ScopedFlushToZero(const ScopedFlushToZero&) = delete;
  ScopedFlushToZero& operator=(const ScopedFlushToZero&) = delete;
  ScopedFlushToZero(ScopedFlushToZero&&) = delete;
  ScopedFlushToZero& operator=(ScopedFlushToZero&&) = delete;

 private:
  unsigned int before_;
};

}  // namespace hybrid
