// SPDX-License-Identifier: GPL-3.0-or-later
// Which bricks of 8×8×8 cells exist, sparsely: what every layer of the occupancy map stands on.
//
// A hash table leads from a brick's coordinates to what a layer knows of it (cell_table.h).
// In front of the table stands a bitmap of 64×64×64 units, each one brick or a power of two of them along an
// edge, over all that exists (32 kB, so that it stays in the first cache): where nothing is, a question ends
// after one to four words.
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

// Where cells and bricks lie, and the bitmap.
class BrickGrid {
 public:
  static constexpr int kShift = 3, kEdge = 1 << kShift, kCells = kEdge * kEdge * kEdge;

  // `cell_m` > 0 and finite, else std::invalid_argument; `origin` near what is put in, so that cells are
  // exact far from the world's origin.
  BrickGrid(double cell_m, const glm::dvec3& origin);

  [[nodiscard]] double cell_m() const noexcept { return cell_m_; }
  [[nodiscard]] const glm::dvec3& origin() const noexcept { return origin_; }

  // The same rounding for what is put in and for what is asked. What lies further out than the farthest cell
  // (and what is not a number) is in the outermost cells, where questions from out there find it.
  [[nodiscard]] CellCoordinates cell_of(const glm::dvec3& p) const noexcept {
#if defined(__x86_64__)
    // The same, x and y at once: of a look-up along a path rounding is a large part.
    const __m128d per_cell = _mm_set1_pd(per_cell_);
    const __m128i xy = below(_mm_mul_pd(_mm_sub_pd(_mm_loadu_pd(&p.x), _mm_loadu_pd(&origin_.x)), per_cell)),
                  z = below(_mm_mul_sd(_mm_sub_sd(_mm_load_sd(&p.z), _mm_load_sd(&origin_.z)), per_cell));
    const auto both = static_cast<std::uint64_t>(_mm_cvtsi128_si64(xy));
    return {static_cast<std::int32_t>(both), static_cast<std::int32_t>(both >> 32), _mm_cvtsi128_si32(z)};
#else
    return {along(p.x - origin_.x), along(p.y - origin_.y), along(p.z - origin_.z)};
#endif
  }
  [[nodiscard]] CellRange cells_of(const glm::dvec3& low, const glm::dvec3& high) const noexcept {
    const CellCoordinates first = cell_of(low);
    return {first, low == high ? first : cell_of(high)};
  }
  [[nodiscard]] static CellCoordinates brick_of(const CellCoordinates& cell) noexcept {
    return {cell[0] >> kShift, cell[1] >> kShift, cell[2] >> kShift};
  }

  // Of a layer of a brick (one z), bit x + 8 y: the cells x low to high and y low to high of a part of it.
  [[nodiscard]] static std::uint64_t layer_mask(const CellRange& part) noexcept {
    constexpr std::int32_t in_brick = kEdge - 1;
    const std::int32_t x0 = part.low[0] & in_brick, x1 = part.high[0] & in_brick, y0 = part.low[1] & in_brick,
                       y1 = part.high[1] & in_brick;
    const std::uint64_t row = (0xFFULL << x0) & (0xFFULL >> (in_brick - x1));
    const std::uint64_t rows = (~0ULL << (8 * y0)) & (~0ULL >> (8 * (in_brick - y1)));
    return row * 0x0101010101010101ULL & rows;
  }
  // The cells of a range that lie in a brick.
  [[nodiscard]] static CellRange part_in(const CellRange& cells, const CellCoordinates& brick) noexcept {
    CellRange part;
    for (std::size_t d = 0; d < 3; ++d) {
      part.low[d] = std::max(cells.low[d], brick[d] * kEdge);
      part.high[d] = std::min(cells.high[d], brick[d] * kEdge + kEdge - 1);
    }
    return part;
  }

