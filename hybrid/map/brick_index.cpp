// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/map/brick_index.h"

#include <cmath>
#include <stdexcept>

namespace hybrid {

BrickGrid::BrickGrid(double cell_m, const glm::dvec3& origin)
    : cell_m_(cell_m), per_cell_(1.0 / cell_m), origin_(origin) {
  if (!(cell_m > 0.0) || !std::isfinite(cell_m) || !std::isfinite(per_cell_))
    throw std::invalid_argument("an occupancy cell must be positive");
}

void BrickGrid::reset_bitmap(const CellCoordinates& low, const CellCoordinates& high) {
  const auto fits = [&low, &high](int shift) {
    for (std::size_t d = 0; d < 3; ++d) {
      if ((high[d] >> shift) - (low[d] >> shift) >= kUnits) return false;
    }
    return true;
  };
  int shift = 0;
  while (!fits(shift)) ++shift;
  for (std::size_t d = 0; d < 3; ++d) first_unit_[d] = low[d] >> shift;
  unit_shift_ = kShift + shift;
  bitmap_.assign(static_cast<std::size_t>(kUnits) * kUnits, 0);
}

void BrickGrid::set_bit(const CellCoordinates& brick) noexcept {
  if (bitmap_.empty()) return;
  const CellCoordinates cell{brick[0] * kEdge, brick[1] * kEdge, brick[2] * kEdge};
  bitmap_[word(unit_of(cell, 2), unit_of(cell, 1))] |= 1ULL << unit_of(cell, 0);
}

}  // namespace hybrid
