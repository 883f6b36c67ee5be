// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "hybrid/base/number_text.h"
#include "hybrid/view/overlay.h"
#include "hybrid/view/palette.h"
#include "hybrid/window/panel_words.h"
#include "hybrid/window/panels.h"

namespace hybrid {
namespace {

constexpr double kPeriod_us = 1000.0;  // period of a servo loop at 1 kHz: the line in the chart of tick times

// Colours of the series. They differ in hue and in lightness (after Okabe & Ito 2008), on light and dark
// paper.
constexpr std::array<glm::vec3, kForceSeries> kSeries{{{0.03F, 0.38F, 0.93F},
                                                       {0.84F, 0.37F, 0.00F},
                                                       {0.00F, 0.62F, 0.45F},
                                                       {0.80F, 0.47F, 0.65F},
                                                       {0.34F, 0.71F, 0.91F},
                                                       {0.55F, 0.55F, 0.55F},
                                                       {0.90F, 0.62F, 0.00F}}};
constexpr std::array<const char*, kForceSeries> kSeriesNames{
    "total", "rigid", "soft", "friction", "damping, texture", "limits", "passivity"};
// The series of each ForcePart, with its colour and name.
constexpr std::array<ForceSeries, kForceParts> kSeriesOfPart{ForceSeries::rigid,    ForceSeries::soft,
                                                             ForceSeries::friction, ForceSeries::damping,
                                                             ForceSeries::limits,   ForceSeries::passivity};
constexpr glm::vec3 kAtRest{0.70F, 0.70F, 0.78F};  // band of the force at rest
constexpr std::size_t kAlways = 3;  // the first series are always named; the others if they occur
// A part that stays below this share of the chart's height does not occur.
constexpr double kLeastShown = 0.005;

constexpr float kKeyRow = 1.35F;  // row pitch of the names of series (em)

struct ChartBox {
  float left, right, top, bottom;  // edges of the plot (pixels)
};

// The end of the axis: a round number that is at least the maximum.
double axis_end(double most) {
  if (!(most > 0.0)) return 1.0;
  double end = round_down(most);
  while (end < most) end += round_down(most);
  return end;
}

// The series that the chart shows: the total first, then those that cover others least.
std::vector<ForceSeries> shown_series(const TickHistory& history, double top_N) {
  std::vector<ForceSeries> shown{ForceSeries::total, ForceSeries::soft, ForceSeries::rigid};
  for (std::size_t s = kAlways; s < kForceSeries; ++s) {
    const auto series = static_cast<ForceSeries>(s);
    if (history.most_N(series) > kLeastShown * top_N) shown.push_back(series);
  }
  return shown;
}

// Names the series in rows of at most kAlways and, below, of the others.
void draw_keys(const Pen& pen, float right, float y, std::span<const ForceSeries> shown) {
  for (const bool first : {true, false}) {
    float x = right;
    for (std::size_t s = kForceSeries; s-- > 0;) {
      if ((s < kAlways) != first || std::ranges::find(shown, static_cast<ForceSeries>(s)) == shown.end())
        continue;
      x -= pen.width(kSeriesNames[s]);
      pen.text(x, y, pen.inks.text, kSeriesNames[s]);
      x -= 0.9F * pen.em;
      pen.fill({x, y + 0.3F * pen.em}, {x + 0.6F * pen.em, y + 0.9F * pen.em}, ink_of(kSeries[s]), 1.0F);
      x -= 0.7F * pen.em;
    }
    y += kKeyRow * pen.em;
  }
}

// Draws one vertical line for each column, from the column's least to its largest force. Each line is joined
// to that of the column before.
void draw_series(const Pen& pen, const ChartBox& box, const TickHistory& history, ForceSeries series,
                 double top_N) {
  const auto count = static_cast<std::size_t>(std::max(box.right - box.left, 1.0F));
  const auto columns = history.columns(series, count);
  const Ink ink = ink_of(kSeries[static_cast<std::size_t>(series)]);
  // If a part is the whole force, its thin line is drawn within the thick line of the total.
  const float half = series == ForceSeries::total ? 1.75F : 0.6F;
  const auto y_of = [&](float force_N) {
    const float share = std::clamp(force_N / static_cast<float>(top_N), 0.0F, 1.0F);
    return box.bottom - share * (box.bottom - box.top);
  };
  std::optional<ColumnRange> before;
  for (std::size_t c = 0; c < count; ++c) {
    if (!columns[c]) {
      before.reset();
      continue;
    }
    ColumnRange range = *columns[c];
    if (before) {
      range.least_N = std::min(range.least_N, before->most_N);
      range.most_N = std::max(range.most_N, before->least_N);
    }
    const float x = box.left + static_cast<float>(c);
    pen.fill({x, y_of(range.most_N) - half}, {x + 1.0F, y_of(range.least_N) + half}, ink);
    before = columns[c];
  }
}

// Draws the force at rest as a band of one just noticeable difference on either side. The band has gaps where
// no force at rest was found for kLongestGap_s.
void draw_at_rest(const Pen& pen, const ChartBox& box, const TickHistory& history, double top_N) {
  constexpr double kLongestGap_s = 0.25;
  const auto& forces = history.at_rest();
  const Ink ink = ink_of(kAtRest);
  const auto x_of = [&](double t_s) {
    return box.right -
           static_cast<float>((history.end_s() - t_s) / history.seconds()) * (box.right - box.left);
  };
  const auto y_of = [&](double force_N) {
    return box.bottom - static_cast<float>(std::clamp(force_N / top_N, 0.0, 1.0)) * (box.bottom - box.top);
  };
  for (std::size_t n = 1; n < forces.size(); ++n) {
    const ForceAtRest &from = forces[n - 1], &to = forces[n];
    const double gap_s = to.t_s - from.t_s;
    if (gap_s > kLongestGap_s) continue;
    for (float x = std::max(x_of(from.t_s), box.left); x < x_of(to.t_s); x += 1.0F) {
      const double share = static_cast<double>((x - x_of(from.t_s)) / (x_of(to.t_s) - x_of(from.t_s)));
      const double force_N = std::lerp(glm::length(from.at_rest_N), glm::length(to.at_rest_N), share);
      const double half_N = std::lerp(from.noticeable_N, to.noticeable_N, share);
      pen.fill({x, y_of(force_N + half_N)}, {x + 1.0F, y_of(force_N - half_N)}, ink);
    }
  }
}

// The newest difference from the force at rest, and the largest one in the chart.
std::string words_at_rest(const TickHistory& history) {
  double most_jnd = 0.0;
  for (const ForceAtRest& found : history.at_rest()) most_jnd = std::max(most_jnd, found.jnd());
  return "at rest ± 1 JND; off by " + with_decimals(history.at_rest().back().jnd(), 1) + ", at most " +
         with_decimals(most_jnd, 1) + " JND";
}

void draw_time_axis(const Pen& pen, float left, float right, float bottom, const TickHistory& history) {
  const std::string from = "-" + with_decimals(history.seconds(), 0) + " s", to = "now";
  pen.text(left, bottom + 0.3F * pen.em, pen.inks.pale, from);
  pen.text(right - pen.width(to), bottom + 0.3F * pen.em, pen.inks.pale, to);
}

}  // namespace

void draw_force_chart(const Pen& pen, const PixelRect& where, const TickHistory& history) {
  const float em = pen.em;
  const auto x0 = static_cast<float>(where.x), y0 = static_cast<float>(where.y);
  const auto x1 = x0 + static_cast<float>(where.width), y1 = y0 + static_cast<float>(where.height);
  const double top_N = axis_end(history.most_N());
  const std::string top = force_text(top_N);
  const std::vector<ForceSeries> shown = shown_series(history, top_N);
  const bool at_rest = !history.at_rest().empty();
  const float keys = kKeyRow * ((shown.size() > kAlways ? 1.0F : 0.0F) + (at_rest ? 1.0F : 0.0F));
  const ChartBox box{x0 + pen.width(top) + 0.5F * em, x1, y0 + (1.7F + keys) * em, y1 - 1.5F * em};
  for (int line = 0; line <= 2; ++line) {
    const float y = box.bottom - 0.5F * static_cast<float>(line) * (box.bottom - box.top);
    pen.line({box.left, y}, {box.right, y}, pen.inks.edge);
    const std::string words = line == 0 ? "0" : line == 2 ? top : std::string();
    pen.text(box.left - 0.5F * em - pen.width(words), y - 0.6F * em, pen.inks.pale, words);
  }
  draw_keys(pen, box.right, y0, shown);
  if (at_rest) {
    const std::string words = words_at_rest(history);
    const float x = box.right - pen.width(words), y = box.top - (1.7F - 0.35F) * em;
    pen.text(x, y, pen.inks.text, words);
    pen.fill({x - 0.9F * em, y + 0.3F * em}, {x - 0.3F * em, y + 0.9F * em}, ink_of(kAtRest), 1.0F);
    draw_at_rest(pen, box, history, top_N);
  }
  for (const ForceSeries series : shown) draw_series(pen, box, history, series, top_N);
  draw_time_axis(pen, box.left, box.right, box.bottom, history);
}

void draw_force_parts(const Pen& pen, const PixelRect& where, const TickHistory& history) {
  const float em = pen.em;
  const auto x0 = static_cast<float>(where.x), y0 = static_cast<float>(where.y);
  const auto x1 = x0 + static_cast<float>(where.width), y1 = y0 + static_cast<float>(where.height);
  const float left = x0 + pen.width("-0.888 N") + 0.5F * em, top = y0 + (1.7F + kKeyRow) * em,
              bottom = y1 - 1.5F * em;
  const auto count = static_cast<std::size_t>(std::max(x1 - left, 1.0F));
  const auto columns = history.parts(count);
  double above_N = 0.0, below_N = 0.0;
  std::array<float, kForceParts> most{};
  for (const auto& parts : columns) {
    double up = 0.0, down = 0.0;
    for (std::size_t p = 0; parts && p < kForceParts; ++p) {
      const float part = (*parts)[p];
      if (!std::isfinite(part)) continue;
      (part > 0.0F ? up : down) += std::abs(static_cast<double>(part));
      most[p] = std::max(most[p], std::abs(part));
    }
    above_N = std::max(above_N, up);
    below_N = std::max(below_N, down);
  }
  const double high_N = axis_end(above_N), low_N = below_N > kLeastShown * high_N ? axis_end(below_N) : 0.0;
  const auto y_of = [&](double force_N) {
    return top + static_cast<float>((high_N - force_N) / (high_N + low_N)) * (bottom - top);
  };
  for (std::size_t c = 0; c < count; ++c) {
    if (!columns[c]) continue;
    const float x = left + static_cast<float>(c);
    double up = 0.0, down = 0.0, felt = 0.0;
    for (std::size_t p = 0; p < kForceParts; ++p) {
      const double part = static_cast<double>((*columns[c])[p]);
      if (!std::isfinite(part)) continue;
      double& end = part > 0.0 ? up : down;
      pen.fill({x, y_of(std::max(end, end + part))}, {x + 1.0F, y_of(std::min(end, end + part))},
               ink_of(kSeries[static_cast<std::size_t>(kSeriesOfPart[p])]));
      end += part;
      felt += part;
    }
    pen.fill({x, y_of(felt) - 1.0F}, {x + 1.0F, y_of(felt) + 1.0F}, pen.inks.text);
  }
  for (const double at_N : {high_N, 0.0, -low_N}) {
    const std::string words = at_N == 0.0 ? "0" : at_N < 0.0 ? "-" + force_text(-at_N) : force_text(at_N);
    pen.line({left, y_of(at_N)}, {x1, y_of(at_N)}, pen.inks.edge);
    if (at_N < 0.0 && y_of(at_N) - y_of(0.0) < 1.2F * em) continue;  // it would cover the zero
    pen.text(left - 0.5F * em - pen.width(words), y_of(at_N) - 0.6F * em, pen.inks.pale, words);
  }
  std::vector<ForceSeries> shown{ForceSeries::soft, ForceSeries::rigid};
  for (std::size_t p = 2; p < kForceParts; ++p) {
    if (static_cast<double>(most[p]) > kLeastShown * high_N) shown.push_back(kSeriesOfPart[p]);
  }
  draw_keys(pen, x1, y0, shown);
  draw_time_axis(pen, left, x1, bottom, history);
}

void draw_tick_times(const Pen& pen, const PixelRect& where, const TickTimes& times) {
  const float em = pen.em;
  const auto x0 = static_cast<float>(where.x), y0 = static_cast<float>(where.y);
  const auto w = static_cast<float>(where.width);
  const float bottom = y0 + static_cast<float>(where.height) - 1.5F * em, top = y0 + 1.7F * em;
  pen.text(x0, y0, pen.inks.text,
           "median " + tick_time_text(times.p50_us) + ", 99 % " + tick_time_text(times.p99_us) + ", most " +
               tick_time_text(times.most_us));
  std::uint64_t most = 1;
  for (const std::uint64_t count : times.bins) most = std::max(most, count);
  const auto x_of = [&](double us) {
    return x0 + w * static_cast<float>(std::log(us / TickTimes::kFirst_us) /
                                       std::log(TickTimes::kLast_us / TickTimes::kFirst_us));
  };
  pen.line({x0, bottom}, {x0 + w, bottom}, pen.inks.edge);
  const float bar = w / static_cast<float>(TickTimes::kBins);
  for (std::size_t b = 0; b < TickTimes::kBins; ++b) {
    if (times.bins[b] == 0) continue;
    // The height is logarithmic, so that a single late tick among thousands is visible.
    const double share =
        std::log1p(static_cast<double>(times.bins[b])) / std::log1p(static_cast<double>(most));
    const float x = x0 + static_cast<float>(b) * bar;
    pen.fill({x, bottom - std::max(2.0F, static_cast<float>(share) * (bottom - top))},
             {x + bar - 1.0F, bottom}, pen.inks.force);
  }
  const float late = x_of(kPeriod_us);
  pen.line({late, top - 0.3F * em}, {late, bottom}, ink_of(kSeries[1]), 2.0F);
  for (const double us : {1.0, 10.0, 100.0, 1000.0}) {
    const std::string words = us < kPeriod_us ? with_decimals(us, 0) + " µs" : "1 ms";
    pen.text(std::min(x_of(us) + (us > 1.0 ? -0.5F * pen.width(words) : 0.0F), x0 + w - pen.width(words)),
             bottom + 0.3F * em, pen.inks.pale, words);
  }
  const std::string missed = std::to_string(times.late) + " missed";
  pen.text(x0 + w - pen.width(missed), bottom + 0.3F * em, times.late > 0 ? pen.inks.text : pen.inks.pale,
           missed);
}

void draw_stage_times(const Pen& pen, const PixelRect& where, const TickTimes& times) {
  const float em = pen.em, row = static_cast<float>(where.height) / static_cast<float>(kStages);
  const float left = static_cast<float>(where.x) + 7.0F * em;
  const float right = static_cast<float>(where.x + where.width) - pen.width("888.8 µs") - 0.5F * em;
  const double most = std::max(1e-9, *std::max_element(times.stage_us.begin(), times.stage_us.end()));
  for (std::size_t s = 0; s < kStages; ++s) {
    const float y = static_cast<float>(where.y) + static_cast<float>(s) * row;
    std::string name = kStageNames[s];
    std::replace(name.begin(), name.end(), '_', ' ');
    pen.text(static_cast<float>(where.x), y, pen.inks.text, name);
    const auto share = static_cast<float>(times.stage_us[s] / most);
    pen.fill({left, y + 0.25F * em}, {left + std::max(share * (right - left), 1.0F), y + 0.95F * em},
             pen.inks.force, 1.0F);
    const std::string us = with_decimals(times.stage_us[s], 1) + " µs";
    pen.text(static_cast<float>(where.x + where.width) - pen.width(us), y, pen.inks.pale, us);
  }
}

}  // namespace hybrid
