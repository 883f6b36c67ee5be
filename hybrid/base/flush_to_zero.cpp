// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/base/flush_to_zero.h"

#include <xmmintrin.h>

namespace hybrid {
namespace {

constexpr unsigned int kFlushAndZero = 0x8040U;  // FTZ and DAZ

}  // namespace

void flush_denormals() noexcept {
  _mm_setcsr(_mm_getcsr() | kFlushAndZero);
}

FlushedDenormals::FlushedDenormals() noexcept : before_(_mm_getcsr()) {
  flush_denormals();
}

FlushedDenormals::~FlushedDenormals() {
  _mm_setcsr(before_);
}

}  // namespace hybrid
