// SPDX-License-Identifier: GPL-3.0-or-later
// Loops over the cells and blocks of a level, for the passes of rigid blocks only.
#pragma once

#include "voxel/multigrid/fas.h"

namespace voxel {

// Calls visit(cell, lane) for the cells of a block in a run.
template <class Visit>
void for_cells(const RigidBlocks::Run& run, const Visit& visit) {
  for (std::uint32_t lanes = run.lanes; lanes != 0; lanes &= lanes - 1) {
    const auto lane = static_cast<std::uint32_t>(std::countr_zero(lanes));
    visit(run.row * kRow + lane, lane);
  }
}

inline double along(const Spring& spring, int axis, int d) {
  return static_cast<double>(spring.on(axis, d));
}

template <class Visit>
void Multigrid::for_blocks(int level, const RigidBlocks::Box& box, const Visit& visit) noexcept {
  for (std::size_t p = 0; p < block_state_.size(); ++p) {
    const RigidBlocks::OnLevel& on = blocks_->on(level, p);
    if (on.count > 0 && on.box.meets(box)) visit(p, on, block_state_[p].on[static_cast<std::size_t>(level)]);
  }
}

}  // namespace voxel
