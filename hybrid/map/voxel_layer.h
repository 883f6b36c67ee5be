// SPDX-License-Identifier: GPL-3.0-or-later
// The soft layer of the occupancy map: surface voxels, one by one, each in the list of its cell, moved in
// O(1).
//
// Blocks of 4×4×4 cells lie in a hash table of two cache lines each, with the first voxel of every occupied
// cell packed in the order of cells: a surface passes through 10 to 20 of 64. So one cell is looked up in one
// wait for the memory, where a table of bricks that lead to blocks that lead to lists waits three times. A
// block too full for that has an array of its own. Bricks of 2×2×2 blocks say where their blocks lie, for
// boxes, for what moves from one to another and for what only asks whether anything is near.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "hybrid/map/brick_index.h"

namespace hybrid {

class SoftCells {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  struct Trail {
    CellTrail blocks, bricks;
  };

  SoftCells(double cell_m, const glm::dvec3& origin) : bricks_(cell_m, origin) {}

  // ---- on load; these allocate ----
  std::uint32_t add(std::uint32_t count);  // returns the first of their numbers
  void place(std::uint32_t number, const glm::dvec3& position);
  // Room for so many more bricks, four blocks in each, and as many blocks that are full.
  void seal(std::size_t more_bricks);

  // ---- in the tick ----
  // Without room the voxel stays known where it was, and overflows() counts it.
  void move(std::uint32_t number, const glm::dvec3& position) noexcept;
  // Is there a voxel in a brick that the box touches?
  [[nodiscard]] bool any_near(const glm::dvec3& low, const glm::dvec3& high) const noexcept;
  // Voxels of the cells that the box touches: bricks along x, y, z, in these blocks, in these cells, in these
  // the last that came first.
  [[nodiscard]] std::size_t in(const glm::dvec3& low, const glm::dvec3& high, std::span<std::uint32_t> out,
                               Trail& trail) const noexcept;

  [[nodiscard]] std::size_t bricks() const noexcept { return bricks_.size(); }
  [[nodiscard]] std::uint64_t overflows() const noexcept { return overflows_; }
  [[nodiscard]] std::size_t memory_bytes() const noexcept;
  template <class Visit>
  void each_cell(Visit&& visit) const;  // visit(cell), of every occupied one
  [[nodiscard]] bool validate() const;

 private:
  static constexpr int kBlockShift = 2, kBlockEdge = 4, kBlockCells = 64;
  static constexpr std::size_t kPacked = 25;
  // Fewer than so many cells and an array of its own is given back.
  static constexpr std::size_t kFew = 17;
  // A link is a voxel's number and whether there is another after it: then next_ has the link to that one,
  // and where a voxel is alone in its cell, as nearly all are, next_ is not read.
  static constexpr std::uint32_t kMore = 0x80000000U, kNumber = kMore - 1;

  struct alignas(64) Block {
    CellCoordinates at{kNoPlace, 0, 0};
    std::uint32_t full = kNone;  // number in full_; kNone: packed
    std::uint64_t occupied = 0;  // bit x + 4 y + 16 z: the cell is
    std::uint32_t brick = kNone;
    std::array<std::uint32_t, kPacked> links;  // as many as cells are occupied; the rest has no meaning
    Block() noexcept {}                        // NOLINT: links stay as they are, a cache line of memory
    void start(const CellCoordinates& block) noexcept {
      at = block;
      full = kNone;
      occupied = 0;
    }
  };
  static_assert(sizeof(Block) == 128);
  struct Brick {
    CellCoordinates at{kNoPlace, 0, 0};
    std::uint32_t blocks = 0;              // bit x + 2 y + 4 z: the block exists
    std::array<std::uint32_t, 8> place{};  // [x + 2 y + 4 z], of those that do
    void start(const CellCoordinates& brick) noexcept {
      at = brick;
      blocks = 0;
    }
  };
  using Full = std::array<std::uint32_t, kBlockCells>;  // [cell] link; free: [0] is the next free one

