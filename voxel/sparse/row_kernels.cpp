// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/sparse/row_kernels.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "voxel/wide.h"

namespace voxel::sparse {
namespace {

constexpr float kFar = std::numeric_limits<float>::max();

// The row with the values beyond both ends, so that x is a plain stride too.
struct Padded {
  std::array<float, kRow + 2> value;

  explicit Padded(const RowView& u) {
    value[0] = u.left;
    std::copy_n(u.own, kRow, value.begin() + 1);
    value[kRow + 1] = u.right;
  }
  [[nodiscard]] const float* down() const { return value.data(); }
  [[nodiscard]] const float* up() const { return value.data() + 2; }
};

}  // namespace

HYBRID_WIDE void row_beside(const RowSprings& s, const RowView& u, const float* load, float* out) noexcept {
  const float *yd = u.y_down, *yu = u.y_up, *zd = u.z_down, *zu = u.z_up;
  const float *kyu = s.up[1], *kyd = s.down[1], *kzu = s.up[2], *kzd = s.down[2];
  Row t;
  for (int i = 0; i < kRow; ++i)
    t[static_cast<std::size_t>(i)] = kyd[i] * yd[i] + kyu[i] * yu[i] + kzd[i] * zd[i] + kzu[i] * zu[i];
  if (load != nullptr) {
    for (int i = 0; i < kRow; ++i) t[static_cast<std::size_t>(i)] += load[i];
  }
  std::copy(t.begin(), t.end(), out);
}

HYBRID_WIDE void row_minimum(const RowSprings& s, const float* beside, const float* x, float left,
                             float right, float* out) noexcept {
  std::array<float, kRow + 2> p;
  p[0] = left;
  std::copy_n(x, kRow, p.begin() + 1);
  p[kRow + 1] = right;
  const float *xd = p.data(), *xu = p.data() + 2, *kxu = s.up[0], *kxd = s.down[0], *inverse = s.inverse;
  Row t;
  for (int i = 0; i < kRow; ++i)
    t[static_cast<std::size_t>(i)] = (kxd[i] * xd[i] + kxu[i] * xu[i] + beside[i]) * inverse[i];
  std::copy(t.begin(), t.end(), out);
}

HYBRID_WIDE float row_difference(const float* a, const float* b) noexcept {
  float most = 0.0F;
  for (int i = 0; i < kRow; ++i) most = std::max(most, std::fabs(a[i] - b[i]));
  return most;
}

HYBRID_WIDE float row_weighted(const float* a, const float* weight) noexcept {
  float most = 0.0F;
  for (int i = 0; i < kRow; ++i) most = std::max(most, std::fabs(a[i]) * weight[i]);
  return most;
}

HYBRID_WIDE void row_pull(const RowSprings& s, const RowView& u, float* out) noexcept {
  const Padded p(u);
  const float *xd = p.down(), *xu = p.up(), *yd = u.y_down, *yu = u.y_up, *zd = u.z_down, *zu = u.z_up,
              *own = u.own;
  const float *kxu = s.up[0], *kxd = s.down[0], *kyu = s.up[1], *kyd = s.down[1], *kzu = s.up[2],
              *kzd = s.down[2];
  Row r;
  for (int i = 0; i < kRow; ++i) {
    const float c = own[i];
    r[static_cast<std::size_t>(i)] = kxd[i] * (xd[i] - c) + kxu[i] * (xu[i] - c) + kyd[i] * (yd[i] - c) +
                                     kyu[i] * (yu[i] - c) + kzd[i] * (zd[i] - c) + kzu[i] * (zu[i] - c);
  }
  std::copy(r.begin(), r.end(), out);
}

HYBRID_WIDE void row_residual(const RowSprings& s, const RowView& u, const float* load, float* out) noexcept {
  row_pull(s, u, out);
  const float* inverse = s.inverse;
  if (load != nullptr) {
    for (int i = 0; i < kRow; ++i) out[i] += load[i];
  }
  for (int i = 0; i < kRow; ++i) out[i] = inverse[i] != 0.0F ? out[i] : 0.0F;
}

HYBRID_WIDE void clamp_row(const RowSprings& s, const RowView& u, const AxisLimits& limits,
                           float* wanted) noexcept {
  const Padded p(u);
  const std::array<const float*, 3> up{p.up(), u.y_up, u.z_up}, down{p.down(), u.y_down, u.z_down};
  Row low, high;
  low.fill(-kFar);
  high.fill(kFar);
  for (std::size_t d = 0; d < 3; ++d) {
    const float b0 = limits.low[d], b1 = limits.high[d];
    const float *nu = up[d], *nd = down[d], *ku = s.up[d], *kd = s.down[d];
    for (int i = 0; i < kRow; ++i) {
      const auto ui = static_cast<std::size_t>(i);
      // Added where there is no link, kFar leaves no trace: a limit so wide holds nothing.
      const float no_up = ku[i] > 0.0F ? 0.0F : kFar, no_down = kd[i] > 0.0F ? 0.0F : kFar;
      low[ui] = std::max(low[ui], std::max(nu[i] - b1 - no_up, nd[i] + b0 - no_down));
      high[ui] = std::min(high[ui], std::min(nu[i] - b0 + no_up, nd[i] + b1 + no_down));
    }
  }
  const float* own = u.own;
  for (int i = 0; i < kRow; ++i) {
    const auto ui = static_cast<std::size_t>(i);
    const float t = std::min(std::max(wanted[i], low[ui]), high[ui]);
    wanted[i] = low[ui] > high[ui] ? own[i] : t;
  }
}

HYBRID_WIDE bool row_near_limits(const RowSprings& s, const RowView& u, const AxisLimits& limits, float share,
                                 const float* wanted) noexcept {
  std::array<float, kRow + 2> p;
  p[0] = u.left;
  std::copy_n(wanted, kRow, p.begin() + 1);
  p[kRow + 1] = u.right;
  const std::array<const float*, 3> up{p.data() + 2, u.y_up, u.z_up}, down{p.data(), u.y_down, u.z_down};
  int near = 0;
  for (std::size_t d = 0; d < 3; ++d) {
    const float b0 = share * limits.low[d], b1 = share * limits.high[d];
    const float *nu = up[d], *nd = down[d], *ku = s.up[d], *kd = s.down[d];
    for (int i = 0; i < kRow; ++i) {
      const float above = nu[i] - wanted[i], below = wanted[i] - nd[i];
      near |=
          static_cast<int>(ku[i] > 0.0F) & (static_cast<int>(above >= b1) | static_cast<int>(above <= b0));
      near |=
          static_cast<int>(kd[i] > 0.0F) & (static_cast<int>(below >= b1) | static_cast<int>(below <= b0));
    }
  }
  return near != 0;
}

HYBRID_WIDE void take_row(float* own, const float* wanted, int first) noexcept {
  static constexpr auto kAlternate = [] {
    std::array<std::uint32_t, kRow + 1> mask{};
    for (std::size_t i = 0; i < mask.size(); i += 2) mask[i] = 1;
    return mask;
  }();
  const std::uint32_t* taken = kAlternate.data() + first;
  for (int i = 0; i < kRow; ++i) own[i] = taken[i] != 0 ? wanted[i] : own[i];
}

}  // namespace voxel::sparse
