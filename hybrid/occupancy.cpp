// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/occupancy.h"

#include <bit>
#include <utility>

namespace hybrid {
namespace {

constexpr std::uint32_t kLayer = BrickIndex::kEdge * BrickIndex::kEdge;  // cells of one z in a brick

}  // namespace

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
  const std::uint32_t inner = BrickIndex::index_in_brick(cell);
  std::uint32_t old = soft_cell_[number];
  if (old != kNone && old % kCells == inner && soft_index_.at(old / kCells) == at) return;
  std::uint32_t brick = soft_index_.find_or_add(at, may_allocate);
  if (brick == kNone && old != kNone && alone_in_brick(number)) {
    // What it leaves is room for what it needs.
    unlink(number);
    release_if_empty(old / kCells);
    old = kNone;
    brick = soft_index_.find_or_add(at, false);
  }
  if (brick == kNone) {
    ++overflows_;
    return;
  }
  if (brick == soft_bricks_.size()) soft_bricks_.emplace_back();
  if (old != kNone) unlink(number);
  SoftBrick& to = soft_bricks_[brick];
  std::uint64_t& layer = to.layer[inner / kLayer];
  const std::uint64_t bit = 1ULL << (inner % kLayer);
  next_[number] = (layer & bit) != 0 ? to.head[inner] : kNone;
  to.head[inner] = number;
  layer |= bit;
  soft_cell_[number] = brick * kCells + inner;
  if (old != kNone) release_if_empty(old / kCells);
}

void OccupancyMap::unlink(std::uint32_t number) noexcept {
  const std::uint32_t cell = soft_cell_[number], inner = cell % kCells;
  SoftBrick& brick = soft_bricks_[cell / kCells];
  std::uint32_t* link = &brick.head[inner];
  while (*link != number) link = &next_[*link];
  *link = next_[number];
  if (brick.head[inner] == kNone) brick.layer[inner / kLayer] &= ~(1ULL << (inner % kLayer));
}

void OccupancyMap::release_if_empty(std::uint32_t brick) noexcept {
  std::uint64_t any = 0;
  for (const std::uint64_t layer : soft_bricks_[brick].layer) any |= layer;
  if (any == 0) soft_index_.release(brick);
}

bool OccupancyMap::alone_in_brick(std::uint32_t number) const noexcept {
  const SoftBrick& brick = soft_bricks_[soft_cell_[number] / kCells];
  int cells = 0;
  for (const std::uint64_t layer : brick.layer) cells += std::popcount(layer);
  return cells == 1 && brick.head[soft_cell_[number] % kCells] == number && next_[number] == kNone;
}

bool OccupancyMap::any_near(const glm::dvec3& low, const glm::dvec3& high) const noexcept {
  if (fixed_.any_near(low, high)) return true;
  if (!moving_.empty() && moving_.any_near(low, high)) return true;
  bool any = false;
  soft_index_.each(low, high, [&any](std::uint32_t, const CellRange&) {
    any = true;
    return false;
  });
  return any;
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
    const std::uint64_t mask = BrickIndex::layer_mask(part);
    const auto first = static_cast<std::uint32_t>(part.low[2] & (BrickIndex::kEdge - 1)),
               last = static_cast<std::uint32_t>(part.high[2] & (BrickIndex::kEdge - 1));
    for (std::uint32_t z = first; z <= last; ++z) {
      for (std::uint64_t bits = brick.layer[z] & mask; bits != 0; bits &= bits - 1) {
        const std::uint32_t inner = z * kLayer + static_cast<std::uint32_t>(std::countr_zero(bits));
        for (std::uint32_t v = brick.head[inner]; v != kNone; v = next_[v]) {
          if (count == out.size()) return false;
          out[count++] = v;
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
    const CellCoordinates& at = soft_index_.at(b);  // a released brick has no bit
    for (std::int32_t z = 0; z < BrickIndex::kEdge; ++z) {
      for (std::uint64_t bits = soft_bricks_[b].layer[static_cast<std::size_t>(z)]; bits != 0;
           bits &= bits - 1) {
        constexpr std::int32_t edge = BrickIndex::kEdge;
        const std::int32_t i = std::countr_zero(bits);
        cells +=
            fixed_.occupied({at[0] * edge + i % edge, at[1] * edge + i / edge, at[2] * edge + z}) ? 0 : 1;
      }
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
  std::size_t listed = 0, placed = 0, bricks = 0;
  for (std::uint32_t b = 0; b < soft_bricks_.size(); ++b) {
    std::size_t in_brick = 0;
    for (std::uint32_t i = 0; i < kCells; ++i) {
      if ((soft_bricks_[b].layer[i / kLayer] >> (i % kLayer) & 1U) == 0) continue;
      if (soft_bricks_[b].head[i] == kNone) return false;
      for (std::uint32_t n = soft_bricks_[b].head[i]; n != kNone; n = next_[n]) {
        if (soft_cell_[n] != b * kCells + i) return false;
        if (++in_brick > next_.size()) return false;
      }
    }
    // A brick is found where it says it is exactly when it holds something.
    if ((soft_index_.find(soft_index_.at(b)) == b) != (in_brick != 0)) return false;
    bricks += in_brick != 0 ? 1 : 0;
    listed += in_brick;
  }
  for (const std::uint32_t cell : soft_cell_) placed += cell != kNone ? 1 : 0;
  return listed == placed && bricks == soft_index_.live() && moving_.validate();
}

}  // namespace hybrid