  [[nodiscard]] static CellCoordinates block_of(const CellCoordinates& cell) noexcept {
    return {cell[0] >> kBlockShift, cell[1] >> kBlockShift, cell[2] >> kBlockShift};
  }
  [[nodiscard]] static CellCoordinates brick_of_block(const CellCoordinates& block) noexcept {
    return {block[0] >> 1, block[1] >> 1, block[2] >> 1};
  }
  [[nodiscard]] static std::uint32_t block_in_brick(const CellCoordinates& block) noexcept {
    return static_cast<std::uint32_t>((block[0] & 1) + 2 * (block[1] & 1) + 4 * (block[2] & 1));
  }
  [[nodiscard]] static std::uint32_t cell_in_block(const CellCoordinates& cell) noexcept {
    return static_cast<std::uint32_t>((cell[0] & 3) + 4 * (cell[1] & 3) + 16 * (cell[2] & 3));
  }
  [[nodiscard]] static std::size_t rank(const Block& block, std::uint64_t bit) noexcept;
  // Of an occupied cell.
  [[nodiscard]] const std::uint32_t& link_at(const Block& block, std::uint32_t cell) const noexcept {
    return block.full == kNone ? block.links[rank(block, 1ULL << cell)] : full_[block.full][cell];
  }
  [[nodiscard]] std::uint32_t& link_at(Block& block, std::uint32_t cell) noexcept {
    return block.full == kNone ? block.links[rank(block, 1ULL << cell)] : full_[block.full][cell];
  }

  void put(std::uint32_t number, const glm::dvec3& position, bool may_allocate);
  // False, and nothing is changed: there are others in one of the two cells.
  bool move_within(std::uint32_t number, Block& block, std::uint32_t from, std::uint32_t to) noexcept;
  // Out of its cell; the block may then be empty.
  void take_out(std::uint32_t number, Block& block, std::uint32_t cell) noexcept;
  // A block that is empty, and a brick that then is, are room again.
  void remove_block(std::uint32_t place) noexcept;
  // False: there is no room, and nothing was changed. `hint`: the block's brick, or kNone where it is not
  // known.
  bool put_in(std::uint32_t number, const CellCoordinates& block, std::uint32_t cell, std::uint32_t hint,
              bool may_allocate);
  bool link_in(std::uint32_t number, std::uint32_t place, std::uint32_t cell, bool may_allocate);
  [[nodiscard]] std::uint32_t hinted_brick(const CellCoordinates& brick) const noexcept;
  void put_next_to(const Block& block) noexcept;
  [[nodiscard]] std::uint32_t add_block(const CellCoordinates& at, bool may_allocate);
  bool add_cell(Block& block, std::uint32_t cell, std::uint32_t link, bool may_allocate);
  void remove_cell(Block& block, std::uint32_t cell, std::uint32_t* link) noexcept;
  void now_at(const Block& block, std::uint32_t place) noexcept;
  void now_at(const Brick& brick, std::uint32_t place) noexcept;

  // What in() rarely comes to, apart: so that what it mostly does is short and needs no stack.
  [[nodiscard, gnu::noinline]] std::size_t in_other_block(const CellCoordinates& cell,
                                                          std::span<std::uint32_t> out,
                                                          Trail& trail) const noexcept;
  [[nodiscard, gnu::noinline]] std::size_t in_box(const glm::dvec3& low, const glm::dvec3& high,
                                                  std::span<std::uint32_t> out, Trail& trail) const noexcept;
  [[nodiscard, gnu::always_inline]] std::size_t in_cell(const Block& block, std::uint32_t cell,
                                                        std::span<std::uint32_t> out) const noexcept;
  // All of a list but the first, which is written.
  [[nodiscard, gnu::noinline]] std::size_t follow(std::uint32_t link,
                                                  std::span<std::uint32_t> out) const noexcept;
  // Writes what the cells of these bits hold, all of which are occupied.
  void list(const Block& block, std::uint64_t bits, std::span<std::uint32_t> out,
            std::size_t& count) const noexcept;

  BrickIndex<Brick> bricks_;
  CellTable<Block> blocks_;
  std::vector<Full, HugePages<Full>> full_;
  std::uint32_t free_full_ = kNone;
  std::vector<std::uint32_t, HugePages<std::uint32_t>> next_;  // [number] link to the next in its cell
  std::vector<std::uint32_t, HugePages<std::uint32_t>>
      cell_;  // [number] place of block · 64 + cell, or kNone
  std::vector<std::uint64_t, HugePages<std::uint64_t>> key_;  // [number] the cell's coordinates in one word
  // Bricks that were put into last, mostly the next one's too: of a surface whose two sides are numbered in
  // turns, the last but one.
  std::array<std::uint32_t, 2> last_put_{};
  std::uint64_t overflows_ = 0;
};

template <class Visit>
void SoftCells::each_cell(Visit&& visit) const {
  blocks_.each([&visit](const Block& block, std::uint32_t) {
    for (std::int32_t cell = 0; cell < kBlockCells; ++cell) {
      if ((block.occupied >> cell & 1U) == 0) continue;
      visit(CellCoordinates{block.at[0] * kBlockEdge + cell % 4, block.at[1] * kBlockEdge + cell / 4 % 4,
                            block.at[2] * kBlockEdge + cell / 16});
    }
  });
}

}  // namespace hybrid
