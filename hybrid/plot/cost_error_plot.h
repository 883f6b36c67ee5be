// SPDX-License-Identifier: GPL-3.0-or-later
// Error over the cost of a tick as a figure: a mark for each setting or scan, and the bounds of both.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace hybrid {

struct CostErrorMark {
  enum class Kind : std::uint8_t { usual, grey, alarming };
  std::string words{};
  double cost_us = 0.0;  // a mark without cost is not drawn
  double error_jnd = 0.0;
  std::uint64_t memory_bytes = 0;  // area of the mark
  Kind kind = Kind::usual;
  bool ringed = false;
};

struct CostErrorFigure {
  std::string title{}, subtitle{};
  std::vector<CostErrorMark> marks{};
  std::vector<std::size_t> line{};  // indices of marks that a line joins
  double budget_us = 0.0, error_jnd = 0.0;
  std::string error_axis{};
};

// Both axes are logarithmic. Names that would overlap others are left out; each mark has its name as tooltip.
std::string cost_error_svg(const CostErrorFigure& figure);

}  // namespace hybrid
