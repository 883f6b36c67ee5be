// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/base/flush_to_zero.h"

#include <xmmintrin.h>

namespace hybrid {
namespace {

constexpr unsigned int kFlushAndZero = 0x8040U;  // FTZ and DAZ

}  // namespace

void set_flush_to_zero() noexcept {
  _mm_setcsr(_mm_getcsr() | kFlushAndZero);
}

ScopedFlushToZero::ScopedFlushToZero() noexcept : before_(_mm_getcsr()) {
  set_flush_to_zero();
}

ScopedFlushToZero::~ScopedFlushToZero() {
  _mm_setcsr(before_);
}

}  // namespace hybrid
