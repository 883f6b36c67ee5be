// SPDX-License-Identifier: GPL-3.0-or-later
// Whether a link is at one of its limits.
#pragma once

#include "voxel/lattice/displacement.h"
#include "voxel/lattice/lattice.h"

namespace voxel {

// Of the spacing: a link that is nearer to a limit than this is at it (an active limit). A float of a displacement
// of ten spacings is rounded by a hundredth of that.
inline constexpr float kAtLimit = 1e-4F;

// May any link of a voxel on one axis be within `share` of the spacing of a limit? By the tightest limits of
// all, which is a tenth of the cost of looking at each link's own: most often the answer is no.
inline bool may_be_tight(const Lattice& lattice, const Displacement& state, VoxelId v, int axis,
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
