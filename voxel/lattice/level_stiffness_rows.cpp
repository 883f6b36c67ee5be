// SPDX-License-Identifier: GPL-3.0-or-later
// Writes out the springs and limits of mixed rows. Equal rows share one copy.
#include "voxel/lattice/level_stiffness.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

namespace voxel {

namespace {

// FNV-1a, on 64-bit words.
template <class T>
void add_to_hash(std::uint64_t& hash, const T& what) {
  static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % sizeof(std::uint64_t) == 0);
  constexpr std::uint64_t kPrime = 0x100000001b3;  // of the 64-bit FNV hash
  const auto* at = reinterpret_cast<const char*>(&what);
  for (std::size_t n = 0; n < sizeof(T); n += sizeof(std::uint64_t)) {
    std::uint64_t word = 0;
    std::memcpy(&word, at + n, sizeof word);
    hash = (hash ^ word) * kPrime;
  }
}

template <class T>
bool same_bits(const T& a, const T& b) {
  const auto* bytes = reinterpret_cast<const char*>(&a);
  return std::equal(bytes, bytes + sizeof(T), reinterpret_cast<const char*>(&b));
}

}  // namespace

// Index of an earlier row equal to the one just written at written_count_; written_count_ if there is none.
std::uint32_t LevelStiffness::find_written() noexcept {
  const std::uint32_t last = written_count_;
  std::uint64_t hash = 0xcbf29ce484222325;
  add_to_hash(hash, written_[last]);
  add_to_hash(hash, written_stands_[last]);
  if (written_cells_.size() > 0) add_to_hash(hash, written_cells_[last]);
  if (written_limits_.size() > 0) add_to_hash(hash, written_limits_[last]);
  const std::size_t mask = written_by_hash_.size() - 1;
  // The words hashed last affect the high bits most, so the high half is folded in.
  for (std::size_t n = (hash ^ hash >> 32U) & mask;; n = (n + 1) & mask) {
    if (written_by_hash_[n] == 0) {
      written_by_hash_[n] = last + 1;
      return last;
    }
    const std::uint32_t other = written_by_hash_[n] - 1;
    if (same_bits(written_[other], written_[last]) &&
        same_bits(written_stands_[other], written_stands_[last]) &&
        (written_cells_.size() == 0 || same_bits(written_cells_[other], written_cells_[last])) &&
        (written_limits_.size() == 0 || same_bits(written_limits_[other], written_limits_[last])))
      return other;
  }
}

// Writes the springs of the row at index written_count_. False if the row is empty.
bool LevelStiffness::write_out(RowId row) noexcept {
  Written& out = written_[written_count_];
  LaneBits& stands = written_stands_[written_count_];
  return level_ == 0 ? write_voxels(row, out, stands)
                     : write_cells(row, out, stands, written_cells_[written_count_]);
}

void LevelStiffness::write_lane(std::size_t i, const VoxelSprings& springs, Written& out,
                                LaneBits& stands) noexcept {
  unsigned bits = 0;
  for (std::size_t d = 0; d < 3; ++d) {
    const std::size_t at = Written::kBefore + d * kRow + i;
    out.along[at] = springs.up[d].along;
    out.across[at] = springs.up[d].across;
    out.inverse[d][i] = springs.inverse[d];
    if (springs.inverse[d] == 0.0F) bits |= 1U << d;
  }
  stands[i] = static_cast<std::uint8_t>(bits);
  if (i > 0) return;
  out.along[Written::kBefore - 1] = springs.down[0].along;
  out.across[Written::kBefore - 1] = springs.down[0].across;
}

