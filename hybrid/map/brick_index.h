// SPDX-License-Identifier: GPL-3.0-or-later
// A sparse set of bricks of 8×8×8 cells, the basis of every layer of the occupancy map.
//
// A hash table maps a brick's coordinates to a layer's entry (cell_table.h). In front of the table is a
// bitmap of 64×64×64 units over all existing bricks. A unit is one brick, or a power of two bricks along each
// edge. The bitmap takes 32 kB, so it stays in the first-level cache. A query of an empty region reads only
// one to four words of the bitmap.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>
#if defined(__x86_64__)
#include <emmintrin.h>
#endif

#include "hybrid/map/cell_table.h"

namespace hybrid {

struct CellRange {  // both inclusive
  CellCoordinates low{}, high{};
};

// The geometry of cells and bricks, and the bitmap.
class BrickGrid {
 public:
  // log2 of the edge of a brick (cells), its edge, its number of cells
  static constexpr int kShift = 3, kEdge = 1 << kShift, kCells = kEdge * kEdge * kEdge;

  // Throws std::invalid_argument if `cell_m` is not positive and finite. `origin`: a point near the contents,
  // so that cells are exact far from the world's origin.
  BrickGrid(double cell_m, const glm::dvec3& origin);

  [[nodiscard]] double cell_m() const noexcept { return cell_m_; }
  [[nodiscard]] const glm::dvec3& origin() const noexcept { return origin_; }

  // Insertions and queries use the same rounding. Positions beyond the farthest cell, and NaN, are in the
  // outermost cells, where queries at such positions find them.
  [[nodiscard]] CellCoordinates cell_of(const glm::dvec3& p) const noexcept {
#if defined(__x86_64__)
    // Computes x and y at once, because rounding is a large part of a look-up along a path.
    const __m128d per_cell = _mm_set1_pd(per_cell_);
    const __m128i xy = floor_cells(
                      _mm_mul_pd(_mm_sub_pd(_mm_loadu_pd(&p.x), _mm_loadu_pd(&origin_.x)), per_cell)),
                  z = floor_cells(
                      _mm_mul_sd(_mm_sub_sd(_mm_load_sd(&p.z), _mm_load_sd(&origin_.z)), per_cell));
    const auto both = static_cast<std::uint64_t>(_mm_cvtsi128_si64(xy));
    return {static_cast<std::int32_t>(both), static_cast<std::int32_t>(both >> 32), _mm_cvtsi128_si32(z)};
#else
    return {floor_cell(p.x - origin_.x), floor_cell(p.y - origin_.y), floor_cell(p.z - origin_.z)};
#endif
  }
  [[nodiscard]] CellRange cells_of(const glm::dvec3& low, const glm::dvec3& high) const noexcept {
    const CellCoordinates first = cell_of(low);
    return {first, low == high ? first : cell_of(high)};
  }
  [[nodiscard]] static CellCoordinates brick_of(const CellCoordinates& cell) noexcept {
    return {cell[0] >> kShift, cell[1] >> kShift, cell[2] >> kShift};
  }

  // Mask of the cells of range `part` in one z-layer of a brick (bit x + 8 y). `part` must lie in the brick.
  [[nodiscard]] static std::uint64_t layer_mask(const CellRange& part) noexcept {
    constexpr std::int32_t in_brick = kEdge - 1;
    const std::int32_t x0 = part.low[0] & in_brick, x1 = part.high[0] & in_brick, y0 = part.low[1] & in_brick,
                       y1 = part.high[1] & in_brick;
    const std::uint64_t row = (0xFFULL << x0) & (0xFFULL >> (in_brick - x1));
    const std::uint64_t rows = (~0ULL << (8 * y0)) & (~0ULL >> (8 * (in_brick - y1)));
    return row * 0x0101010101010101ULL & rows;
  }
  // The part of a range of cells that lies in a brick.
  [[nodiscard]] static CellRange range_in_brick(const CellRange& cells,
                                                const CellCoordinates& brick) noexcept {
    CellRange part;
    for (std::size_t d = 0; d < 3; ++d) {
      part.low[d] = std::max(cells.low[d], brick[d] * kEdge);
      part.high[d] = std::min(cells.high[d], brick[d] * kEdge + kEdge - 1);
    }
    return part;
  }

  // False: none of the bricks that these cells touch exists. True: one may exist.
  [[nodiscard]] bool may_exist(const CellRange& cells) const noexcept {
    if (bitmap_.empty()) return true;
    const std::int32_t x0 = unit_of(cells.low, 0), x1 = unit_of(cells.high, 0), y0 = unit_of(cells.low, 1),
                       y1 = unit_of(cells.high, 1), z0 = unit_of(cells.low, 2), z1 = unit_of(cells.high, 2);
    const std::uint64_t along_x = (~0ULL << x0) & (~0ULL >> (kUnits - 1 - x1));
    for (std::int32_t z = z0; z <= z1; ++z) {
      for (std::int32_t y = y0; y <= y1; ++y) {
        if ((bitmap_[word(z, y)] & along_x) != 0) return true;
      }
    }
    return false;
  }
  [[nodiscard]] bool may_exist(const CellCoordinates& cell) const noexcept {
    return bitmap_.empty() ||
           (bitmap_[word(unit_of(cell, 2), unit_of(cell, 1))] >> unit_of(cell, 0) & 1U) != 0;
  }
  [[nodiscard]] bool brick_may_exist(const CellCoordinates& brick) const noexcept {
    return may_exist(CellCoordinates{brick[0] * kEdge, brick[1] * kEdge, brick[2] * kEdge});
  }

