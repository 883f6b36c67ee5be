// SPDX-License-Identifier: GPL-3.0-or-later
// Moves the voxels that are tied to a given set through links at their limits (its dependents).
//
// The search is breadth-first. Voxels move one at a time, each after its source. Roles, springs, limits and
// loads are looked up once for each row of 32 voxels and all three axes, because a lookup per voxel would
// dominate the cost.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "voxel/lattice/displacement.h"
#include "voxel/lattice/lattice.h"
#include "voxel/lattice/lazy_array.h"
#include "voxel/lattice/level_stiffness.h"
#include "voxel/lattice/near_limit.h"
#include "voxel/relaxation/relaxation.h"

namespace voxel {

class LimitFollowers {
 public:
  // Largest number of followers on one axis; the last visit may add a few more.
  static constexpr std::size_t kMaxFollowers = 2000;
  // Largest number of rows that are searched. Voxels in further rows stay.
  static constexpr std::size_t kMostRows = 16'384;

  // Allocates; throws std::bad_alloc.
  LimitFollowers(const Lattice& lattice, std::size_t most_sources);

  // `sources`: at most most_sources voxels, none anchored. A free voxel beside a source or a follower is
  // moved if the link between the two is near a limit. It goes to its local equilibrium within its limits. If
  // that link is at a limit afterwards, the voxel is a follower, too. Rows with a motion of more than
  // `mark_dirty` of the spacing are marked dirty. Does not allocate or throw.
  void move(Relaxation& relaxation, Displacement& state, std::span<const VoxelId> sources,
            float mark_dirty) noexcept;

  [[nodiscard]] std::size_t memory_bytes() const {
    return entry_.resident_bytes() + resident_bytes(rows_) + resident_bytes(followers_);
  }

 private:
  // A row that is searched. The bits of a mask are lanes.
  struct Row {
    RowId row = 0;
    std::uint32_t stays = 0;   // empty, anchored, or not free
    std::uint32_t closed = 0;  // those in `stays`, and the voxels in followers_
    bool noted = false, dirty = false;
    RowStiffness springs;
    RowLimits limits;
    std::array<const float*, 3> bricks{}, frozen{};  // [axis] loads (N); null: none
  };
  static constexpr float kSearched = 0.1F;  // (unit: spacing) links nearer to a limit than this are searched

  [[nodiscard]] Row* look_at(RowId row) noexcept;
  void add(Row& row, VoxelId v) noexcept {
    row.closed |= 1U << v % kRow;
    followers_.push_back(v);
  }
  template <std::size_t kAxis>
  void move_on(std::span<const VoxelId> sources) noexcept;
  template <std::size_t kAxis, std::size_t kD, bool kUp>
  void visit(VoxelId from, VoxelId at) noexcept;
  template <std::size_t kAxis>
  [[nodiscard]] float local_equilibrium(const Row& row, VoxelId v) const noexcept;

  const Lattice& lattice_;
  std::array<float, 3> spacing_m_{};
  bool has_plasticity_;
  Relaxation* relaxation_ = nullptr;  // set during move()
  Displacement* state_ = nullptr;
  float mark_dirty_ = 0.0F;
  LazyArray<std::uint16_t> entry_;  // [row] 1 + index into rows_; 0: not looked at
  LazyVector<Row> rows_;
  std::vector<VoxelId> followers_;  // sources first
};

}  // namespace voxel
