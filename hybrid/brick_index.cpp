// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/brick_index.h"

#include <cmath>
#include <stdexcept>

namespace hybrid {

BrickIndex::BrickIndex(double cell_m, const glm::dvec3& origin)
    : cell_m_(cell_m), per_cell_(1.0 / cell_m), origin_(origin) {
  if (!(cell_m > 0.0) || !std::isfinite(cell_m) || !std::isfinite(per_cell_))
    throw std::invalid_argument("an occupancy cell must be positive");
  rehash(64);
}

std::uint32_t BrickIndex::find_or_add(const CellCoordinates& brick, bool may_allocate) {
  const std::size_t mask = table_.size() - 1;
  std::size_t slot = hash(brick) & mask;
  for (; table_[slot].brick != kNone; slot = (slot + 1) & mask) {
    if (table_[slot].at == brick) return table_[slot].brick;
  }
  if (last_released_ != kNone) {
    const std::uint32_t again = last_released_;
    last_released_ = static_cast<std::uint32_t>(at_[again][1]);
    --released_;
    at_[again] = brick;
    table_[slot] = {brick, again};
    mark(brick);
    return again;
  }
  const auto added = static_cast<std::uint32_t>(at_.size());
  const bool table_full = (at_.size() + 1) * 2 > table_.size();
  if (!may_allocate && (table_full || at_.size() == at_.capacity())) return kNone;
  at_.push_back(brick);
  if (table_full) {
    rehash(table_.size() * 2);  // takes the new brick with it
  } else {
    table_[slot] = {brick, added};
  }
  mark(brick);
  return added;
}

void BrickIndex::release(std::uint32_t brick) noexcept {
  const CellCoordinates at = at_[brick];
  const std::size_t mask = table_.size() - 1;
  std::size_t hole = hash(at) & mask;
  while (table_[hole].brick != brick) hole = (hole + 1) & mask;
  // No tombstones, which would fill the table in a long session: what a probe finds beyond the hole moves up
  // into it, unless its own place lies between (Knuth, The Art of Computer Programming 3, 6.4 R).
  for (std::size_t slot = (hole + 1) & mask; table_[slot].brick != kNone; slot = (slot + 1) & mask) {
    const std::size_t home = hash(table_[slot].at) & mask;
    if (((slot - home) & mask) < ((slot - hole) & mask)) continue;
    table_[hole] = table_[slot];
    hole = slot;
  }
  table_[hole] = Slot{};
  at_[brick] = {kReleased, static_cast<std::int32_t>(last_released_), 0};
  last_released_ = brick;
  ++released_;
  unmark(at);
}

void BrickIndex::rehash(std::size_t capacity) {
  table_.assign(capacity, Slot{});
  for (std::uint32_t b = 0; b < at_.size(); ++b) {
    if (at_[b][0] == kReleased) continue;
    std::size_t slot = hash(at_[b]) & (capacity - 1);
    while (table_[slot].brick != kNone) slot = (slot + 1) & (capacity - 1);
    table_[slot] = {at_[b], b};
  }
}

void BrickIndex::seal(std::size_t more) {
  at_.shrink_to_fit();
  at_.reserve(at_.size() + more);
  std::size_t capacity = 64;
  while (capacity < 2 * (at_.capacity() + 1)) capacity *= 2;
  rehash(capacity);

  CellCoordinates low{}, high{};
  bool first = true;
  for (const CellCoordinates& b : at_) {
    if (b[0] == kReleased) continue;
    if (first) low = high = b;
    first = false;
    for (std::size_t d = 0; d < 3; ++d) {
      low[d] = std::min(low[d], b[d]);
      high[d] = std::max(high[d], b[d]);
    }
  }
  const auto fits = [&low, &high](int shift) {
    for (std::size_t d = 0; d < 3; ++d) {
      if ((high[d] >> shift) - (low[d] >> shift) >= kUnits) return false;
    }
    return true;
  };
  unit_shift_ = 0;
  while (!fits(unit_shift_)) ++unit_shift_;
  for (std::size_t d = 0; d < 3; ++d) {
    first_unit_[d] = low[d] >> unit_shift_;
    first_unit_number_[d] = first_unit_[d];
  }
  units_per_cell_ = std::ldexp(1.0, -(kShift + unit_shift_));
  bitmap_.assign(static_cast<std::size_t>(kUnits) * kUnits, 0);
  for (const CellCoordinates& b : at_) {
    if (b[0] != kReleased) mark(b);
  }
}

void BrickIndex::mark(const CellCoordinates& brick) noexcept {
  if (bitmap_.empty()) return;
  bitmap_[word(unit_of(brick[2], 2), unit_of(brick[1], 1))] |= 1ULL << unit_of(brick[0], 0);
}

void BrickIndex::unmark(const CellCoordinates& brick) noexcept {
  // A bit too many costs a probe of the table and no more. It stays where finding out would cost many: in
  // units of many bricks, and in the outermost, which are also all that lies further out.
  constexpr int kMostShift = 2;
  if (bitmap_.empty() || unit_shift_ > kMostShift) return;
  for (std::size_t d = 0; d < 3; ++d) {
    const std::int32_t unit = unit_of(brick[d], d);
    if (unit == 0 || unit == kUnits - 1) return;
  }
  CellCoordinates low{}, c{};
  for (std::size_t d = 0; d < 3; ++d) low[d] = (brick[d] >> unit_shift_) * (1 << unit_shift_);
  const std::int32_t edge = 1 << unit_shift_;
  for (c[2] = low[2]; c[2] < low[2] + edge; ++c[2]) {
    for (c[1] = low[1]; c[1] < low[1] + edge; ++c[1]) {
      for (c[0] = low[0]; c[0] < low[0] + edge; ++c[0]) {
        if (find(c) != kNone) return;
      }
    }
  }
  bitmap_[word(unit_of(brick[2], 2), unit_of(brick[1], 1))] &= ~(1ULL << unit_of(brick[0], 0));
}

std::size_t BrickIndex::memory_bytes() const noexcept {
  return at_.capacity() * sizeof(CellCoordinates) + table_.size() * sizeof(Slot) +
         bitmap_.capacity() * sizeof(std::uint64_t);
}

}  // namespace hybrid
