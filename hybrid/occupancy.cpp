// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/occupancy.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <stdexcept>

namespace hybrid {
namespace {

// Cells are numbered in 32 bits; what lies further out than this is clamped to the edge cells, where it is
// still found by whatever else is out there.
constexpr double kFarthestCell = 1e9;

// Does the triangle touch the box? Separating axes (Akenine-Möller 2001): three box axes, the plane, nine
// edge products.
bool triangle_touches_box(const std::array<glm::dvec3, 3>& t, const glm::dvec3& centre, double half) {
  const std::array<glm::dvec3, 3> v{t[0] - centre, t[1] - centre, t[2] - centre};
  const auto separates = [&v, half](const glm::dvec3& axis) {
    const double p0 = glm::dot(v[0], axis), p1 = glm::dot(v[1], axis), p2 = glm::dot(v[2], axis);
    const double r = half * (std::fabs(axis.x) + std::fabs(axis.y) + std::fabs(axis.z));
    return std::min({p0, p1, p2}) > r || std::max({p0, p1, p2}) < -r;
  };
  const std::array<glm::dvec3, 3> e{v[1] - v[0], v[2] - v[1], v[0] - v[2]};
  for (int d = 0; d < 3; ++d) {
    glm::dvec3 axis(0.0);
    axis[d] = 1.0;
    if (separates(axis)) return false;
    for (const glm::dvec3& edge : e) {
      if (separates(glm::cross(axis, edge))) return false;
    }
  }
  return !separates(glm::cross(e[0], e[1]));
}

}  // namespace

OccupancyMap::OccupancyMap(double cell_m, const glm::dvec3& origin) : cell_m_(cell_m), origin_(origin) {
  if (!(cell_m > 0.0) || !std::isfinite(cell_m))
    throw std::invalid_argument("an occupancy cell must be positive");
  rehash(1024);
}

OccupancyMap::Coordinates OccupancyMap::cell_of(const glm::dvec3& p) const noexcept {
  Coordinates c{};
  for (std::size_t d = 0; d < 3; ++d) {
    const double x = std::floor((p[static_cast<int>(d)] - origin_[static_cast<int>(d)]) / cell_m_);
    c[d] = static_cast<std::int32_t>(std::clamp(x, -kFarthestCell, kFarthestCell));
  }
  return c;
}

std::uint32_t OccupancyMap::hash(const Coordinates& c) noexcept {
  // Three odd multipliers and a finaliser (Teschner et al. 2003 mix the same way, with worse low bits).
  std::uint64_t h = static_cast<std::uint32_t>(c[0]) * 0x9E3779B97F4A7C15ULL ^
                    static_cast<std::uint32_t>(c[1]) * 0xC2B2AE3D27D4EB4FULL ^
                    static_cast<std::uint32_t>(c[2]) * 0x165667B19E3779F9ULL;
  h ^= h >> 29;
  h *= 0xBF58476D1CE4E5B9ULL;
  return static_cast<std::uint32_t>(h >> 32);
}

std::uint32_t OccupancyMap::index_in_brick(const Coordinates& cell) noexcept {
  constexpr std::int32_t mask = kEdge - 1;
  return static_cast<std::uint32_t>((cell[0] & mask) + (cell[1] & mask) * kEdge +
                                    (cell[2] & mask) * kEdge * kEdge);
}

std::uint32_t OccupancyMap::find(const Coordinates& brick) const noexcept {
  const std::size_t mask = table_.size() - 1;
  for (std::size_t slot = hash(brick) & mask;; slot = (slot + 1) & mask) {
    const std::uint32_t b = table_[slot];
    if (b == kNone || bricks_[b].at == brick) return b;
  }
}

std::uint32_t OccupancyMap::find_or_add(const Coordinates& brick, bool may_allocate) {
  const std::uint32_t found = find(brick);
  if (found != kNone) return found;
  if (!may_allocate && (bricks_.size() == bricks_.capacity() || (bricks_.size() + 1) * 2 > table_.size()))
    return kNone;
  if (may_allocate && (bricks_.size() + 1) * 2 > table_.size()) rehash(table_.size() * 2);
  const auto added = static_cast<std::uint32_t>(bricks_.size());
  Brick& b = bricks_.emplace_back();
  b.at = brick;
  b.soft_head.fill(kNone);
  b.rigid.fill(0);
  const std::size_t mask = table_.size() - 1;
  std::size_t slot = hash(brick) & mask;
  while (table_[slot] != kNone) slot = (slot + 1) & mask;
  table_[slot] = added;
  return added;
}

void OccupancyMap::rehash(std::size_t capacity) {
  table_.assign(capacity, kNone);
  for (std::uint32_t b = 0; b < bricks_.size(); ++b) {
    std::size_t slot = hash(bricks_[b].at) & (capacity - 1);
    while (table_[slot] != kNone) slot = (slot + 1) & (capacity - 1);
    table_[slot] = b;
  }
}

void OccupancyMap::add_triangle(std::uint32_t object, const glm::dvec3& a, const glm::dvec3& b,
                                const glm::dvec3& c) {
  const std::array<glm::dvec3, 3> t{a, b, c};
  const Coordinates low = cell_of(glm::min(a, glm::min(b, c))), high = cell_of(glm::max(a, glm::max(b, c)));
  // A little larger than the cell, so that a triangle in the face between two cells is in both.
  const double half = 0.5 * cell_m_ * (1.0 + 1e-9);
  for (std::int32_t k = low[2]; k <= high[2]; ++k) {
    for (std::int32_t j = low[1]; j <= high[1]; ++j) {
      for (std::int32_t i = low[0]; i <= high[0]; ++i) {
        const glm::dvec3 centre = origin_ + cell_m_ * (glm::dvec3(i, j, k) + 0.5);
        if (!triangle_touches_box(t, centre, half)) continue;
        Brick& brick = bricks_[find_or_add({i >> kShift, j >> kShift, k >> kShift}, true)];
        brick.rigid[index_in_brick({i, j, k})] = 1;
        brick.rigid_mask |= rigid_bit(object);
      }
    }
  }
}

std::uint32_t OccupancyMap::add_soft(std::uint32_t count) {
  const auto first = static_cast<std::uint32_t>(next_.size());
  next_.resize(next_.size() + count, kNone);
  soft_cell_.resize(soft_cell_.size() + count, kNone);
  return first;
}

void OccupancyMap::reserve_bricks(std::size_t more) {
  bricks_.shrink_to_fit();
  bricks_.reserve(bricks_.size() + more);
  std::size_t capacity = 1024;
  while (capacity < 2 * (bricks_.capacity() + 1)) capacity *= 2;
  rehash(capacity);
}

void OccupancyMap::place(std::uint32_t number, const glm::dvec3& position) {
  put(number, position, true);
}

void OccupancyMap::move(std::uint32_t number, const glm::dvec3& position) noexcept {
  put(number, position, false);
}

void OccupancyMap::put(std::uint32_t number, const glm::dvec3& position, bool may_allocate) {
  const Coordinates cell = cell_of(position);
  const Coordinates at{cell[0] >> kShift, cell[1] >> kShift, cell[2] >> kShift};
  const std::uint32_t old = soft_cell_[number];
  const std::uint32_t inner = index_in_brick(cell);
  if (old != kNone && old % kCells == inner && bricks_[old / kCells].at == at) return;
  const std::uint32_t brick = find_or_add(at, may_allocate);
  if (brick == kNone) {
    ++overflows_;
    return;
  }
  if (old != kNone) {
    Brick& from = bricks_[old / kCells];
    std::uint32_t* link = &from.soft_head[old % kCells];
    while (*link != number) link = &next_[*link];
    *link = next_[number];
    --from.soft_count;
  }
  Brick& to = bricks_[brick];
  next_[number] = to.soft_head[inner];
  to.soft_head[inner] = number;
  ++to.soft_count;
  soft_cell_[number] = brick * kCells + inner;
}

template <class Visit>
void OccupancyMap::each_brick(const glm::dvec3& low, const glm::dvec3& high, Visit&& visit) const noexcept {
  const Coordinates a = cell_of(low), b = cell_of(high);
  Coordinates at{};
  for (at[2] = a[2] >> kShift; at[2] <= b[2] >> kShift; ++at[2]) {
    for (at[1] = a[1] >> kShift; at[1] <= b[1] >> kShift; ++at[1]) {
      for (at[0] = a[0] >> kShift; at[0] <= b[0] >> kShift; ++at[0]) {
        const std::uint32_t found = find(at);
        if (found == kNone) continue;
        Coordinates from{}, to{};
        for (std::size_t d = 0; d < 3; ++d) {
          from[d] = std::max(a[d], at[d] * kEdge);
          to[d] = std::min(b[d], at[d] * kEdge + kEdge - 1);
        }
        if (!visit(bricks_[found], from, to)) return;
      }
    }
  }
}

bool OccupancyMap::any_near(const glm::dvec3& low, const glm::dvec3& high) const noexcept {
  bool any = false;
  each_brick(low, high, [&any](const Brick& brick, const Coordinates&, const Coordinates&) {
    any = brick.rigid_mask != 0 || brick.soft_count != 0;
    return !any;
  });
  return any;
}

std::uint64_t OccupancyMap::rigid_in(const glm::dvec3& low, const glm::dvec3& high) const noexcept {
  std::uint64_t mask = 0;
  each_brick(low, high, [&mask](const Brick& brick, const Coordinates& from, const Coordinates& to) {
    if ((brick.rigid_mask & ~mask) == 0) return true;
    for (std::int32_t k = from[2]; k <= to[2]; ++k) {
      for (std::int32_t j = from[1]; j <= to[1]; ++j) {
        for (std::int32_t i = from[0]; i <= to[0]; ++i) {
          if (brick.rigid[index_in_brick({i, j, k})] == 0) continue;
          mask |= brick.rigid_mask;
          return true;
        }
      }
    }
    return true;
  });
  return mask;
}

std::size_t OccupancyMap::soft_in(const glm::dvec3& low, const glm::dvec3& high,
                                  std::span<std::uint32_t> out) const noexcept {
  std::size_t count = 0;
  each_brick(low, high, [&](const Brick& brick, const Coordinates& from, const Coordinates& to) {
    if (brick.soft_count == 0) return true;
    for (std::int32_t k = from[2]; k <= to[2]; ++k) {
      for (std::int32_t j = from[1]; j <= to[1]; ++j) {
        for (std::int32_t i = from[0]; i <= to[0]; ++i) {
          for (std::uint32_t n = brick.soft_head[index_in_brick({i, j, k})]; n != kNone; n = next_[n]) {
            if (count == out.size()) return false;
            out[count++] = n;
          }
        }
      }
    }
    return true;
  });
  return count;
}

std::size_t OccupancyMap::occupied_cells() const noexcept {
  std::size_t cells = 0;
  for (const Brick& b : bricks_) {
    for (std::size_t i = 0; i < kCells; ++i) cells += b.rigid[i] != 0 || b.soft_head[i] != kNone ? 1 : 0;
  }
  return cells;
}

std::size_t OccupancyMap::memory_bytes() const {
  return bricks_.capacity() * sizeof(Brick) +
         (table_.size() + next_.size() + soft_cell_.size()) * sizeof(std::uint32_t);
}

bool OccupancyMap::validate() const {
  std::size_t listed = 0, placed = 0;
  for (std::size_t b = 0; b < bricks_.size(); ++b) {
    std::size_t in_brick = 0;
    for (std::size_t i = 0; i < kCells; ++i) {
      for (std::uint32_t n = bricks_[b].soft_head[i]; n != kNone; n = next_[n]) {
        if (soft_cell_[n] != b * kCells + i) return false;
        if (++in_brick > next_.size()) return false;
      }
    }
    if (in_brick != bricks_[b].soft_count) return false;
    listed += in_brick;
  }
  for (const std::uint32_t cell : soft_cell_) placed += cell != kNone ? 1 : 0;
  return listed == placed;
}

}  // namespace hybrid
