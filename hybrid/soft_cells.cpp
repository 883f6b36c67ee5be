// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/soft_cells.h"

#include <algorithm>
#include <array>
#include <bit>

namespace hybrid {
namespace {

constexpr std::size_t kBlocksOfNewBrick = 4;  // of eight; a surface passes through about half
constexpr std::size_t kFewBlocks = 8;         // that a box is asked of block by block, and not by bricks

// std::popcount is a call where the processor's newer instructions may not be assumed.
std::size_t bits_in(std::uint64_t x) noexcept {
  x -= x >> 1 & 0x5555555555555555ULL;
  x = (x & 0x3333333333333333ULL) + (x >> 2 & 0x3333333333333333ULL);
  x = (x + (x >> 4)) & 0x0F0F0F0F0F0F0F0FULL;
  return static_cast<std::size_t>(x * 0x0101010101010101ULL >> 56);
}

// Of a block of 4 x 4 x 4 cells, bit x + 4 y + 16 z: the cells of the range, which may reach beyond it.
std::uint64_t block_mask(const CellCoordinates& block, const CellRange& part) noexcept {
  std::array<std::int32_t, 3> from{}, to{};
  for (std::size_t d = 0; d < 3; ++d) {
    from[d] = std::max(0, part.low[d] - 4 * block[d]);
    to[d] = std::min(3, part.high[d] - 4 * block[d]);
    if (from[d] > to[d]) return 0;
  }
  const std::uint64_t x = ((0xFULL << from[0]) & (0xFULL >> (3 - to[0]))) * 0x1111111111111111ULL;
  const std::uint64_t y =
      ((0xFFFFULL << (4 * from[1])) & (0xFFFFULL >> (4 * (3 - to[1]))) & 0xFFFFULL) * 0x0001000100010001ULL;
  const std::uint64_t z = (~0ULL << (16 * from[2])) & (~0ULL >> (16 * (3 - to[2])));
  return x & y & z;
}

// Calls visit(block) for each block of a brick in the range, along x first.
template <class Visit>
bool each_block(const CellCoordinates& brick, const CellCoordinates& low, const CellCoordinates& high,
                const Visit& visit) noexcept {
  CellCoordinates from{}, to{}, b{};
  for (std::size_t d = 0; d < 3; ++d) {
    from[d] = std::max(low[d], 2 * brick[d]);
    to[d] = std::min(high[d], 2 * brick[d] + 1);
  }
  for (b[2] = from[2]; b[2] <= to[2]; ++b[2]) {
    for (b[1] = from[1]; b[1] <= to[1]; ++b[1]) {
      for (b[0] = from[0]; b[0] <= to[0]; ++b[0]) {
        if (!visit(b)) return false;
      }
    }
  }
  return true;
}

}  // namespace

std::size_t SoftCells::rank(const Block& block, std::uint64_t bit) noexcept {
  return bits_in(block.occupied & (bit - 1));
}

std::uint32_t SoftCells::add(std::uint32_t count) {
  const auto first = static_cast<std::uint32_t>(next_.size());
  next_.resize(next_.size() + count, kNone);
  cell_.resize(cell_.size() + count, kNone);
  return first;
}

void SoftCells::now_at(const Block& block, std::uint32_t place) noexcept {
  for (std::uint64_t bits = block.occupied; bits != 0; bits &= bits - 1) {
    const auto cell = static_cast<std::uint32_t>(std::countr_zero(bits));
    for (std::uint32_t link = link_at(block, cell);; link = next_[link & kNumber]) {
      cell_[link & kNumber] = place * kBlockCells + cell;
      if ((link & kMore) == 0) break;
    }
  }
}

void SoftCells::seal(std::size_t more_bricks) {
  const std::size_t more = std::min(more_bricks, next_.size());  // a voxel is in one brick
  bricks_.seal(more);
  blocks_.seal(std::min(kBlocksOfNewBrick * more, next_.size()),
               [this](const Block& block, std::uint32_t place) { now_at(block, place); });
  full_.shrink_to_fit();
  full_.reserve(full_.size() + std::min(kBlocksOfNewBrick * more, next_.size() / kFew));
}

void SoftCells::place(std::uint32_t number, const glm::dvec3& position) {
  put(number, position, true);
}

void SoftCells::move(std::uint32_t number, const glm::dvec3& position) noexcept {
  put(number, position, false);
}

void SoftCells::put(std::uint32_t number, const glm::dvec3& position, bool may_allocate) {
  const CellCoordinates to = bricks_.cell_of(position), block = block_of(to);
  const std::uint32_t cell = cell_in_block(to), old = cell_[number];
  if (old == kNone) {
    if (!put_in(number, block, cell, may_allocate)) ++overflows_;
    return;
  }
  const CellCoordinates old_block = blocks_[old / kBlockCells].at;
  const std::uint32_t old_cell = old % kBlockCells;
  if (old_cell == cell && same(old_block, block)) return;
  // First out, so that what it leaves is room for what it needs: a voxel that is alone needs no other.
  take_out(number);
  if (put_in(number, block, cell, may_allocate)) return;
  ++overflows_;
  put_in(number, old_block, old_cell, false);  // what it left is still there
}

void SoftCells::take_out(std::uint32_t number) noexcept {
  const std::uint32_t place = cell_[number] / kBlockCells, cell = cell_[number] % kBlockCells;
  Block& block = blocks_[place];
  std::uint32_t *link = &link_at(block, cell), *before = nullptr;
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
  remove_cell(block, cell);
  if (block.occupied != 0) return;
  const std::uint32_t brick = bricks_.find(brick_of_block(block.at));
  bricks_[brick].blocks &= ~bit_in_brick(block.at);
  blocks_.erase(place);
  if (bricks_[brick].blocks == 0) bricks_.release(brick);
}

void SoftCells::remove_cell(Block& block, std::uint32_t cell) noexcept {
  const std::size_t count = bits_in(block.occupied) - 1;
  if (block.full == kNone) {
    const std::size_t at = rank(block, 1ULL << cell);
    for (std::size_t n = at; n < count; ++n) block.links[n] = block.links[n + 1];
    block.occupied &= ~(1ULL << cell);
    return;
  }
  block.occupied &= ~(1ULL << cell);
  if (count >= kFew) return;
  Full& full = full_[block.full];
  std::size_t n = 0;
  for (std::uint64_t bits = block.occupied; bits != 0; bits &= bits - 1)
    block.links[n++] = full[static_cast<std::size_t>(std::countr_zero(bits))];
  full[0] = free_full_;
  free_full_ = block.full;
  block.full = kNone;
}

bool SoftCells::add_cell(Block& block, std::uint32_t cell, std::uint32_t link, bool may_allocate) {
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

std::uint32_t SoftCells::add_block(const CellCoordinates& at, bool may_allocate) {
  if (!may_allocate && !blocks_.has_room()) return kNone;
  const std::uint32_t brick = bricks_.find_or_add(brick_of_block(at), may_allocate);
  if (brick == kNone) return kNone;
  bricks_[brick].blocks |= bit_in_brick(at);
  return blocks_.find_or_add(at, may_allocate,
                             [this](const Block& block, std::uint32_t place) { now_at(block, place); });
}

bool SoftCells::put_in(std::uint32_t number, const CellCoordinates& at, std::uint32_t cell,
                       bool may_allocate) {
  std::uint32_t place = last_put_;
  if (place >= blocks_.places() || !same(blocks_[place].at, at)) place = blocks_.find(at);
  if (place == kNone) place = add_block(at, may_allocate);
  if (place == kNone) return false;
  last_put_ = place;
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

bool SoftCells::any_near(const glm::dvec3& low, const glm::dvec3& high) const noexcept {
  bool any = false;
  CellTrail trail;
  bricks_.each(bricks_.cells_of(low, high), trail, [&any](const Brick&, const CellRange&) {
    any = true;
    return false;
  });
  return any;
}

void SoftCells::list(const Block& block, std::uint64_t mask, std::span<std::uint32_t> out,
                     std::size_t& count) const noexcept {
  for (std::uint64_t bits = block.occupied & mask; bits != 0; bits &= bits - 1) {
    for (std::uint32_t link = link_at(block, static_cast<std::uint32_t>(std::countr_zero(bits)));;
         link = next_[link & kNumber]) {
      if (count == out.size()) return;
      out[count++] = link & kNumber;
      if ((link & kMore) == 0) break;
    }
  }
}

inline std::size_t SoftCells::in_cell(const CellCoordinates& cell, std::span<std::uint32_t> out,
                                      CellTrail& trail) const noexcept {
  const CellCoordinates at = block_of(cell);
  std::uint32_t place = blocks_.hinted(at, trail);
  if (place == kNone) {
    if (!bricks_.perhaps(cell)) return 0;
    place = blocks_.find_and_look_ahead(at, trail);
    if (place == kNone) return 0;
  }
  const Block& block = blocks_[place];
  const std::uint32_t in_block = cell_in_block(cell);
  if ((block.occupied >> in_block & 1U) == 0) return 0;
  std::size_t count = 0;
  for (std::uint32_t link = link_at(block, in_block);; link = next_[link & kNumber]) {
    if (count == out.size()) return count;
    out[count++] = link & kNumber;
    if ((link & kMore) == 0) return count;
  }
}

inline std::size_t SoftCells::in_box(const CellRange& cells, std::span<std::uint32_t> out,
                                     CellTrail& trail) const noexcept {
  std::size_t count = 0;
  const CellCoordinates a = block_of(cells.low), b = block_of(cells.high);
  if (same(a, b)) {  // one block: a point, and many small boxes
    const std::uint32_t place = block_at(a, trail);
    if (place != kNone) list(blocks_[place], block_mask(a, cells), out, count);
    return count;
  }
  double blocks = 1.0;
  for (std::size_t d = 0; d < 3; ++d) blocks *= std::max(0.0, static_cast<double>(b[d]) - a[d] + 1.0);
  if (blocks > kFewBlocks) {
    CellTrail unused;
    bricks_.each(cells, unused, [&](const Brick& brick, const CellRange& part) {
      return each_block(brick.at, a, b, [&](const CellCoordinates& at) {
        if ((brick.blocks & bit_in_brick(at)) == 0) return true;
        list(blocks_[blocks_.find(at)], block_mask(at, part), out, count);
        return count < out.size();
      });
    });
    return count;
  }
  if (!bricks_.perhaps(cells)) return count;
  // All blocks come at once. Then brick by brick, in the order in which they are of more blocks.
  CellCoordinates c{};
  for (c[2] = a[2]; blocks_.large() && c[2] <= b[2]; ++c[2]) {
    for (c[1] = a[1]; c[1] <= b[1]; ++c[1]) {
      for (c[0] = a[0]; c[0] <= b[0]; ++c[0]) {
        if (blocks_.hinted(c, trail) == kNone) blocks_.fetch(c);
      }
    }
  }
  const CellCoordinates first = brick_of_block(a), last = brick_of_block(b);
  for (c[2] = first[2]; c[2] <= last[2]; ++c[2]) {
    for (c[1] = first[1]; c[1] <= last[1]; ++c[1]) {
      for (c[0] = first[0]; c[0] <= last[0]; ++c[0]) {
        each_block(c, a, b, [&](const CellCoordinates& at) {
          const std::uint32_t place = block_at(at, trail);
          if (place != kNone) list(blocks_[place], block_mask(at, cells), out, count);
          return true;
        });
      }
    }
  }
  return count;
}

std::size_t SoftCells::in(const glm::dvec3& low, const glm::dvec3& high, std::span<std::uint32_t> out,
                          CellTrail& trail) const noexcept {
  if (blocks_.size() == 0) return 0;
  const CellCoordinates first = bricks_.cell_of(low);
  return low == high ? in_cell(first, out, trail) : in_box({first, bricks_.cell_of(high)}, out, trail);
}

std::size_t SoftCells::memory_bytes() const noexcept {
  return bricks_.memory_bytes() + blocks_.memory_bytes() + full_.capacity() * sizeof(Full) +
         (next_.capacity() + cell_.capacity()) * sizeof(std::uint32_t);
}

bool SoftCells::validate() const {
  bool right = bricks_.table().validate() && blocks_.validate();
  std::size_t listed = 0, placed = 0, full = 0, blocks_of_bricks = 0;
  blocks_.each([&](const Block& block, std::uint32_t place) {
    const std::uint32_t brick = bricks_.find(brick_of_block(block.at));
    right = right && block.occupied != 0 && brick != kNone && bricks_.perhaps_brick(bricks_[brick].at) &&
            (bricks_[brick].blocks & bit_in_brick(block.at)) != 0;
    full += block.full != kNone ? 1 : 0;
    right =
        right && (block.full != kNone ? bits_in(block.occupied) >= kFew : bits_in(block.occupied) <= kPacked);
    for (std::uint64_t bits = block.occupied; right && bits != 0; bits &= bits - 1) {
      const auto cell = static_cast<std::uint32_t>(std::countr_zero(bits));
      for (std::uint32_t link = link_at(block, cell); right; link = next_[link & kNumber]) {
        const std::uint32_t n = link & kNumber;
        right = n < next_.size() && cell_[n] == place * kBlockCells + cell && ++listed <= next_.size();
        if ((link & kMore) == 0) break;
      }
    }
  });
  // A brick holds something, and has the bits of its blocks alone.
  bricks_.table().each([&](const Brick& brick, std::uint32_t) {
    right = right && brick.blocks != 0;
    blocks_of_bricks += bits_in(brick.blocks);
  });
  for (std::uint32_t n = free_full_; n != kNone && full <= full_.size(); n = full_[n][0]) ++full;
  for (const std::uint32_t cell : cell_) placed += cell != kNone ? 1 : 0;
  return right && listed == placed && blocks_of_bricks == blocks_.size() && full == full_.size();
}

}  // namespace hybrid
