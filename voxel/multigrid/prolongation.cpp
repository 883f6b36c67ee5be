// SPDX-License-Identifier: GPL-3.0-or-later
// Interpolation of coarse corrections along x.
#include "voxel/multigrid/prolongation.h"

namespace voxel {

Prolongation::Prolongation(const Grid& fine)
    : rows_(static_cast<std::size_t>(fine.dims[1]) / 2 + 4),
      lanes_(static_cast<std::size_t>(fine.columns + 2) * kRow),
      cell_lanes_(lanes_ / 2 + std::size_t{2} * kRow),
      cells_(4 * cell_lanes_),
      lanes_of_(2 * rows_ * 4 * lanes_),
      spread_(2 * rows_) {}

void Prolongation::begin(int first, int last, int j0, int j1) noexcept {
  first_ = first;
  groups_ = last - first + 1;
  j0_ = j0;
  for (int k = 0; k < 2; ++k) {
    for (int j = j0; j <= j1; ++j) spread_[slot(j, k)] = {};
  }
}

void Prolongation::spread(int j, int k, bool is_source, bool whole) noexcept {
  const std::size_t to = slot(j, k);
  float* lanes = lanes_of_.data() + to * 4 * lanes_;
  if (!whole) {
    spread_along(cells(3), groups_, lanes + 3 * lanes_);
    whole = all_ones(lanes + 3 * lanes_, 2 * groups_);
  }
  spread_[to] = {is_source, whole};
  if (!is_source) return;
  for (std::size_t axis = 0; axis < 3; ++axis) spread_along(cells(axis), groups_, lanes + axis * lanes_);
}

}  // namespace voxel
