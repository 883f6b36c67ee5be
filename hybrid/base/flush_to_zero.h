// SPDX-License-Identifier: GPL-3.0-or-later
// Denormals: numbers so small that a processor takes much longer for them.
#pragma once

namespace hybrid {

// Flush-to-zero on the calling thread.
void flush_denormals() noexcept;
// The same while it lives: on a thread that is the driver's.
class FlushedDenormals {
 public:
  FlushedDenormals() noexcept;
  ~FlushedDenormals();
  FlushedDenormals(const FlushedDenormals&) = delete;
  FlushedDenormals& operator=(const FlushedDenormals&) = delete;
  FlushedDenormals(FlushedDenormals&&) = delete;
  FlushedDenormals& operator=(FlushedDenormals&&) = delete;

 private:
  unsigned int before_;
};

}  // namespace hybrid
