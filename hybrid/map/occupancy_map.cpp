// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/map/occupancy_map.h"

#include <utility>

namespace hybrid {

OccupancyMap::OccupancyMap(double cell_m, const glm::dvec3& origin)
    : fixed_(cell_m, origin), soft_(cell_m, origin) {}

void OccupancyMap::add_triangle(std::uint32_t object, const glm::dvec3& a, const glm::dvec3& b,
                                const glm::dvec3& c, double margin_m) {
  fixed_.add_triangle(rigid_bit(object), a, b, c, margin_m);
}

void OccupancyMap::add_moving(std::uint32_t object, std::shared_ptr<const SurfaceCells> cells,
                              const glm::dvec3& position, const glm::dquat& rotation) {
  moving_.add(object, rigid_bit(object), std::move(cells), position, rotation);
}

void OccupancyMap::reserve_bricks(std::size_t more) {
  fixed_.seal();
  soft_.seal(more);
}

void OccupancyMap::move_body(std::uint32_t object, const glm::dvec3& position,
                             const glm::dquat& rotation) noexcept {
  moving_.move(object, position, rotation);
}

bool OccupancyMap::any_near(const glm::dvec3& low, const glm::dvec3& high) const noexcept {
  if (fixed_.any_near(low, high)) return true;
  if (!moving_.empty() && moving_.any_near(low, high)) return true;
  return soft_.any_near(low, high);
}

std::uint64_t OccupancyMap::rigid_in(const glm::dvec3& low, const glm::dvec3& high,
                                     Trail& trail) const noexcept {
  const std::uint64_t fixed = fixed_.objects_in(low, high, trail.fixed);
  return moving_.empty() ? fixed : fixed | moving_.objects_in(low, high);
}

std::size_t OccupancyMap::occupied_cells() const noexcept {
  std::size_t cells = fixed_.occupied_cells() + moving_.occupied_cells();
  soft_.each_cell([&](const CellCoordinates& cell) { cells += fixed_.occupied(cell) ? 0 : 1; });
  return cells;
}

std::size_t OccupancyMap::memory_bytes() const {
  return fixed_.memory_bytes() + moving_.memory_bytes() + soft_.memory_bytes();
}

bool OccupancyMap::validate() const {
  return soft_.validate() && moving_.validate();
}

}  // namespace hybrid
