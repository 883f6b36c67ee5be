// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/bench/convergence_plot.h"

#include "hybrid/plot/svg_figure.h"

namespace hybrid {
namespace {

std::vector<double> rounds_of(const std::vector<double>& values) {
  std::vector<double> rounds(values.size());
  for (std::size_t n = 0; n < rounds.size(); ++n) rounds[n] = static_cast<double>(n);
  return rounds;
}

}  // namespace

void save_settling_plot(const std::filesystem::path& svg, const std::vector<bench::SettlingObject>& objects) {
  Figure figure;
  figure.title = "Relaxation of tissue that was pushed and let go";
  figure.notes = {
      "One voxel, moved by half a spacing: how far it is from rest after each round of relaxation."};
  PanelGroup& group = figure.groups.emplace_back();
  group.x_label = "round of relaxation";
  for (const bench::SettlingObject& object : objects) {
    Panel& panel = group.panels.emplace_back();
    panel.title = object.name;
    panel.y_label = "share of the push";
    panel.height = 220.0;
    panel.from_zero = true;
    for (std::size_t n = 0; n < object.curves.size(); ++n) {
      const bench::SettlingCurve& curve = object.curves[n];
      panel.series.push_back(
          {curve.name, rounds_of(curve.displacement), curve.displacement, series_colour(n)});
    }
  }
  save_svg(svg, figure);
}

}  // namespace hybrid
