// SPDX-License-Identifier: GPL-3.0-or-later
// Figures as SVG. Panels are stacked, and the panels of a group share one x axis. Values that are not finite
// leave a gap. Names may contain any characters. A file stays below 300 kB for any number of samples.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "hybrid/plot/axis.h"

namespace hybrid {

struct Series {
  std::string name;  // empty: not listed in the legend
  std::vector<double> x, y;
  std::string colour = "#000000";
  double width = 1.5;  // (pixels)
  bool dashed = false;
};

// An area between two curves over the same x, which must never fall.
struct Area {
  std::string name;
  std::vector<double> x, low, high;
  std::string colour = "#cccccc";
};

// Shaded intervals of the x axis.
struct Bands {
  std::string name;
  Intervals intervals;
  std::string colour = "#eeeeee";
};

// A dashed line across a panel. Its label is in the legend, where it covers no data.
struct ReferenceLine {
  double y = 0.0;
  std::string label;
  std::string colour = "#666666";
};

// A row of bars. Its name is on the left, and a note on the right.
struct Lane {
  std::string name, note;
  Intervals intervals;
  std::string colour = "#000000";
};

struct Panel {
  std::string title;
  std::string y_label;     // includes the unit if `y_unit` is empty
  double height = 200.0;   // (pixels); ignored with lanes
  bool from_zero = false;  // the y axis contains 0; only on a linear scale
  Scale y_scale = Scale::linear;
  std::string y_unit;  // if not empty, each tick has this unit with a prefix ("10 µs")
  std::vector<Bands> bands;
  std::vector<Area> areas;
  std::vector<Series> series;
  std::vector<ReferenceLine> lines;
  std::vector<Lane> lanes;  // if not empty, only bands are drawn besides the lanes
  std::string note;         // a line below the panel
};

struct PanelGroup {
  std::string x_label;  // includes the unit
  std::vector<Panel> panels;
  Scale x_scale = Scale::linear;
  Intervals squeezed;  // only on a linear x axis: drawn short, on grey, with their length below
};

struct Figure {
  std::string title;
  std::vector<std::string> notes;  // lines below the title
  std::vector<PanelGroup> groups;
  double width = 960.0;  // (pixels)
};

// Colours that colour-blind readers can distinguish on white (Okabe & Ito 2008). They repeat after
// kSeriesColours.
inline constexpr std::size_t kSeriesColours = 7;
std::string series_colour(std::size_t index);

std::string to_svg(const Figure& figure);

// Throws std::runtime_error: file not writable, disk full.
void save_svg(const std::filesystem::path& file, const Figure& figure);

}  // namespace hybrid
