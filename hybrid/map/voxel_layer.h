// SPDX-License-Identifier: GPL-3.0-or-later
// The soft layer of the occupancy map. Each surface voxel is in the list of its cell and is moved in O(1).
//
// Blocks of 4×4×4 cells are in a hash table. A block takes two cache lines and contains the first voxel of
// every occupied cell, packed in the order of cells. A surface occupies 10 to 20 of the 64 cells. A query of
// one cell therefore waits for memory once; a chain of bricks, blocks and lists would wait three times. A
// block with too many occupied cells has an array of its own. Bricks of 2×2×2 blocks contain the places of
// their blocks. They serve boxes, voxels that move between blocks, and queries that only ask whether anything
// is near.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "hybrid/map/brick_index.h"

namespace hybrid {

class VoxelLayer {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  struct Trail {
    CellTrail blocks, bricks;
  };

  VoxelLayer(double cell_m, const glm::dvec3& origin) : bricks_(cell_m, origin) {}

  // ---- on load; these allocate ----
  std::uint32_t add(std::uint32_t count);  // returns the first of their numbers
  void place(std::uint32_t number, const glm::dvec3& position);
  // Makes room for `more_bricks` further bricks, each with four blocks that may all be full.
  void seal(std::size_t more_bricks);

  // ---- in the tick ----
  // If there is no room, the voxel stays listed in its last cell, and overflows() counts it.
  void move(std::uint32_t number, const glm::dvec3& position) noexcept;
  // Is there a voxel in a brick that the box touches?
  [[nodiscard]] bool any_near(const glm::dvec3& low, const glm::dvec3& high) const noexcept;
  // Writes the voxels of the cells that the box touches, and returns how many. They are in the order of
  // bricks along x, y, z, then blocks, then cells. In a cell the latest insertion comes first.
  [[nodiscard]] std::size_t in(const glm::dvec3& low, const glm::dvec3& high, std::span<std::uint32_t> out,
                               Trail& trail) const noexcept;

  [[nodiscard]] std::size_t bricks() const noexcept { return bricks_.size(); }
  [[nodiscard]] std::uint64_t overflows() const noexcept { return overflows_; }
  [[nodiscard]] std::size_t memory_bytes() const noexcept;
  template <class Visit>
  void each_cell(Visit&& visit) const;  // visit(cell) for every occupied cell
  [[nodiscard]] bool validate() const;

 private:
  // log2 of the edge of a block (cells), its edge, its number of cells
  static constexpr int kBlockShift = 2, kBlockEdge = 4, kBlockCells = 64;
  // greatest number of occupied cells of a block whose links are stored without gaps
  static constexpr std::size_t kPacked = 25;
  // A full block's array is freed when fewer cells than this are occupied.
  static constexpr std::size_t kUnpackBelow = 17;
  // A link is a voxel's number and a flag: kMore means that next_ has the link to another voxel of the cell.
  // For a voxel that is alone in its cell, as nearly all are, next_ is not read.
  static constexpr std::uint32_t kMore = 0x80000000U, kNumber = kMore - 1;

  struct alignas(64) Block {
    CellCoordinates at{kNoPlace, 0, 0};
    std::uint32_t full = kNone;  // index into full_; kNone: packed
    std::uint64_t occupied = 0;  // bit x + 4 y + 16 z of occupied cells
    std::uint32_t brick = kNone;
    std::array<std::uint32_t, kPacked> links;  // one per occupied cell; the rest is undefined
    Block() noexcept {}                        // NOLINT: links stay uninitialised, to save a cache line
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
    std::array<std::uint32_t, 8> place{};  // [x + 2 y + 4 z] place of an existing block
    void start(const CellCoordinates& brick) noexcept {
      at = brick;
      blocks = 0;
    }
  };
  using Full = std::array<std::uint32_t, kBlockCells>;  // [cell] link; free array: [0] is the next free one

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
  // std::popcount is a call on older instruction sets.
  [[nodiscard]] static std::size_t bits_in(std::uint64_t x) noexcept {
    x -= x >> 1 & 0x5555555555555555ULL;
    x = (x & 0x3333333333333333ULL) + (x >> 2 & 0x3333333333333333ULL);
    x = (x + (x >> 4)) & 0x0F0F0F0F0F0F0F0FULL;
    return static_cast<std::size_t>(x * 0x0101010101010101ULL >> 56);
  }
  // Number of occupied cells before that of `bit`.
  [[nodiscard]] static std::size_t rank(const Block& block, std::uint64_t bit) noexcept {
    return bits_in(block.occupied & (bit - 1));
  }
  // Link of an occupied cell.
  [[nodiscard]] const std::uint32_t& link_at(const Block& block, std::uint32_t cell) const noexcept {
    return block.full == kNone ? block.links[rank(block, 1ULL << cell)] : full_[block.full][cell];
  }
  [[nodiscard]] std::uint32_t& link_at(Block& block, std::uint32_t cell) noexcept {
    return block.full == kNone ? block.links[rank(block, 1ULL << cell)] : full_[block.full][cell];
  }

