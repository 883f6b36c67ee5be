// SPDX-License-Identifier: GPL-3.0-or-later
// The shared occupancy map: which surface voxels and which rigid surfaces lie in which cell of the scene.
//
// Sparse: bricks of 8×8×8 cells in hash tables; memory follows occupied cells, not the scene's extent. Three
// layers, one question. Fixed rigid surfaces are rasterised conservatively on load, a bit a cell, and a cell
// says only that some of them pass: the exact question goes to the surface itself. Moving rigid bodies carry
// such cells in their own frame, so that what is known of them is never stale. Soft surface voxels are kept
// one by one (an intrusive list a cell), moved in O(1).
#pragma once

#include <array>
#include <cstdint>
#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <span>
#include <vector>

#include "hybrid/brick_index.h"
#include "hybrid/moving_cells.h"
#include "hybrid/surface_cells.h"

namespace hybrid {

class OccupancyMap {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  // `cell_m` > 0; `origin` near the scene, so that cells are exact far from the world's origin.
  OccupancyMap(double cell_m, const glm::dvec3& origin);

  // ---- on load; these allocate ----
  // A triangle of fixed rigid object number `object`: every cell that comes within `margin_m` of it.
  void add_triangle(std::uint32_t object, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                    double margin_m = 0.0);
  // Rigid object number `object` moves: its surface in its own frame, sealed, and where it is now (body to
  // scene).
  void add_moving(std::uint32_t object, std::shared_ptr<const SurfaceCells> cells, const glm::dvec3& position,
                  const glm::dquat& rotation);
  // `count` soft surface voxels get numbers of their own; returns the first. Then place each.
  std::uint32_t add_soft(std::uint32_t count);
  void place(std::uint32_t number, const glm::dvec3& position);
  // Room for motion: bricks may grow by this many without allocating. Call once, after everything is placed.
  // Voxels need no more than one brick each, and a brick that the last one leaves is room again: however long
  // they wander, only how many bricks (and blocks of them, of which there are four for each) they are in at
  // one time counts.
  void reserve_bricks(std::size_t more);

  // ---- in the tick; these do not allocate ----
  // Soft voxel `number` is now at `position` (scene frame, meters).
  void move(std::uint32_t number, const glm::dvec3& position) noexcept;
  // The moving rigid object is now there. O(1); every question asked later is answered for this pose.
  void move_body(std::uint32_t object, const glm::dvec3& position, const glm::dquat& rotation) noexcept;
  // Does anything at all lie in a brick that this box touches? The cheapest question: no cell is looked at.
  [[nodiscard]] bool any_near(const glm::dvec3& low, const glm::dvec3& high) const noexcept;
  // Bit per rigid object (objects beyond 62 share bit 63) with surface in a brick of which the box touches an
  // occupied cell: never too few, perhaps too many; the exact question goes to the surface.
  [[nodiscard]] std::uint64_t rigid_in(const glm::dvec3& low, const glm::dvec3& high) const noexcept;
  // Soft voxel numbers in the cells that the box touches; returns how many were written, at most out.size().
  [[nodiscard]] std::size_t soft_in(const glm::dvec3& low, const glm::dvec3& high,
                                    std::span<std::uint32_t> out) const noexcept;

  [[nodiscard]] double cell_m() const { return fixed_.cell_m(); }
  [[nodiscard]] std::size_t occupied_cells() const noexcept;
  [[nodiscard]] std::size_t memory_bytes() const;
  // Bricks in which soft voxels are: never an empty one.
  [[nodiscard]] std::size_t soft_bricks() const noexcept { return soft_index_.live(); }
  // Moves that found no room for a brick: raise the reserve. The voxel stays known at its last cell.
  [[nodiscard]] std::uint64_t overflows() const { return overflows_; }
  // Of moving bodies: districts entered or left since they were added.
  [[nodiscard]] std::uint64_t district_changes() const noexcept { return moving_.district_changes(); }
  // For tests: every soft voxel stands in the list of the cell it says it is in, every moving body in those
  // of its districts, and nowhere else.
  [[nodiscard]] bool validate() const;

  [[nodiscard]] static std::uint64_t rigid_bit(std::uint32_t object) {
    return 1ULL << (object < 63 ? object : 63);
  }

 private:
  static constexpr int kCells = BrickIndex::kCells;
  // Of a soft brick's cells only those blocks have room for voxels in which some are: a surface passes
  // through about half of them.
  static constexpr int kBlockShift = 2, kBlocks = 8, kBlockCells = kCells / kBlocks;  // 4 x 4 x 4 cells
  struct BlockOfBrick {
    std::uint64_t occupied = 0;  // bit x + 4 y + 16 z: the cell is
    std::uint32_t number = 0;    // of soft_blocks_, where any cell is occupied
  };
  struct alignas(64) SoftBrick {  // what is known of a block lies in one cache line
    std::array<BlockOfBrick, kBlocks> block{};
  };
  static_assert(sizeof(SoftBrick) == 128);
  // [cell] a link to its first soft voxel. What is not occupied has no meaning: nothing is written over when
  // a block is used again.
  using SoftBlock = std::array<std::uint32_t, kBlockCells>;
  // A link is a voxel's number and whether there is another after it: then next_ has the link to that one,
  // and where a voxel is alone in its cell, as nearly all are, next_ is not read.
  static constexpr std::uint32_t kMore = 0x80000000U, kNumber = kMore - 1;
  struct Within {  // a brick
    std::uint32_t block, cell;
  };
  [[nodiscard]] static Within within_brick(const CellCoordinates& cell) noexcept {
    const auto part = [&cell](std::size_t d) {
      return static_cast<std::uint32_t>(cell[d] & (BrickIndex::kEdge - 1));
    };
    const std::uint32_t x = part(0), y = part(1), z = part(2);
    return {(x >> 2) + 2 * (y >> 2) + 4 * (z >> 2), (x & 3) + 4 * (y & 3) + 16 * (z & 3)};
  }

  void put(std::uint32_t number, const glm::dvec3& position, bool may_allocate);
  // Out of its cell; a block and a brick that are then empty are room again.
  void take_out(std::uint32_t number) noexcept;
  // False: there is no room, and nothing was changed.
  bool put_in(std::uint32_t number, const CellCoordinates& brick, const Within& at, bool may_allocate);

  SurfaceCells fixed_;
  MovingCells moving_;
  BrickIndex soft_index_;
  std::vector<SoftBrick> soft_bricks_;  // [brick of soft_index_]
  std::vector<SoftBlock> soft_blocks_;  // [number]; of free ones the first entry is the next free one
  std::uint32_t free_block_ = kNone;
  std::vector<std::uint32_t> next_;  // [soft number] link to the next in its cell, if any
  std::vector<std::uint32_t>
      soft_cell_;  // [soft number] brick · kCells + block · kBlockCells + cell, or kNone
  std::uint64_t overflows_ = 0;
};

}  // namespace hybrid
