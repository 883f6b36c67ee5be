// SPDX-License-Identifier: GPL-3.0-or-later
// Rigid blocks: components of an object whose links have no slack (Lattice::block), on every level of the
// multigrid hierarchy.
//
// Such a component can only be displaced as a whole: it has three unknowns, however many voxels it has. It
// would never move if its voxels moved one at a time. So its voxels do not move when rows are relaxed, and
// the block moves, as one, to the equilibrium of its border's springs. On a coarse level a block consists of
// the cells in which it has at least half of the voxels. These cells move as one, too. Their correction is
// prolonged like that of other cells.
//
// A block that has too few voxels in such cells is unknown to that level and to all coarser ones. It takes
// the mean of the corrections prolonged to its voxels. This is accurate if the block lies in at most two
// cells of that level along each axis. A block that sprawls further (a thin sheet, a scaffold) connects
// tissue that these levels treat as separate. So they do not move the block, and for the cells around it the
// block is fixed (boundary_springs.h).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "voxel/lattice/lattice.h"
#include "voxel/lattice/lazy_array.h"
#include "voxel/lattice/level_stiffness.h"

namespace voxel {

// A block's motion δ must satisfy normal · δ >= -room, or = -room if `both`.
struct BlockBound {
  glm::dvec3 normal{0.0};
  double room_m = 0.0;
  bool both = false;
  double force_N = 0.0;  // force of the bound on the block along the normal (its multiplier)
};
// Returns the motion (m) of a body that `force_N` pulls against springs of this stiffness, within `bounds`.
// On entry, BlockBound::force_N is a first guess of each bound's force; on return it is that force. The
// forces are found by coordinate ascent of the dual problem (Hildreth). The body has three unknowns, so a few
// rounds suffice.
glm::dvec3 move_within(const glm::dvec3& force_N, const glm::dvec3& stiffness_N_per_m,
                       std::span<BlockBound> bounds) noexcept;

// Orthonormal directions in which a block is fixed.
struct HeldDirections {
  std::array<glm::dvec3, 3> of{};
  std::size_t count = 0;

  void add(const glm::dvec3& normal) noexcept;
  [[nodiscard]] glm::dvec3 free_component(glm::dvec3 way) const noexcept;
};

class RigidBlocks {
 public:
  // Cells first … last on each axis, inclusive.
  struct Box {
    std::array<int, 3> first{0, 0, 0}, last{-1, -1, -1};
    [[nodiscard]] bool meets(const Box& other) const noexcept {
      for (std::size_t d = 0; d < 3; ++d) {
        if (first[d] > other.last[d] || last[d] < other.first[d]) return false;
      }
      return true;
    }
  };
  struct Run {  // lanes of a row, as bits
    RowId row;
    std::uint32_t lanes;
  };
  struct Link {  // from a voxel or cell of the block to one outside
    VoxelId cell, beside;
    Spring spring;
    std::uint8_t d;
    bool up;  // `beside` is the upper end
  };
  struct OnLevel {
    std::vector<Run> rows;
    std::vector<Link> border;
    std::size_t count = 0;  // voxels or cells
    Box box;
    glm::dvec3 stiffness{0.0};  // of the border (N/m)
  };

  // `levels`: level 0 first. Allocates.
  RigidBlocks(const Lattice& lattice, const std::vector<LevelStiffness*>& levels);

  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] const OnLevel& on(int level, std::size_t block) const {
    return levels_[static_cast<std::size_t>(level)].blocks[block];
  }
  // Number of the block that a cell belongs to, plus one; 0: none.
  [[nodiscard]] std::uint16_t of(int level, VoxelId cell) const {
    return level == 0 ? lattice_.block(cell) : levels_[static_cast<std::size_t>(level)].number[cell];
  }
  [[nodiscard]] bool in_row(int level, RowId row) const {
    return levels_[static_cast<std::size_t>(level)].row[row] != 0;
  }
  // Does the row hold nothing but blocks?
  [[nodiscard]] bool fill_row(int level, RowId row) const {
    return levels_[static_cast<std::size_t>(level)].row[row] >= kFilled;
  }
  // Does the row hold nothing but blocks that the next coarser level knows? Such blocks are restricted and
  // corrected as wholes, not row by row.
  [[nodiscard]] bool fill_known_row(int level, RowId row) const {
    return levels_[static_cast<std::size_t>(level)].row[row] == kFilledKnown;
  }
  // Is the block fixed for coarse levels that do not know it?
  [[nodiscard]] bool sprawls(std::size_t block) const { return sprawls_[block] != 0; }
  // Voxels of the block that may have a load beside their springs: one of bricks or plastic links of the
  // tissue beside the block.
  [[nodiscard]] const std::vector<VoxelId>& loaded(std::size_t block) const { return loaded_[block]; }
  // Surface numbers of its surface voxels.
  [[nodiscard]] const std::vector<std::uint32_t>& surface(std::size_t block) const { return surface_[block]; }
  [[nodiscard]] VoxelId first(std::size_t block) const {
    return on(0, block).border.empty() ? VoxelId{0} : on(0, block).border.front().cell;
  }
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Level {
    std::vector<OnLevel> blocks;
    LazyArray<std::uint16_t> number;  // [cell]; empty on level 0
    std::vector<std::uint8_t> row;    // [row] 1: has cells of blocks; kFilled, kFilledKnown; 0: has none
  };
  // kFilled: the row has cells of blocks only. kFilledKnown: the next coarser level also knows all these
  // blocks.
  static constexpr std::uint8_t kFilled = 2, kFilledKnown = 3;
  // A cell, and the number of voxels of one block in it.
  struct Share {
    VoxelId cell;
    std::uint32_t voxels;
  };
  void find_voxels();
  void find_cells(int level, std::vector<std::vector<Share>>& shares, std::vector<std::uint32_t>& filled);
  [[nodiscard]] static bool compact(const Grid& grid, const std::vector<Share>& shares);
  void find_border(int level);
  void find_filled_rows(int level);
  void find_loaded();

  const Lattice& lattice_;
  std::vector<LevelStiffness*> couplings_;
  std::size_t count_;
  std::vector<Level> levels_;
  std::vector<std::uint8_t> sprawls_;  // [block]
  std::vector<std::vector<VoxelId>> loaded_;
  std::vector<std::vector<std::uint32_t>> surface_;
};

}  // namespace voxel
