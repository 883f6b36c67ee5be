// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/map/fixed_surface_layer.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace hybrid {
namespace {

constexpr int kEdge = BrickGrid::kEdge;
// Longer triangles are halved until each spans few cells, because the box of an oblique triangle is mostly
// empty.
constexpr double kLongestPiece = 8.0;  // cells

// Does the triangle touch the box? Separating axes (Akenine-Möller 2001): three box axes, the triangle's
// normal, and nine cross products of edges.
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

std::uint64_t bit_in_layer(const CellCoordinates& cell) {
  constexpr std::int32_t in_brick = kEdge - 1;
  return 1ULL << ((cell[0] & in_brick) + kEdge * (cell[1] & in_brick));
}

std::size_t layer_of(const CellCoordinates& cell) {
  return static_cast<std::size_t>(cell[2] & (kEdge - 1));
}

}  // namespace

SurfaceCells::Brick& SurfaceCells::brick_at(const CellCoordinates& cell) {
  const CellCoordinates at = BrickGrid::brick_of(cell);
  if (last_ == kNone || index_[last_].at != at)
    last_ = index_.find_or_add(at, true, [](const Brick&, std::uint32_t) {});
  return index_[last_];
}

void SurfaceCells::add_triangle(std::uint64_t object_bit, const glm::dvec3& a, const glm::dvec3& b,
                                const glm::dvec3& c, double margin_m) {
  low_ = glm::min(low_, glm::min(a, glm::min(b, c)) - margin_m);
  high_ = glm::max(high_, glm::max(a, glm::max(b, c)) + margin_m);
  const double ab = glm::length(b - a), bc = glm::length(c - b), ca = glm::length(a - c);
  const double longest = std::max({ab, bc, ca});
  if (longest <= kLongestPiece * cell_m()) {
    add_piece(object_bit, {a, b, c}, margin_m);
  } else if (longest == ab) {
    const glm::dvec3 m = 0.5 * (a + b);
    add_triangle(object_bit, a, m, c, margin_m);
    add_triangle(object_bit, m, b, c, margin_m);
  } else if (longest == bc) {
    add_triangle(object_bit, b, c, a, margin_m);
  } else {
    add_triangle(object_bit, c, a, b, margin_m);
  }
}

void SurfaceCells::add_piece(std::uint64_t object_bit, const std::array<glm::dvec3, 3>& t, double margin_m) {
  const auto [a, b] = index_.cells_of(glm::min(t[0], glm::min(t[1], t[2])) - margin_m,
                                      glm::max(t[0], glm::max(t[1], t[2])) + margin_m);
  // A triangle whose box spans one cell or a row of cells touches all of them, because it is connected.
  // Others need the exact test.
  int axes = 0;
  double farthest = 1.0;
  for (std::size_t d = 0; d < 3; ++d) {
    axes += a[d] != b[d] ? 1 : 0;
    farthest = std::max({farthest, std::fabs(a[d]), std::fabs(b[d])});
  }
  const bool ask = axes > 1;
  // Vertices relative to the map's origin, as cells are. The box is slightly larger than the cell, so that a
  // triangle in the face between two cells is in both despite rounding.
  const std::array<glm::dvec3, 3> local{t[0] - index_.origin(), t[1] - index_.origin(),
                                        t[2] - index_.origin()};
  const glm::dvec3 far = glm::abs(t[0]);
  const double half =
      0.5 * cell_m() * (1.0 + 1e-9 + 4e-15 * farthest) + 1e-15 * std::max({far.x, far.y, far.z}) + margin_m;
  CellCoordinates c{};
  for (c[2] = a[2]; c[2] <= b[2]; ++c[2]) {
    for (c[1] = a[1]; c[1] <= b[1]; ++c[1]) {
      for (c[0] = a[0]; c[0] <= b[0]; ++c[0]) {
        // A fine mesh has many triangles in a cell: the exact test is made only until the cell is occupied.
        if (ask && !is_occupied_in_last_brick(c, object_bit) &&
            !triangle_touches_box(local, cell_m() * (glm::dvec3(c[0], c[1], c[2]) + 0.5), half))
          continue;
        Brick& brick = brick_at(c);
        brick.layer[layer_of(c)] |= bit_in_layer(c);
        brick.objects |= object_bit;
      }
    }
  }
}

bool SurfaceCells::is_occupied_in_last_brick(const CellCoordinates& cell,
                                             std::uint64_t object_bit) const noexcept {
  if (last_ == kNone || index_[last_].at != BrickGrid::brick_of(cell)) return false;
  const Brick& brick = index_[last_];
  return (brick.objects & object_bit) != 0 && (brick.layer[layer_of(cell)] & bit_in_layer(cell)) != 0;
}

void SurfaceCells::seal() {
  index_.seal(0, [](const Brick&, std::uint32_t) {});
  last_ = kNone;
}

bool SurfaceCells::any_near(const glm::dvec3& low, const glm::dvec3& high) const noexcept {
  if (!touches_bounds(low, high)) return false;
  bool any = false;
  CellTrail trail;
  index_.each(index_.cells_of(low, high), trail, [&any](const Brick&, const CellRange&) {
    any = true;
    return false;
  });
  return any;
}

std::uint64_t SurfaceCells::objects_in(const glm::dvec3& low, const glm::dvec3& high,
                                       CellTrail& trail) const noexcept {
  if (!touches_bounds(low, high)) return 0;
  std::uint64_t objects = 0;
  index_.each(index_.cells_of(low, high), trail, [&](const Brick& brick, const CellRange& part) {
    if ((brick.objects & ~objects) == 0) return true;
    const std::uint64_t mask = BrickGrid::layer_mask(part);
    const std::size_t last = layer_of(part.high);
    for (std::size_t z = layer_of(part.low); z <= last; ++z) {
      if ((brick.layer[z] & mask) == 0) continue;
      objects |= brick.objects;
      break;
    }
    return true;
  });
  return objects;
}

bool SurfaceCells::occupied(const CellCoordinates& cell) const noexcept {
  const std::uint32_t n = index_.find(BrickGrid::brick_of(cell));
  return n != kNone && (index_[n].layer[layer_of(cell)] & bit_in_layer(cell)) != 0;
}

std::size_t SurfaceCells::occupied_cells() const noexcept {
  std::size_t cells = 0;
  index_.table().each([&cells](const Brick& b, std::uint32_t) {
    for (const std::uint64_t layer : b.layer) cells += static_cast<std::size_t>(std::popcount(layer));
  });
  return cells;
}

std::size_t SurfaceCells::memory_bytes() const noexcept {
  return index_.memory_bytes();
}

}  // namespace hybrid
