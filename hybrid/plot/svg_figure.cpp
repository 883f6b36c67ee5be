// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/plot/svg_figure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "hybrid/base/letters.h"
#include "hybrid/base/number_text.h"
#include "hybrid/base/whole_file.h"
#include "hybrid/plot/downsample.h"
#include "hybrid/plot/svg_canvas.h"

namespace hybrid {
namespace {

constexpr double letter = 6.4;  // pixels; upper estimate of a letter's mean width at font size 12
constexpr double most_points =
    18'000;  // greatest number of points in all lines; a point takes about 12 bytes
constexpr double lane_height = 22.0;
constexpr std::size_t most_lanes = 24;
constexpr double kTitleLetter = 7.9;  // pixels; upper estimate of a bold letter's mean width at font size 13
constexpr double kEntryGap = 6.0;     // between entries of a legend (pixels)
constexpr double kRounding = 1e-6;    // pixels; a line may reach this far beyond the end of its axis
constexpr int kTicks = 10;            // approximate number of ticks of an x axis
constexpr double kTickGap = 8.0;      // between the axis and the text of a tick (pixels)
constexpr const char* kSqueezedColour = "#ececec";

// The axes of a panel, which map its data to the page.
struct Axes {
  double left, top, width, height;
  Axis x, y;
};

// Intervals on the page (pixels). Neighbours nearer than half a pixel are merged, and intervals are cut to
// the axes.
Intervals page_intervals(const Intervals& intervals, const Axes& axes) {
  Intervals out;
  for (const auto& [from, to] : intervals) {
    if (!plottable(from) || !plottable(to) || to < axes.x.values().from || from > axes.x.values().to)
      continue;
    const double a = std::max(axes.x.page(from), axes.left);
    const double b = std::min(axes.x.page(to), axes.left + axes.width);
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

// Positions of values on the page. A value without a position gets one that is not finite.
std::vector<double> on_page(const std::vector<double>& values, std::size_t count, const Axis& axis) {
  std::vector<double> page(count);
  for (std::size_t i = 0; i < count; ++i) page[i] = axis.page(values[i]);
  return page;
}

void draw_series(Svg& svg, const Series& series, const Axes& axes, std::size_t points) {
  const std::size_t n = std::min(series.x.size(), series.y.size());
  const std::vector<double> x = on_page(series.x, n, axes.x), y = on_page(series.y, n, axes.y);
  bool forward = true;
  for (std::size_t i = 1; i < n && forward; ++i) forward = !(x[i] < x[i - 1]);
  std::vector<PlotPoint> page;
  if (forward) {
    page = downsample_columns(x, y, axes.left - kRounding, axes.left + axes.width + kRounding,
                              std::clamp<std::size_t>(points / 4, 40, static_cast<std::size_t>(axes.width)));
  } else {
    std::vector<PlotPoint> all;
    all.reserve(n);
    for (std::size_t i = 0; i < n; ++i) all.push_back({x[i], y[i]});
    page = downsample_path(all, 0.4, std::max<std::size_t>(points, 40));
  }
  svg.body += "<path d=\"" + path_of(page) + "\" stroke=\"" + escaped(series.colour) + "\" stroke-width=\"" +
              fixed(series.width) + "\" stroke-linejoin=\"round\" stroke-linecap=\"round\"" +
              (series.dashed ? " stroke-dasharray=\"6 4\"" : "") + "/>\n";
}

void draw_area(Svg& svg, const Area& area, const Axes& axes, std::size_t points) {
  const std::size_t columns =
      std::clamp<std::size_t>(points / 8, 20, static_cast<std::size_t>(axes.width) / 2);
  const std::size_t n = std::min({area.x.size(), area.low.size(), area.high.size()});
  const std::vector<double> x = on_page(area.x, n, axes.x);
  const double left = axes.left - kRounding, right = axes.left + axes.width + kRounding;
  const auto low = downsample_columns(x, on_page(area.low, n, axes.y), left, right, columns);
  const auto high = downsample_columns(x, on_page(area.high, n, axes.y), left, right, columns);
  std::string d;
  const auto add = [&](const PlotPoint& p) {
    if (!std::isfinite(p.y)) return;
    add_point(d, d.empty() ? 'M' : 'L', p.x, std::clamp(p.y, axes.top - 9.0, axes.top + axes.height + 9.0));
  };
  for (const PlotPoint& p : low) add(p);
  std::for_each(high.rbegin(), high.rend(), add);
  if (!d.empty())
    svg.body += "<path d=\"" + d + "Z\" fill=\"" + escaped(area.colour) + "\" stroke=\"none\"/>\n";
}

double unscaled_symmetric(double at) {
  return std::abs(at) <= 1.0 ? at : std::copysign(std::pow(10.0, std::abs(at) - 1.0), at);
}

struct LegendEntry {
  std::string name, colour;
  bool filled, dashed;
};

std::vector<LegendEntry> legend_of(const Panel& panel) {
  std::vector<LegendEntry> entries;
  for (const Series& s : panel.series) entries.push_back({s.name, s.colour, false, s.dashed});
  for (const ReferenceLine& line : panel.lines) {
    if (plottable(line.y)) entries.push_back({line.label, line.colour, false, true});
  }
  for (const Area& a : panel.areas) entries.push_back({a.name, a.colour, true, false});
  for (const Bands& b : panel.bands) entries.push_back({b.name, b.colour, true, false});
  std::erase_if(entries, [](const LegendEntry& e) { return e.name.empty(); });
  for (LegendEntry& e : entries) e.name = shortened(e.name, 60);
  return entries;
}

double entry_width(const LegendEntry& e) {
  return 40.0 + letter * static_cast<double>(letters(e.name));
}

// Draws the legend's rows; returns their height.
double draw_legend(Svg& svg, const std::vector<LegendEntry>& entries, double left, double top, double width) {
  double x = left;
  double y = top;
  for (const LegendEntry& e : entries) {
    if (x > left && x + entry_width(e) > left + width) {
      x = left;
      y += 17.0;
    }
    if (e.filled) {
      svg.rect(x, y + 3.0, 22.0, 10.0, e.colour, "stroke=\"#bbbbbb\" stroke-width=\"0.5\"");
    } else {
      svg.line(x, y + 8.0, x + 22.0, y + 8.0, e.colour,
               e.dashed ? "stroke-width=\"2.4\" stroke-dasharray=\"6 4\"" : "stroke-width=\"2.4\"");
    }
    svg.text(x + 27.0, y + 12.0, e.name, "class=\"t\"");
    x += entry_width(e) + kEntryGap;
  }
  return entries.empty() ? 0.0 : y - top + 20.0;
}

// Texts of the ticks. A single tick has no pitch, so its own size serves as the pitch.
std::vector<std::string> tick_texts(const std::vector<double>& ticks, Scale scale, const std::string& unit) {
  const double step = ticks.size() > 1 ? ticks[1] - ticks[0] : 0.0;
  std::vector<std::string> texts;
  for (const double tick : ticks) {
    if (!unit.empty()) {
      texts.push_back(quantity_text(tick, unit));
    } else {
      texts.push_back(tick_text(tick, scale == Scale::linear || tick == 0.0 ? step : tick));
    }
  }
  return texts;
}

// The y axis that shows all values of a panel, with a margin.
Axis choose_y(const Panel& panel, double top, double height) {
  ValueRange y;  // in the coordinate in which the axis is linear
  const auto add = [&](double v) { y.add(scaled(panel.y_scale, v)); };
  for (const Series& s : panel.series) std::ranges::for_each(s.y, add);
  for (const ReferenceLine& line : panel.lines) add(line.y);
  for (const Area& a : panel.areas) {
    std::ranges::for_each(a.low, add);
    std::ranges::for_each(a.high, add);
  }
  if ((panel.from_zero && panel.y_scale == Scale::linear) || y.empty()) y.add(0.0);
  double span = y.to - y.from;
  if (!(span > 1e-12 * std::max(std::abs(y.to), std::abs(y.from)))) {
    span = y.to != 0.0 ? std::abs(y.to) : 1.0;
    y.to += 0.5 * span;
    if (!panel.from_zero) y.from -= 0.5 * span;
  }
  y.to += 0.06 * span;
  if (!(panel.from_zero && y.from == 0.0)) y.from -= 0.06 * span;
  if (panel.y_scale == Scale::logarithmic) y = {std::pow(10.0, y.from), std::pow(10.0, y.to)};
  if (panel.y_scale == Scale::symmetric) y = {unscaled_symmetric(y.from), unscaled_symmetric(y.to)};
  return {panel.y_scale, y, top + height, top};
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
  double y_label_x = 14.0;
  for (const Bands& bands : panel.bands) {
    for (const auto& [a, b] : page_intervals(bands.intervals, axes)) {
      svg.rect(a, axes.top, std::max(b - a, 0.6), axes.height, bands.colour);
    }
  }
  for (const auto& [a, b] : page_intervals(axes.x.squeezed(), axes))
    svg.rect(a, axes.top, b - a, axes.height, kSqueezedColour);
  for (const double tick : axes.x.ticks(kTicks)) {
    svg.line(axes.x.page(tick), axes.top, axes.x.page(tick), axes.top + axes.height, "#dddddd",
             "stroke-width=\"0.6\"");
  }
  if (has_lanes) {
    draw_lanes(svg, panel, axes, lanes);
  } else {
    axes.y = choose_y(panel, axes.top, axes.height);
    const std::vector<double> ticks = axes.y.ticks(std::clamp(static_cast<int>(axes.height / 32.0), 3, 10));
    const std::vector<std::string> texts = tick_texts(ticks, panel.y_scale, panel.y_unit);
    std::size_t longest = 1;
    for (std::size_t n = 0; n < ticks.size(); ++n) {
      const double y = axes.y.page(ticks[n]);
      svg.line(axes.left, y, axes.left + axes.width, y, "#dddddd", "stroke-width=\"0.6\"");
      svg.text(axes.left - kTickGap, y + 4.0, texts[n], "class=\"t\" text-anchor=\"end\"");
      longest = std::max(longest, letters(texts[n]));
    }
    y_label_x = std::max(axes.left - kTickGap - letter * static_cast<double>(longest) - 10.0, 14.0);
    svg.body += "<g clip-path=\"url(#" + std::string("c") + fixed(axes.top) + ")\">\n";
    for (const Area& area : panel.areas) draw_area(svg, area, axes, points);
    if (axes.y.values().from < 0.0 && axes.y.values().to > 0.0) {
      svg.line(axes.left, axes.y.page(0.0), axes.left + axes.width, axes.y.page(0.0), "#888888");
    }
    for (const Series& series : panel.series) draw_series(svg, series, axes, points);
    for (const ReferenceLine& line : panel.lines) {
      if (!plottable(line.y)) continue;
      svg.line(axes.left, axes.y.page(line.y), axes.left + axes.width, axes.y.page(line.y), line.colour,
               "stroke-width=\"1.4\" stroke-dasharray=\"6 4\"");
    }
    svg.body += "</g>\n";
    const bool nothing = std::ranges::none_of(
        panel.series, [](const Series& s) { return std::ranges::any_of(s.y, plottable); });
    if (nothing) {
      svg.text(axes.left + 0.5 * axes.width, axes.top + 0.5 * axes.height, "no finite values",
               "class=\"t p\" text-anchor=\"middle\"");
    }
    svg.body += "<text transform=\"translate(" + fixed(y_label_x) + " " +
                fixed(axes.top + 0.5 * axes.height) + ") rotate(-90)\" text-anchor=\"middle\" class=\"t\">" +
                escaped(panel.y_label) + "</text>\n";
  }
  svg.body += "<rect x=\"" + fixed(axes.left) + "\" y=\"" + fixed(axes.top) + "\" width=\"" +
              fixed(axes.width) + "\" height=\"" + fixed(axes.height) +
              "\" fill=\"none\" stroke=\"#555555\"/>\n";
}

ValueRange x_range(const PanelGroup& group) {
  ValueRange range;
  for (const Panel& panel : group.panels) {
    for (const Series& s : panel.series) {
      for (const double v : s.x) {
        if (group.x_scale != Scale::logarithmic || v > 0.0) range.add(v);
      }
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
  if (range.empty()) range = {1.0, 2.0};
  if (!(range.to - range.from > 1e-12 * std::max(std::abs(range.to), std::abs(range.from)))) {
    const double half = range.to != 0.0 ? 0.5 * std::abs(range.to) : 0.5;
    range.from -= half;
    range.to += half;
  }
  return range;
}

// Draws the texts below a group: numbers, and the length of each squeezed interval.
void draw_x_ticks(Svg& svg, const PanelGroup& group, const Axis& x, double y) {
  const std::vector<double> ticks = x.ticks(kTicks);
  const std::vector<std::string> texts = tick_texts(ticks, group.x_scale, "");
  Intervals taken;  // intervals of the page that have texts
  for (const auto& [from, to] : x.squeezed()) {
    const double middle = 0.5 * (x.page(from) + x.page(to));
    const std::string words = "+" + tick_text(to - from, 0.1);
    const double half = 0.5 * letter * static_cast<double>(letters(words)) + 6.0;
    svg.text(middle, y, words, "class=\"t p\" text-anchor=\"middle\"");
    taken.emplace_back(middle - half, middle + half);
  }
  for (std::size_t n = 0; n < ticks.size(); ++n) {
    const double at = x.page(ticks[n]);
    const double half = 0.5 * letter * static_cast<double>(letters(texts[n]));
    const bool free = std::ranges::none_of(
        taken, [&](const auto& t) { return at + half > t.first && at - half < t.second; });
    if (free) svg.text(at, y, texts[n], "class=\"t\" text-anchor=\"middle\"");
    if (free) taken.emplace_back(at - half, at + half + 4.0);
  }
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
    const Axis x(group.x_scale, x_range(group), left, left + plot_width, group.squeezed);
    for (const Panel& panel : group.panels) {
      const std::vector<LegendEntry> legend = legend_of(panel);
      double legend_left = left;
      if (!panel.title.empty()) {
        svg.text(left, y + 12.0, panel.title, "class=\"h2\"");
        // The legend is beside the title if there is room for it. Otherwise it is between the title and the
        // axes.
        const double beside = left + kTitleLetter * static_cast<double>(letters(panel.title)) + 24.0;
        double needed = 0.0;
        for (const LegendEntry& e : legend) needed += entry_width(e) + kEntryGap;
        if (!legend.empty() && beside + needed <= left + plot_width) {
          legend_left = beside;
        } else {
          y += legend.empty() ? 19.0 : 18.0;
        }
      }
      y += draw_legend(svg, legend, legend_left, y, left + plot_width - legend_left);
      const std::size_t lanes = std::min(panel.lanes.size(), most_lanes);
      const double height =
          panel.lanes.empty() ? std::max(panel.height, 40.0) : lane_height * static_cast<double>(lanes);
      clips += "<clipPath id=\"c" + fixed(y) + "\"><rect x=\"" + fixed(left) + "\" y=\"" + fixed(y) +
               "\" width=\"" + fixed(plot_width) + "\" height=\"" + fixed(height) + "\"/></clipPath>\n";
      draw_panel(svg, panel, {left, y, plot_width, height, x, {}}, points, lanes);
      y += height + 14.0;
      std::string note = panel.note;
      if (panel.lanes.size() > lanes) {
        std::string more = "and " + std::to_string(panel.lanes.size() - lanes) + " more, not shown";
        if (!note.empty()) more.append("; ").append(note);
        note = std::move(more);
      }
      if (!note.empty()) {
        svg.text(left, y + 2.0, note, "class=\"t p\"");
        y += 18.0;
      }
    }
    draw_x_ticks(svg, group, x, y + 2.0);
    y += 18.0;
    svg.text(left + 0.5 * plot_width, y, group.x_label, "class=\"t\" text-anchor=\"middle\"");
    y += 26.0;
  }
  const std::string size = "width=\"" + fixed(figure.width) + "\" height=\"" + fixed(y) + "\"";
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" " + size +
         " viewBox=\"0 0 " + fixed(figure.width) + " " + fixed(y) + "\" fill=\"none\">\n<title>" +
         escaped(figure.title) +
         "</title>\n<style>text{font-family:Helvetica,Arial,'DejaVu Sans',sans-serif;fill:#1c2129}"
         ".t{font-size:12px}.p{fill:#5c6572}.h1{font-size:18px;font-weight:bold}"
         ".h2{font-size:13px;font-weight:bold}</style>\n<defs>\n" +
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

}  // namespace hybrid