bool LevelStiffness::write_voxels(RowId row, Written& out, LaneBits& stands) const noexcept {
  // Materials around the row, [lane + 1][z][y]: the nine with the same x are adjacent.
  using Slice = std::array<std::uint8_t, 9>;
  std::array<Slice, kRow + 2> around{};
  for (std::size_t n = 0; n < 9; ++n) {
    const RowId r =
        row - grid_.row_z - 1 + static_cast<RowId>(n / 3) * grid_.row_z + static_cast<RowId>(n % 3);
    const VoxelId first = r * kRow;
    around[0][n] = lattice_.material(grid_.down(first, 0));
    for (VoxelId i = 0; i < kRow; ++i) around[i + 1][n] = lattice_.material(first + i);
    around[kRow + 1][n] = lattice_.material(grid_.up(first + kRow - 1, 0));
  }
  // Springs of links of the row's voxel in slice x. along_x(): in +x. in_slices(): in d = 1 or 2, the link
  // down to the neighbour below (from = 0) or up (from = 1).
  const auto along_x = [&](std::size_t x) { return lattice_.spring_among(around[x], around[x + 1], 0); };
  const auto in_slices = [&](std::size_t x, std::size_t from, int d) {
    Slice a{}, b{};
    const std::size_t along = d == 1 ? 1 : 3, across = d == 1 ? 3 : 1;
    for (std::size_t n = 0; n < 9; ++n) {
      // The order is that of Lattice::spring(), so that sums round alike.
      const std::size_t beside = d == 1 ? n / 3 : n % 3,
                        at = (d == 1 ? n % 3 : n / 3) * across + from * along;
      a[n] = around[x - 1 + beside][at];
      b[n] = around[x - 1 + beside][at + along];
    }
    return lattice_.spring_among(a, b, d);
  };
  VoxelSprings springs;
  bool anchored = false, any = false;
  for (std::size_t i = 0; i < kRow; ++i) {
    const std::size_t x = i + 1;
    const auto v = static_cast<VoxelId>(row * kRow + i);
    any = any || around[x][4] != 0;
    // Most voxels of a row have the same springs as the voxel before them.
    const bool as_before = i > 0 && around[x + 1] == around[x] && around[x] == around[x - 1] &&
                           around[x - 1] == around[x - 2] && anchored == lattice_.anchored(v);
    if (!as_before) {
      anchored = lattice_.anchored(v);
      springs.down[0] = i > 0 ? springs.up[0] : along_x(0);
      springs.up[0] = along_x(x);
      for (const int d : {1, 2}) {
        springs.down[static_cast<std::size_t>(d)] = in_slices(x, 0, d);
        springs.up[static_cast<std::size_t>(d)] = in_slices(x, 1, d);
      }
      springs.inverse = {};
      if (!anchored) springs.set_inverse();
    }
    write_lane(i, springs, out, stands);
  }
  return any;
}

void LevelStiffness::write_limits(RowId row, RowLimits::Written& out) const noexcept {
  constexpr float kFar = std::numeric_limits<float>::max();
  constexpr LinkLimit kNone{-kFar, kFar, kFar};
  std::array<LinkLimit, 3> tightest{kNone, kNone, kNone};
  for (std::size_t i = 0; i < kRow; ++i) {
    const auto v = static_cast<VoxelId>(row * kRow + i);
    for (int d = 0; d < 3; ++d) {
      const auto ud = static_cast<std::size_t>(d);
      const VoxelId up = grid_.up(v, d), down = grid_.down(v, d);
      const bool here = lattice_.filled(v);
      const LinkLimit above = here && lattice_.filled(up) ? lattice_.limit(v, d) : kNone,
                      below = here && lattice_.filled(down) ? lattice_.limit(down, d) : kNone;
      out.up_low[ud][i] = above.along_low;
      out.up_high[ud][i] = above.along_high;
      out.up_across[ud][i] = above.across;
      out.down_low[ud][i] = below.along_low;
      out.down_high[ud][i] = below.along_high;
      out.down_across[ud][i] = below.across;
      for (const LinkLimit& l : {above, below}) {
        LinkLimit& t = tightest[ud];
        t.along_low = std::max(t.along_low, l.along_low);
        t.along_high = std::min(t.along_high, l.along_high);
        t.across = std::min(t.across, l.across);
      }
    }
  }
  for (int axis = 0; axis < 3; ++axis)
    out.tightest[static_cast<std::size_t>(axis)] = AxisLimits(tightest, axis);
}

RowLimits LevelStiffness::limits(RowId row) const noexcept {
  RowLimits out{&label_limits_[label_[row]], nullptr};
  if (written_limits_.size() > 0 && kind(row) == mixed) {
    out.lanes = &written_limits_[written_at_[row]];
    out.of = &out.lanes->tightest;
  }
  return out;
}

bool LevelStiffness::write_cells(RowId row, Written& out, LaneBits& stands, Cells& cells) const noexcept {
  const std::array<int, 3> c = grid_.row_coordinates(row);
  bool any = false;
  for (int lane = 0; lane < kRow; ++lane) {
    const std::array<int, 3> cell{(c[0] - 1) * kRow + lane, c[1], c[2]};
    const Content inside = cell[0] < grid_.dims[0] ? content(cell) : nothing;
    const VoxelSprings springs = springs_by_links(cell, inside);
    int below = 0;
    for (int corner = 0; inside != nothing && corner < 8; ++corner) {
      const std::array<int, 3> fine{2 * cell[0] + (corner & 1), 2 * cell[1] + (corner >> 1 & 1),
                                    2 * cell[2] + (corner >> 2)};
      const auto& dims = finer_->grid_.dims;
      if (fine[0] < dims[0] && fine[1] < dims[1] && fine[2] < dims[2] && finer_->content(fine) != nothing)
        ++below;
    }
    any = any || inside != nothing;
    cells.share[static_cast<std::size_t>(lane)] = below > 0 ? 1.0F / static_cast<float>(below) : 0.0F;
    cells.filled[static_cast<std::size_t>(lane)] = inside == nothing ? 0.0F : 1.0F;
    write_lane(static_cast<std::size_t>(lane), springs, out, stands);
  }
  return any;
}

}  // namespace voxel
