// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/map/voxel_layer.h"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

namespace hybrid {
namespace {

constexpr std::size_t kBlocksOfNewBrick = 4;  // of eight; a surface passes through about half
// Of voxels that are expected on load, in a block: of a surface 10 are, and a few blocks more are for motion.
constexpr std::size_t kVoxelsOfBlock = 9;
constexpr std::size_t kParts = 16;                    // of a box, blocks that are fetched together
constexpr std::size_t kLarge = std::size_t{1} << 19;  // bytes: more than a core's own cache has room for

// std::popcount is a call where the processor's newer instructions may not be assumed.
std::size_t bits_in(std::uint64_t x) noexcept {
  x -= x >> 1 & 0x5555555555555555ULL;
  x = (x & 0x3333333333333333ULL) + (x >> 2 & 0x3333333333333333ULL);
  x = (x + (x >> 4)) & 0x0F0F0F0F0F0F0F0FULL;
  return static_cast<std::size_t>(x * 0x0101010101010101ULL >> 56);
}

// In integers, which takes one branch; where only zero's sign differs, the answer for a box is the same.
bool same_bits(const glm::dvec3& a, const glm::dvec3& b) noexcept {
  const auto differ = [](double x, double y) {
    return std::bit_cast<std::uint64_t>(x) ^ std::bit_cast<std::uint64_t>(y);
  };
  return (differ(a.x, b.x) | differ(a.y, b.y) | differ(a.z, b.z)) == 0;
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

namespace {

constexpr std::uint64_t kNoKey = ~std::uint64_t{0};

// A cell in one word; none where it is so far out that it has no room there.
std::uint64_t key_of(const CellCoordinates& cell) noexcept {
  constexpr std::int32_t kHalf = 1 << 20;
  std::uint64_t key = 0;
  for (const std::int32_t c : cell) {
    if (c < -kHalf || c >= kHalf) return kNoKey;
    key = key << 21U | static_cast<std::uint64_t>(c + kHalf);
  }
  return key;
}

}  // namespace

std::size_t SoftCells::rank(const Block& block, std::uint64_t bit) noexcept {
  return bits_in(block.occupied & (bit - 1));
}

std::uint32_t SoftCells::add(std::uint32_t count) {
  const auto first = static_cast<std::uint32_t>(next_.size());
  next_.resize(next_.size() + count, kNone);
  cell_.resize(cell_.size() + count, kNone);
  key_.resize(cell_.size(), kNoKey);
  blocks_.expect(count / kVoxelsOfBlock,
                 [this](const Block& block, std::uint32_t place) { now_at(block, place); });
  return first;
}

void SoftCells::now_at(const Brick& brick, std::uint32_t place) noexcept {
  for (std::uint32_t bits = brick.blocks; bits != 0; bits &= bits - 1)
    blocks_[brick.place[static_cast<std::size_t>(std::countr_zero(bits))]].brick = place;
}

void SoftCells::now_at(const Block& block, std::uint32_t place) noexcept {
  bricks_[block.brick].place[block_in_brick(block.at)] = place;
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
  bricks_.seal(more, [this](const Brick& brick, std::uint32_t place) { now_at(brick, place); });
  blocks_.seal(std::min(kBlocksOfNewBrick * more, next_.size()),
               [this](const Block& block, std::uint32_t place) { now_at(block, place); });
  std::vector<Full, HugePages<Full>> full;  // as many as that and no more, in one copy
  full.reserve(full_.size() + std::min(kBlocksOfNewBrick * more, next_.size() / kFew));
  full.assign(full_.begin(), full_.end());
  full_ = std::move(full);
}

inline void SoftCells::put(std::uint32_t number, const glm::dvec3& position, bool may_allocate) {
  const CellCoordinates to = bricks_.cell_of(position);
  // Most that are looked at are where they were; of those no block is asked for.
  const std::uint64_t key = key_of(to);
  if (key != kNoKey && key_[number] == key) return;
  const CellCoordinates block = block_of(to);
  const std::uint32_t cell = cell_in_block(to), hint = hinted_brick(brick_of_block(block));
  // Beside what the voxel leaves, of which its number tells: one wait for both.
  if (hint == kNone && blocks_.large()) blocks_.fetch(block);
  const std::uint32_t old = cell_[number];
  if (old == kNone) {
    if (put_in(number, block, cell, hint, may_allocate)) {
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
    if (hint == kNone) put_next_to(left);
    if (!move_within(number, left, old_cell, cell)) {
      take_out(number, left, old_cell);
      link_in(number, place, cell, false);  // there is room: it was in this block
    }
    cell_[number] = place * kBlockCells + cell;
    return;
  }
  // First out, so that what it leaves is room for what it needs: a voxel that is alone needs no other.
  const CellCoordinates old_block = left.at;
  take_out(number, left, old_cell);
  if (left.occupied == 0) remove_block(place);
  if (put_in(number, block, cell, hint, may_allocate)) {
    key_[number] = key;
    return;
  }
  ++overflows_;
  put_in(number, old_block, old_cell, kNone, false);  // what it left is still there
}

void SoftCells::place(std::uint32_t number, const glm::dvec3& position) {
  put(number, position, true);
}

void SoftCells::move(std::uint32_t number, const glm::dvec3& position) noexcept {
  put(number, position, false);
}

inline bool SoftCells::move_within(std::uint32_t number, Block& block, std::uint32_t from,
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
  // Only what lies between them moves up or down: of the next cell along x nothing does.
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

inline void SoftCells::take_out(std::uint32_t number, Block& block, std::uint32_t cell) noexcept {
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

void SoftCells::remove_block(std::uint32_t place) noexcept {
  const std::uint32_t brick = blocks_[place].brick;
  bricks_[brick].blocks &= ~(1U << block_in_brick(blocks_[place].at));
  blocks_.erase(place);
  if (bricks_[brick].blocks == 0) bricks_.release(brick);
}

inline void SoftCells::remove_cell(Block& block, std::uint32_t cell, std::uint32_t* link) noexcept {
  const std::size_t count = bits_in(block.occupied) - 1;
  block.occupied &= ~(1ULL << cell);
  if (block.full == kNone) {
    for (std::uint32_t* const last = block.links.data() + count; link < last; ++link) link[0] = link[1];
    return;
  }
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
  const std::uint32_t brick =
      bricks_.find_or_add(brick_of_block(at), may_allocate,
                          [this](const Brick& moved, std::uint32_t place) { now_at(moved, place); });
  if (brick == kNone) return kNone;
  const std::uint32_t place = blocks_.add(
      at, may_allocate, [this](const Block& block, std::uint32_t moved) { now_at(block, moved); });
  blocks_[place].brick = brick;
  bricks_[brick].blocks |= 1U << block_in_brick(at);
  bricks_[brick].place[block_in_brick(at)] = place;
  return place;
}

inline std::uint32_t SoftCells::hinted_brick(const CellCoordinates& brick) const noexcept {
  for (const std::uint32_t n : last_put_) {
    if (n < bricks_.table().places() && same(bricks_[n].at, brick)) return n;
  }
  return kNone;
}

inline void SoftCells::put_next_to(const Block& block) noexcept {
  last_put_[1] = last_put_[0];
  last_put_[0] = block.brick;
}

inline bool SoftCells::put_in(std::uint32_t number, const CellCoordinates& at, std::uint32_t cell,
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
  if (hint == kNone) put_next_to(blocks_[place]);
  return link_in(number, place, cell, may_allocate);
}

inline bool SoftCells::link_in(std::uint32_t number, std::uint32_t place, std::uint32_t cell,
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

bool SoftCells::any_near(const glm::dvec3& low, const glm::dvec3& high) const noexcept {
  bool any = false;
  CellTrail trail;
  bricks_.each(bricks_.cells_of(low, high), trail, [&any](const Brick&, const CellRange&) {
    any = true;
    return false;
  });
  return any;
}

void SoftCells::list(const Block& block, std::uint64_t bits, std::span<std::uint32_t> out,
                     std::size_t& count) const noexcept {
  const bool packed = block.full == kNone;
  const std::uint32_t* const links = packed ? block.links.data() : full_[block.full].data();
  std::uint64_t passed = 0;  // cells before these
  std::size_t n = 0;         // of them occupied
  for (; bits != 0; bits &= bits - 1) {
    std::size_t at = static_cast<std::size_t>(std::countr_zero(bits));
    if (packed) {
      const std::uint64_t before = (bits & (~bits + 1)) - 1;
      const std::uint64_t between = block.occupied & before & ~passed;
      n += between == 0 ? 0 : bits_in(between);
      passed = before;
      at = n;
    }
    for (std::uint32_t link = links[at];; link = next_[link & kNumber]) {
      if (count == out.size()) return;
      out[count++] = link & kNumber;
      if ((link & kMore) == 0) break;
    }
  }
}

std::size_t SoftCells::follow(std::uint32_t link, std::span<std::uint32_t> out) const noexcept {
  std::size_t count = 1;
  while ((link & kMore) != 0 && count < out.size()) {
    link = next_[link & kNumber];
    out[count++] = link & kNumber;
  }
  return count;
}

inline std::size_t SoftCells::in_cell(const Block& block, std::uint32_t cell,
                                      std::span<std::uint32_t> out) const noexcept {
  if ((block.occupied >> cell & 1U) == 0 || out.empty()) return 0;
  const std::uint32_t link = link_at(block, cell);
  out[0] = link & kNumber;
  return (link & kMore) == 0 ? 1 : follow(link, out);
}

std::size_t SoftCells::in_other_block(const CellCoordinates& cell, std::span<std::uint32_t> out,
                                      Trail& trail) const noexcept {
  if (blocks_.size() == 0 || !bricks_.perhaps(cell)) return 0;
  const std::uint32_t place = blocks_.find_and_look_ahead(block_of(cell), trail.blocks);
  return place == kNone ? 0 : in_cell(blocks_[place], cell_in_block(cell), out);
}

std::size_t SoftCells::in_box(const glm::dvec3& low, const glm::dvec3& high, std::span<std::uint32_t> out,
                              Trail& trail) const noexcept {
  if (blocks_.size() == 0) return 0;
  const CellRange cells = bricks_.cells_of(low, high);
  if (!bricks_.perhaps(cells)) return 0;
  // What the bricks say comes first, then what their blocks say: so that of the blocks of a small box all
  // are on their way from the memory together, and of their arrays too.
  struct Part {
    std::uint32_t place;
    std::uint64_t bits;
  };
  std::array<Part, kParts> parts;
  std::size_t count = 0, waiting = 0;
  const bool fetch_blocks = blocks_.large(), fetch_full = full_.size() * sizeof(Full) > kLarge;
  const auto list_waiting = [&] {
    for (std::size_t n = 0; n < waiting; ++n) {
      const Block& block = blocks_[parts[n].place];
      parts[n].bits &= block.occupied;
      if (!fetch_full || block.full == kNone) continue;
      for (std::size_t z = 0; z < 4; ++z) {
        if ((parts[n].bits >> (16 * z) & 0xFFFF) != 0) __builtin_prefetch(&full_[block.full][16 * z]);
      }
    }
    for (std::size_t n = 0; n < waiting; ++n) list(blocks_[parts[n].place], parts[n].bits, out, count);
    waiting = 0;
    return count < out.size();
  };
  const CellCoordinates a = block_of(cells.low), b = block_of(cells.high);
  bricks_.each(cells, trail.bricks, [&](const Brick& brick, const CellRange& part) {
    return each_block(brick.at, a, b, [&](const CellCoordinates& at) {
      const std::uint32_t in_brick = block_in_brick(at);
      if ((brick.blocks >> in_brick & 1U) == 0) return true;
      const std::uint32_t place = brick.place[in_brick];
      if (fetch_blocks) blocks_.fetch_place(place);
      parts[waiting++] = {place, block_mask(at, part)};
      return waiting < kParts || list_waiting();
    });
  });
  list_waiting();
  return count;
}

std::size_t SoftCells::in(const glm::dvec3& low, const glm::dvec3& high, std::span<std::uint32_t> out,
                          Trail& trail) const noexcept {
  if (!same_bits(low, high)) return in_box(low, high, out, trail);
  const CellCoordinates cell = bricks_.cell_of(low);
  const Block* const block = blocks_.still_in(block_of(cell), trail.blocks);
  return block != nullptr ? in_cell(*block, cell_in_block(cell), out) : in_other_block(cell, out, trail);
}

std::size_t SoftCells::memory_bytes() const noexcept {
  return bricks_.memory_bytes() + blocks_.memory_bytes() + full_.capacity() * sizeof(Full) +
         (next_.capacity() + cell_.capacity()) * sizeof(std::uint32_t) +
         key_.capacity() * sizeof(std::uint64_t);
}

bool SoftCells::validate() const {
  bool right = bricks_.table().validate() && blocks_.validate();
  std::size_t listed = 0, placed = 0, full = 0, blocks_of_bricks = 0;
  blocks_.each([&](const Block& block, std::uint32_t place) {
    const std::uint32_t brick = bricks_.find(brick_of_block(block.at)), in_brick = block_in_brick(block.at);
    right = right && block.occupied != 0 && brick != kNone && bricks_.perhaps_brick(bricks_[brick].at) &&
            block.brick == brick && (bricks_[brick].blocks >> in_brick & 1U) != 0 &&
            bricks_[brick].place[in_brick] == place;
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
