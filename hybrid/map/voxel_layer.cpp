// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/map/voxel_layer.h"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

namespace hybrid {
namespace {

constexpr std::size_t kBlocksOfNewBrick = 4;  // blocks to reserve; a surface fills about half of the 8
// Voxels expected per block on load. A surface has 10 per block; expecting only 9 leaves spare blocks for
// motion.
constexpr std::size_t kVoxelsOfBlock = 9;

constexpr std::uint64_t kNoKey = ~std::uint64_t{0};

// The cell's coordinates in one word; kNoKey if they are too large for it.
std::uint64_t key_of(const CellCoordinates& cell) noexcept {
  constexpr std::int32_t kHalf = 1 << 20;  // coordinates −kHalf … kHalf − 1 fit into 21 bits
  std::uint64_t key = 0;
  for (const std::int32_t c : cell) {
    if (c < -kHalf || c >= kHalf) return kNoKey;
    key = key << 21U | static_cast<std::uint64_t>(c + kHalf);
  }
  return key;
}

}  // namespace

std::uint32_t VoxelLayer::add(std::uint32_t count) {
  const auto first = static_cast<std::uint32_t>(next_.size());
  next_.resize(next_.size() + count, kNone);
  cell_.resize(cell_.size() + count, kNone);
  key_.resize(cell_.size(), kNoKey);
  blocks_.expect(count / kVoxelsOfBlock,
                 [this](const Block& block, std::uint32_t place) { set_place(block, place); });
  return first;
}

void VoxelLayer::set_place(const Brick& brick, std::uint32_t place) noexcept {
  for (std::uint32_t bits = brick.blocks; bits != 0; bits &= bits - 1)
    blocks_[brick.place[static_cast<std::size_t>(std::countr_zero(bits))]].brick = place;
}

void VoxelLayer::set_place(const Block& block, std::uint32_t place) noexcept {
  bricks_[block.brick].place[block_in_brick(block.at)] = place;
  for (std::uint64_t bits = block.occupied; bits != 0; bits &= bits - 1) {
    const auto cell = static_cast<std::uint32_t>(std::countr_zero(bits));
    for (std::uint32_t link = link_at(block, cell);; link = next_[link & kNumber]) {
      cell_[link & kNumber] = place * kBlockCells + cell;
      if ((link & kMore) == 0) break;
    }
  }
}

void VoxelLayer::seal(std::size_t more_bricks) {
  const std::size_t more = std::min(more_bricks, next_.size());  // a voxel is in one brick
  bricks_.seal(more, [this](const Brick& brick, std::uint32_t place) { set_place(brick, place); });
  blocks_.seal(std::min(kBlocksOfNewBrick * more, next_.size()),
               [this](const Block& block, std::uint32_t place) { set_place(block, place); });
  std::vector<Full, HugePages<Full>> full;  // copied once, to exactly the needed capacity
  full.reserve(full_.size() + std::min(kBlocksOfNewBrick * more, next_.size() / kUnpackBelow));
  full.assign(full_.begin(), full_.end());
  full_ = std::move(full);
}

inline void VoxelLayer::insert(std::uint32_t number, const glm::dvec3& position, bool may_allocate) {
  const CellCoordinates to = bricks_.cell_of(position);
  // Most voxels are still in their cell, so their block need not be read.
  const std::uint64_t key = key_of(to);
  if (key != kNoKey && key_[number] == key) return;
  const CellCoordinates block = block_of(to);
  const std::uint32_t cell = cell_in_block(to), hint = hinted_brick(brick_of_block(block));
  // The new block is fetched together with the block that the voxel leaves, whose place is known. So there is
  // one wait for both.
  if (hint == kNone && blocks_.large()) blocks_.prefetch(block);
  const std::uint32_t old = cell_[number];
  if (old == kNone) {
    if (insert_in_block(number, block, cell, hint, may_allocate)) {
      key_[number] = key;
    } else {
      ++overflows_;
    }
    return;
  }
  const std::uint32_t place = old / kBlockCells, old_cell = old % kBlockCells;
  Block& left = blocks_[place];
  if (same(left.at, block)) {
    key_[number] = key;
    if (old_cell == cell) return;
    if (hint == kNone) remember_brick(left);
    if (!move_within(number, left, old_cell, cell)) {
      remove(number, left, old_cell);
      insert_in_cell(number, place, cell, false);  // there is room: the voxel was in this block
    }
    cell_[number] = place * kBlockCells + cell;
    return;
  }
  // The voxel is removed first, so that its room is free for the insertion. A voxel that was alone in its
  // brick therefore needs no other room.
  const CellCoordinates old_block = left.at;
  remove(number, left, old_cell);
  if (left.occupied == 0) remove_block(place);
  if (insert_in_block(number, block, cell, hint, may_allocate)) {
    key_[number] = key;
    return;
  }
  ++overflows_;
  insert_in_block(number, old_block, old_cell, kNone, false);  // its old room is still free
}

void VoxelLayer::place(std::uint32_t number, const glm::dvec3& position) {
  insert(number, position, true);
}

void VoxelLayer::move(std::uint32_t number, const glm::dvec3& position) noexcept {
  insert(number, position, false);
}

inline bool VoxelLayer::move_within(std::uint32_t number, Block& block, std::uint32_t from,
                                    std::uint32_t to) noexcept {
  const std::uint64_t from_bit = 1ULL << from, to_bit = 1ULL << to, others = block.occupied & ~from_bit;
  if ((others & to_bit) != 0) return false;
  if (block.full != kNone) {
    Full& full = full_[block.full];
    if (full[from] != number) return false;
    full[to] = number;
    block.occupied = others | to_bit;
    return true;
  }
  std::size_t n = bits_in(others & (from_bit - 1));
  if (block.links[n] != number) return false;
  // Only the links of the cells between `from` and `to` shift. Neighbours along x have no cell between them.
  if (to > from) {
    for (std::uint64_t bits = others & (to_bit - from_bit); bits != 0; bits &= bits - 1, ++n)
      block.links[n] = block.links[n + 1];
  } else {
    for (std::uint64_t bits = others & (from_bit - to_bit); bits != 0; bits &= bits - 1, --n)
      block.links[n] = block.links[n - 1];
  }
  block.links[n] = number;
  block.occupied = others | to_bit;
  return true;
}

inline void VoxelLayer::remove(std::uint32_t number, Block& block, std::uint32_t cell) noexcept {
  std::uint32_t *const first = &link_at(block, cell), *link = first, *before = nullptr;
  while ((*link & kNumber) != number) {
    before = link;
    link = &next_[*link & kNumber];
  }
  if ((*link & kMore) != 0) {
    *link = next_[number];
  } else if (before != nullptr) {
    *before &= ~kMore;
  } else {
    remove_cell(block, cell, first);
  }
}

void VoxelLayer::remove_block(std::uint32_t place) noexcept {
  const std::uint32_t brick = blocks_[place].brick;
  bricks_[brick].blocks &= ~(1U << block_in_brick(blocks_[place].at));
  blocks_.erase(place);
  if (bricks_[brick].blocks == 0) bricks_.release(brick);
}

inline void VoxelLayer::remove_cell(Block& block, std::uint32_t cell, std::uint32_t* link) noexcept {
  const std::size_t count = bits_in(block.occupied) - 1;
  block.occupied &= ~(1ULL << cell);
  if (block.full == kNone) {
    for (std::uint32_t* const last = block.links.data() + count; link < last; ++link) link[0] = link[1];
    return;
  }
  if (count >= kUnpackBelow) return;
  Full& full = full_[block.full];
  std::size_t n = 0;
  for (std::uint64_t bits = block.occupied; bits != 0; bits &= bits - 1)
    block.links[n++] = full[static_cast<std::size_t>(std::countr_zero(bits))];
  full[0] = free_full_;
  free_full_ = block.full;
  block.full = kNone;
}

bool VoxelLayer::add_cell(Block& block, std::uint32_t cell, std::uint32_t link, bool may_allocate) {
  const std::uint64_t bit = 1ULL << cell;
  const std::size_t count = bits_in(block.occupied);
  if (block.full == kNone && count < kPacked) {
    const std::size_t at = rank(block, bit);
    for (std::size_t n = count; n > at; --n) block.links[n] = block.links[n - 1];
    block.links[at] = link;
    block.occupied |= bit;
    return true;
  }
  if (block.full == kNone) {
    std::uint32_t number = free_full_;
    if (number != kNone) {
      free_full_ = full_[number][0];
    } else {
      if (!may_allocate && full_.size() == full_.capacity()) return false;
      number = static_cast<std::uint32_t>(full_.size());
      full_.emplace_back();
    }
    std::size_t n = 0;
    for (std::uint64_t bits = block.occupied; bits != 0; bits &= bits - 1)
      full_[number][static_cast<std::size_t>(std::countr_zero(bits))] = block.links[n++];
    block.full = number;
  }
  full_[block.full][cell] = link;
  block.occupied |= bit;
  return true;
}

std::uint32_t VoxelLayer::add_block(const CellCoordinates& at, bool may_allocate) {
  if (!may_allocate && !blocks_.has_room()) return kNone;
  const std::uint32_t brick =
      bricks_.find_or_add(brick_of_block(at), may_allocate,
                          [this](const Brick& moved, std::uint32_t place) { set_place(moved, place); });
  if (brick == kNone) return kNone;
  const std::uint32_t place = blocks_.add(
      at, may_allocate, [this](const Block& block, std::uint32_t moved) { set_place(block, moved); });
  blocks_[place].brick = brick;
  bricks_[brick].blocks |= 1U << block_in_brick(at);
  bricks_[brick].place[block_in_brick(at)] = place;
  return place;
}

inline std::uint32_t VoxelLayer::hinted_brick(const CellCoordinates& brick) const noexcept {
  for (const std::uint32_t n : last_bricks_) {
    if (n < bricks_.table().places() && same(bricks_[n].at, brick)) return n;
  }
  return kNone;
}

inline void VoxelLayer::remember_brick(const Block& block) noexcept {
  last_bricks_[1] = last_bricks_[0];
  last_bricks_[0] = block.brick;
}

inline bool VoxelLayer::insert_in_block(std::uint32_t number, const CellCoordinates& at, std::uint32_t cell,
                                        std::uint32_t hint, bool may_allocate) {
  const std::uint32_t in_brick = block_in_brick(at);
  std::uint32_t place = kNone;
  if (hint == kNone) {
    place = blocks_.find(at);
  } else if ((bricks_[hint].blocks >> in_brick & 1U) != 0) {
    place = bricks_[hint].place[in_brick];
  }
  if (place == kNone) place = add_block(at, may_allocate);
  if (place == kNone) return false;
  if (hint == kNone) remember_brick(blocks_[place]);
  return insert_in_cell(number, place, cell, may_allocate);
}

inline bool VoxelLayer::insert_in_cell(std::uint32_t number, std::uint32_t place, std::uint32_t cell,
                                       bool may_allocate) {
  Block& block = blocks_[place];
  if ((block.occupied >> cell & 1U) != 0) {
    std::uint32_t& link = link_at(block, cell);
    next_[number] = link;
    link = number | kMore;
  } else if (!add_cell(block, cell, number, may_allocate)) {
    return false;
  }
  cell_[number] = place * kBlockCells + cell;
  return true;
}

}  // namespace hybrid
