// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/map/voxel_layer.h"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>

namespace hybrid {
namespace {

constexpr std::size_t kBatch = 16;                    // blocks of a box that are fetched together
constexpr std::size_t kLarge = std::size_t{1} << 19;  // bytes; a larger array exceeds the cache of one core

// Compares bits as integers, which takes one branch. If only the sign of a zero differs, in() calls in_box(),
// which gives the same result.
bool same_bits(const glm::dvec3& a, const glm::dvec3& b) noexcept {
  const auto differ = [](double x, double y) {
    return std::bit_cast<std::uint64_t>(x) ^ std::bit_cast<std::uint64_t>(y);
  };
  return (differ(a.x, b.x) | differ(a.y, b.y) | differ(a.z, b.z)) == 0;
}

// Mask of the cells of a block that are in the range (bit x + 4 y + 16 z). The range may extend beyond the
// block.
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

// Calls visit(block) for each block of a brick in the range, along x first, until visit returns false.
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

bool VoxelLayer::any_near(const glm::dvec3& low, const glm::dvec3& high) const noexcept {
  bool any = false;
  CellTrail trail;
  bricks_.each(bricks_.cells_of(low, high), trail, [&any](const Brick&, const CellRange&) {
    any = true;
    return false;
  });
  return any;
}

void VoxelLayer::write_cells(const Block& block, std::uint64_t bits, std::span<std::uint32_t> out,
                             std::size_t& count) const noexcept {
  const bool packed = block.full == kNone;
  const std::uint32_t* const links = packed ? block.links.data() : full_[block.full].data();
  std::uint64_t passed = 0;  // cells before the current one
  std::size_t n = 0;         // occupied cells among them
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

std::size_t VoxelLayer::write_rest(std::uint32_t link, std::span<std::uint32_t> out) const noexcept {
  std::size_t count = 1;
  while ((link & kMore) != 0 && count < out.size()) {
    link = next_[link & kNumber];
    out[count++] = link & kNumber;
  }
  return count;
}

inline std::size_t VoxelLayer::in_cell(const Block& block, std::uint32_t cell,
                                       std::span<std::uint32_t> out) const noexcept {
  if ((block.occupied >> cell & 1U) == 0 || out.empty()) return 0;
  const std::uint32_t link = link_at(block, cell);
  out[0] = link & kNumber;
  return (link & kMore) == 0 ? 1 : write_rest(link, out);
}

std::size_t VoxelLayer::in_other_block(const CellCoordinates& cell, std::span<std::uint32_t> out,
                                       Trail& trail) const noexcept {
  if (blocks_.size() == 0 || !bricks_.may_exist(cell)) return 0;
  const std::uint32_t place = blocks_.find_ahead(block_of(cell), trail.blocks);
  return place == kNone ? 0 : in_cell(blocks_[place], cell_in_block(cell), out);
}

std::size_t VoxelLayer::in_box(const glm::dvec3& low, const glm::dvec3& high, std::span<std::uint32_t> out,
                               Trail& trail) const noexcept {
  if (blocks_.size() == 0) return 0;
  const CellRange cells = bricks_.cells_of(low, high);
  if (!bricks_.may_exist(cells)) return 0;
  // Finds the bricks first and then their blocks, so that all blocks of a small box, and their arrays, are
  // fetched from memory together.
  struct Part {
    std::uint32_t place;
    std::uint64_t bits;
  };
  std::array<Part, kBatch> parts;
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
    for (std::size_t n = 0; n < waiting; ++n) write_cells(blocks_[parts[n].place], parts[n].bits, out, count);
    waiting = 0;
    return count < out.size();
  };
  const CellCoordinates a = block_of(cells.low), b = block_of(cells.high);
  bricks_.each(cells, trail.bricks, [&](const Brick& brick, const CellRange& part) {
    return each_block(brick.at, a, b, [&](const CellCoordinates& at) {
      const std::uint32_t in_brick = block_in_brick(at);
      if ((brick.blocks >> in_brick & 1U) == 0) return true;
      const std::uint32_t place = brick.place[in_brick];
      if (fetch_blocks) blocks_.prefetch_place(place);
      parts[waiting++] = {place, block_mask(at, part)};
      return waiting < kBatch || list_waiting();
    });
  });
  list_waiting();
  return count;
}

std::size_t VoxelLayer::in(const glm::dvec3& low, const glm::dvec3& high, std::span<std::uint32_t> out,
                           Trail& trail) const noexcept {
  if (!same_bits(low, high)) return in_box(low, high, out, trail);
  const CellCoordinates cell = bricks_.cell_of(low);
  const Block* const block = blocks_.last_entry_at(block_of(cell), trail.blocks);
  return block != nullptr ? in_cell(*block, cell_in_block(cell), out) : in_other_block(cell, out, trail);
}

std::size_t VoxelLayer::memory_bytes() const noexcept {
  return bricks_.memory_bytes() + blocks_.memory_bytes() + full_.capacity() * sizeof(Full) +
         (next_.capacity() + cell_.capacity()) * sizeof(std::uint32_t) +
         key_.capacity() * sizeof(std::uint64_t);
}

bool VoxelLayer::validate() const {
  bool right = bricks_.table().validate() && blocks_.validate();
  std::size_t listed = 0, placed = 0, full = 0, blocks_of_bricks = 0;
  blocks_.each([&](const Block& block, std::uint32_t place) {
    const std::uint32_t brick = bricks_.find(brick_of_block(block.at)), in_brick = block_in_brick(block.at);
    right = right && block.occupied != 0 && brick != kNone && bricks_.brick_may_exist(bricks_[brick].at) &&
            block.brick == brick && (bricks_[brick].blocks >> in_brick & 1U) != 0 &&
            bricks_[brick].place[in_brick] == place;
    full += block.full != kNone ? 1 : 0;
    right = right && (block.full != kNone ? bits_in(block.occupied) >= kUnpackBelow
                                          : bits_in(block.occupied) <= kPacked);
    for (std::uint64_t bits = block.occupied; right && bits != 0; bits &= bits - 1) {
      const auto cell = static_cast<std::uint32_t>(std::countr_zero(bits));
      for (std::uint32_t link = link_at(block, cell); right; link = next_[link & kNumber]) {
        const std::uint32_t n = link & kNumber;
        right = n < next_.size() && cell_[n] == place * kBlockCells + cell && ++listed <= next_.size();
        if ((link & kMore) == 0) break;
      }
    }
  });
  // A brick is not empty, and has the bits of its own blocks only.
  bricks_.table().each([&](const Brick& brick, std::uint32_t) {
    right = right && brick.blocks != 0;
    blocks_of_bricks += bits_in(brick.blocks);
  });
  for (std::uint32_t n = free_full_; n != kNone && full <= full_.size(); n = full_[n][0]) ++full;
  for (const std::uint32_t cell : cell_) placed += cell != kNone ? 1 : 0;
  return right && listed == placed && blocks_of_bricks == blocks_.size() && full == full_.size();
}

}  // namespace hybrid
