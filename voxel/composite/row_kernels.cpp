// SPDX-License-Identifier: GPL-3.0-or-later
// Smoothing and residual of a level (row_kernels.h).
#include "voxel/composite/row_kernels.h"

#include <array>

namespace voxel::composite {
namespace {

// A row of bounds that bound nothing.
const std::array<float, kMaxVectors* kLanes> kNoBoundRow = [] {
  std::array<float, kMaxVectors * kLanes> row{};
  row.fill(kNoBound);
  return row;
}();

// Share of the stiffness of links to active nodes that is passed to coarser levels. With a share of 1 a
// moving contact lags. With a share of a third the contact oscillates.
constexpr float kActiveStiffness = 0.5F;

// Masks of every second lane. even: from lane 0 on; odd: from lane 1 on.
struct Colours {
  Mask8 even, odd;
};
HYBRID_INLINE void find_colours(Colours& c) {
  c.even = Mask8{-1, 0, -1, 0, -1, 0, -1, 0};
  c.odd = Mask8{0, -1, 0, -1, 0, -1, 0, -1};
}

// kVectorsOfRow: vectors of a row. A constant number lets them stay in registers. 0: as many as the level
// has.
template <int kVectorsOfRow>
HYBRID_INLINE void smooth_row(const LevelView& v, int j, int k) {
  constexpr int kRoom = kVectorsOfRow == 0 ? kMaxVectors : kVectorsOfRow;
  const int vectors = kVectorsOfRow == 0 ? static_cast<int>(v.stride / kLanes) : kVectorsOfRow;
  const std::size_t row = static_cast<std::size_t>(k) * v.plane + static_cast<std::size_t>(j) * v.stride;
  float* const u = v.u + row;
  const float* const gy = v.weight[1] + row;
  const float* const gz = v.weight[2] + row;
  const float* const gx = v.weight[0] + row;
  const float* const lo = v.lower != nullptr ? v.lower + row : kNoBoundRow.data();
  const float* const hi = v.negated_upper != nullptr ? v.negated_upper + row : kNoBoundRow.data();
  const float* const inverse_of_row =
      v.inverse_with_active != nullptr ? v.inverse_with_active : v.inverse_diagonal;
  Float8 own[kRoom], force[kRoom];
  for (int o = 0; o < vectors; ++o) {
    const int at = o * kLanes;
    Float8 x, g, sum{};
    load(own[o], u + at);
    load(x, u + at - v.stride);
    load(g, gy + at - v.stride);
    sum = g * x;
    load(x, u + at + v.stride);
    load(g, gy + at);
    sum = v.spring[1] * (sum + g * x);
    Float8 other{};
    load(x, u + at - v.plane);
    load(g, gz + at - v.plane);
    other = g * x;
    load(x, u + at + v.plane);
    load(g, gz + at);
    force[o] = sum + v.spring[2] * (other + g * x);
    if (v.f != nullptr) {
      load(x, v.f + row + at);
      force[o] += x;
    }
  }
  Colours colours;
  find_colours(colours);
  for (int parity = 0; parity < 2; ++parity) {
    const Mask8& colour = parity == 0 ? colours.even : colours.odd;
    for (int o = 0; o < vectors; ++o) {
      const int at = o * kLanes;
      Float8 down, up, low, high, back, ahead, inverse;
      shift_down(down, own[o > 0 ? o - 1 : 0], own[o]);
      shift_up(up, own[o], own[o + 1 < vectors ? o + 1 : o]);
      load(back, gx + at - 1);
      load(ahead, gx + at);
      load(inverse, inverse_of_row + row + at);
      load(low, lo + at);
      load(high, hi + at);
      Float8 x = (force[o] + v.spring[0] * (back * down + ahead * up)) * inverse;
      x = x > low ? x : low;
      high = -high;
      x = x < high ? x : high;
      own[o] = (colour & (inverse > Float8{})) ? x : own[o];
    }
  }
  for (int o = 0; o < vectors; ++o) store(u + o * kLanes, own[o]);
}

template <int kVectorsOfRow>
HYBRID_INLINE void smooth(const LevelView& v) {
  for (int colour = 0; colour < 2; ++colour) {
    for (int k = v.first[2]; k <= v.last[2]; ++k) {
      const int from = v.first[1] + ((v.first[1] + k + colour) & 1);
      for (int j = from; j <= v.last[1]; j += 2) smooth_row<kVectorsOfRow>(v, j, k);
    }
  }
}

template <bool kLinksOnly>
HYBRID_INLINE void residual(const LevelView& v, const std::array<int, 3>& first,
                            const std::array<int, 3>& last) {
  const int vectors = static_cast<int>(v.stride / kLanes);
  for (int k = first[2]; k <= last[2]; ++k) {
    for (int j = first[1]; j <= last[1]; ++j) {
      const std::size_t row = static_cast<std::size_t>(k) * v.plane + static_cast<std::size_t>(j) * v.stride;
      const float* const u = v.u + row;
      const float *const gx = v.weight[0] + row, *const gy = v.weight[1] + row, *const gz = v.weight[2] + row;
      for (int o = 0; o < vectors; ++o) {
        const int at = o * kLanes;
        Float8 own, x, g, r, along, all, inverse;
        load(own, u + at);
        load(x, u + at - v.stride);
        load(g, gy + at - v.stride);
        r = g * x;
        load(x, u + at + v.stride);
        load(g, gy + at);
        r = v.spring[1] * (r + g * x);
        load(x, u + at - v.plane);
        load(g, gz + at - v.plane);
        along = g * x;
        load(x, u + at + v.plane);
        load(g, gz + at);
        r += v.spring[2] * (along + g * x);
        load(x, u + at - 1);
        load(g, gx + at - 1);
        along = g * x;
        load(x, u + at + 1);
        load(g, gx + at);
        r += v.spring[0] * (along + g * x);
        load(all, v.diagonal + row + at);
        load(inverse, v.inverse_diagonal + row + at);
        r -= all * own;
        const Float8 zero{};
        if constexpr (!kLinksOnly) {
          if (v.f != nullptr) {
            load(x, v.f + row + at);
            r += x;
          }
        }
        r = inverse > zero ? r : zero;
        if constexpr (!kLinksOnly) {
          const Float8 one = zero + 1.0F;
          Float8 is_free = inverse > zero ? one : zero, is_active{};
          if (v.lower != nullptr) {
            load(x, v.lower + row + at);
            const Mask8 held = (own <= x) & (r < zero);
            r = held ? zero : r;
            is_free = held ? zero : is_free;
            is_active = held ? one : is_active;
          }
          if (v.negated_upper != nullptr) {
            load(x, v.negated_upper + row + at);
            const Mask8 held = (own >= -x) & (r > zero);
            r = held ? zero : r;
            is_free = held ? zero : is_free;
            is_active = held ? one : is_active;
          }
          store(v.is_free + row + at, is_free);
          store(v.is_active + row + at, is_active);
        }
        store(v.residual + row + at, r);
      }
    }
  }
}

}  // namespace

HYBRID_MULTIVERSIONED void smooth_level(const LevelView& v) noexcept {
  switch (v.stride) {
    case 8:
      smooth<1>(v);
      break;
    case 16:
      smooth<2>(v);
      break;
    case 24:
      smooth<3>(v);
      break;
    case 32:
      smooth<4>(v);
      break;
    default:
      smooth<0>(v);
  }
}

HYBRID_MULTIVERSIONED void residual_of_level(const LevelView& v) noexcept {
  residual<false>(v, v.first, v.last);
}

HYBRID_MULTIVERSIONED void link_forces_of_level(const LevelView& v, const std::array<int, 3>& first,
                                                const std::array<int, 3>& last) noexcept {
  residual<true>(v, first, last);
}

HYBRID_MULTIVERSIONED void find_active_stiffness(const LevelView& v) noexcept {
  const int vectors = static_cast<int>(v.stride / kLanes);
  for (int k = v.first[2]; k <= v.last[2]; ++k) {
    for (int j = v.first[1]; j <= v.last[1]; ++j) {
      const std::size_t row = static_cast<std::size_t>(k) * v.plane + static_cast<std::size_t>(j) * v.stride;
      for (int o = 0; o < vectors; ++o) {
        const std::size_t at = row + static_cast<std::size_t>(o * kLanes);
        Float8 x, g, sum, to_active{}, own;
        const std::array<std::size_t, 3> by{1, v.stride, v.plane};
        for (std::size_t d = 0; d < 3; ++d) {
          load(x, v.is_active + at - by[d]);
          load(g, v.weight[d] + at - by[d]);
          sum = g * x;
          load(x, v.is_active + at + by[d]);
          load(g, v.weight[d] + at);
          to_active += v.spring[d] * (sum + g * x);
        }
        load(own, v.active_stiffness + at);
        load(x, v.is_free + at);
        store(v.active_stiffness + at, x * (own + kActiveStiffness * to_active));
      }
    }
  }
}

HYBRID_MULTIVERSIONED void add_active_stiffness(const LevelView& v, float* f) noexcept {
  const int vectors = static_cast<int>(v.stride / kLanes);
  for (int k = v.first[2]; k <= v.last[2]; ++k) {
    for (int j = v.first[1]; j <= v.last[1]; ++j) {
      const std::size_t row = static_cast<std::size_t>(k) * v.plane + static_cast<std::size_t>(j) * v.stride;
      for (int o = 0; o < vectors; ++o) {
        const std::size_t at = row + static_cast<std::size_t>(o * kLanes);
        Float8 active_stiffness, own, load_f, all, inverse;
        load(active_stiffness, v.active_stiffness + at);
        load(own, v.u + at);
        load(load_f, f + at);
        load(all, v.diagonal + at);
        load(inverse, v.inverse_diagonal + at);
        store(f + at, load_f + active_stiffness * own);
        const Float8 zero{}, one = zero + 1.0F;
        Float8 sum = all + active_stiffness;
        sum = inverse > zero ? sum : one;
        const Float8 with = one / sum;
        store(v.inverse_with_active + at, inverse > zero ? with : zero);
      }
    }
  }
}

}  // namespace voxel::composite
