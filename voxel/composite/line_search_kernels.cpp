// SPDX-License-Identifier: GPL-3.0-or-later
// Line searches along a given direction of one level (row_kernels.h).
#include <algorithm>
#include <array>

#include "voxel/composite/row_kernels.h"

namespace voxel::composite {
namespace {

// If half of a correction lies beyond the energy minimum, the energy does not change. If more than half lies
// beyond it, the correction is shortened, by at most kMaxShortening of its length.
constexpr double kMinOvershoot = 0.5, kMaxShortening = 0.9;

}  // namespace

HYBRID_MULTIVERSIONED void beyond_bounds(const float* u, const float* lower, const float* negated_upper,
                                         float* beyond, std::size_t count) noexcept {
  const Float8 zero{};
  for (std::size_t n = 0; n < count; n += kLanes) {
    Float8 x, low = zero, high = zero, bound;
    load(x, u + n);
    // Room to the bound that a larger displacement would meet.
    Float8 above = zero - composite::kNoBound, below = above;
    if (lower != nullptr) {
      load(bound, lower + n);
      low = bound > zero ? bound : zero;
      below = x - bound;
    }
    if (negated_upper != nullptr) {
      load(bound, negated_upper + n);
      high = bound > zero ? -bound : zero;
      above = -bound - x;
    }
    // A displacement above 0 is measured from the lower bound, one below 0 from the upper bound.
    Float8 up = x - low, down = high - x;
    up = up < above ? up : above;
    down = down < below ? down : below;
    store(beyond + n, x > zero ? (up > zero ? up : zero) : (down > zero ? -down : zero));
  }
}

HYBRID_MULTIVERSIONED ModeResponse mode_response(const LevelView& v, const float* mode,
                                                 const std::array<int, 3>& finer_first,
                                                 const std::array<int, 3>& finer_last) noexcept {
  const int vectors = static_cast<int>(v.stride / kLanes);
  // Masks along x. In rows that cross the finer patch the nodes inside that patch count 0.
  const RowMask all_own = uncovered_lanes(0, -1, vectors);
  const RowMask some_own = uncovered_lanes(finer_first[0], finer_last[0], vectors);
  ModeResponse sum;
  for (int k = v.first[2]; k <= v.last[2]; ++k) {
    const bool under_k = k >= finer_first[2] && k <= finer_last[2];
    Float8 plane_force{}, plane_stiffness{};
    for (int j = v.first[1]; j <= v.last[1]; ++j) {
      const std::size_t row = static_cast<std::size_t>(k) * v.plane + static_cast<std::size_t>(j) * v.stride;
      const float* const own =
          (under_k && j >= finer_first[1] && j <= finer_last[1] ? some_own : all_own).data();
      for (int o = 0; o < vectors; ++o) {
        const std::size_t at = row + static_cast<std::size_t>(o * kLanes);
        Float8 here, m, all, inverse, x, g, counts;
        load(here, v.u + at);
        load(m, mode + at);
        load(all, v.diagonal + at);
        load(inverse, v.inverse_diagonal + at);
        load(counts, own + o * kLanes);
        Float8 force = -all * here, stiffness = all * m;
        if (v.f != nullptr) {
          load(x, v.f + at);
          force += x;
        }
        const std::array<std::size_t, 3> by{1, v.stride, v.plane};
        for (std::size_t d = 0; d < 3; ++d) {
          const Float8 spring = Float8{} + v.spring[d];
          load(g, v.weight[d] + at - by[d]);
          g *= spring;
          load(x, v.u + at - by[d]);
          force += g * x;
          load(x, mode + at - by[d]);
          stiffness -= g * x;
          load(g, v.weight[d] + at);
          g *= spring;
          load(x, v.u + at + by[d]);
          force += g * x;
          load(x, mode + at + by[d]);
          stiffness -= g * x;
        }
        const Float8 zero{};
        counts = inverse > zero ? counts : zero;
        plane_force += counts * m * force;
        plane_stiffness += counts * m * stiffness;
      }
    }
    for (int lane = 0; lane < kLanes; ++lane) {
      sum.force += static_cast<double>(plane_force[lane]);
      sum.stiffness += static_cast<double>(plane_stiffness[lane]);
    }
  }
  return sum;
}

HYBRID_MULTIVERSIONED void shorten_correction(const LevelView& v, float* before) noexcept {
  // The side plane beyond the last plane of unknowns is included, because prolongation moved it, too.
  const std::size_t count = static_cast<std::size_t>(v.last[2] + 2) * v.plane;
  for (std::size_t n = 0; n < count; n += kLanes) {
    Float8 x, was;
    load(x, v.u + n);
    load(was, before + n);
    store(before + n, x - was);
  }
  // Along the correction the energy is a parabola: slope and curvature at its end give the minimum.
  const ModeResponse sum = mode_response(v, before, {0, 0, 0}, {-1, -1, -1});
  if (!(sum.stiffness > 0.0)) return;
  const double overshoot = -sum.force / sum.stiffness;
  if (overshoot <= kMinOvershoot) return;
  const auto back = static_cast<float>(std::min(overshoot, kMaxShortening));
  for (std::size_t n = 0; n < count; n += kLanes) {
    Float8 x, correction, inverse;
    load(x, v.u + n);
    load(correction, before + n);
    load(inverse, v.inverse_diagonal + n);
    const Float8 zero{};
    correction = inverse > zero ? correction : zero;
    store(v.u + n, x - back * correction);
  }
}

HYBRID_MULTIVERSIONED void step_along_mode(float* u, const float* mode, float by, const float* lower,
                                           const float* negated_upper, std::size_t count) noexcept {
  for (std::size_t n = 0; n < count; n += kLanes) {
    Float8 x, m, bound;
    load(x, u + n);
    load(m, mode + n);
    x += by * m;
    if (lower != nullptr) {
      load(bound, lower + n);
      x = x > bound ? x : bound;
    }
    if (negated_upper != nullptr) {
      load(bound, negated_upper + n);
      bound = -bound;
      x = x < bound ? x : bound;
    }
    store(u + n, x);
  }
}

}  // namespace voxel::composite
