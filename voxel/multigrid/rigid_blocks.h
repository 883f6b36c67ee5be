// SPDX-License-Identifier: GPL-3.0-or-later
// Parts of an object without slack (Lattice::part), on every level of the multigrid hierarchy.
//
// A region whose links are all of one length can only be displaced as a whole: it has three unknowns, however
// many voxels it has. Voxel by voxel it would never move, since each is held by those beside it. So its
// voxels stand while rows are relaxed, and the part goes, as one, to where the springs that leave it are in
// balance. On a coarse level it is the cells of which it is half at least; these go as one, too, and soft
// tissue around is told of it as of any other cells. Where most of it is in cells of which it is
// less than half, that level, and all coarser ones, know of it as of tissue, and tell it the mean of what
// they tell its voxels: right where it lies in three cells along an axis at most. One that sprawls further,
// as a thin sheet does, or a scaffold, holds tissue together that such levels take for loose: they do not
// move it, and it holds on to the cells around it as what stands does (boundary_springs.h). (ProlongedBox
// means, it swung for ever.)
//
// (Rejected: its springs in place of its limits, so many times stiffer that nobody sees it. Round what is a
// hundred times stiffer than the rest a cycle leaves 0.83 of the error, and what is left is a strain that
// limits do not allow.)
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

// A part's motion δ must satisfy normal · δ >= -room, or, `both`, = -room.
struct BlockBound {
  glm::dvec3 normal{0.0};
  double room_m = 0.0;
  bool both = false;
  double force_N = 0.0;  // along the normal, that keeps it so
};
// Where a body goes that `force_N` pulls on springs of this stiffness, within bounds: finds their forces,
// too, from those that stand there on. Coordinate ascent of the dual (Hildreth's): with three unknowns a few
// rounds.
glm::dvec3 move_within(const glm::dvec3& force_N, const glm::dvec3& stiffness_N_per_m,
                       std::span<BlockBound> bounds) noexcept;

// Directions in which a part is held, at right angles to one another.
struct HeldDirections {
  std::array<glm::dvec3, 3> of{};
  std::size_t count = 0;

  void add(const glm::dvec3& normal) noexcept;
  [[nodiscard]] glm::dvec3 free_block(glm::dvec3 way) const noexcept;
};

class RigidBlocks {
 public:
  // Cells first … last on each axis, all included.
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
  struct Link {  // of a voxel or cell of the part to one that is not
    VoxelId cell, beside;
    Spring spring;
    std::uint8_t d;
    bool up;  // the one beside is the upper one
  };
  struct OnLevel {
    std::vector<Run> rows;
    std::vector<Link> border;
    std::size_t count = 0;  // voxels, or cells
    Box box;
    glm::dvec3 stiffness{0.0};  // of the border (N/m)
  };

  // `levels`: level 0 first. Allocates.
  RigidBlocks(const Lattice& lattice, const std::vector<LevelStiffness*>& levels);

  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] const OnLevel& on(int level, std::size_t part) const {
    return levels_[static_cast<std::size_t>(level)].parts[part];
  }
  // Number of the part that a cell belongs to, plus one; 0: to none.
  [[nodiscard]] std::uint16_t of(int level, VoxelId cell) const {
    return level == 0 ? lattice_.part(cell) : levels_[static_cast<std::size_t>(level)].number[cell];
  }
  [[nodiscard]] bool in_row(int level, RowId row) const {
    return levels_[static_cast<std::size_t>(level)].row[row] != 0;
  }
  // Is all that there is in it?
  [[nodiscard]] bool fill_row(int level, RowId row) const {
    return levels_[static_cast<std::size_t>(level)].row[row] >= kFilled;
  }
  // … and is it known on the next level, which so hears of it, and tells it, as a whole?
  [[nodiscard]] bool fill_known_row(int level, RowId row) const {
    return levels_[static_cast<std::size_t>(level)].row[row] == kFilledKnown;
  }
  // Do coarse levels that do not know it hold it where it is?
  [[nodiscard]] bool sprawls(std::size_t part) const { return sprawls_[part] != 0; }
  // Voxels of the part that have loads beside their springs: bricks, or links that yield, of what is beside.
  [[nodiscard]] const std::vector<VoxelId>& loaded(std::size_t part) const { return loaded_[part]; }
  // Its surface voxels, by number.
  [[nodiscard]] const std::vector<std::uint32_t>& surface(std::size_t part) const { return surface_[part]; }
  [[nodiscard]] VoxelId first(std::size_t part) const {
    return on(0, part).border.empty() ? VoxelId{0} : on(0, part).border.front().cell;
  }
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Level {
    std::vector<OnLevel> parts;
    LazyArray<std::uint16_t> number;  // [cell]; empty on level 0
    std::vector<std::uint8_t> row;    // [row] 1: cells of parts are in it; kFilled: and no others
  };
  static constexpr std::uint8_t kFilled = 2, kFilledKnown = 3;
  // How many voxels a cell has, and how many of them are of a part.
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
  std::vector<std::uint8_t> sprawls_;  // [part]
  std::vector<std::vector<VoxelId>> loaded_;
  std::vector<std::vector<std::uint32_t>> surface_;
};

}  // namespace voxel
