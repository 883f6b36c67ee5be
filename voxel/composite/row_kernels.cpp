// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/composite/row_kernels.h"

#include <algorithm>

namespace voxel::composite {
namespace {

// A row that bounds nothing.
const std::array<float, kMaxOctets* kOctet> kNoBoundRow = [] {
  std::array<float, kMaxOctets * kOctet> row{};
  row.fill(kNoBound);
  return row;
}();

// Of what ties nodes to stuck ones: with all of it a contact that moves lags, with a third it wavers.
constexpr float kActiveStiffness = 0.5F;

// In a cycle a link gets this much stiffer at most, or softer.
constexpr float kMaxCycleFactor = 2.0F, kMinCycleFactor = 0.25F;

// Of a correction, what is too far: from where on its energy is more than without it, and taken back at most.
constexpr double kMinOvershoot = 0.5, kMaxShortening = 0.9;

// Lanes of every second node, beginning with the first, with the second.
struct Colours {
  OctetMask even, odd;
};
HYBRID_INLINE void find_colours(Colours& c) {
  c.even = OctetMask{-1, 0, -1, 0, -1, 0, -1, 0};
  c.odd = OctetMask{0, -1, 0, -1, 0, -1, 0, -1};
}

// `kOctetsOfRow` 0: as many as the row has.
template <int kOctetsOfRow>
HYBRID_INLINE void smooth_row(const LevelView& v, int j, int k) {
  constexpr int kRoom = kOctetsOfRow == 0 ? kMaxOctets : kOctetsOfRow;
  const int octets = kOctetsOfRow == 0 ? static_cast<int>(v.stride / kOctet) : kOctetsOfRow;
  const std::size_t row = static_cast<std::size_t>(k) * v.plane + static_cast<std::size_t>(j) * v.stride;
  float* const u = v.u + row;
  const float* const gy = v.link[1] + row;
  const float* const gz = v.link[2] + row;
  const float* const gx = v.link[0] + row;
  const float* const lo = v.least != nullptr ? v.least + row : kNoBoundRow.data();
  const float* const hi = v.most_negative != nullptr ? v.most_negative + row : kNoBoundRow.data();
  const float* const of_all = v.inverse_with_active != nullptr ? v.inverse_with_active : v.inverse;
  Octet own[kRoom], pull[kRoom];
  for (int o = 0; o < octets; ++o) {
    const int at = o * kOctet;
    Octet x, g, sum{};
    load(own[o], u + at);
    load(x, u + at - v.stride);
    load(g, gy + at - v.stride);
    sum = g * x;
    load(x, u + at + v.stride);
    load(g, gy + at);
    sum = v.spring[1] * (sum + g * x);
    Octet other{};
    load(x, u + at - v.plane);
    load(g, gz + at - v.plane);
    other = g * x;
    load(x, u + at + v.plane);
    load(g, gz + at);
    pull[o] = sum + v.spring[2] * (other + g * x);
    if (v.f != nullptr) {
      load(x, v.f + row + at);
      pull[o] += x;
    }
  }
  Colours colours;
  find_colours(colours);
  for (int parity = 0; parity < 2; ++parity) {
    const OctetMask& colour = parity == 0 ? colours.even : colours.odd;
    for (int o = 0; o < octets; ++o) {
      const int at = o * kOctet;
      Octet down, up, low, high, back, ahead, inverse;
      shift_down(down, own[o > 0 ? o - 1 : 0], own[o]);
      shift_up(up, own[o], own[o + 1 < octets ? o + 1 : o]);
      load(back, gx + at - 1);
      load(ahead, gx + at);
      load(inverse, of_all + row + at);
      load(low, lo + at);
      load(high, hi + at);
      Octet x = (pull[o] + v.spring[0] * (back * down + ahead * up)) * inverse;
      x = x > low ? x : low;
      high = -high;
      x = x < high ? x : high;
      own[o] = (colour & (inverse > Octet{})) ? x : own[o];
    }
  }
  for (int o = 0; o < octets; ++o) store(u + o * kOctet, own[o]);
}

template <int kOctetsOfRow>
HYBRID_INLINE void smooth(const LevelView& v) {
  for (int colour = 0; colour < 2; ++colour) {
    for (int k = v.first[2]; k <= v.last[2]; ++k) {
      const int from = v.first[1] + ((v.first[1] + k + colour) & 1);
      for (int j = from; j <= v.last[1]; j += 2) smooth_row<kOctetsOfRow>(v, j, k);
    }
  }
}

template <bool kLinks>
HYBRID_INLINE void residual(const LevelView& v, const std::array<int, 3>& first, const std::array<int, 3>& last) {
  const int octets = static_cast<int>(v.stride / kOctet);
  for (int k = first[2]; k <= last[2]; ++k) {
    for (int j = first[1]; j <= last[1]; ++j) {
      const std::size_t row = static_cast<std::size_t>(k) * v.plane + static_cast<std::size_t>(j) * v.stride;
      const float* const u = v.u + row;
      const float *const gx = v.link[0] + row, *const gy = v.link[1] + row, *const gz = v.link[2] + row;
      for (int o = 0; o < octets; ++o) {
        const int at = o * kOctet;
        Octet own, x, g, r, along, all, inverse;
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
        load(all, v.all + row + at);
        load(inverse, v.inverse + row + at);
        r -= all * own;
        const Octet zero{};
        if constexpr (!kLinks) {
          if (v.f != nullptr) {
            load(x, v.f + row + at);
            r += x;
          }
        }
        r = inverse > zero ? r : zero;
        if constexpr (!kLinks) {
          const Octet one = zero + 1.0F;
          Octet is_free = inverse > zero ? one : zero, is_active{};
          if (v.least != nullptr) {
            load(x, v.least + row + at);
            const OctetMask held = (own <= x) & (r < zero);
            r = held ? zero : r;
            is_free = held ? zero : is_free;
            is_active = held ? one : is_active;
          }
          if (v.most_negative != nullptr) {
            load(x, v.most_negative + row + at);
            const OctetMask held = (own >= -x) & (r > zero);
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

HYBRID_WIDE void smooth_level(const LevelView& v) noexcept {
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

HYBRID_WIDE void residual_of_level(const LevelView& v) noexcept {
  residual<false>(v, v.first, v.last);
}

HYBRID_WIDE void link_forces_of_level(const LevelView& v, const std::array<int, 3>& first,
                                const std::array<int, 3>& last) noexcept {
  residual<true>(v, first, last);
}

HYBRID_WIDE void find_active_stiffness(const LevelView& v) noexcept {
  const int octets = static_cast<int>(v.stride / kOctet);
  for (int k = v.first[2]; k <= v.last[2]; ++k) {
    for (int j = v.first[1]; j <= v.last[1]; ++j) {
      const std::size_t row = static_cast<std::size_t>(k) * v.plane + static_cast<std::size_t>(j) * v.stride;
      for (int o = 0; o < octets; ++o) {
        const std::size_t at = row + static_cast<std::size_t>(o * kOctet);
        Octet x, g, sum, ties{}, own;
        const std::array<std::size_t, 3> by{1, v.stride, v.plane};
        for (std::size_t d = 0; d < 3; ++d) {
          load(x, v.is_active + at - by[d]);
          load(g, v.link[d] + at - by[d]);
          sum = g * x;
          load(x, v.is_active + at + by[d]);
          load(g, v.link[d] + at);
          ties += v.spring[d] * (sum + g * x);
        }
        load(own, v.active_stiffness + at);
        load(x, v.is_free + at);
        store(v.active_stiffness + at, x * (own + kActiveStiffness * ties));
      }
    }
  }
}

HYBRID_WIDE void add_active_stiffness(const LevelView& v, float* f) noexcept {
  const int octets = static_cast<int>(v.stride / kOctet);
  for (int k = v.first[2]; k <= v.last[2]; ++k) {
    for (int j = v.first[1]; j <= v.last[1]; ++j) {
      const std::size_t row = static_cast<std::size_t>(k) * v.plane + static_cast<std::size_t>(j) * v.stride;
      for (int o = 0; o < octets; ++o) {
        const std::size_t at = row + static_cast<std::size_t>(o * kOctet);
        Octet active_stiffness, own, load_f, all, inverse;
        load(active_stiffness, v.active_stiffness + at);
        load(own, v.u + at);
        load(load_f, f + at);
        load(all, v.all + at);
        load(inverse, v.inverse + at);
        store(f + at, load_f + active_stiffness * own);
        const Octet zero{}, one = zero + 1.0F;
        Octet sum = all + active_stiffness;
        sum = inverse > zero ? sum : one;
        const Octet with = one / sum;
        store(v.inverse_with_active + at, inverse > zero ? with : zero);
      }
    }
  }
}

// Left where it was, a tight cone came after its bound by a node a sweep, since only where its planes meet
// does anything pull at it, and the force was a fifth off, and then for good. What a bound goes beyond goes
// with it, too: found by the cycle alone, on the way down the force was twice as far off.
HYBRID_WIDE void follow_bounds(float* u, const float* held, const float* least, const float* most_negative,
                               std::size_t count) noexcept {
  for (std::size_t n = 0; n < count; n += kOctet) {
    Octet x, h;
    load(x, u + n);
    load(h, held + n);
    const Octet none = Octet{} + 0.5F * kNoBound, zero{};
    if (least != nullptr) {
      Octet low;
      load(low, least + n);
      x = (((h > zero) & (low > none)) | (low > x)) ? low : x;
    }
    if (most_negative != nullptr) {
      Octet high;
      load(high, most_negative + n);
      high = -high;
      x = (((h < zero) & (high < -none)) | (high < x)) ? high : x;
    }
    store(u + n, x);
  }
}

HYBRID_WIDE void note_at_bound(float* held, const float* u, const float* least, const float* most_negative,
                           std::size_t count) noexcept {
  for (std::size_t n = 0; n < count; n += kOctet) {
    Octet x, bound;
    load(x, u + n);
    const Octet one = Octet{} + 1.0F;
    Octet h{};
    if (least != nullptr) {
      load(bound, least + n);
      h = x <= bound ? one : h;
    }
    if (most_negative != nullptr) {
      load(bound, most_negative + n);
      h = x >= -bound ? -one : h;
    }
    store(held + n, h);
  }
}

HYBRID_WIDE void beyond_bounds(const float* u, const float* least, const float* most_negative, float* beyond,
                               std::size_t count) noexcept {
  const Octet zero{};
  for (std::size_t n = 0; n < count; n += kOctet) {
    Octet x, low = zero, high = zero, bound;
    load(x, u + n);
    if (least != nullptr) {
      load(bound, least + n);
      low = bound > zero ? bound : zero;
    }
    if (most_negative != nullptr) {
      load(bound, most_negative + n);
      high = bound > zero ? -bound : zero;
    }
    // Above 0 what holds it below, under 0 what holds it above.
    const Octet up = x - low, down = x - high;
    store(beyond + n, x > zero ? (up > zero ? up : zero) : (down < zero ? down : zero));
  }
}

HYBRID_WIDE ModeResponse mode_response(const LevelView& v, const float* mode, const std::array<int, 3>& finer_first,
                             const std::array<int, 3>& finer_last) noexcept {
  const int octets = static_cast<int>(v.stride / kOctet);
  // ModeResponse x, for rows that the finer box has some nodes of: 0 for these.
  std::array<float, kMaxOctets * kOctet> all_own, some_own;
  for (std::size_t i = 0; i < v.stride; ++i) {
    const int at = static_cast<int>(i);
    all_own[i] = 1.0F;
    some_own[i] = at >= finer_first[0] && at <= finer_last[0] ? 0.0F : 1.0F;
  }
  ModeResponse sum;
  for (int k = v.first[2]; k <= v.last[2]; ++k) {
    const bool under_k = k >= finer_first[2] && k <= finer_last[2];
    Octet pull{}, stiffness{};
    for (int j = v.first[1]; j <= v.last[1]; ++j) {
      const std::size_t row = static_cast<std::size_t>(k) * v.plane + static_cast<std::size_t>(j) * v.stride;
      const float* const own =
          (under_k && j >= finer_first[1] && j <= finer_last[1] ? some_own : all_own).data();
      for (int o = 0; o < octets; ++o) {
        const std::size_t at = row + static_cast<std::size_t>(o * kOctet);
        Octet here, m, all, inverse, x, g, counts;
        load(here, v.u + at);
        load(m, mode + at);
        load(all, v.all + at);
        load(inverse, v.inverse + at);
        load(counts, own + o * kOctet);
        Octet force = -all * here, resists = all * m;
        const std::array<std::size_t, 3> by{1, v.stride, v.plane};
        for (std::size_t d = 0; d < 3; ++d) {
          const Octet spring = Octet{} + v.spring[d];
          load(g, v.link[d] + at - by[d]);
          g *= spring;
          load(x, v.u + at - by[d]);
          force += g * x;
          load(x, mode + at - by[d]);
          resists -= g * x;
          load(g, v.link[d] + at);
          g *= spring;
          load(x, v.u + at + by[d]);
          force += g * x;
          load(x, mode + at + by[d]);
          resists -= g * x;
        }
        const Octet zero{};
        counts = inverse > zero ? counts : zero;
        pull += counts * m * force;
        stiffness += counts * m * resists;
      }
    }
    for (int lane = 0; lane < kOctet; ++lane) {
      sum.pull += static_cast<double>(pull[lane]);
      sum.stiffness += static_cast<double>(stiffness[lane]);
    }
  }
  return sum;
}

HYBRID_WIDE void shorten_correction(const LevelView& v, float* before) noexcept {
  // With the side beyond the last plane, which goes along too.
  const std::size_t count = static_cast<std::size_t>(v.last[2] + 2) * v.plane;
  for (std::size_t n = 0; n < count; n += kOctet) {
    Octet x, was;
    load(x, v.u + n);
    load(was, before + n);
    store(before + n, x - was);
  }
  // As it was: what pulls there is what pulls here and what the way itself resists with.
  const ModeResponse sum = mode_response(v, before, {0, 0, 0}, {-1, -1, -1});
  double loads = 0.0;
  if (v.f != nullptr) {
    for (int k = v.first[2]; k <= v.last[2]; ++k) {
      for (int j = v.first[1]; j <= v.last[1]; ++j) {
        const std::size_t row =
            static_cast<std::size_t>(k) * v.plane + static_cast<std::size_t>(j) * v.stride;
        float of_row = 0.0F;
        for (std::size_t i = 0; i < v.stride; ++i) {
          const std::size_t n = row + i;
          of_row += v.inverse[n] > 0.0F ? v.f[n] * before[n] : 0.0F;
        }
        loads += static_cast<double>(of_row);
      }
    }
  }
  if (!(sum.stiffness > 0.0)) return;
  const double too_far = -(sum.pull + loads) / sum.stiffness;
  if (too_far <= kMinOvershoot) return;
  const auto back = static_cast<float>(std::min(too_far, kMaxShortening));
  for (std::size_t n = 0; n < count; n += kOctet) {
    Octet x, way, inverse;
    load(x, v.u + n);
    load(way, before + n);
    load(inverse, v.inverse + n);
    const Octet zero{};
    way = inverse > zero ? way : zero;
    store(v.u + n, x - back * way);
  }
}

HYBRID_WIDE void step_along_mode(float* u, const float* mode, float by, const float* least,
                          const float* most_negative, std::size_t count) noexcept {
  for (std::size_t n = 0; n < count; n += kOctet) {
    Octet x, m, bound;
    load(x, u + n);
    load(m, mode + n);
    x += by * m;
    if (least != nullptr) {
      load(bound, least + n);
      x = x > bound ? x : bound;
    }
    if (most_negative != nullptr) {
      load(bound, most_negative + n);
      bound = -bound;
      x = x < bound ? x : bound;
    }
    store(u + n, x);
  }
}

HYBRID_WIDE float largest_limit_ratio(const float* u, const float* link, std::size_t by, const LinkMultiplier& limit,
                                std::size_t count) noexcept {
  Octet most{};
  const Octet zero{};
  for (std::size_t n = 0; n < count; n += kOctet) {
    Octet own, next, g;
    load(own, u + n);
    load(next, u + n + by);
    load(g, link + n);
    const Octet longer = next - own, of_high = limit.per_longer * longer,
                of_low = -limit.per_shorter * longer;
    Octet of = of_high > of_low ? of_high : of_low;
    of = g > zero ? of : zero;
    take_largest(most, of);
  }
  float result = 0.0F;
  for (int lane = 0; lane < kOctet; ++lane) result = most[lane] > result ? most[lane] : result;
  return result;
}

HYBRID_WIDE float update_row_weights(const float* u, const float* link, std::size_t by, const LinkMultiplier& limit,
                                float* held, std::size_t count) noexcept {
  Octet most{};
  const Octet zero{}, one = zero + 1.0F;
  const float above = 1.0F + limit.tolerance, below = 1.0F - limit.tolerance;
  for (std::size_t n = 0; n < count; n += kOctet) {
    Octet own, next, g, h;
    load(own, u + n);
    load(next, u + n + by);
    load(g, link + n);
    load(h, held + n);
    const Octet longer = next - own, of_high = limit.per_longer * longer,
                of_low = -limit.per_shorter * longer;
    const Octet of = of_high > of_low ? of_high : of_low;
    Octet by_now = of * (0.5F + 0.5F * of);
    by_now = by_now < kMaxCycleFactor ? by_now : zero + kMaxCycleFactor;
    by_now = by_now > kMinCycleFactor ? by_now : zero + kMinCycleFactor;
    by_now = ((of > above) | (of < below)) ? by_now : one;
    h *= by_now;
    const Octet stiffest = limit.max_factor * g;
    h = h > g ? h : g;
    h = h < stiffest ? h : stiffest;
    store(held + n, h);
    Octet times = h / g;
    times = g > zero ? times : zero;
    take_largest(most, times);
  }
  float result = 1.0F;
  for (int lane = 0; lane < kOctet; ++lane) result = most[lane] > result ? most[lane] : result;
  return result;
}

float updated_weight(float held, float link, float of_limit, const LinkMultiplier& limit) noexcept {
  if (of_limit > 1.0F + limit.tolerance || of_limit < 1.0F - limit.tolerance)
    held *= std::clamp(of_limit * (0.5F + 0.5F * of_limit), kMinCycleFactor, kMaxCycleFactor);
  return std::clamp(held, link, limit.max_factor * link);
}

}  // namespace voxel::composite
