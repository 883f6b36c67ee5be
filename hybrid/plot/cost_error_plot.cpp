// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/plot/cost_error_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "hybrid/base/letters.h"
#include "hybrid/plot/axis.h"
#include "hybrid/plot/svg_canvas.h"
#include "hybrid/plot/svg_figure.h"

namespace hybrid {
namespace {

// Size of the page and its frame (pixels).
constexpr double kCostWidth = 960.0, kCostHeight = 620.0;
constexpr double kFrameLeft = 76.0, kFrameRight = 930.0, kFrameTop = 70.0, kFrameBottom = 560.0;
constexpr double kSmallestMark = 4.0, kLargestMark = 14.0;  // radius
constexpr double kLetterWidth = 6.8;                        // width of a letter, of the wider fonts
constexpr double kNameApart = 13.0;                         // least distance of the base lines of two names
constexpr double kRing = 4.0;                               // distance of a ring from its mark
constexpr std::size_t kMostOfName = 60;                     // letters
constexpr int kMostTicks = 16;                              // on an axis
constexpr double kBeyond = 1.5;       // factor by which the axes exceed the outermost values
constexpr double kLeastShown = 0.01;  // JND; a smaller error is drawn at this value
constexpr const char* kGrey = "#b5bac1";

class CostErrorPlot {
 public:
  explicit CostErrorPlot(const CostErrorFigure& figure) : figure_(figure) {
    ValueRange cost, error;
    cost.add(figure.budget_us);
    error.add(figure.error_jnd);
    for (const CostErrorMark& m : figure.marks) {
      if (!drawn(m)) continue;
      cost.add(m.cost_us);
      error.add(shown_error(m));
      most_bytes_ = std::max(most_bytes_, static_cast<double>(m.memory_bytes));
    }
    x_ = Axis(Scale::logarithmic, {cost.from / kBeyond, cost.to * kBeyond}, kFrameLeft, kFrameRight);
    y_ = Axis(Scale::logarithmic, {error.from / kBeyond, error.to * kBeyond}, kFrameBottom, kFrameTop);
  }

  std::string page() {
    svg_.text(kFrameLeft, 30.0, shortened(figure_.title, 80), "class=\"h1\"");
    svg_.text(kFrameLeft, 50.0, figure_.subtitle, "class=\"t p\"");
    draw_axes();
    draw_bounds();
    draw_line();
    for (const bool grey : {true, false}) {
      for (const CostErrorMark& m : figure_.marks) {
        if (drawn(m) && (m.kind == CostErrorMark::Kind::grey) == grey) draw_mark(m);
      }
    }
    draw_names();
    return whole();
  }

 private:
  struct Name {
    double from, to, y;  // y: base line
  };

  static bool drawn(const CostErrorMark& m) { return m.cost_us > 0.0; }
  static double shown_error(const CostErrorMark& m) { return std::max(m.error_jnd, kLeastShown); }
  [[nodiscard]] double x_of(const CostErrorMark& m) const { return x_.page(m.cost_us); }
  [[nodiscard]] double y_of(const CostErrorMark& m) const { return y_.page(shown_error(m)); }
  [[nodiscard]] double radius_of(const CostErrorMark& m) const {
    const double share = most_bytes_ > 0.0 ? static_cast<double>(m.memory_bytes) / most_bytes_ : 0.0;
    return std::max(kSmallestMark, kLargestMark * std::sqrt(share));
  }

  void draw_axes() {
    for (const double tick : x_.ticks(kMostTicks)) {
      const double x = x_.page(tick);
      svg_.line(x, kFrameTop, x, kFrameBottom, "#dddddd", "stroke-width=\"0.6\"");
      svg_.text(x, kFrameBottom + 18.0, tick_text(tick, tick), "class=\"t\" text-anchor=\"middle\"");
    }
    for (const double tick : y_.ticks(kMostTicks)) {
      const double y = y_.page(tick);
      svg_.line(kFrameLeft, y, kFrameRight, y, "#dddddd", "stroke-width=\"0.6\"");
      svg_.text(kFrameLeft - 8.0, y + 4.0, tick_text(tick, tick), "class=\"t\" text-anchor=\"end\"");
    }
    svg_.body += fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" stroke=\"#555555\"/>\n",
                             fixed(kFrameLeft), fixed(kFrameTop), fixed(kFrameRight - kFrameLeft),
                             fixed(kFrameBottom - kFrameTop));
    svg_.text(0.5 * (kFrameLeft + kFrameRight), kFrameBottom + 42.0, "tick, p99.9 (µs)",
              "class=\"t\" text-anchor=\"middle\"");
    svg_.body += fmt::format(
        "<text transform=\"translate(22 {}) rotate(-90)\" text-anchor=\"middle\" class=\"t\">{}</text>\n",
        fixed(0.5 * (kFrameTop + kFrameBottom)), escaped(figure_.error_axis));
  }

