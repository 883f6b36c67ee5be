// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tune/tune_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "hybrid/base/letters.h"
#include "hybrid/plot/svg_canvas.h"
#include "hybrid/plot/svg_figure.h"

namespace hybrid {
namespace {

// Size of the page, and edges of the axes' frame (pixels).
constexpr double kWidth = 960.0, kHeight = 620.0;
constexpr double kLeft = 76.0, kRight = 930.0, kTop = 70.0, kBottom = 560.0;
constexpr double kSmallestMark = 4.0, kLargestMark = 14.0;  // radius
constexpr double kLetterWidth = 6.8;                        // width of a letter, of the wider fonts
constexpr double kNameApart = 13.0;                         // least distance of the base lines of two names
constexpr int kTicks = 16;                                  // marks on an axis, at most
constexpr double kMargin = 1.5;       // factor by which the axes exceed the outermost values
constexpr double kLeastShown = 0.01;  // JND; a smaller error is drawn at this value
constexpr const char* kGrey = "#b5bac1";

class TunePlot {
 public:
  explicit TunePlot(const TuneResult& result) : result_(result) {
    ValueRange cost, error;
    cost.add(result.bounds.budget_us);
    error.add(result.bounds.error_jnd);
    for (const TunedSetting& s : result.settings) {
      if (!drawn(s)) continue;
      cost.add(s.tick_us.p999);
      error.add(error_of(s));
      most_bytes_ = std::max(most_bytes_, static_cast<double>(s.memory_bytes));
    }
    x_ = Axis(Scale::logarithmic, {cost.from / kMargin, cost.to * kMargin}, kLeft, kRight);
    y_ = Axis(Scale::logarithmic, {error.from / kMargin, error.to * kMargin}, kBottom, kTop);
  }

  std::string page(const std::string& title) {
    svg_.text(kLeft, 30.0, shortened(title, 80), "class=\"h1\"");
    svg_.text(
        kLeft, 50.0,
        "Error against the truth over the cost of a tick. Line: settings that no other one beats; grey: "
        "beaten; area of a mark: memory.",
        "class=\"t p\"");
    draw_axes();
    draw_bounds();
    draw_front();
    draw_marks();
    draw_names();
    return whole(title);
  }

 private:
  struct Name {
    double from, to, y;  // y: of the base line
  };

  static bool drawn(const TunedSetting& s) { return s.whole_session && s.tick_us.p999 > 0.0; }
  static bool beaten(const TunedSetting& s) { return !s.whole() || s.dominated_by.has_value(); }
  static double error_of(const TunedSetting& s) { return std::max(s.error.worst_jnd(), kLeastShown); }
  [[nodiscard]] double x_of(const TunedSetting& s) const { return x_.page(s.tick_us.p999); }
  [[nodiscard]] double y_of(const TunedSetting& s) const { return y_.page(error_of(s)); }
  [[nodiscard]] double radius_of(const TunedSetting& s) const {
    const double share = most_bytes_ > 0.0 ? static_cast<double>(s.memory_bytes) / most_bytes_ : 0.0;
    return std::max(kSmallestMark, kLargestMark * std::sqrt(share));
  }

  void draw_axes() {
    for (const double tick : x_.ticks(kTicks)) {
      const double x = x_.page(tick);
      svg_.line(x, kTop, x, kBottom, "#dddddd", "stroke-width=\"0.6\"");
      svg_.text(x, kBottom + 18.0, tick_text(tick, tick), "class=\"t\" text-anchor=\"middle\"");
    }
    for (const double tick : y_.ticks(kTicks)) {
      const double y = y_.page(tick);
      svg_.line(kLeft, y, kRight, y, "#dddddd", "stroke-width=\"0.6\"");
      svg_.text(kLeft - 8.0, y + 4.0, tick_text(tick, tick), "class=\"t\" text-anchor=\"end\"");
    }
    svg_.body += fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" stroke=\"#555555\"/>\n",
                             fixed(kLeft), fixed(kTop), fixed(kRight - kLeft), fixed(kBottom - kTop));
    svg_.text(0.5 * (kLeft + kRight), kBottom + 42.0, "tick, p99.9 (µs)",
              "class=\"t\" text-anchor=\"middle\"");
    svg_.body += fmt::format(
        "<text transform=\"translate(22 {}) rotate(-90)\" text-anchor=\"middle\" "
        "class=\"t\">error, p99, the larger of moving and still (JND)</text>\n",
        fixed(0.5 * (kTop + kBottom)));
  }

