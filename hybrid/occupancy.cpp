// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/occupancy.h"

#include <utility>

namespace hybrid {

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
  soft_index_.seal(more);
  soft_bricks_.shrink_to_fit();
  soft_bricks_.reserve(soft_bricks_.size() + more);
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
  const std::uint32_t old = soft_cell_[number];
  const std::uint32_t inner = BrickIndex::index_in_brick(cell);
  if (old != kNone && old % kCells == inner && soft_index_.at(old / kCells) == at) return;
  const std::uint32_t brick = soft_index_.find_or_add(at, may_allocate);
  if (brick == kNone) {
    ++overflows_;
    return;
  }
  if (brick == soft_bricks_.size()) soft_bricks_.emplace_back().head.fill(kNone);
  if (old != kNone) {
    SoftBrick& from = soft_bricks_[old / kCells];
    std::uint32_t* link = &from.head[old % kCells];
    while (*link != number) link = &next_[*link];
    *link = next_[number];
    --from.count;
  }
  SoftBrick& to = soft_bricks_[brick];
  next_[number] = to.head[inner];
  to.head[inner] = number;
  ++to.count;
  soft_cell_[number] = brick * kCells + inner;
}

bool OccupancyMap::soft_near(const glm::dvec3& low, const glm::dvec3& high) const noexcept {
  bool any = false;
  soft_index_.each(low, high, [&](std::uint32_t brick, const CellRange&) {
    any = soft_bricks_[brick].count != 0;
    return !any;
  });
  return any;
}

bool OccupancyMap::any_near(const glm::dvec3& low, const glm::dvec3& high) const noexcept {
  if (fixed_.any_near(low, high)) return true;
  if (!moving_.empty() && moving_.any_near(low, high)) return true;
  return !soft_bricks_.empty() && soft_near(low, high);
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
    if (brick.count == 0) return true;
    for (std::int32_t k = part.low[2]; k <= part.high[2]; ++k) {
      for (std::int32_t j = part.low[1]; j <= part.high[1]; ++j) {
        for (std::int32_t i = part.low[0]; i <= part.high[0]; ++i) {
          for (std::uint32_t v = brick.head[BrickIndex::index_in_brick({i, j, k})]; v != kNone;
               v = next_[v]) {
            if (count == out.size()) return false;
            out[count++] = v;
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
  for (std::uint32_t b = 0; b < soft_bricks_.size(); ++b) {
    if (soft_bricks_[b].count == 0) continue;
    const CellCoordinates& at = soft_index_.at(b);
    for (std::int32_t i = 0; i < kCells; ++i) {
      if (soft_bricks_[b].head[static_cast<std::size_t>(i)] == kNone) continue;
      constexpr std::int32_t edge = BrickIndex::kEdge;
      const bool rigid_too = fixed_.occupied(
          {at[0] * edge + i % edge, at[1] * edge + i / edge % edge, at[2] * edge + i / (edge * edge)});
      cells += rigid_too ? 0 : 1;
    }
  }
  return cells;
}

std::size_t OccupancyMap::memory_bytes() const {
  return fixed_.memory_bytes() + moving_.memory_bytes() + soft_index_.memory_bytes() +
         soft_bricks_.capacity() * sizeof(SoftBrick) +
         (next_.capacity() + soft_cell_.capacity()) * sizeof(std::uint32_t);
}

bool OccupancyMap::validate() const {
  std::size_t listed = 0, placed = 0;
  for (std::size_t b = 0; b < soft_bricks_.size(); ++b) {
    std::size_t in_brick = 0;
    for (std::size_t i = 0; i < kCells; ++i) {
      for (std::uint32_t n = soft_bricks_[b].head[i]; n != kNone; n = next_[n]) {
        if (soft_cell_[n] != b * kCells + i) return false;
        if (++in_brick > next_.size()) return false;
      }
    }
    if (in_brick != soft_bricks_[b].count) return false;
    listed += in_brick;
  }
  for (const std::uint32_t cell : soft_cell_) placed += cell != kNone ? 1 : 0;
  return listed == placed && moving_.validate();
}

}  // namespace hybrid
