// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/stability/plot.h"

#include <limits>
#include <utility>

namespace hybrid {
namespace {

constexpr double kDot = 8.0;  // pixels

std::vector<double> in_kN(std::vector<double> stiffness) {
  for (double& k : stiffness) k *= 1e-3;
  return stiffness;
}

// Measured points as dots. A sample between two gaps is drawn as a dot as wide as its line.
Series dots(const BoundaryCurve& curve, const std::string& colour, double width) {
  constexpr double kGap = std::numeric_limits<double>::quiet_NaN();
  Series series{.name = {}, .x = {}, .y = {}, .colour = colour, .width = width};
  for (std::size_t n = 0; n < curve.measured_x.size(); ++n) {
    for (const double y : {curve.measured_N_per_m[n] * 1e-3, kGap}) {
      series.x.push_back(curve.measured_x[n]);
      series.y.push_back(y);
    }
  }
  return series;
}

}  // namespace

Figure stability_figure(const std::vector<BoundaryGroup>& groups, const std::string& title,
                        const std::vector<std::string>& notes) {
  Figure figure;
  figure.title = title;
  figure.notes = notes;
  for (const BoundaryGroup& group : groups) {
    PanelGroup& drawn = figure.groups.emplace_back();
    drawn.x_label = group.x_label;
    for (const BoundaryPanel& panel : group.panels) {
      Panel& p = drawn.panels.emplace_back();
      p.title = panel.title;
      p.y_label = "stiffness K (kN/m)";
      p.height = 230.0;
      p.from_zero = true;
      for (std::size_t n = 0; n < panel.curves.size(); ++n) {
        const BoundaryCurve& curve = panel.curves[n];
        p.series.push_back({curve.name, curve.x, in_kN(curve.theory_N_per_m), series_colour(n), 1.6});
      }
      // Dots are drawn on top of all lines, each with a white rim that separates it from the lines.
      for (std::size_t n = 0; n < panel.curves.size(); ++n) {
        p.series.push_back(dots(panel.curves[n], "#ffffff", kDot + 3.0));
        p.series.push_back(dots(panel.curves[n], series_colour(n), kDot));
      }
    }
  }
  return figure;
}

}  // namespace hybrid