 protected:
  // Makes an empty bitmap over bricks within these bounds; call set_bit() for each brick afterwards.
  void reset_bitmap(const CellCoordinates& low, const CellCoordinates& high);
  void set_bit(const CellCoordinates& brick) noexcept;
  // Call after a brick was removed. `exists(brick)`: is it still in the table?
  template <class Exists>
  void clear_bit(const CellCoordinates& brick, Exists&& exists) noexcept {
    // A superfluous bit costs one probe of the table. It stays set where clearing would need many probes: in
    // units of many bricks, and in the outermost units, which also stand for everything further out.
    constexpr int kMostShift = 2;
    const int shift = unit_shift_ - kShift;
    if (bitmap_.empty() || shift > kMostShift) return;
    const CellCoordinates cell{brick[0] * kEdge, brick[1] * kEdge, brick[2] * kEdge};
    for (std::size_t d = 0; d < 3; ++d) {
      const std::int32_t unit = unit_of(cell, d);
      if (unit == 0 || unit == kUnits - 1) return;
    }
    CellCoordinates low{}, c{};
    for (std::size_t d = 0; d < 3; ++d) low[d] = (brick[d] >> shift) * (1 << shift);
    const std::int32_t edge = 1 << shift;
    for (c[2] = low[2]; c[2] < low[2] + edge; ++c[2]) {
      for (c[1] = low[1]; c[1] < low[1] + edge; ++c[1]) {
        for (c[0] = low[0]; c[0] < low[0] + edge; ++c[0]) {
          if (exists(c)) return;
        }
      }
    }
    bitmap_[word(unit_of(cell, 2), unit_of(cell, 1))] &= ~(1ULL << unit_of(cell, 0));
  }
  [[nodiscard]] std::size_t bitmap_bytes() const noexcept {
    return bitmap_.capacity() * sizeof(std::uint64_t);
  }

 private:
  // largest coordinate of a cell; places further out are clamped to it
  static constexpr double kFarthestCell = 1e9;
  static constexpr std::int32_t kUnits = 64;  // units of the bitmap along an edge

  // Rounds down to an integer without std::floor, which is a function call on older instruction sets. NaN
  // becomes the highest cell.
#if defined(__x86_64__)
  [[nodiscard]] static __m128i floor_cells(__m128d scaled) noexcept {  // both values at once
    const __m128d x = _mm_max_pd(_mm_min_pd(scaled, _mm_set1_pd(kFarthestCell)), _mm_set1_pd(-kFarthestCell));
    const __m128i cell = _mm_cvttpd_epi32(x);
    const __m128i above = _mm_castpd_si128(_mm_cmpgt_pd(_mm_cvtepi32_pd(cell), x));  // 64 bits per value
    return _mm_add_epi32(cell, _mm_shuffle_epi32(above, 0x08));
  }
#else
  [[nodiscard]] std::int32_t floor_cell(double offset_m) const noexcept {
    const double scaled = offset_m * per_cell_, low = scaled < kFarthestCell ? scaled : kFarthestCell,
                 x = low > -kFarthestCell ? low : -kFarthestCell;
    const auto cell = static_cast<std::int32_t>(x);
    return cell - (static_cast<double>(cell) > x ? 1 : 0);
  }
#endif
  [[nodiscard]] std::int32_t unit_of(const CellCoordinates& cell, std::size_t axis) const noexcept {
    return std::clamp((cell[axis] >> unit_shift_) - first_unit_[axis], 0, kUnits - 1);
  }
  [[nodiscard]] static std::size_t word(std::int32_t unit_z, std::int32_t unit_y) noexcept {
    return static_cast<std::size_t>(unit_z) * kUnits + static_cast<std::size_t>(unit_y);
  }

  double cell_m_, per_cell_;
  glm::dvec3 origin_;
  std::vector<std::uint64_t> bitmap_;  // [z][y], bit x; empty until sealed
  CellCoordinates first_unit_{};
  int unit_shift_ = kShift;  // right shift from cells to units
};

// The bricks of one layer. Brick: the layer's entry, with the members that CellTable needs.
template <class Brick>
class BrickIndex : public BrickGrid {
 public:
  static constexpr std::uint32_t kNone = CellTable<Brick>::kNone;
  using BrickGrid::BrickGrid;