  // False: no brick that these cells touch exists. True: perhaps one does.
  [[nodiscard]] bool perhaps(const CellRange& cells) const noexcept {
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
  [[nodiscard]] bool perhaps(const CellCoordinates& cell) const noexcept {
    return bitmap_.empty() ||
           (bitmap_[word(unit_of(cell, 2), unit_of(cell, 1))] >> unit_of(cell, 0) & 1U) != 0;
  }
  [[nodiscard]] bool perhaps_brick(const CellCoordinates& brick) const noexcept {
    return perhaps(CellCoordinates{brick[0] * kEdge, brick[1] * kEdge, brick[2] * kEdge});
  }

 protected:
  // The bitmap anew, over bricks within these; then mark() each.
  void span(const CellCoordinates& low, const CellCoordinates& high);
  void mark(const CellCoordinates& brick) noexcept;
  // `exists(brick)`: does it still?
  template <class Exists>
  void unmark(const CellCoordinates& brick, Exists&& exists) noexcept {
    // A bit too many costs a probe of the table and no more. It stays where finding out would cost many: in
    // units of many bricks, and in the outermost, which are also all that lies further out.
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
  static constexpr double kFarthestCell = 1e9;
  static constexpr std::int32_t kUnits = 64;  // of the bitmap, along an edge

  // The greatest whole number that is not above: std::floor is a call where the processor's newer
  // instructions may not be assumed. Written so that what is not a number becomes the highest cell.
#if defined(__x86_64__)
  [[nodiscard]] static __m128i below(__m128d scaled) noexcept {  // of two
    const __m128d x = _mm_max_pd(_mm_min_pd(scaled, _mm_set1_pd(kFarthestCell)), _mm_set1_pd(-kFarthestCell));
    const __m128i cell = _mm_cvttpd_epi32(x);
    const __m128i above = _mm_castpd_si128(_mm_cmpgt_pd(_mm_cvtepi32_pd(cell), x));  // 64 bits each, or none
    return _mm_add_epi32(cell, _mm_shuffle_epi32(above, 0x08));
  }
#else
  [[nodiscard]] std::int32_t along(double offset_m) const noexcept {
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
  int unit_shift_ = kShift;  // from cells to units
};

// The bricks of a layer. Brick: what it knows of one, an entry of CellTable.
template <class Brick>
class BrickIndex : public BrickGrid {
 public:
  static constexpr std::uint32_t kNone = CellTable<Brick>::kNone;
  using BrickGrid::BrickGrid;

  // Numbers are valid until a brick is added that makes room by allocating.
  [[nodiscard]] std::uint32_t find(const CellCoordinates& brick) const noexcept { return table_.find(brick); }
  [[nodiscard]] std::uint32_t find(const CellCoordinates& brick, CellTrail& trail) const noexcept {
    const std::uint32_t hinted = table_.hinted(brick, trail);
    return hinted != kNone || !perhaps_brick(brick) ? hinted : table_.find(brick, trail);
  }
  [[nodiscard]] Brick& operator[](std::uint32_t number) noexcept { return table_[number]; }
  [[nodiscard]] const Brick& operator[](std::uint32_t number) const noexcept { return table_[number]; }
  [[nodiscard]] std::size_t size() const noexcept { return table_.size(); }
  [[nodiscard]] bool has_room() const noexcept { return table_.has_room(); }
  [[nodiscard]] const CellTable<Brick>& table() const noexcept { return table_; }

  // kNone only when it may not allocate and there is no room. moved(brick, its new number): the table grew.
  template <class Moved>
  std::uint32_t find_or_add(const CellCoordinates& brick, bool may_allocate, Moved&& moved) {
    const std::size_t before = table_.size();
    const std::uint32_t number = table_.find_or_add(brick, may_allocate, moved);
    if (table_.size() != before) mark(brick);
    return number;
  }
  // The brick is no more, and its room is any other's. Allocates nothing.
  void release(std::uint32_t number) noexcept {
    const CellCoordinates at = table_[number].at;
    table_.erase(number);
    unmark(at, [this](const CellCoordinates& c) { return find(c) != kNone; });
  }

  // Room for so many more bricks without allocating, and the bitmap over those that exist. Bricks may be
  // added later; those beyond the bitmap's edge share its outermost units.
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
    span(low, high);
    table_.each([this](const Brick& b, std::uint32_t) { mark(b.at); });
  }

  // Calls visit(brick, the cells of the box in it) for each existing brick that the box touches, until it
  // returns false: along x first, then y, then z; of a box of more bricks than there are places, in the order
  // of places. Looks at no more bricks than those.
  template <class Visit>
  void each(const CellRange& cells, CellTrail& trail, Visit&& visit) const noexcept {
    if (table_.size() == 0) return;
    const CellCoordinates a = brick_of(cells.low), b = brick_of(cells.high);
    if (same(a, b)) {  // one brick: a point, and most small boxes
      const Brick* brick = table_.still_in(a, trail);
      if (brick == nullptr && perhaps_brick(a)) {
        const std::uint32_t n = table_.find_and_look_ahead(a, trail);
        brick = n != kNone ? &table_[n] : nullptr;
      }
      if (brick != nullptr) visit(*brick, cells);
      return;
    }
    if (!perhaps(cells)) return;
    double bricks = 1.0;
    for (std::size_t d = 0; d < 3; ++d) bricks *= std::max(0.0, static_cast<double>(b[d]) - a[d] + 1.0);
    if (bricks > static_cast<double>(table_.places())) {
      for (std::uint32_t n = 0; n < table_.places(); ++n) {
        if (!table_.holds(n)) continue;
        const CellCoordinates& c = table_[n].at;
        bool within = true;
        for (std::size_t d = 0; d < 3; ++d) within = within && c[d] >= a[d] && c[d] <= b[d];
        if (within && !visit(table_[n], part_in(cells, c))) return;
      }
      return;
    }
    CellCoordinates c{};
    if (bricks <= 8.0 && table_.large()) {
      for (c[2] = a[2]; c[2] <= b[2]; ++c[2]) {
        for (c[1] = a[1]; c[1] <= b[1]; ++c[1]) {
          for (c[0] = a[0]; c[0] <= b[0]; ++c[0]) {
            if (table_.hinted(c, trail) == kNone && perhaps_brick(c)) table_.fetch(c);
          }
        }
      }
    }
    for (c[2] = a[2]; c[2] <= b[2]; ++c[2]) {
      for (c[1] = a[1]; c[1] <= b[1]; ++c[1]) {
        for (c[0] = a[0]; c[0] <= b[0]; ++c[0]) {
          const std::uint32_t n = find(c, trail);
          if (n != kNone && !visit(table_[n], part_in(cells, c))) return;
        }
      }
    }
  }

  [[nodiscard]] std::size_t memory_bytes() const noexcept { return table_.memory_bytes() + bitmap_bytes(); }

 private:
  CellTable<Brick> table_;
};

}  // namespace hybrid