  void draw_bounds() {
    const double x = x_.page(figure_.budget_us), y = y_.page(figure_.error_jnd);
    svg_.line(x, kFrameTop, x, kFrameBottom, "#D55E00", "stroke-dasharray=\"5 4\"");
    svg_.line(kFrameLeft, y, kFrameRight, y, "#009E73", "stroke-dasharray=\"5 4\"");
    svg_.text(x - 5.0, kFrameTop + 16.0, fmt::format("budget {:.0f} µs", figure_.budget_us),
              "class=\"t h\" text-anchor=\"end\"");
    svg_.text(kFrameLeft + 6.0, y - 5.0, fmt::format("{:.2g} JND", figure_.error_jnd), "class=\"t h\"");
  }

  void draw_line() {
    std::string d;
    for (const std::size_t n : figure_.line) {
      const CostErrorMark& m = figure_.marks[n];
      if (drawn(m)) d += fmt::format("{}{} {}", d.empty() ? 'M' : 'L', fixed(x_of(m)), fixed(y_of(m)));
    }
    if (!d.empty())
      svg_.body += fmt::format("<path d=\"{}\" stroke=\"{}\" stroke-width=\"1.5\"/>\n", d, series_colour(0));
  }

  void draw_circle(const CostErrorMark& m, double radius, const std::string& style) {
    svg_.body += fmt::format("<circle cx=\"{}\" cy=\"{}\" r=\"{}\" {}><title>{}</title></circle>\n",
                             fixed(x_of(m)), fixed(y_of(m)), fixed(radius), style, escaped(m.words));
  }

  void draw_mark(const CostErrorMark& m) {
    const bool grey = m.kind == CostErrorMark::Kind::grey;
    const std::string colour = grey ? kGrey : series_colour(m.kind == CostErrorMark::Kind::alarming ? 1 : 0);
    draw_circle(m, radius_of(m), fmt::format("fill=\"{}\"{}", colour, grey ? "" : " stroke=\"#ffffff\""));
    if (m.ringed)
      draw_circle(m, radius_of(m) + kRing,
                  fmt::format("stroke=\"{}\" stroke-width=\"2.5\"", series_colour(1)));
  }

  // Draws the names that do not overlap others: of marks with a ring first, then of those on the line.
  void draw_names() {
    std::vector<std::size_t> order;
    for (std::size_t n = 0; n < figure_.marks.size(); ++n) {
      if (figure_.marks[n].ringed) order.push_back(n);
    }
    order.insert(order.end(), figure_.line.begin(), figure_.line.end());
    for (std::size_t n = 0; n < figure_.marks.size(); ++n) order.push_back(n);
    std::vector<bool> done(figure_.marks.size(), false);
    for (const std::size_t n : order) {
      if (!done[n] && drawn(figure_.marks[n])) draw_name(figure_.marks[n]);
      done[n] = true;
    }
  }

  void draw_name(const CostErrorMark& m) {
    const std::string words = shortened(m.words, kMostOfName);
    const double width = kLetterWidth * static_cast<double>(letters(words));
    const double aside = radius_of(m) + (m.ringed ? kRing : 0.0) + 5.0;
    // The name is tried at the height of the mark, then above it, then below it; each time on both sides.
    for (const double lower : {-3.0, -16.0, 14.0}) {
      for (const bool left : {false, true}) {
        const double x = left ? x_of(m) - aside : x_of(m) + aside, from = left ? x - width : x;
        const Name name{from, from + width, y_of(m) + lower};
        if (!has_room(name)) continue;
        names_.push_back(name);
        svg_.text(x, name.y, words,
                  fmt::format("class=\"t h{}\" text-anchor=\"{}\"",
                              m.kind == CostErrorMark::Kind::grey ? " p" : "", left ? "end" : "start")
                      .c_str());
        return;
      }
    }
  }

  // Is the name within the frame, and clear of all other names?
  [[nodiscard]] bool has_room(const Name& name) const {
    return name.from > kFrameLeft && name.to < kFrameRight && name.y > kFrameTop + kNameApart &&
           name.y < kFrameBottom && std::ranges::none_of(names_, [&](const Name& other) {
             return name.from < other.to && name.to > other.from && std::fabs(name.y - other.y) < kNameApart;
           });
  }

  [[nodiscard]] std::string whole() const {
    return fmt::format(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" "
        "height=\"{1}\" viewBox=\"0 0 {0} {1}\" fill=\"none\">\n<title>{2}</title>\n"
        "<style>text{{font-family:Helvetica,Arial,'DejaVu Sans',sans-serif;fill:#1c2129}}.t{{font-size:12px}}"
        ".p{{fill:#5c6572}}.h1{{font-size:18px;font-weight:bold}}"
        ".h{{paint-order:stroke;stroke:#ffffff;stroke-width:3px}}</style>\n"
        "<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n{3}</svg>\n",
        fixed(kCostWidth), fixed(kCostHeight), escaped(figure_.title), svg_.body);
  }

  const CostErrorFigure& figure_;
  Axis x_, y_;
  double most_bytes_ = 0.0;
  Svg svg_;
  std::vector<Name> names_;
};

}  // namespace

std::string cost_error_svg(const CostErrorFigure& figure) {
  return CostErrorPlot(figure).page();
}

}  // namespace hybrid