  // Indices are valid until a brick is added with allocation.
  [[nodiscard]] std::uint32_t find(const CellCoordinates& brick) const noexcept { return table_.find(brick); }
  [[nodiscard]] std::uint32_t find(const CellCoordinates& brick, CellTrail& trail) const noexcept {
    const std::uint32_t hinted = table_.hinted(brick, trail);
    return hinted != kNone || !brick_may_exist(brick) ? hinted : table_.find(brick, trail);
  }
  [[nodiscard]] Brick& operator[](std::uint32_t number) noexcept { return table_[number]; }
  [[nodiscard]] const Brick& operator[](std::uint32_t number) const noexcept { return table_[number]; }
  [[nodiscard]] std::size_t size() const noexcept { return table_.size(); }
  [[nodiscard]] bool has_room() const noexcept { return table_.has_room(); }
  [[nodiscard]] const CellTable<Brick>& table() const noexcept { return table_; }

  // Returns kNone only if there is no room and allocation is not allowed. If the table grew, moved(brick, its
  // new index) is called for all bricks.
  template <class Moved>
  std::uint32_t find_or_add(const CellCoordinates& brick, bool may_allocate, Moved&& moved) {
    const std::size_t before = table_.size();
    const std::uint32_t number = table_.find_or_add(brick, may_allocate, moved);
    if (table_.size() != before) set_bit(brick);
    return number;
  }
  // Removes the brick and frees its place. Allocates nothing.
  void release(std::uint32_t number) noexcept {
    const CellCoordinates at = table_[number].at;
    table_.erase(number);
    clear_bit(at, [this](const CellCoordinates& c) { return find(c) != kNone; });
  }

  // Makes the bitmap over the existing bricks, and room for `more` bricks. These need no allocation when they
  // are added. Bricks beyond the bitmap share its outermost units.
  template <class Moved>
  void seal(std::size_t more, Moved&& moved) {
    table_.seal(more, moved);
    CellCoordinates low{}, high{};
    bool first = true;
    table_.each([&](const Brick& b, std::uint32_t) {
      if (first) low = high = b.at;
      first = false;
      for (std::size_t d = 0; d < 3; ++d) {
        low[d] = std::min(low[d], b.at[d]);
        high[d] = std::max(high[d], b.at[d]);
      }
    });
    reset_bitmap(low, high);
    table_.each([this](const Brick& b, std::uint32_t) { set_bit(b.at); });
  }

  // Calls visit(brick, cells of the range in it) for each existing brick that the range touches, until visit
  // returns false. The order is along x first, then y, then z. If the range has more bricks than the table
  // has places, the order is that of the places.
  template <class Visit>
  void each(const CellRange& cells, CellTrail& trail, Visit&& visit) const noexcept {
    if (table_.size() == 0) return;
    const CellCoordinates a = brick_of(cells.low), b = brick_of(cells.high);
    if (same(a, b)) {  // one brick: a point, or most small boxes
      const Brick* brick = table_.last_entry_at(a, trail);
      if (brick == nullptr && brick_may_exist(a)) {
        const std::uint32_t n = table_.find_ahead(a, trail);
        brick = n != kNone ? &table_[n] : nullptr;
      }
      if (brick != nullptr) visit(*brick, cells);
      return;
    }
    if (!may_exist(cells)) return;
    double bricks = 1.0;
    for (std::size_t d = 0; d < 3; ++d) bricks *= std::max(0.0, static_cast<double>(b[d]) - a[d] + 1.0);
    if (bricks > static_cast<double>(table_.places())) {
      for (std::uint32_t n = 0; n < table_.places(); ++n) {
        if (!table_.is_used(n)) continue;
        const CellCoordinates& c = table_[n].at;
        bool within = true;
        for (std::size_t d = 0; d < 3; ++d) within = within && c[d] >= a[d] && c[d] <= b[d];
        if (within && !visit(table_[n], range_in_brick(cells, c))) return;
      }
      return;
    }
    CellCoordinates c{};
    if (bricks <= 8.0 && table_.large()) {
      for (c[2] = a[2]; c[2] <= b[2]; ++c[2]) {
        for (c[1] = a[1]; c[1] <= b[1]; ++c[1]) {
          for (c[0] = a[0]; c[0] <= b[0]; ++c[0]) {
            if (table_.hinted(c, trail) == kNone && brick_may_exist(c)) table_.prefetch(c);
          }
        }
      }
    }
    for (c[2] = a[2]; c[2] <= b[2]; ++c[2]) {
      for (c[1] = a[1]; c[1] <= b[1]; ++c[1]) {
        for (c[0] = a[0]; c[0] <= b[0]; ++c[0]) {
          const std::uint32_t n = find(c, trail);
          if (n != kNone && !visit(table_[n], range_in_brick(cells, c))) return;
        }
      }
    }
  }

  [[nodiscard]] std::size_t memory_bytes() const noexcept { return table_.memory_bytes() + bitmap_bytes(); }

 private:
  CellTable<Brick> table_;
};

}  // namespace hybrid
