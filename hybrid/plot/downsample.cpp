// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/plot/downsample.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace hybrid {
namespace {

constexpr double kGap = std::numeric_limits<double>::quiet_NaN();

bool is_gap(const PlotPoint& p) {
  return !std::isfinite(p.x) || !std::isfinite(p.y);
}

void add_gap(std::vector<PlotPoint>& out, double x) {
  if (!out.empty() && !is_gap(out.back())) out.push_back({x, kGap});
}

}  // namespace

std::vector<PlotPoint> downsample_columns(std::span<const double> x, std::span<const double> y, double x_from,
                                          double x_to, std::size_t columns) {
  std::vector<PlotPoint> out;
  const std::size_t n = std::min(x.size(), y.size());
  const double width = x_to - x_from;
  const auto column_of = [&](double at) {
    return width > 0.0
               ? std::min(static_cast<std::size_t>((at - x_from) / width * static_cast<double>(columns)),
                          columns - 1)
               : std::size_t{0};
  };
  std::size_t i = 0;
  while (i < n && columns > 0) {
    if (!std::isfinite(x[i]) || x[i] < x_from || x[i] > x_to) {
      ++i;
      continue;
    }
    if (!std::isfinite(y[i])) {
      add_gap(out, x[i]);
      ++i;
      continue;
    }
    // A run of finite samples in one column.
    const std::size_t column = column_of(x[i]);
    const std::size_t first = i;
    std::size_t lowest = i;
    std::size_t highest = i;
    while (i < n && std::isfinite(y[i]) && x[i] >= x_from && x[i] <= x_to && column_of(x[i]) == column) {
      if (y[i] < y[lowest]) lowest = i;
      if (y[i] > y[highest]) highest = i;
      ++i;
    }
    std::array<std::size_t, 4> kept{first, std::min(lowest, highest), std::max(lowest, highest), i - 1};
    for (std::size_t k = 0; k < kept.size(); ++k) {
      if (k == 0 || kept[k] != kept[k - 1]) out.push_back({x[kept[k]], y[kept[k]]});
    }
  }
  return out;
}

std::vector<PlotPoint> downsample_path(std::span<const PlotPoint> path, double tolerance, std::size_t most) {
  std::vector<PlotPoint> out;
  // Each doubling about halves the points of a dense path. A drawing is some thousand units wide, so the loop
  // ends.
  for (int round = 0; round < 40; ++round, tolerance *= 2.0) {
    out.clear();
    PlotPoint skipped{kGap, kGap};  // last point that was left out; it is kept if a line ends there
    for (const PlotPoint& point : path) {
      if (is_gap(point)) {
        if (!is_gap(skipped)) out.push_back(skipped);
        skipped = {kGap, kGap};
        add_gap(out, 0.0);
        continue;
      }
      if (!out.empty() && !is_gap(out.back()) &&
          std::hypot(point.x - out.back().x, point.y - out.back().y) < tolerance) {
        skipped = point;
        continue;
      }
      out.push_back(point);
      skipped = {kGap, kGap};
    }
    if (!is_gap(skipped)) out.push_back(skipped);
    if (out.size() <= most) return out;
  }
  out.resize(std::min(out.size(), most));  // only gaps are left; they cannot be thinned
  return out;
}

}  // namespace hybrid
