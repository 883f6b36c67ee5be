// SPDX-License-Identifier: GPL-3.0-or-later
// Tests whether a link is at one of its limits (an active limit).
#pragma once

#include "voxel/lattice/displacement.h"
#include "voxel/lattice/lattice.h"

namespace voxel {

// Share of the spacing: a link nearer to a limit than this is at its limit. Rounding of a float displacement
// of ten spacings is a hundredth of this.
inline constexpr float kAtLimit = 1e-4F;

// Quick test: false if no link of the voxel is within `share` of the spacing of a limit on this axis. Uses
// the tightest limits of all links, because a look-up of each link's own limits costs much more. So `true`
// may be a false alarm.
inline bool may_be_at_limit(const Lattice& lattice, const Displacement& state, VoxelId v, int axis,
                            float share) noexcept {
  const auto& u = state.u[static_cast<std::size_t>(axis)];
  for (int d = 0; d < 3; ++d) {
    const LinkLimit& l = lattice.tightest(d);
    const float tight = share * static_cast<float>(lattice.spacing_m()[d]);
    const float low = (axis == d ? l.along_low : -l.across) + tight,
                high = (axis == d ? l.along_high : l.across) - tight;
    const VoxelId up = lattice.up(v, d), down = lattice.down(v, d);
    const float above = u[up] - u[v], below = u[v] - u[down];
    if (((above <= low || above >= high) && lattice.filled(up)) ||
        ((below <= low || below >= high) && lattice.filled(down)))
      return true;
  }
  return false;
}

}  // namespace voxel
