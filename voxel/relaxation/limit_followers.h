// SPDX-License-Identifier: GPL-3.0-or-later
// What hangs on some voxels by links at their limits, brought along with them.
//
// Voxel by voxel, breadth first, each after the one it hangs on. What is asked of a voxel on the way (may it
// move, was it brought along, what are its springs and limits, what else pulls it) is looked up once for its
// row of 32 and all three axes: looked up for each voxel it took more than a third of a contact that a quick
// hand pressed until the chain was tight, now a sixth.
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
  static constexpr std::size_t kMostDrawn = 2000;   // voxels that come along on an axis, and a few
  static constexpr std::size_t kMostRows = 16'384;  // that are looked at; what is further away stays

  // Allocates; throws std::bad_alloc.
  LimitFollowers(const Lattice& lattice, std::size_t most_roots);

  // Each free voxel beside one of `roots` (at most most_roots, none anchored), or beside one that was brought
  // along, goes to where its links, and what else pulls it, would have it, as far as those let it, if the
  // link between the two is near a limit; if it is at one afterwards, the voxel was brought along. Voxels
  // that move by more than `stir` of the spacing stir their rows. Does not allocate or throw.
  void draw(Relaxation& relaxation, Displacement& state, std::span<const VoxelId> roots,
            float mark_dirty) noexcept;

  [[nodiscard]] std::size_t memory_bytes() const {
    return entry_.resident_bytes() + resident_bytes(rows_) + resident_bytes(drawn_);
  }

 private:
  // Bits are lanes.
  struct Row {
    RowId row = 0;
    std::uint32_t stays = 0;   // no voxel, anchored, or not free
    std::uint32_t closed = 0;  // these, and what is in drawn_
    bool noted = false, dirty = false;
    RowStiffness springs;
    RowLimits limits;
    std::array<const float*, 3> bricks{}, balance{};  // [axis] what pulls besides (N); null: nothing
  };
  static constexpr float kSearched = 0.1F;  // of the spacing: links that are looked at

  [[nodiscard]] Row* look_at(RowId row) noexcept;
  void add(Row& row, VoxelId v) noexcept {
    row.closed |= 1U << v % kRow;
    drawn_.push_back(v);
  }
  template <std::size_t kAxis>
  void draw_on(std::span<const VoxelId> roots) noexcept;
  template <std::size_t kAxis, std::size_t kD, bool kUp>
  void look_from(VoxelId from, VoxelId at) noexcept;
  template <std::size_t kAxis>
  [[nodiscard]] float place_of(const Row& row, VoxelId v) const noexcept;

  const Lattice& lattice_;
  std::array<float, 3> spacing_m_{};
  bool yields_;
  Relaxation* relaxation_ = nullptr;  // while it draws
  Displacement* state_ = nullptr;
  float mark_dirty_ = 0.0F;
  LazyArray<std::uint16_t> entry_;  // [row] 1 + index into rows_; 0: not looked at
  LazyVector<Row> rows_;
  std::vector<VoxelId> drawn_;  // the roots first
};

}  // namespace voxel
