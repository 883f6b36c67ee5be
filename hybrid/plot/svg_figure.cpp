// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/plot/svg_figure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "hybrid/base/number_text.h"
#include "hybrid/base/whole_file.h"
#include "hybrid/plot/downsample.h"
#include "hybrid/plot/svg_canvas.h"

namespace hybrid {
namespace {

constexpr double letter = 6.4;          // mean width of a letter at 12 pixels, on the wide side
constexpr double most_points = 18'000;  // of all lines together; about 12 bytes each
constexpr double lane_height = 22.0;
constexpr std::size_t most_lanes = 24;

// Larger values would overflow in differences; no measurement is that large.
bool plottable(double v) {
  return std::isfinite(v) && std::abs(v) < 1e150;
}

struct Range {
  double from = std::numeric_limits<double>::infinity();
  double to = -std::numeric_limits<double>::infinity();
  void add(double v) {
    if (!plottable(v)) return;
    from = std::min(from, v);
    to = std::max(to, v);
  }
  [[nodiscard]] bool empty() const { return !(from <= to); }
};

// Maps a panel's data to the page.
struct Axes {
  double left, top, width, height;
  Range x, y;
  [[nodiscard]] double px(double v) const { return left + (v - x.from) / (x.to - x.from) * width; }
  [[nodiscard]] double py(double v) const { return top + height - (v - y.from) / (y.to - y.from) * height; }
};

// Intervals on the page (pixels): neighbours nearer than half a pixel are merged, and intervals are cut to
// the axes.
std::vector<std::pair<double, double>> page_intervals(const std::vector<std::pair<double, double>>& intervals,
                                                      const Axes& axes) {
  std::vector<std::pair<double, double>> out;
  for (const auto& [from, to] : intervals) {
    if (!plottable(from) || !plottable(to) || to < axes.x.from || from > axes.x.to) continue;
    const double a = std::max(axes.px(from), axes.left);
    const double b = std::min(axes.px(to), axes.left + axes.width);
    if (!out.empty() && a - out.back().second < 0.5) {
      out.back().second = std::max(out.back().second, b);
    } else {
      out.emplace_back(a, b);
    }
  }
  return out;
}

void add_point(std::string& d, char command, double x, double y) {
  d += command;
  d += fixed(x);
  d += ' ';
  d += fixed(y);
}

std::string path_of(const std::vector<PlotPoint>& page) {
  std::string d;
  bool drawing = false;
  for (const PlotPoint& p : page) {
    if (!std::isfinite(p.x) || !std::isfinite(p.y)) {
      drawing = false;
      continue;
    }
    add_point(d, drawing ? 'L' : 'M', p.x, p.y);
    // A single sample between two gaps is drawn as a dot.
    if (!drawing) d += "h0";
    drawing = true;
  }
  return d;
}

void draw_series(Svg& svg, const Series& series, const Axes& axes, std::size_t points) {
  const std::size_t n = std::min(series.x.size(), series.y.size());
  std::vector<double> y(series.y.begin(), series.y.begin() + static_cast<std::ptrdiff_t>(n));
  for (double& v : y) {
    if (!plottable(v)) v = std::numeric_limits<double>::quiet_NaN();
  }
  bool forward = true;
  for (std::size_t i = 1; i < n && forward; ++i) forward = !(series.x[i] < series.x[i - 1]);
  std::vector<PlotPoint> page;
  if (forward) {
    page = downsample_columns(series.x, y, axes.x.from, axes.x.to,
                              std::clamp<std::size_t>(points / 4, 40, static_cast<std::size_t>(axes.width)));
    for (PlotPoint& p : page) p = {axes.px(p.x), std::isfinite(p.y) ? axes.py(p.y) : p.y};
  } else {
    std::vector<PlotPoint> all;
    all.reserve(n);
    for (std::size_t i = 0; i < n; ++i) {
      all.push_back({plottable(series.x[i]) ? axes.px(series.x[i]) : std::numeric_limits<double>::quiet_NaN(),
                     std::isfinite(y[i]) ? axes.py(y[i]) : y[i]});
    }
    page = downsample_path(all, 0.4, std::max<std::size_t>(points, 40));
  }
  svg.body += "<path d=\"" + path_of(page) + "\" stroke=\"" + escaped(series.colour) + "\" stroke-width=\"" +
              fixed(series.width) + "\" stroke-linejoin=\"round\" stroke-linecap=\"round\"" +
              (series.dashed ? " stroke-dasharray=\"6 4\"" : "") + "/>\n";
}

void draw_area(Svg& svg, const Area& area, const Axes& axes, std::size_t points) {
  const std::size_t columns =
      std::clamp<std::size_t>(points / 8, 20, static_cast<std::size_t>(axes.width) / 2);
  const auto low = downsample_columns(area.x, area.low, axes.x.from, axes.x.to, columns);
  const auto high = downsample_columns(area.x, area.high, axes.x.from, axes.x.to, columns);
  std::string d;
  const auto add = [&](const PlotPoint& p) {
    if (!plottable(p.y)) return;
    const double y = std::clamp(axes.py(p.y), axes.top - 9.0, axes.top + axes.height + 9.0);
    add_point(d, d.empty() ? 'M' : 'L', axes.px(p.x), y);
  };
  for (const PlotPoint& p : low) add(p);
  std::for_each(high.rbegin(), high.rend(), add);
  if (!d.empty())
    svg.body += "<path d=\"" + d + "Z\" fill=\"" + escaped(area.colour) + "\" stroke=\"none\"/>\n";
}

struct LegendEntry {
  std::string name, colour;
  bool filled, dashed;
};

std::vector<LegendEntry> legend_of(const Panel& panel) {
  std::vector<LegendEntry> entries;
  for (const Series& s : panel.series) entries.push_back({s.name, s.colour, false, s.dashed});
  for (const Area& a : panel.areas) entries.push_back({a.name, a.colour, true, false});
  for (const Bands& b : panel.bands) entries.push_back({b.name, b.colour, true, false});
  std::erase_if(entries, [](const LegendEntry& e) { return e.name.empty(); });
  for (LegendEntry& e : entries) e.name = shortened(e.name, 60);
  return entries;
}

double entry_width(const LegendEntry& e) {
  return 40.0 + letter * static_cast<double>(letters(e.name));
}

// Draws the legend's rows (or only measures them, if `svg` is null); returns their height.
double draw_legend(Svg* svg, const std::vector<LegendEntry>& entries, double left, double top, double width) {
  double x = left;
  double y = top;
  for (const LegendEntry& e : entries) {
    if (x > left && x + entry_width(e) > left + width) {
      x = left;
      y += 17.0;
    }
    if (svg != nullptr) {
      if (e.filled) {
        svg->rect(x, y + 3.0, 22.0, 10.0, e.colour, "stroke=\"#bbbbbb\" stroke-width=\"0.5\"");
      } else {
        svg->line(x, y + 8.0, x + 22.0, y + 8.0, e.colour,
                  e.dashed ? "stroke-width=\"2.4\" stroke-dasharray=\"6 4\"" : "stroke-width=\"2.4\"");
      }
      svg->text(x + 27.0, y + 12.0, e.name, "class=\"t\"");
    }
    x += entry_width(e) + 6.0;
  }
  return entries.empty() ? 0.0 : y - top + 21.0;
}

void choose_y(const Panel& panel, Axes& axes) {
  for (const Series& s : panel.series) {
    for (const double v : s.y) axes.y.add(v);
  }
  for (const ReferenceLine& line : panel.lines) axes.y.add(line.y);
  for (const Area& a : panel.areas) {
    for (const double v : a.low) axes.y.add(v);
    for (const double v : a.high) axes.y.add(v);
  }
  if (panel.from_zero || axes.y.empty()) axes.y.add(0.0);
  double span = axes.y.to - axes.y.from;
  if (!(span > 1e-12 * std::max(std::abs(axes.y.to), std::abs(axes.y.from)))) {
    span = axes.y.to != 0.0 ? std::abs(axes.y.to) : 1.0;
    axes.y.to += 0.5 * span;
    if (!panel.from_zero) axes.y.from -= 0.5 * span;
  }
  axes.y.to += 0.06 * span;
  if (!(panel.from_zero && axes.y.from == 0.0)) axes.y.from -= 0.06 * span;
}

void draw_lanes(Svg& svg, const Panel& panel, const Axes& axes, std::size_t shown) {
  for (std::size_t l = 0; l < shown; ++l) {
    const Lane& lane = panel.lanes[l];
    const double y = axes.top + lane_height * static_cast<double>(l);
    if (l > 0) svg.line(axes.left, y, axes.left + axes.width, y, "#e4e4e4");
    svg.text(axes.left - 8.0, y + 15.0, shortened(lane.name, 22), "class=\"t\" text-anchor=\"end\"");
    for (const auto& [a, b] : page_intervals(lane.intervals, axes)) {
      svg.rect(a, y + 5.0, std::max(b - a, 0.8), lane_height - 10.0, lane.colour);
    }
    svg.text(axes.left + axes.width + 8.0, y + 15.0, lane.note, "class=\"t p\"");
  }
}

void draw_panel(Svg& svg, const Panel& panel, Axes axes, std::size_t points, std::size_t lanes) {
  const bool has_lanes = !panel.lanes.empty();
  for (const Bands& bands : panel.bands) {
    for (const auto& [a, b] : page_intervals(bands.intervals, axes)) {
      svg.rect(a, axes.top, std::max(b - a, 0.6), axes.height, bands.colour);
    }
  }
  for (const double tick : nice_ticks(axes.x.from, axes.x.to, 10)) {
    svg.line(axes.px(tick), axes.top, axes.px(tick), axes.top + axes.height, "#dddddd",
             "stroke-width=\"0.6\"");
  }
  if (has_lanes) {
    draw_lanes(svg, panel, axes, lanes);
  } else {
    choose_y(panel, axes);
    const std::vector<double> ticks =
        nice_ticks(axes.y.from, axes.y.to, std::clamp(static_cast<int>(axes.height / 36.0), 3, 10));
    const double step = ticks.size() > 1 ? ticks[1] - ticks[0] : 0.0;
    for (const double tick : ticks) {
      svg.line(axes.left, axes.py(tick), axes.left + axes.width, axes.py(tick), "#dddddd",
               "stroke-width=\"0.6\"");
      svg.text(axes.left - 8.0, axes.py(tick) + 4.0, tick_text(tick, step),
               "class=\"t\" text-anchor=\"end\"");
    }
    svg.body += "<g clip-path=\"url(#" + std::string("c") + fixed(axes.top) + ")\">\n";
    for (const Area& area : panel.areas) draw_area(svg, area, axes, points);
    if (axes.y.from < 0.0 && axes.y.to > 0.0) {
      svg.line(axes.left, axes.py(0.0), axes.left + axes.width, axes.py(0.0), "#888888");
    }
    for (const ReferenceLine& line : panel.lines) {
      if (!plottable(line.y)) continue;
      svg.line(axes.left, axes.py(line.y), axes.left + axes.width, axes.py(line.y), line.colour,
               "stroke-dasharray=\"3 3\"");
    }
    for (const Series& series : panel.series) draw_series(svg, series, axes, points);
    svg.body += "</g>\n";
    for (const ReferenceLine& line : panel.lines) {
      if (!plottable(line.y)) continue;
      svg.text(axes.left + axes.width - 6.0, axes.py(line.y) - 4.0, line.label,
               "class=\"t p h\" text-anchor=\"end\"");
    }
    const bool nothing = std::ranges::none_of(
        panel.series, [](const Series& s) { return std::ranges::any_of(s.y, plottable); });
    if (nothing) {
      svg.text(axes.left + 0.5 * axes.width, axes.top + 0.5 * axes.height, "no finite values",
               "class=\"t p\" text-anchor=\"middle\"");
    }
    svg.body += "<text transform=\"translate(18 " + fixed(axes.top + 0.5 * axes.height) +
                ") rotate(-90)\" text-anchor=\"middle\" class=\"t\">" + escaped(panel.y_label) + "</text>\n";
  }
  svg.body += "<rect x=\"" + fixed(axes.left) + "\" y=\"" + fixed(axes.top) + "\" width=\"" +
              fixed(axes.width) + "\" height=\"" + fixed(axes.height) +
              "\" fill=\"none\" stroke=\"#555555\"/>\n";
}

Range x_range(const PanelGroup& group) {
  Range range;
  for (const Panel& panel : group.panels) {
    for (const Series& s : panel.series) {
      for (const double v : s.x) range.add(v);
    }
    for (const Area& a : panel.areas) {
      for (const double v : a.x) range.add(v);
    }
    for (const Lane& lane : panel.lanes) {
      for (const auto& [from, to] : lane.intervals) {
        range.add(from);
        range.add(to);
      }
    }
  }
  if (range.empty()) range = {0.0, 1.0};
  if (!(range.to - range.from > 1e-12 * std::max(std::abs(range.to), std::abs(range.from)))) {
    const double half = range.to != 0.0 ? 0.5 * std::abs(range.to) : 0.5;
    range.from -= half;
    range.to += half;
  }
  return range;
}

}  // namespace

std::string to_svg(const Figure& figure) {
  double left = 76.0;
  double right = 28.0;
  double lines = 1.0;  // number of lines that share the points
  for (const PanelGroup& group : figure.groups) {
    for (const Panel& panel : group.panels) {
      lines += static_cast<double>(panel.series.size() + panel.areas.size());
      for (const Lane& lane : panel.lanes) {
        left = std::max(left,
                        18.0 + letter * static_cast<double>(std::min<std::size_t>(letters(lane.name), 22)));
        right = std::max(right, 18.0 + letter * static_cast<double>(letters(lane.note)));
      }
    }
  }
  const double plot_width = std::max(figure.width - left - std::min(right, 0.3 * figure.width), 100.0);
  const auto points = static_cast<std::size_t>(most_points / lines);

  Svg svg;
  std::string clips;
  double y = 32.0;
  svg.text(left, y, shortened(figure.title, static_cast<std::size_t>(plot_width / 9.0)), "class=\"h1\"");
  for (const std::string& note : figure.notes) {
    y += 18.0;
    svg.text(left, y, note, "class=\"t p\"");
  }
  y += 18.0;
  for (const PanelGroup& group : figure.groups) {
    const Range x = x_range(group);
    for (const Panel& panel : group.panels) {
      if (!panel.title.empty()) {
        svg.text(left, y + 12.0, panel.title, "class=\"h2\"");
        y += 20.0;
      }
      y += draw_legend(&svg, legend_of(panel), left, y, plot_width);
      const std::size_t lanes = std::min(panel.lanes.size(), most_lanes);
      const double height =
          panel.lanes.empty() ? std::max(panel.height, 40.0) : lane_height * static_cast<double>(lanes);
      clips += "<clipPath id=\"c" + fixed(y) + "\"><rect x=\"" + fixed(left) + "\" y=\"" + fixed(y) +
               "\" width=\"" + fixed(plot_width) + "\" height=\"" + fixed(height) + "\"/></clipPath>\n";
      draw_panel(svg, panel, {left, y, plot_width, height, x, {}}, points, lanes);
      y += height + 14.0;
      if (panel.lanes.size() > lanes) {
        svg.text(left, y + 2.0, "and " + std::to_string(panel.lanes.size() - lanes) + " more, not shown",
                 "class=\"t p\"");
        y += 14.0;
      }
    }
    const std::vector<double> ticks = nice_ticks(x.from, x.to, 10);
    const double step = ticks.size() > 1 ? ticks[1] - ticks[0] : 0.0;
    for (const double tick : ticks) {
      svg.text(left + (tick - x.from) / (x.to - x.from) * plot_width, y + 2.0, tick_text(tick, step),
               "class=\"t\" text-anchor=\"middle\"");
    }
    y += 20.0;
    svg.text(left + 0.5 * plot_width, y, group.x_label, "class=\"t\" text-anchor=\"middle\"");
    y += 26.0;
  }
  const std::string size = "width=\"" + fixed(figure.width) + "\" height=\"" + fixed(y) + "\"";
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" " + size +
         " viewBox=\"0 0 " + fixed(figure.width) + " " + fixed(y) + "\" fill=\"none\">\n<title>" +
         escaped(figure.title) +
         "</title>\n<style>text{font-family:Helvetica,Arial,'DejaVu Sans',sans-serif;fill:#1c2129}"
         ".t{font-size:12px}.p{fill:#5c6572}.h1{font-size:18px;font-weight:bold}"
         ".h2{font-size:13px;font-weight:bold}"
         ".h{paint-order:stroke;stroke:#ffffff;stroke-width:3px}</style>\n<defs>\n" +
         clips + "</defs>\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n" + svg.body + "</svg>\n";
}

void save_svg(const std::filesystem::path& file, const Figure& figure) {
  save_text(file, to_svg(figure));
}

std::string series_colour(std::size_t index) {
  static constexpr std::array<const char*, 7> colours{"#0072B2", "#D55E00", "#009E73", "#CC79A7",
                                                      "#E69F00", "#56B4E9", "#000000"};
  return colours[index % colours.size()];
}

std::vector<double> nice_ticks(double from, double to, int wanted) {
  std::vector<double> ticks;
  if (!plottable(from) || !plottable(to) || !(to > from) || wanted < 1) return ticks;
  const double rough = (to - from) / wanted;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  double step = 10.0 * power;
  for (const double nice : {5.0, 2.0, 1.0}) {
    if (nice * power >= rough * (1.0 - 1e-9)) step = nice * power;
  }
  const double first = std::ceil(from / step - 1e-9);
  for (int i = 0; i < 64; ++i) {
    const double tick = (first + i) * step;
    if (tick > to + 1e-9 * step) break;
    ticks.push_back(tick);
  }
  return ticks;
}

std::string tick_text(double value, double step) {
  std::string text;
  const double size = std::max(std::abs(value), std::abs(step));
  if (std::abs(value) < 1e-9 * std::abs(step)) return "0";
  if (size >= 1e6 || (step != 0.0 && std::abs(step) < 1e-5)) {
    text = with_digits(value, 4);
  } else {
    int decimals = step != 0.0 ? 0 : 3;
    for (double scaled = std::abs(step);
         decimals < 6 && std::abs(scaled - std::round(scaled)) > 1e-6 * scaled;) {
      scaled *= 10.0;
      ++decimals;
    }
    text = with_decimals(value, decimals);
  }
  return text.starts_with("-") ? "−" + text.substr(1) : text;
}

}  // namespace hybrid
