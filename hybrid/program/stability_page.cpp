// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/program/stability_page.h"

#include <fmt/format.h>

#include <set>

namespace hybrid {
namespace {

std::string stability_verdict(const StabilityReport& report) {
  std::string text;
  for (const Boundary kind : {Boundary::stable, Boundary::passive}) {
    const Agreement all = agreement(report, kind);
    if (all.rows == 0) continue;
    text +=
        fmt::format("{}{} stiffness is within {:.2f} % of theory in {} settings", text.empty() ? "" : "; ",
                    kind == Boundary::stable ? "Stable" : "passive", 100.0 * all.worst, all.rows);
  }
  std::optional<double> least;
  for (const StabilityRow& row : report.rows) {
    if (row.kind == Boundary::buzz && row.measured && !row.coupling_N_per_m &&
        !(least && *least < *row.measured))
      least = row.measured;
  }
  if (least) {
    text += fmt::format("{}a steady press begins to buzz from a coupling of {:.0f} N/m on",
                        text.empty() ? "In the worst setting " : "; in the worst setting ", *least);
  }
  return text.empty() ? "No limit of stability was found in these settings." : text + ".";
}

std::string setting_words(const StabilityRow& row) {
  std::string text = row.grip == "none" ? "no hand" : row.grip + " grip";
  if (!row.device.empty()) text += ", " + row.device;
  if (row.young_Pa) text += fmt::format(", tissue of {:.0f} kPa", 1e-3 * *row.young_Pa);
  if (row.coupling_N_per_m) text += fmt::format(", coupling of {:.0f} N/m", *row.coupling_N_per_m);
  return text;
}

PageTable sweep_table(const StabilityReport& report, StabilitySweep sweep, std::size_t number) {
  PageTable table{.name = fmt::format("sweep-{}", number),
                  .caption = std::string(title_of(sweep)),
                  .head = {"setting", "limit of", "b (N s/m)", "B of the wall (N s/m)", "rate (Hz)",
                           "delay (ticks)", "measured", "unit", "theory", "off by (%)", "lower bound"},
                  .rows = {}};
  for (const StabilityRow& row : report.rows) {
    if (row.sweep != sweep) continue;
    PageCell measured = number_cell(row.measured, 0);
    if (!row.measured) measured.text = fmt::format("> {:.0f}", row.stiffest);
    const auto error = row.error();
    table.rows.push_back({{.text = setting_words(row)},
                          {.text = std::string(name_of(row.kind))},
                          number_cell(row.damping_N_s_per_m(), 3),
                          number_cell(row.setting.wall_damping_N_s_per_m, 2),
                          number_cell(row.setting.rate_hz, 0),
                          count_cell(static_cast<std::uint64_t>(row.setting.delay_ticks)),
                          measured,
                          {.text = row.coupling_N_per_m ? "Pa" : "N/m"},
                          number_cell(row.theory, 0),
                          number_cell(error ? std::optional(100.0 * *error) : std::nullopt, 2),
                          number_cell(row.lower_bound, 0)});
  }
  return table;
}

}  // namespace

Page stability_page(const Scene& scene, const StabilityReport& report, const std::optional<Figure>& figure) {
  const int below = below_bound(report);
  Page page{
      .title = (scene.title.empty() ? scene.file.stem().string() : scene.title) + ": stability of the loop",
      .verdict = stability_verdict(report),
      .mark = below > 0 ? PageMark::bad : PageMark::none,
      .summary = {"Measured is the stiffness of the virtual coupling up to which the loop is stable or "
                  "passive, or at which a steady press begins to buzz."}};
  if (below > 0) page.summary.push_back(fmt::format("{} rows lie below their lower bound.", below));
  if (report.stopped_by != 0)
    page.summary.emplace_back("A signal ended the measurement; the rows are those done.");
  if (figure) {
    page.sections.push_back(
        {.heading = "Theory and measurement",
         .parts = {PageFigure{.name = "stability",
                              .caption = "Lines: theory. Dots: measured by the program's own loop.",
                              .alternative = "Stiffness over damping and rate; the tables have the figures",
                              .svg = to_svg(*figure)}}});
  }
  std::set<StabilitySweep> done;
  for (const StabilityRow& row : report.rows) {
    if (!done.insert(row.sweep).second) continue;
    page.sections.push_back({.heading = std::string(title_of(row.sweep)),
                             .parts = {sweep_table(report, row.sweep, done.size())}});
  }
  return page;
}

}  // namespace hybrid