  void insert(std::uint32_t number, const glm::dvec3& position, bool may_allocate);
  // False if another voxel is in one of the two cells; nothing is changed then.
  bool move_within(std::uint32_t number, Block& block, std::uint32_t from, std::uint32_t to) noexcept;
  // Removes the voxel from its cell; the block may be empty afterwards.
  void remove(std::uint32_t number, Block& block, std::uint32_t cell) noexcept;
  // Frees an empty block, and its brick if that is empty too.
  void remove_block(std::uint32_t place) noexcept;
  // False if there is no room; nothing is changed then. `hint`: the block's brick, or kNone if unknown.
  bool insert_in_block(std::uint32_t number, const CellCoordinates& block, std::uint32_t cell,
                       std::uint32_t hint, bool may_allocate);
  bool insert_in_cell(std::uint32_t number, std::uint32_t place, std::uint32_t cell, bool may_allocate);
  [[nodiscard]] std::uint32_t hinted_brick(const CellCoordinates& brick) const noexcept;
  void remember_brick(const Block& block) noexcept;
  [[nodiscard]] std::uint32_t add_block(const CellCoordinates& at, bool may_allocate);
  bool add_cell(Block& block, std::uint32_t cell, std::uint32_t link, bool may_allocate);
  void remove_cell(Block& block, std::uint32_t cell, std::uint32_t* link) noexcept;
  void set_place(const Block& block, std::uint32_t place) noexcept;
  void set_place(const Brick& brick, std::uint32_t place) noexcept;

  // The rare parts of in() are separate functions, so that its common path is short and needs no stack.
  [[nodiscard, gnu::noinline]] std::size_t in_other_block(const CellCoordinates& cell,
                                                          std::span<std::uint32_t> out,
                                                          Trail& trail) const noexcept;
  [[nodiscard, gnu::noinline]] std::size_t in_box(const glm::dvec3& low, const glm::dvec3& high,
                                                  std::span<std::uint32_t> out, Trail& trail) const noexcept;
  [[nodiscard, gnu::always_inline]] std::size_t in_cell(const Block& block, std::uint32_t cell,
                                                        std::span<std::uint32_t> out) const noexcept;
  // Writes the rest of a list whose first voxel is written already.
  [[nodiscard, gnu::noinline]] std::size_t write_rest(std::uint32_t link,
                                                      std::span<std::uint32_t> out) const noexcept;
  // Writes the voxels of the cells in `bits`, all of which are occupied.
  void write_cells(const Block& block, std::uint64_t bits, std::span<std::uint32_t> out,
                   std::size_t& count) const noexcept;

  BrickIndex<Brick> bricks_;
  CellTable<Block> blocks_;
  std::vector<Full, HugePages<Full>> full_;
  std::uint32_t free_full_ = kNone;
  std::vector<std::uint32_t, HugePages<std::uint32_t>> next_;  // [number] link to the next voxel in its cell
  // [number] place of block · 64 + cell, or kNone.
  std::vector<std::uint32_t, HugePages<std::uint32_t>> cell_;
  std::vector<std::uint64_t, HugePages<std::uint64_t>> key_;  // [number] the cell's coordinates in one word
  // Bricks of the last insertions; the next insertion is mostly in one of them. There are two, because the
  // two sides of a thin object are numbered in turns.
  std::array<std::uint32_t, 2> last_bricks_{};
  std::uint64_t overflows_ = 0;
};

template <class Visit>
void VoxelLayer::each_cell(Visit&& visit) const {
  blocks_.each([&visit](const Block& block, std::uint32_t) {
    for (std::int32_t cell = 0; cell < kBlockCells; ++cell) {
      if ((block.occupied >> cell & 1U) == 0) continue;
      visit(CellCoordinates{block.at[0] * kBlockEdge + cell % 4, block.at[1] * kBlockEdge + cell / 4 % 4,
                            block.at[2] * kBlockEdge + cell / 16});
    }
  });
}

}  // namespace hybrid
