// SPDX-License-Identifier: GPL-3.0-or-later
// Test whether links of a row come near their limits.
#include "voxel/multigrid/row_kernels.h"

#include <algorithm>
#include <cmath>

#include "voxel/lattice/simd_dispatch.h"

namespace voxel {

HYBRID_MULTIVERSIONED bool row_near_limits(const RowSprings& s, const RowView& u, const AxisLimits& limits,
                                           float share, const float* wanted) noexcept {
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

}  // namespace voxel
