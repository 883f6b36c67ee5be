// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/chain/limits.h"

namespace voxel {

ChainLimits::ChainLimits(const Lattice& lattice) {
  std::array<bool, 256> used{};
  for (RowId row = 0; row < lattice.grid().rows(); ++row) {
    if (lattice.filled_in(row) == 0) continue;
    const std::uint8_t* const labels = lattice.labels(row);
    for (int i = 0; i < kRow; ++i) used[labels[i]] = true;
  }
  for (std::size_t d = 0; d < 3; ++d) {
    for (std::size_t label = 0; label < 256; ++label) {
      if (label == 0 || !used[label]) {
        shorter_[d][label] = longer_[d][label] = across_[d][label] = kUnbounded;
        continue;
      }
      const auto l = static_cast<std::uint8_t>(label);
      const LinkLimit& limit = lattice.limit_between(l, l, static_cast<int>(d));
      shorter_[d][label] = -0.5F * limit.along_low;
      longer_[d][label] = 0.5F * limit.along_high;
      across_[d][label] = 0.5F * limit.across;
      registers_ = label < 8 ? 1 : label < 16 ? 2 : 0;
    }
  }
}

ChainLimits::WaveLimits ChainLimits::for_wave(int axis, Way way) const {
  WaveLimits result;
  for (int n = 0; n < kDirections; ++n) {
    const auto d = static_cast<std::size_t>(n / 2);
    const bool up = n % 2 == 0;
    // Below a raised voxel the links get longer, above it they get shorter. Around a lowered voxel it is the
    // reverse.
    const HalfLimitTable& along = up == (way == Way::raise) ? shorter_[d] : longer_[d];
    result.half[static_cast<std::size_t>(n)] = axis == n / 2 ? along.data() : across_[d].data();
  }
  return result;
}

}  // namespace voxel
