// SPDX-License-Identifier: GPL-3.0-or-later
// Finds blocks of an object whose links have no slack. This happens once, because labels do not change.
#include <algorithm>
#include <numeric>
#include <vector>

#include "voxel/lattice/lattice.h"

namespace voxel {

bool Lattice::any_without_slack() const {
  return std::any_of(materials_.begin() + 1, materials_.end(),
                     [](const LinkMaterial& m) { return m.without_slack(); });
}

// Flood fill from `voxels`: appends to the list all connected voxels without slack for which `enter` returns
// true. `enter` must return true at most once per voxel.
template <class Enter>
void Lattice::flood(std::vector<VoxelId>& voxels, const Enter& enter) const {
  for (std::size_t head = 0; head < voxels.size(); ++head) {
    for (int d = 0; d < 3; ++d) {
      for (const VoxelId w : {grid_.down(voxels[head], d), grid_.up(voxels[head], d)}) {
        if (filled(w) && without_slack(w) && enter(w)) voxels.push_back(w);
      }
    }
  }
}

// Anchors all voxels that are connected without slack to an anchored voxel.
void Lattice::anchor_blocks(LazyArray<std::uint32_t>& lanes) {
  if (!any_without_slack()) return;
  std::vector<VoxelId> voxels;
  for (RowId row = 0; row < grid_.rows(); ++row) {
    if (filled_in(row) == 0 || lanes[row] == 0) continue;
    for (VoxelId v = row * kRow; v < (row + 1) * kRow; ++v) {
      if ((lanes[row] >> v % kRow & 1U) != 0 && without_slack(v)) voxels.push_back(v);
    }
  }
  const std::size_t before = voxels.size();
  flood(voxels, [&lanes](VoxelId w) {
    const std::uint32_t bit = 1U << w % kRow;
    if ((lanes[w / kRow] & bit) != 0) return false;
    lanes[w / kRow] |= bit;
    return true;
  });
  anchored_count_ += voxels.size() - before;
}

void Lattice::find_blocks() {
  if (!any_without_slack()) return;
  LazyArray<std::uint32_t> found(grid_.size());  // component number, from 1 on; 0: none
  std::vector<std::size_t> sizes;
  std::vector<VoxelId> voxels;
  for (RowId row = 0; row < grid_.rows(); ++row) {
    if (filled_in(row) == 0) continue;
    for (VoxelId v = row * kRow; v < (row + 1) * kRow; ++v) {
      if (!filled(v) || !without_slack(v) || found[v] != 0 || anchored(v)) continue;
      const auto number = static_cast<std::uint32_t>(sizes.size() + 1);
      found[v] = number;
      voxels.assign(1, v);
      flood(voxels, [&](VoxelId w) {
        if (found[w] != 0) return false;
        found[w] = number;
        return true;
      });
      sizes.push_back(voxels.size());
    }
  }
  std::vector<std::uint32_t> order(sizes.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return sizes[a] > sizes[b]; });
  std::vector<std::uint16_t> number_of(sizes.size() + 1, 0);
  for (const std::uint32_t n : order) {
    if (block_count_ == kMaxBlocks || sizes[n] < 2) break;
    number_of[n + 1] = static_cast<std::uint16_t>(++block_count_);
  }
  if (block_count_ == 0) return;
  block_ = LazyArray<std::uint16_t>(grid_.size());
  for (RowId row = 0; row < grid_.rows(); ++row) {
    if (filled_in(row) == 0) continue;
    for (VoxelId v = row * kRow; v < (row + 1) * kRow; ++v) {
      if (found[v] != 0 && number_of[found[v]] != 0) block_[v] = number_of[found[v]];
    }
  }
}

}  // namespace voxel
