// SPDX-License-Identifier: GPL-3.0-or-later
// Rigid blocks on coarse levels: the load of a block is restricted as one sum, and a correction moves a block
// as one.
#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

#include "voxel/multigrid/fas.h"

#include "voxel/multigrid/rigid_block_visits.h"

namespace voxel {

// Sets the residual that is restricted from the cells of blocks in a row (rigid_blocks.h explains when a
// level knows a block, and when a block sprawls). It is 0 for a block that the coarser level knows, because
// that level gets the block's residual as a whole. It is 0 for a block that sprawls. The residual of any
// other block is divided equally among its cells.
void Multigrid::set_block_lanes(int level, RowId row, LaneSpan span, RowVector& out) const noexcept {
  for (int i = span.first * kLanes; i < (span.last + 1) * kLanes; ++i) {
    const std::uint16_t number = blocks_->of(level, row * kRow + static_cast<VoxelId>(i));
    if (number == 0) continue;
    const BlockOnLevel& on = block_state_[number - 1U].on[static_cast<std::size_t>(level)];
    const bool known = blocks_->on(level + 1, number - 1U).count > 0;
    const double share = known || blocks_->sprawls(number - 1U)
                             ? 0.0
                             : 1.0 / static_cast<double>(blocks_->on(level, number - 1U).count);
    for (int axis = 0; axis < 3; ++axis)
      out[static_cast<std::size_t>(axis)][static_cast<std::size_t>(i)] =
          static_cast<float>(share * on.left[axis]);
  }
}

// A coarse cell of a block may contain other tissue. Adds the residual of that tissue to the block's
// residual.
void Multigrid::restrict_block_lanes(int level, RowId row, LaneSpan span, const RowVector& sums) noexcept {
  for (int i = span.first * kLanes; i < (span.last + 1) * kLanes; ++i) {
    const std::uint16_t number = blocks_->of(level, row * kRow + static_cast<VoxelId>(i));
    if (number == 0) continue;
    BlockOnLevel& on = block_state_[number - 1U].on[static_cast<std::size_t>(level)];
    for (int axis = 0; axis < 3; ++axis)
      on.passed[axis] +=
          static_cast<double>(sums[static_cast<std::size_t>(axis)][static_cast<std::size_t>(i)]);
  }
}

void Multigrid::load_blocks(int level, const RigidBlocks::Box& box) noexcept {
  if (blocks_ == nullptr) return;
  const Level& l = at(level);
  for_blocks(level, box, [&](std::size_t p, const RigidBlocks::OnLevel& of, BlockOnLevel& on) {
    const bool known = blocks_->on(level - 1, p).count > 0;
    if (known && !block_state_[p].on[static_cast<std::size_t>(level - 1)].active) return;
    on.load = on.passed;
    for (const RigidBlocks::Link& link : of.border) {
      for (int axis = 0; axis < 3; ++axis) {
        const auto& prolonged = l.prolonged[static_cast<std::size_t>(axis)];
        on.load[axis] -= along(link.spring, axis, link.d) *
                         static_cast<double>(prolonged[link.beside] - prolonged[link.cell]);
      }
    }
  });
}

void Multigrid::note_prolonged_blocks(int level, RowId row, LaneSpan span, const RowVector& way) noexcept {
  for (int i = span.first * kLanes; i < (span.last + 1) * kLanes; ++i) {
    const std::uint16_t number = blocks_->of(level, row * kRow + static_cast<VoxelId>(i));
    if (number == 0) continue;
    BlockOnLevel& on = block_state_[number - 1U].on[static_cast<std::size_t>(level)];
    for (int axis = 0; axis < 3; ++axis)
      on.sum[axis] += static_cast<double>(way[static_cast<std::size_t>(axis)][static_cast<std::size_t>(i)]);
  }
}

void Multigrid::prolong_to_blocks(int level, Displacement& state, const ObstacleView& obstacles) noexcept {
  Level& coarse = at(level + 1);
  for (std::size_t p = 0; p < block_state_.size(); ++p) {
    const RigidBlocks::OnLevel &of = blocks_->on(level, p), &above = blocks_->on(level + 1, p);
    BlockState& block = block_state_[p];
    BlockOnLevel &on = block.on[static_cast<std::size_t>(level)],
                 &from = block.on[static_cast<std::size_t>(level) + 1];
    glm::dvec3 way = above.count > 0                        ? from.pending_correction
                     : of.count > 0 && !blocks_->sprawls(p) ? on.sum / static_cast<double>(of.count)
                                                            : glm::dvec3(0.0);
    on.sum = glm::dvec3(0.0);
    if (above.count > 0 && way != glm::dvec3(0.0)) {
      from.pending_correction = glm::dvec3(0.0);
      // all its cells count as prolonged, inside and outside the box
      for (const RigidBlocks::Run& run : above.rows) {
        for (std::size_t axis = 0; axis < 3; ++axis)
          for_cells(run, [&](VoxelId cell, std::uint32_t) {
            coarse.prolonged[axis][cell] = coarse.value[axis][cell];
          });
        log_.note(level + 1, run.row);
      }
    }
    if (of.count == 0 || way == glm::dvec3(0.0)) continue;
    way = block.held.free_component(way);
    if (level > 0) {
      shift_cells(level, p, way);
      on.pending_correction += way;
      continue;
    }
    const glm::dvec3 went = move_block(p, way, state, obstacles);
    if (above.count == 0 || went == way) continue;
    // The part of the correction that the block refused is subtracted from its cells.
    for (const RigidBlocks::Run& run : above.rows) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto less = static_cast<float>(way[static_cast<int>(axis)] - went[static_cast<int>(axis)]);
        for_cells(run, [&](VoxelId cell, std::uint32_t) {
          coarse.value[axis][cell] -= less;
          coarse.prolonged[axis][cell] -= less;
        });
      }
    }
  }
}

BoundarySprings::Support Multigrid::support_of_block(std::size_t block) const noexcept {
  if (blocks_->sprawls(block)) return BoundarySprings::kAll;
  const HeldDirections& held = block_state_[block].held;
  if (held.count == 0) return {};
  return held.count == 1
             ? BoundarySprings::along(glm::vec3(held.of[0]), BoundarySprings::Support::By::obstacle)
             : BoundarySprings::kAll;
}

void Multigrid::freeze_blocks(const Displacement& state) noexcept {
  for (std::size_t p = 0; p < block_state_.size(); ++p) block_state_[p].frozen_N = -block_force(p, state);
}

void Multigrid::forget_pending_of_blocks(int level, RowId row) noexcept {
  for (VoxelId cell = row * kRow; cell < (row + 1) * kRow; ++cell) {
    const std::uint16_t number = blocks_->of(level, cell);
    if (number != 0)
      block_state_[number - 1U].on[static_cast<std::size_t>(level)].pending_correction = glm::dvec3(0.0);
  }
}

void Multigrid::restart_blocks() noexcept {
  for (BlockState& p : block_state_) {
    p.frozen_N = glm::dvec3(0.0);
    for (BlockOnLevel& on : p.on) on = {};
  }
}

}  // namespace voxel
