// SPDX-License-Identifier: GPL-3.0-or-later
// Which bricks of 8×8×8 cells exist, sparsely: what every layer of the occupancy map stands on.
//
// A hash table leads from a brick's coordinates to its number; each layer keeps its own data by that number.
// In front of the table stands a bitmap of 64×64×64 units, each one brick or a power of two of them along an
// edge, over all that exists (32 kB, so that it stays in the first cache): where nothing is, a question ends
// after one to four words.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <limits>
#include <vector>

namespace hybrid {

using CellCoordinates = std::array<std::int32_t, 3>;

struct CellRange {  // both inclusive
  CellCoordinates low{}, high{};
};

class BrickIndex {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  static constexpr int kShift = 3, kEdge = 1 << kShift, kCells = kEdge * kEdge * kEdge;

  // `cell_m` > 0 and finite, else std::invalid_argument; `origin` near what is put in, so that cells are
  // exact far from the world's origin.
  BrickIndex(double cell_m, const glm::dvec3& origin);

  [[nodiscard]] double cell_m() const noexcept { return cell_m_; }
  [[nodiscard]] const glm::dvec3& origin() const noexcept { return origin_; }

  // The same rounding for what is put in and for what is asked. What lies further out than the farthest cell
  // (and what is not a number) is in the outermost cells, where questions from out there find it.
  [[nodiscard]] CellCoordinates cell_of(const glm::dvec3& p) const noexcept {
    return {along(p.x - origin_.x), along(p.y - origin_.y), along(p.z - origin_.z)};
  }
  [[nodiscard]] CellRange cells_of(const glm::dvec3& low, const glm::dvec3& high) const noexcept {
    const CellCoordinates first = cell_of(low);
    return {first, low == high ? first : cell_of(high)};
  }
  [[nodiscard]] static CellCoordinates brick_of(const CellCoordinates& cell) noexcept {
    return {cell[0] >> kShift, cell[1] >> kShift, cell[2] >> kShift};
  }
  [[nodiscard]] static std::uint32_t index_in_brick(const CellCoordinates& cell) noexcept {
    constexpr std::int32_t mask = kEdge - 1;
    return static_cast<std::uint32_t>((cell[0] & mask) + (cell[1] & mask) * kEdge +
                                      (cell[2] & mask) * kEdge * kEdge);
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

  // Numbers run from 0 in order of appearance; kNone: there is no such brick.
  [[nodiscard]] std::uint32_t find(const CellCoordinates& brick) const noexcept {
    const std::size_t mask = table_.size() - 1;
    for (std::size_t slot = hash(brick) & mask;; slot = (slot + 1) & mask) {
      const Slot& s = table_[slot];
      if (s.brick == kNone || s.at == brick) return s.brick;
    }
  }
  // kNone only when it may not allocate and there is no room. Numbers that were released come first.
  std::uint32_t find_or_add(const CellCoordinates& brick, bool may_allocate);
  // The brick is no more: its number and its room are the next new brick's. Allocates nothing.
  void release(std::uint32_t brick) noexcept;
  [[nodiscard]] std::size_t size() const noexcept { return at_.size(); }  // numbers ever given
  [[nodiscard]] std::size_t live() const noexcept { return at_.size() - released_; }
  [[nodiscard]] const CellCoordinates& at(std::uint32_t brick) const noexcept { return at_[brick]; }

  // Room for so many more bricks without allocating, and the bitmap over those that exist. Bricks may be
  // added later; those beyond the bitmap's edge share its outermost units.
  void seal(std::size_t more);

  // False: no brick that this box touches exists. True: perhaps one does.
  [[nodiscard]] bool perhaps(const glm::dvec3& low, const glm::dvec3& high) const noexcept {
    if (at_.empty()) return false;
    if (bitmap_.empty()) return true;
    const std::int32_t x0 = unit_at(low.x - origin_.x, 0), x1 = unit_at(high.x - origin_.x, 0),
                       y0 = unit_at(low.y - origin_.y, 1), y1 = unit_at(high.y - origin_.y, 1),
                       z0 = unit_at(low.z - origin_.z, 2), z1 = unit_at(high.z - origin_.z, 2);
    const std::uint64_t along_x = (~0ULL << x0) & (~0ULL >> (kUnits - 1 - x1));
    for (std::int32_t z = z0; z <= z1; ++z) {
      for (std::int32_t y = y0; y <= y1; ++y) {
        if ((bitmap_[word(z, y)] & along_x) != 0) return true;
      }
    }
    return false;
  }

  // Calls visit(number, the cells of the box in that brick) for each existing brick that the box touches,
  // until it returns false. Looks at no more bricks than exist.
  template <class Visit>
  void each(const glm::dvec3& low, const glm::dvec3& high, Visit&& visit) const noexcept {
    if (!perhaps(low, high)) return;
    const CellRange cells = cells_of(low, high);
    const CellCoordinates a = brick_of(cells.low), b = brick_of(cells.high);
    if (a == b) {  // one brick: a point, and most small boxes
      const std::uint32_t n = find(a);
      if (n != kNone) visit(n, cells);
      return;
    }
    double bricks = 1.0;
    for (std::size_t d = 0; d < 3; ++d) bricks *= std::max(0.0, static_cast<double>(b[d]) - a[d] + 1.0);
    if (bricks > static_cast<double>(at_.size())) {
      for (std::uint32_t n = 0; n < at_.size(); ++n) {
        const CellCoordinates& c = at_[n];
        bool within = true;
        for (std::size_t d = 0; d < 3; ++d) within = within && c[d] >= a[d] && c[d] <= b[d];
        if (within && !visit(n, part_in(cells, c))) return;
      }
      return;
    }
    CellCoordinates c{};
    for (c[2] = a[2]; c[2] <= b[2]; ++c[2]) {
      for (c[1] = a[1]; c[1] <= b[1]; ++c[1]) {
        const std::uint64_t row = row_of(c);
        for (c[0] = a[0]; c[0] <= b[0]; ++c[0]) {
          if ((row >> unit_of(c[0], 0) & 1U) == 0) continue;
          const std::uint32_t n = find(c);
          if (n != kNone && !visit(n, part_in(cells, c))) return;
        }
      }
    }
  }

  [[nodiscard]] std::size_t memory_bytes() const noexcept;

 private:
  static constexpr double kFarthestCell = 1e9;
  static constexpr std::int32_t kUnits = 64;  // of the bitmap, along an edge
  // In place of the first coordinate of a released brick: no cell is there. The second is the number that was
  // released before it.
  static constexpr std::int32_t kReleased = std::numeric_limits<std::int32_t>::min();
  struct Slot {
    CellCoordinates at{};
    std::uint32_t brick = kNone;
  };

  [[nodiscard]] std::int32_t along(double offset_m) const noexcept {
    // std::floor is a call where the processor's newer instructions may not be assumed. Written so that what
    // is not a number becomes the lowest cell.
    const double x = std::max(-kFarthestCell, std::min(offset_m * per_cell_, kFarthestCell));
    const auto cell = static_cast<std::int32_t>(x);
    return cell - (static_cast<double>(cell) > x ? 1 : 0);
  }
  [[nodiscard]] static CellRange part_in(const CellRange& cells, const CellCoordinates& brick) noexcept {
    CellRange part;
    for (std::size_t d = 0; d < 3; ++d) {
      part.low[d] = std::max(cells.low[d], brick[d] * kEdge);
      part.high[d] = std::min(cells.high[d], brick[d] * kEdge + kEdge - 1);
    }
    return part;
  }
  [[nodiscard]] static std::uint32_t hash(const CellCoordinates& c) noexcept {
    // Three odd multipliers and a finaliser (Teschner et al. 2003 mix the same way, with worse low bits).
    std::uint64_t h = static_cast<std::uint32_t>(c[0]) * 0x9E3779B97F4A7C15ULL ^
                      static_cast<std::uint32_t>(c[1]) * 0xC2B2AE3D27D4EB4FULL ^
                      static_cast<std::uint32_t>(c[2]) * 0x165667B19E3779F9ULL;
    h ^= h >> 29;
    h *= 0xBF58476D1CE4E5B9ULL;
    return static_cast<std::uint32_t>(h >> 32);
  }
  [[nodiscard]] std::int32_t unit_of(std::int32_t brick, std::size_t axis) const noexcept {
    return std::clamp((brick >> unit_shift_) - first_unit_[axis], 0, kUnits - 1);
  }
  // The same, of a place: floor(cell / 2^n) is the floor of the unrounded cell / 2^n, a product that is
  // exact.
  [[nodiscard]] std::int32_t unit_at(double offset_m, std::size_t axis) const noexcept {
    const double first = first_unit_number_[axis];
    const double x = std::max(first, std::min(offset_m * per_cell_ * units_per_cell_, first + (kUnits - 1)));
    const auto unit = static_cast<std::int32_t>(x);
    return unit - (static_cast<double>(unit) > x ? 1 : 0) - first_unit_[axis];
  }
  [[nodiscard]] static std::size_t word(std::int32_t unit_z, std::int32_t unit_y) noexcept {
    return static_cast<std::size_t>(unit_z) * kUnits + static_cast<std::size_t>(unit_y);
  }
  // Bits of the bitmap along x; all of them before there is one.
  [[nodiscard]] std::uint64_t row_of(const CellCoordinates& brick) const noexcept {
    if (bitmap_.empty()) return ~0ULL;
    return bitmap_[word(unit_of(brick[2], 2), unit_of(brick[1], 1))];
  }
  void rehash(std::size_t capacity);
  void mark(const CellCoordinates& brick) noexcept;
  void unmark(const CellCoordinates& brick) noexcept;

  double cell_m_, per_cell_;
  glm::dvec3 origin_;
  std::vector<CellCoordinates> at_;  // [brick], released ones too
  std::uint32_t last_released_ = kNone;
  std::size_t released_ = 0;
  std::vector<Slot> table_;            // open addressing, linear probing, at most half full
  std::vector<std::uint64_t> bitmap_;  // [z][y], bit x; empty until sealed
  CellCoordinates first_unit_{};
  std::array<double, 3> first_unit_number_{};
  int unit_shift_ = 0;
  double units_per_cell_ = 1.0 / kEdge;
};

}  // namespace hybrid
