// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/bench/occupancy_plot.h"

#include <algorithm>
#include <string>
#include <utility>

#include "hybrid/plot/svg_figure.h"

namespace hybrid {

void save_occupancy_plot(const std::filesystem::path& svg, const std::vector<bench::OccupancyRow>& rows) {
  Figure figure;
  figure.title = "A look-up over the number of occupied cells";
  figure.notes = {"Median of one box: a hash is level, a tree rises.",
                  "Coherent: a tool along the surface. Random: anywhere on it (dashed)."};
  struct Part {
    bench::OccupancyWhat what;
    int box_cells;
    const char* title;
  };
  PanelGroup& group = figure.groups.emplace_back();
  group.x_label = "occupied cells";
  group.x_scale = Scale::logarithmic;
  for (const Part& part :
       {Part{bench::OccupancyWhat::voxels_surface, 1, "Voxels in one cell"},
        Part{bench::OccupancyWhat::voxels_surface, 5, "Voxels in a tool's box, five cells an edge"},
        Part{bench::OccupancyWhat::triangles, 5, "Any triangle in a tool's box, five cells an edge"}}) {
    Panel panel;
    panel.title = part.title;
    panel.y_label = "time of a look-up";
    panel.y_unit = "s";
    panel.y_scale = Scale::logarithmic;
    panel.height = 180.0;
    for (const bench::OccupancyEngine engine : bench::kOccupancyEngines) {
      for (const bench::OccupancyPattern pattern :
           {bench::OccupancyPattern::coherent, bench::OccupancyPattern::random}) {
        std::vector<std::pair<double, double>> at;
        for (const bench::OccupancyRow& row : rows) {
          if (row.op != "lookup" || row.engine != engine || row.pattern != pattern || row.what != part.what ||
              row.box_cells != part.box_cells || row.cells == 0 || !(row.p50_ns > 0.0))
            continue;
          at.emplace_back(static_cast<double>(row.cells), row.p50_ns * 1e-9);
        }
        if (at.empty()) continue;
        std::sort(at.begin(), at.end());
        Series series;
        series.name = std::string(bench::engine_name(engine)) + ", " + bench::pattern_name(pattern);
        series.colour = series_colour(static_cast<std::size_t>(engine));
        series.dashed = pattern == bench::OccupancyPattern::random;
        for (const auto& [x, y] : at) {
          series.x.push_back(x);
          series.y.push_back(y);
        }
        panel.series.push_back(std::move(series));
      }
    }
    if (!panel.series.empty()) group.panels.push_back(std::move(panel));
  }
  save_svg(svg, figure);
}

}  // namespace hybrid
