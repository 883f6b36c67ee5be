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

// A convex polygon: a triangle that up to two planes have cut.
struct Polygon {
  std::array<glm::dvec3, 5> corner;
  std::size_t count = 0;

  [[nodiscard]] const glm::dvec3& after(std::size_t i) const { return corner[i + 1 == count ? 0 : i + 1]; }
};

// The part of the polygon on one side of a plane across z (Sutherland & Hodgman 1974): sign · z ≤ sign · at.
// Rounding acts as if the plane were displaced by some units in the last place of its coordinates.
Polygon cut(const Polygon& polygon, double sign, double at) {
  Polygon kept;
  for (std::size_t i = 0; i < polygon.count; ++i) {
    const glm::dvec3 &p = polygon.corner[i], &q = polygon.after(i);
    const double from = sign * (p.z - at), to = sign * (q.z - at);
    if (from <= 0.0) kept.corner[kept.count++] = p;
    if ((from <= 0.0) != (to <= 0.0)) kept.corner[kept.count++] = p + from / (from - to) * (q - p);
  }
  return kept;
}

struct Extent {
  double least = 1e300, most = -1e300;

  void add(double x) {
    least = std::min(least, x);
    most = std::max(most, x);
  }
  [[nodiscard]] bool empty() const { return least > most; }
  // The cells that it touches with `slack`, among those from `low` to `high`.
  [[nodiscard]] std::pair<std::int32_t, std::int32_t> cells(double slack, std::int32_t low,
                                                            std::int32_t high) const {
    const auto cell = [low, high](double at) {
      const double inside = std::clamp(at, static_cast<double>(low), static_cast<double>(high));
      const auto towards_zero = static_cast<std::int32_t>(inside);
      return towards_zero - (static_cast<double>(towards_zero) > inside ? 1 : 0);
    };
    return {cell(least - slack), cell(most + slack)};
  }
};

Extent extent_along_y(const Polygon& polygon) {
  Extent extent;
  for (std::size_t i = 0; i < polygon.count; ++i) extent.add(polygon.corner[i].y);
  return extent;
}

// Extent along x of the part of the polygon with low ≤ y ≤ high. The corners of that part lie on the edges.
Extent extent_along_x(const Polygon& polygon, double low, double high) {
  Extent extent;
  for (std::size_t i = 0; i < polygon.count; ++i) {
    const glm::dvec3 &p = polygon.corner[i], &q = polygon.after(i);
    if (std::max(p.y, q.y) < low || std::min(p.y, q.y) > high) continue;
    const auto within = [&](const glm::dvec3& end) {
      if (end.y >= low && end.y <= high) return end.x;
      return p.x + ((end.y < low ? low : high) - p.y) / (q.y - p.y) * (q.x - p.x);
    };
    extent.add(within(p));
    extent.add(within(q));
  }
  return extent;
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
  if (last_ == kNone || !same(index_[last_].at, at))
    last_ = index_.find_or_add(at, true, [](const Brick&, std::uint32_t) {});
  return index_[last_];
}

// The triangle is cut by each layer of cells along z, and each piece by the rows of the layer along y. The
// rest is convex, so it touches every cell between its least and its greatest x.
void SurfaceCells::add_triangle(std::uint64_t object_bit, const glm::dvec3& a, const glm::dvec3& b,
                                const glm::dvec3& c, double margin_m) {
  const glm::dvec3 low_m = glm::min(a, glm::min(b, c)) - margin_m,
                   high_m = glm::max(a, glm::max(b, c)) + margin_m;
  low_ = glm::min(low_, low_m);
  high_ = glm::max(high_, high_m);
  const auto [low, high] = index_.cells_of(low_m, high_m);
  // All cells of one row, because the triangle is connected.
  if (low[1] == high[1] && low[2] == high[2]) {
    occupy(object_bit, low, high[0]);
    return;
  }
  // Corners in cells from the map's origin, as cells are counted. Cells are slightly larger here, so that a
  // triangle in the face between two cells is in both despite rounding.
  const double per_cell = 1.0 / cell_m();
  Polygon triangle{
      {per_cell * (a - index_.origin()), per_cell * (b - index_.origin()), per_cell * (c - index_.origin())},
      3};
  double farthest = 1.0;
  for (std::size_t d = 0; d < 3; ++d)
    farthest =
        std::max({farthest, std::fabs(static_cast<double>(low[d])), std::fabs(static_cast<double>(high[d]))});
  const glm::dvec3 far = glm::max(glm::abs(low_m), glm::abs(high_m));
  const double slack =
      1e-9 + 4e-15 * farthest + per_cell * (2e-15 * std::max({far.x, far.y, far.z}) + margin_m);
  CellCoordinates row = low;
  for (row[2] = low[2]; row[2] <= high[2]; ++row[2]) {
    const Polygon layer = cut(cut(triangle, -1.0, row[2] - slack), 1.0, row[2] + 1.0 + slack);
    if (layer.count == 0) continue;
    const auto [y0, y1] = extent_along_y(layer).cells(slack, low[1], high[1]);
    for (row[1] = y0; row[1] <= y1; ++row[1]) {
      row[0] = low[0];
      if (is_occupied(object_bit, row, high[0])) continue;
      const Extent extent = extent_along_x(layer, row[1] - slack, row[1] + 1.0 + slack);
      if (extent.empty()) continue;
      const auto [x0, x1] = extent.cells(slack, low[0], high[0]);
      row[0] = x0;
      occupy(object_bit, row, x1);
    }
  }
}

// Occupies the cells from `first` along x up to `last_x`.
void SurfaceCells::occupy(std::uint64_t object_bit, const CellCoordinates& first, std::int32_t last_x) {
  CellCoordinates c = first;
  while (c[0] <= last_x) {
    const std::int32_t end = std::min(last_x, c[0] | (kEdge - 1));
    Brick& brick = brick_at(c);
    brick.layer[layer_of(c)] |= BrickGrid::layer_mask({c, {end, c[1], c[2]}});
    brick.objects |= object_bit;
    c[0] = end + 1;
  }
}

// Are the cells from `first` along x up to `last_x` already occupied? Looks in the brick of the last
// insertion only. A fine mesh has many triangles in a cell, and most lie in that brick.
bool SurfaceCells::is_occupied(std::uint64_t object_bit, const CellCoordinates& first,
                               std::int32_t last_x) const noexcept {
  if (last_ == kNone || (first[0] | (kEdge - 1)) < last_x) return false;
  const Brick& brick = index_[last_];
  if ((brick.objects & object_bit) == 0 || !same(brick.at, BrickGrid::brick_of(first))) return false;
  const std::uint64_t cells = BrickGrid::layer_mask({first, {last_x, first[1], first[2]}});
  return (brick.layer[layer_of(first)] & cells) == cells;
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
