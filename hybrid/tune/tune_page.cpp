// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tune/tune_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "hybrid/tune/tune_plot.h"
#include "hybrid/tune/tune_report.h"

namespace hybrid {
namespace {

PageCell p99_cell(const FeltError& error) {
  return number_cell(error.ticks > 0 ? std::optional(error.p99_jnd) : std::nullopt, 2);
}

std::vector<PageCell> setting_cells(const TuneResult& result, std::size_t n) {
  const TunedSetting& s = result.settings[n];
  const bool front = std::ranges::find(result.front, n) != result.front.end();
  const bool chosen = n == result.chosen;
  return {{.text = s.words + (s.own ? " (as it is)" : "")},
          {.text = chosen  ? "chosen"
                   : front ? "on the front"
                           : "beaten",
           .mark = chosen ? PageMark::good : PageMark::none},
          p99_cell(s.error.moving),
          p99_cell(s.error.still),
          number_cell(s.tick_us.p50, 1),
          number_cell(s.tick_us.p99, 1),
          number_cell(s.tick_us.p999, 1),
          number_cell(s.tick_us.max, 1),
          number_cell(1e-6 * static_cast<double>(s.memory_bytes), 1),
          count_cell(s.soft_voxels),
          number_cell(s.load_s, 2)};
}

// The settings that were played to the end, those on the front first, by rising cost.
PageTable whole_table(const TuneResult& result) {
  PageTable table{.name = "settings",
                  .caption = "Settings that were played to the end; errors against the truth",
                  .head = {"setting", "place", "moving 99 % (JND)", "still 99 % (JND)", "tick median (µs)",
                           "tick 99 % (µs)", "tick 99.9 % (µs)", "tick largest (µs)", "memory (MB)", "voxels",
                           "load (s)"},
                  .rows = {}};
  for (const std::size_t n : result.front) table.rows.push_back(setting_cells(result, n));
  for (std::size_t n = 0; n < result.settings.size(); ++n) {
    if (result.settings[n].whole() && result.settings[n].dominated_by)
      table.rows.push_back(setting_cells(result, n));
  }
  return table;
}

PageTable left_out_table(const TuneResult& result) {
  PageTable table{.name = "left-out",
                  .caption = "Settings that were not played to the end, and why",
                  .head = {"setting", "when, and why"},
                  .rows = {}};
  for (const TunedSetting& s : result.settings) {
    if (!s.whole()) table.rows.push_back({{.text = s.words}, {.text = s.left_out}});
  }
  return table;
}

}  // namespace

Page tune_page(const TuneResult& result, const std::string& title) {
  const bool found = result.choice.rule == ChoiceRule::cheapest_accurate;
  Page page{.title = title,
            .verdict = tune_verdict(result),
            .mark = found ? PageMark::good : PageMark::bad,
            .summary = {}};
  page.sections.push_back(
      {.heading = "Error over cost",
       .parts = {
           PageFigure{.name = "front",
                      .caption = "Error of each setting over the 99.9th percentile of its tick. The line "
                                 "joins settings that no other one beats; the area of a mark is memory.",
                      .alternative = "Error over cost of the settings; the table has the figures",
                      .svg = tune_svg(result, title)},
           whole_table(result)}});
  PageSection meaning{.heading = "Truth and confirmation", .parts = {}};
  std::istringstream lines(tune_legend(result));
  for (std::string line; std::getline(lines, line);) meaning.parts.emplace_back(line);
  page.sections.push_back(std::move(meaning));
  PageTable left_out = left_out_table(result);
  if (!left_out.rows.empty())
    page.sections.push_back({.heading = "Left out", .parts = {std::move(left_out)}});
  return page;
}

}  // namespace hybrid