  void draw_bounds() {
    const double x = x_.page(result_.bounds.budget_us), y = y_.page(result_.bounds.error_jnd);
    svg_.line(x, kTop, x, kBottom, "#D55E00", "stroke-dasharray=\"5 4\"");
    svg_.line(kLeft, y, kRight, y, "#009E73", "stroke-dasharray=\"5 4\"");
    svg_.text(x - 5.0, kTop + 16.0, fmt::format("budget {:.0f} µs", result_.bounds.budget_us),
              "class=\"t h\" text-anchor=\"end\"");
    svg_.text(kLeft + 6.0, y - 5.0, fmt::format("{:.2g} JND", result_.bounds.error_jnd), "class=\"t h\"");
  }

  void draw_front() {
    std::string d;
    for (const std::size_t n : result_.front) {
      const TunedSetting& s = result_.settings[n];
      if (drawn(s)) d += fmt::format("{}{} {}", d.empty() ? 'M' : 'L', fixed(x_of(s)), fixed(y_of(s)));
    }
    svg_.body += fmt::format("<path d=\"{}\" stroke=\"{}\" stroke-width=\"1.5\"/>\n", d, series_colour(0));
  }

  void mark(const TunedSetting& s, const std::string& style, double more = 0.0) {
    svg_.body +=
        fmt::format("<circle cx=\"{}\" cy=\"{}\" r=\"{}\" {}><title>{}</title></circle>\n", fixed(x_of(s)),
                    fixed(y_of(s)), fixed(radius_of(s) + more), style, escaped(s.words));
  }

  void draw_marks() {
    for (const TunedSetting& s : result_.settings) {
      if (drawn(s) && beaten(s)) mark(s, fmt::format("fill=\"{}\"", kGrey));
    }
    for (const std::size_t n : result_.front) {
      if (drawn(result_.settings[n]))
        mark(result_.settings[n], fmt::format("fill=\"{}\" stroke=\"#ffffff\"", series_colour(0)));
    }
    const TunedSetting& chosen = result_.settings[result_.chosen];
    if (drawn(chosen)) mark(chosen, fmt::format("stroke=\"{}\" stroke-width=\"2.5\"", series_colour(1)), 4.0);
  }

  // Draws the names that do not overlap others. Each mark also has its name as a tooltip.
  void draw_names() {
    std::vector<std::size_t> order{result_.chosen};
    order.insert(order.end(), result_.front.begin(), result_.front.end());
    for (std::size_t n = 0; n < result_.settings.size(); ++n) order.push_back(n);
    std::vector<bool> done(result_.settings.size(), false);
    for (const std::size_t n : order) {
      const TunedSetting& s = result_.settings[n];
      if (!done[n] && drawn(s)) draw_name(s, n == result_.chosen);
      done[n] = true;
    }
  }

  void draw_name(const TunedSetting& s, bool chosen) {
    const std::string words = shortened(s.words + (chosen ? " (chosen)" : s.own ? " (as it is)" : ""), 60);
    const double width = kLetterWidth * static_cast<double>(letters(words));
    const double aside = radius_of(s) + (chosen ? 4.0 : 0.0) + 5.0;
    // Beside the mark, then above and below its middle.
    for (const double lower : {-3.0, -16.0, 14.0}) {
      for (const bool left : {false, true}) {
        const double x = left ? x_of(s) - aside : x_of(s) + aside, from = left ? x - width : x;
        const Name name{from, from + width, y_of(s) + lower};
        if (!has_room(name)) continue;
        names_.push_back(name);
        svg_.text(
            x, name.y, words,
            fmt::format("class=\"t h{}\" text-anchor=\"{}\"", beaten(s) ? " p" : "", left ? "end" : "start")
                .c_str());
        return;
      }
    }
  }

  // Within the frame, and beside all other names.
  [[nodiscard]] bool has_room(const Name& name) const {
    return name.from > kLeft && name.to < kRight && name.y > kTop + kNameApart && name.y < kBottom &&
           std::ranges::none_of(names_, [&](const Name& other) {
             return name.from < other.to && name.to > other.from && std::fabs(name.y - other.y) < kNameApart;
           });
  }

  [[nodiscard]] std::string whole(const std::string& title) const {
    return fmt::format(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" "
        "height=\"{1}\" viewBox=\"0 0 {0} {1}\" fill=\"none\">\n<title>{2}</title>\n"
        "<style>text{{font-family:Helvetica,Arial,'DejaVu Sans',sans-serif;fill:#1c2129}}.t{{font-size:12px}}"
        ".p{{fill:#5c6572}}.h1{{font-size:18px;font-weight:bold}}"
        ".h{{paint-order:stroke;stroke:#ffffff;stroke-width:3px}}</style>\n"
        "<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n{3}</svg>\n",
        fixed(kWidth), fixed(kHeight), escaped(title), svg_.body);
  }

  const TuneResult& result_;
  Axis x_, y_;
  double most_bytes_ = 0.0;
  Svg svg_;
  std::vector<Name> names_;
};

}  // namespace

std::string tune_svg(const TuneResult& result, const std::string& title) {
  return TunePlot(result).page(title);
}

}  // namespace hybrid
