// SPDX-License-Identifier: GPL-3.0-or-later
// The functions of lanes8.h for AVX-512: registers of 16 floats, and comparisons that give a mask. This
// halves the operations on a row. A single test shows whether any lane moves. Results are the same to the
// last bit. The functions are written in intrinsics, because the compiler's generic vectors of 16 are
// slower than those of 8.
#pragma once

#include "voxel/chain/lanes8.h"

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define HYBRID_LANES16 1
#include <immintrin.h>

#define HYBRID_TARGET_512 __attribute__((target("arch=x86-64-v4")))
#define HYBRID_INLINE_512 inline __attribute__((always_inline, target("arch=x86-64-v4")))

namespace voxel::lanes16 {

using lanes8::exceeds;
using lanes8::required_value;

constexpr std::size_t kWidth = 16, kVectors = kRow / kWidth;
using Floats = float __attribute__((vector_size(4 * kWidth)));
using Masks = __mmask16;
// Intrinsics are used in their masked forms, because GCC 12 warns of its own headers for the unmasked ones.
constexpr Masks kAllLanes = 0xFFFF;

// Does this processor have AVX-512, and does the system save its registers?
inline bool has_lanes16() {
  return __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512bw") != 0 &&
         __builtin_cpu_supports("avx512dq") != 0 && __builtin_cpu_supports("avx512vl") != 0 &&
         __builtin_cpu_supports("avx512cd") != 0 && __builtin_cpu_supports("bmi2") != 0;
}

HYBRID_INLINE_512 void load(const float* at, Floats& out) {
  out = _mm512_loadu_ps(at);
}
HYBRID_INLINE_512 void store(const Floats& value, float* at) {
  _mm512_storeu_ps(at, value);
}
HYBRID_INLINE_512 void broadcast(float value, Floats& out) {
  out = _mm512_set1_ps(value);
}
template <std::size_t kBy>
HYBRID_INLINE_512 void shift_up_by(const Floats& before, const Floats& value, Floats& out) {
  static_assert(kBy < kWidth);
  if constexpr (kBy == 0)
    out = value;
  else
    out = _mm512_castsi512_ps(_mm512_maskz_alignr_epi32(kAllLanes, _mm512_castps_si512(value),
                                                        _mm512_castps_si512(before), kWidth - kBy));
}
template <std::size_t kBy>
HYBRID_INLINE_512 void shift_down_by(const Floats& value, const Floats& after, Floats& out) {
  static_assert(kBy < kWidth);
  if constexpr (kBy == 0)
    out = value;
  else
    out = _mm512_castsi512_ps(
        _mm512_maskz_alignr_epi32(kAllLanes, _mm512_castps_si512(after), _mm512_castps_si512(value), kBy));
}
HYBRID_INLINE_512 void select(const Masks& mask, const Floats& there, const Floats& elsewhere, Floats& out) {
  out = _mm512_mask_blend_ps(mask, elsewhere, there);
}
HYBRID_INLINE_512 bool any_of(const Masks& mask) {
  return mask != 0;
}

struct Table {
  const float* values;
  Floats low;
  HYBRID_INLINE_512 explicit Table(const float* table) : values(table), low(_mm512_loadu_ps(table)) {}
};

using Integers = std::int32_t __attribute__((vector_size(4 * kWidth)));
struct Indices {
  std::array<Integers, kVectors> at;
  HYBRID_INLINE_512 explicit Indices(const std::uint8_t* labels) {
#pragma GCC unroll 2
    for (std::size_t n = 0; n < kVectors; ++n) {
      const __m128i bytes = _mm_loadu_si128(reinterpret_cast<const __m128i*>(labels + n * kWidth));
      at[n] = reinterpret_cast<Integers>(_mm512_maskz_cvtepu8_epi32(kAllLanes, bytes));
    }
  }
};

template <int kRegisters>
HYBRID_INLINE_512 void look_up(const Table& table, const Indices& indices, std::size_t i, Floats& out) {
  const auto index = reinterpret_cast<__m512i>(indices.at[i / kWidth]);
  out = kRegisters > 0 ? _mm512_maskz_permutexvar_ps(kAllLanes, index, table.low)
                       : _mm512_mask_i32gather_ps(Floats{}, kAllLanes, index, table.values, 4);
}

template <bool kRaise>
HYBRID_INLINE_512 void require(const Floats& from, const Floats& limit, Floats& required) {
  required = kRaise ? from - limit : from + limit;
}
template <bool kRaise>
HYBRID_INLINE_512 void take_stronger(const Floats& required, Floats& now) {
  now =
      kRaise ? _mm512_maskz_max_ps(kAllLanes, required, now) : _mm512_maskz_min_ps(kAllLanes, required, now);
}
template <bool kRaise>
HYBRID_INLINE_512 void compare(const Floats& required, const Floats& now, float margin, Masks& moves) {
  moves = kRaise ? _mm512_cmp_ps_mask(required, now + margin, _CMP_GT_OQ)
                 : _mm512_cmp_ps_mask(required, now - margin, _CMP_LT_OQ);
}
HYBRID_INLINE_512 Moved moved(const Masks& front, const Masks& back) {
  return static_cast<Moved>(kAnyMoved | ((front & 1U) != 0 ? kFirstMoved : 0) |
                            ((back >> (kWidth - 1)) != 0 ? kLastMoved : 0));
}

}  // namespace voxel::lanes16
#endif
