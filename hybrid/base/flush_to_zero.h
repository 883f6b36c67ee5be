// SPDX-License-Identifier: GPL-3.0-or-later
// Avoids denormal numbers, which slow a processor down.
#pragma once

namespace hybrid {

// Flush-to-zero on the calling thread.
void set_flush_to_zero() noexcept;
// The same for the lifetime of the object: for a thread that belongs to the driver.
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
