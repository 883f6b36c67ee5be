// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/plot/scenes_plot.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <stdexcept>

#include "hybrid/plot/contacts.h"
#include "hybrid/plot/svg_figure.h"

namespace hybrid {
namespace {

Series difference_series(const ComparedModel& scene, const ComparedModel& reference,
                         const ComparePlotOptions& options) {
  Series line;
  line.name = scene.name;
  const std::size_t count = std::min(scene.rows.size(), reference.rows.size());
  for (std::size_t i = 0; i < count; ++i) {
    line.x.push_back(reference.rows[i].t_s);
    line.y.push_back(signed_jnd(scene.rows[i].force_N, reference.rows[i].force_N, options));
  }
  return line;
}

}  // namespace

Figure scenes_figure(std::span<const ComparedModel> scenes, const std::string& title,
                     const ComparePlotOptions& options) {
  if (options.reference >= scenes.size())
    throw std::invalid_argument("scenes_figure: the reference is no scene");
  const ComparedModel& reference = scenes[options.reference];
  Figure figure;
  figure.title = title;
  figure.notes.push_back(reference_note(reference.name, options));
  PanelGroup group;
  group.x_label = "time (s)";
  Panel force;
  force.title = "Force";
  force.y_label = "force (N)";
  force.height = 240.0;
  force.from_zero = true;
  Panel difference;
  difference.title = "Difference from " + reference.name;
  difference.y_label = "difference (JND)";
  difference.height = 200.0;
  difference.y_scale = Scale::symmetric;
  Intervals touched;
  for (std::size_t s = 0; s < scenes.size(); ++s) {
    const bool is_reference = s == options.reference;
    Series line;
    line.name = scenes[s].name + (is_reference ? " (reference)" : "");
    line.colour = series_colour(s);
    // The reference is drawn first and wide, so that both curves stay visible where they coincide.
    line.width = is_reference ? 3.0 : 1.5;
    line.dashed = s >= kSeriesColours;
    for (const TraceRow& row : scenes[s].rows) {
      line.x.push_back(row.t_s);
      line.y.push_back(glm::length(row.force_N));
    }
    touched = merged(std::move(touched), contact_intervals(scenes[s].rows, ~0U));
    force.series.insert(is_reference ? force.series.begin() : force.series.end(), std::move(line));
    if (is_reference) continue;
    Series apart = difference_series(scenes[s], reference, options);
    apart.colour = series_colour(s);
    apart.dashed = s >= kSeriesColours;
    difference.series.push_back(std::move(apart));
  }
  if (!reference.rows.empty()) {
    const double from = reference.rows.front().t_s, to = reference.rows.back().t_s;
    difference.areas.push_back(not_felt_area({from, to}));
    group.squeezed = long_in_the_air(touched, from, to);
    if (!group.squeezed.empty())
      figure.notes.emplace_back("Grey: long times in the air, drawn short; below them their length (s).");
  }
  group.panels.push_back(std::move(force));
  group.panels.push_back(std::move(difference));
  figure.groups.push_back(std::move(group));
  return figure;
}

void save_scenes_plot(const std::filesystem::path& svg, std::span<const ComparedModel> scenes,
                      const std::string& title, const ComparePlotOptions& options) {
  save_svg(svg, scenes_figure(scenes, title, options));
}

}  // namespace hybrid
