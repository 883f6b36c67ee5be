// SPDX-License-Identifier: GPL-3.0-or-later
// Reduces the points of a polyline, for a plot of a million samples. The drawn line looks the same.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace hybrid {

struct PlotPoint {
  double x = 0.0, y = 0.0;  // y not finite: the line is interrupted here
};

// x must never fall. [x_from, x_to] is divided into `columns` equal parts. In each part the first, the
// lowest, the highest and the last sample stay, in their order, so that no spike is lost. A run of samples
// that are not finite becomes one gap. Samples outside the range are left out.
std::vector<PlotPoint> downsample_columns(std::span<const double> x, std::span<const double> y, double x_from,
                                          double x_to, std::size_t columns);

// For a path that may turn back, such as a loop of force over depth. Lengths are in units of the drawing. A
// point nearer than `tolerance` to the last kept point is left out. The tolerance is doubled until at most
// `most` (>= 2) points stay.
std::vector<PlotPoint> downsample_path(std::span<const PlotPoint> path, double tolerance, std::size_t most);

}  // namespace hybrid
