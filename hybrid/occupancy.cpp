// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/occupancy.h"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

namespace hybrid {
namespace {

constexpr std::size_t kBlocksOfNewBrick = 4;  // of eight; a surface passes through about half

// Of a block of 4 x 4 x 4 cells, bit x + 4 y + 16 z: the cells of the range, which may reach beyond it.
std::uint64_t block_mask(const CellCoordinates& block_low, const CellRange& part) noexcept {
  std::array<std::int32_t, 3> from{}, to{};
  for (std::size_t d = 0; d < 3; ++d) {
    from[d] = std::max(0, part.low[d] - block_low[d]);
    to[d] = std::min(3, part.high[d] - block_low[d]);
    if (from[d] > to[d]) return 0;
  }
  const std::uint64_t x = ((0xFULL << from[0]) & (0xFULL >> (3 - to[0]))) * 0x1111111111111111ULL;
  const std::uint64_t y =
      ((0xFFFFULL << (4 * from[1])) & (0xFFFFULL >> (4 * (3 - to[1]))) & 0xFFFFULL) * 0x0001000100010001ULL;
  const std::uint64_t z = (~0ULL << (16 * from[2])) & (~0ULL >> (16 * (3 - to[2])));
  return x & y & z;
}

}  // namespace

OccupancyMap::OccupancyMap(double cell_m, const glm::dvec3& origin)
    : fixed_(cell_m, origin), soft_index_(cell_m, origin) {}

void OccupancyMap::add_triangle(std::uint32_t object, const glm::dvec3& a, const glm::dvec3& b,
                                const glm::dvec3& c, double margin_m) {
  fixed_.add_triangle(rigid_bit(object), a, b, c, margin_m);
}

void OccupancyMap::add_moving(std::uint32_t object, std::shared_ptr<const SurfaceCells> cells,
                              const glm::dvec3& position, const glm::dquat& rotation) {
  moving_.add(object, rigid_bit(object), std::move(cells), position, rotation);
}

std::uint32_t OccupancyMap::add_soft(std::uint32_t count) {
  const auto first = static_cast<std::uint32_t>(next_.size());
  next_.resize(next_.size() + count, kNone);
  soft_cell_.resize(soft_cell_.size() + count, kNone);
  return first;
}

void OccupancyMap::reserve_bricks(std::size_t more) {
  fixed_.seal();
  more = std::min(more, next_.size());  // a voxel is in one brick
  soft_index_.seal(more);
  soft_bricks_.shrink_to_fit();
  soft_bricks_.reserve(soft_bricks_.size() + more);
  soft_blocks_.shrink_to_fit();
  soft_blocks_.reserve(soft_blocks_.size() + std::min(kBlocksOfNewBrick * more, next_.size()));
}

void OccupancyMap::place(std::uint32_t number, const glm::dvec3& position) {
  put(number, position, true);
}

void OccupancyMap::move(std::uint32_t number, const glm::dvec3& position) noexcept {
  put(number, position, false);
}

void OccupancyMap::move_body(std::uint32_t object, const glm::dvec3& position,
                             const glm::dquat& rotation) noexcept {
  moving_.move(object, position, rotation);
}

void OccupancyMap::put(std::uint32_t number, const glm::dvec3& position, bool may_allocate) {
  const CellCoordinates cell = soft_index_.cell_of(position);
  const CellCoordinates at = BrickIndex::brick_of(cell);
  const Within within = within_brick(cell);
  const std::uint32_t old = soft_cell_[number];
  if (old == kNone) {
    if (!put_in(number, at, within, may_allocate)) ++overflows_;
    return;
  }
  const Within left{old % kCells / kBlockCells, old % kBlockCells};
  const CellCoordinates old_at = soft_index_.at(old / kCells);
  if (left.block == within.block && left.cell == within.cell && old_at == at) return;
  // First out, so that what it leaves is room for what it needs: a voxel that is alone needs no other.
  take_out(number);
  if (put_in(number, at, within, may_allocate)) return;
  ++overflows_;
  put_in(number, old_at, left, false);  // what it left is still there
}

void OccupancyMap::take_out(std::uint32_t number) noexcept {
  const std::uint32_t at = soft_cell_[number], block = at % kCells / kBlockCells, cell = at % kBlockCells;
  SoftBrick& brick = soft_bricks_[at / kCells];
  BlockOfBrick& of = brick.block[block];
  SoftBlock& heads = soft_blocks_[of.number];
  std::uint32_t *link = &heads[cell], *before = nullptr;
  while ((*link & kNumber) != number) {
    before = link;
    link = &next_[*link & kNumber];
  }
  if ((*link & kMore) != 0) {
    *link = next_[number];
    return;
  }
  if (before != nullptr) {
    *before &= ~kMore;
    return;
  }
  of.occupied &= ~(1ULL << cell);
  if (of.occupied != 0) return;
  heads[0] = free_block_;
  free_block_ = of.number;
  std::uint64_t any = 0;
  for (const BlockOfBrick& b : brick.block) any |= b.occupied;
  if (any == 0) soft_index_.release(at / kCells);
}

bool OccupancyMap::put_in(std::uint32_t number, const CellCoordinates& brick, const Within& at,
                          bool may_allocate) {
  const bool room_for_block =
      may_allocate || free_block_ != kNone || soft_blocks_.size() < soft_blocks_.capacity();
  std::uint32_t b = soft_index_.find(brick);
  if (b == kNone) {
    if (!room_for_block) return false;
    b = soft_index_.find_or_add(brick, may_allocate);
    if (b == kNone) return false;
    if (b == soft_bricks_.size()) soft_bricks_.emplace_back();
  }
  BlockOfBrick& to = soft_bricks_[b].block[at.block];
  const std::uint64_t bit = 1ULL << at.cell;
  if (to.occupied == 0) {
    if (!room_for_block) return false;
    if (free_block_ != kNone) {
      to.number = free_block_;
      free_block_ = soft_blocks_[free_block_][0];
    } else {
      to.number = static_cast<std::uint32_t>(soft_blocks_.size());
      soft_blocks_.emplace_back();
    }
  }
  std::uint32_t& head = soft_blocks_[to.number][at.cell];
  const bool more = (to.occupied & bit) != 0;
  if (more) next_[number] = head;
  head = number | (more ? kMore : 0U);
  to.occupied |= bit;
  soft_cell_[number] = b * kCells + at.block * kBlockCells + at.cell;
  return true;
}

bool OccupancyMap::any_near(const glm::dvec3& low, const glm::dvec3& high) const noexcept {
  if (fixed_.any_near(low, high)) return true;
  if (!moving_.empty() && moving_.any_near(low, high)) return true;
  bool any = false;
  soft_index_.each(low, high, [&any](std::uint32_t, const CellRange&) {
    any = true;
    return false;
  });
  return any;
}

std::uint64_t OccupancyMap::rigid_in(const glm::dvec3& low, const glm::dvec3& high) const noexcept {
  const std::uint64_t fixed = fixed_.objects_in(low, high);
  return moving_.empty() ? fixed : fixed | moving_.objects_in(low, high);
}

std::size_t OccupancyMap::soft_in(const glm::dvec3& low, const glm::dvec3& high,
                                  std::span<std::uint32_t> out) const noexcept {
  std::size_t count = 0;
  soft_index_.each(low, high, [&](std::uint32_t n, const CellRange& part) {
    const SoftBrick& brick = soft_bricks_[n];
    const auto list = [&](std::uint32_t link) {  // false: no more room
      for (;; link = next_[link & kNumber]) {
        if (count == out.size()) return false;
        out[count++] = link & kNumber;
        if ((link & kMore) == 0) return true;
      }
    };
    if (part.low == part.high) {
      const Within at = within_brick(part.low);
      const BlockOfBrick& of = brick.block[at.block];
      return (of.occupied >> at.cell & 1U) == 0 || list(soft_blocks_[of.number][at.cell]);
    }
    CellCoordinates first{}, from{}, to{}, b{};
    for (std::size_t d = 0; d < 3; ++d) {
      constexpr std::int32_t in_brick = BrickIndex::kEdge - 1;
      first[d] = part.low[d] & ~in_brick;
      from[d] = (part.low[d] & in_brick) >> kBlockShift;
      to[d] = (part.high[d] & in_brick) >> kBlockShift;
    }
    for (b[2] = from[2]; b[2] <= to[2]; ++b[2]) {
      for (b[1] = from[1]; b[1] <= to[1]; ++b[1]) {
        for (b[0] = from[0]; b[0] <= to[0]; ++b[0]) {
          const auto block = static_cast<std::size_t>(b[0] + 2 * b[1] + 4 * b[2]);
          std::uint64_t bits = brick.block[block].occupied;
          if (bits == 0) continue;
          bits &= block_mask({first[0] + 4 * b[0], first[1] + 4 * b[1], first[2] + 4 * b[2]}, part);
          if (bits == 0) continue;
          const SoftBlock& heads = soft_blocks_[brick.block[block].number];
          for (; bits != 0; bits &= bits - 1) {
            if (!list(heads[static_cast<std::size_t>(std::countr_zero(bits))])) return false;
          }
        }
      }
    }
    return true;
  });
  return count;
}

std::size_t OccupancyMap::occupied_cells() const noexcept {
  std::size_t cells = fixed_.occupied_cells() + moving_.occupied_cells();
  for (std::uint32_t n = 0; n < soft_bricks_.size(); ++n) {
    const CellCoordinates& at = soft_index_.at(n);  // a released brick has no bit
    for (std::int32_t b = 0; b < kBlocks; ++b) {
      for (std::uint64_t bits = soft_bricks_[n].block[static_cast<std::size_t>(b)].occupied; bits != 0;
           bits &= bits - 1) {
        constexpr std::int32_t edge = BrickIndex::kEdge;
        const std::int32_t i = std::countr_zero(bits);
        cells += fixed_.occupied({at[0] * edge + b % 2 * 4 + i % 4, at[1] * edge + b / 2 % 2 * 4 + i / 4 % 4,
                                  at[2] * edge + b / 4 * 4 + i / 16})
                     ? 0
                     : 1;
      }
    }
  }
  return cells;
}

std::size_t OccupancyMap::memory_bytes() const {
  return fixed_.memory_bytes() + moving_.memory_bytes() + soft_index_.memory_bytes() +
         soft_bricks_.capacity() * sizeof(SoftBrick) + soft_blocks_.capacity() * sizeof(SoftBlock) +
         (next_.capacity() + soft_cell_.capacity()) * sizeof(std::uint32_t);
}

bool OccupancyMap::validate() const {
  std::size_t listed = 0, placed = 0, bricks = 0, blocks = 0;
  for (std::uint32_t b = 0; b < soft_bricks_.size(); ++b) {
    const std::size_t before = listed;
    for (std::uint32_t i = 0; i < kCells; ++i) {
      const std::uint32_t block = i / kBlockCells, cell = i % kBlockCells;
      const BlockOfBrick& of = soft_bricks_[b].block[block];
      blocks += cell == 0 && of.occupied != 0 ? 1 : 0;
      if ((of.occupied >> cell & 1U) == 0) continue;
      for (std::uint32_t link = soft_blocks_[of.number][cell];; link = next_[link & kNumber]) {
        const std::uint32_t n = link & kNumber;
        if (n >= next_.size() || soft_cell_[n] != b * kCells + i || ++listed > next_.size()) return false;
        if ((link & kMore) == 0) break;
      }
    }
    // A brick is found where it says it is exactly when it holds something.
    const bool holds = listed != before;
    if ((soft_index_.find(soft_index_.at(b)) == b) != holds) return false;
    bricks += holds ? 1 : 0;
  }
  for (std::uint32_t n = free_block_; n != kNone && blocks <= soft_blocks_.size(); n = soft_blocks_[n][0])
    ++blocks;
  for (const std::uint32_t cell : soft_cell_) placed += cell != kNone ? 1 : 0;
  return listed == placed && bricks == soft_index_.live() && blocks == soft_blocks_.size() &&
         moving_.validate();
}

}  // namespace hybrid
