// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "hybrid/feel/just_noticeable.h"
#include "hybrid/plot/svg_figure.h"
#include "hybrid/validate/cases.h"
#include "hybrid/validate/table.h"

namespace hybrid {
namespace {

constexpr double kDot = 6.0, kBar = 1.6;  // pixels

// Adds an error bar for each point and a dot on it. A sample between gaps is drawn as a dot.
void add_measured(const ValidationSeries& series, const std::string& colour, Panel& panel) {
  constexpr double kGap = std::numeric_limits<double>::quiet_NaN();
  Series bars{.name = series.name, .x = {}, .y = {}, .colour = colour, .width = kBar};
  Series dots{.name = {}, .x = {}, .y = {}, .colour = colour, .width = kDot};
  for (const ValidationPoint& p : series.measured) {
    for (const double y : {p.low, p.high, kGap}) {
      bars.x.push_back(p.x);
      bars.y.push_back(y);
    }
    for (const double y : {p.y, kGap}) {
      dots.x.push_back(p.x);
      dots.y.push_back(y);
    }
  }
  panel.series.push_back(std::move(bars));
  panel.series.push_back(std::move(dots));
}

std::optional<PageFigure> figure_of(const ValidationReport& report, const std::string& group,
                                    const std::string& caption) {
  Figure figure;
  for (const ValidationPanel& one : report.panels) {
    if (one.group != group) continue;
    PanelGroup& drawn = figure.groups.emplace_back();
    drawn.x_label = one.x_label;
    Panel& panel = drawn.panels.emplace_back();
    panel.title = one.title;
    panel.y_label = one.y_label;
    panel.height = 210.0;
    panel.from_zero = true;
    panel.series.push_back({.name = "hybrid", .x = one.x, .y = one.ours, .colour = "#000000", .width = 2.0});
    // A gap at the end makes room, so that the last point is not cut off.
    panel.series.push_back({.name = {}, .x = {1.05 * one.x.back()}, .y = {std::nan("")}});
    for (std::size_t s = 0; s < one.series.size(); ++s) add_measured(one.series[s], series_colour(s), panel);
  }
  if (figure.groups.empty()) return std::nullopt;
  figure.title = fmt::format("Measured force and ours: {}", group);
  return PageFigure{.name = group,
                    .caption = caption,
                    .alternative = fmt::format("Measured force of {} as points with their spread, and the "
                                               "program's force as a line; the table below has the figures",
                                               group),
                    .svg = to_svg(figure)};
}

PageCell verdict_cell(const ValidationRow& row) {
  if (row.fails()) return {.text = "fails", .value = {}, .mark = PageMark::bad};
  if (row.inside()) return {.text = row.stated ? "holds" : "inside", .value = {}, .mark = PageMark::good};
  return {.text = "outside", .value = {}, .mark = PageMark::bad};
}

bool is_of(const ValidationRow& row, const std::vector<std::string>& groups) {
  return std::ranges::find(groups, row.group) != groups.end();
}

// The source of all rows of the groups; empty if there are several.
std::string one_source(const ValidationReport& report, const std::vector<std::string>& groups) {
  std::string source;
  for (const ValidationRow& row : report.rows) {
    if (!is_of(row, groups)) continue;
    if (!source.empty() && source != row.source) return {};
    source = row.source;
  }
  return source;
}

// A value of any size, with a text of four digits.
PageCell digits_cell(std::optional<double> value) {
  if (!value) return {.text = "–"};
  return {.text = fmt::format("{:.4g}", *value), .value = value};
}

std::string spread_text(const ValidationRow& row) {
  return row.low && row.high ? fmt::format("{:.4g} to {:.4g}", *row.low, *row.high) : "–";
}

// A table of the groups' rows. There is a column of spreads only if a row has one, and a column of sources
// only if there are several sources.
PageTable table_of(const ValidationReport& report, const std::vector<std::string>& groups,
                   const std::string& name, const std::string& caption) {
  const bool with_sources = one_source(report, groups).empty();
  const bool with_spread = std::ranges::any_of(
      report.rows, [&](const ValidationRow& row) { return is_of(row, groups) && row.low && row.high; });
  PageTable table{.name = name, .caption = caption, .head = {"case", "quantity", "reference"}, .rows = {}};
  if (with_spread) table.head.emplace_back("spread");
  for (const char* head : {"ours", "difference (%)", "bound (%)", "verdict", "reason"})
    table.head.emplace_back(head);
  if (with_sources) table.head.emplace_back("reference by");
  for (const ValidationRow& row : report.rows) {
    if (!is_of(row, groups)) continue;
    auto& cells = table.rows.emplace_back();
    cells.push_back({.text = row.name});
    cells.push_back(
        {.text = row.unit.empty() ? row.quantity : fmt::format("{} ({})", row.quantity, row.unit)});
    cells.push_back(digits_cell(row.reference));
    if (with_spread) cells.push_back({.text = spread_text(row)});
    cells.push_back(digits_cell(row.ours));
    cells.push_back(number_cell(100.0 * row.difference(), 1));
    cells.push_back(row.bound ? number_cell(100.0 * *row.bound, 1) : PageCell{.text = "spread"});
    cells.push_back(verdict_cell(row));
    cells.push_back({.text = row.inside() ? "" : row.why});
    if (with_sources) cells.push_back({.text = row.source});
  }
  return table;
}

std::string source_sentence(const ValidationReport& report, const std::string& group) {
  const std::string source = one_source(report, {group});
  return source.empty() ? "" : " Source: " + source + ".";
}

PageTable moduli_table(const ValidationReport& report) {
  PageTable table{.name = "silicone-moduli",
                  .caption = "Young's modulus that gives the measured force at 5 % strain",
                  .head = {"material", "plates slip (kPa)", "bonded to the plates (kPa)", "authors (kPa)"},
                  .rows = {}};
  for (const FittedModulus& m : report.moduli) {
    table.rows.push_back(
        {{.text = m.name},
         number_cell(1e-3 * m.slipping_Pa, 1),
         number_cell(1e-3 * m.bonded_Pa, 1),
         number_cell(m.published_Pa ? std::optional(1e-3 * *m.published_Pa) : std::nullopt, 1)});
  }
  return table;
}

PageSection closed_section(const ValidationReport& report) {
  return {.heading = "Closed forms and the haptic loop",
          .parts = {"The tissue's own law on the program's lattice, relaxed to rest, and whole sessions with "
                    "a coupling. \"Bricks\" are energy = \"trilinear\", \"links\" are \"six-link\".",
                    table_of(report, {"closed form", "haptic loop", "deep indentation"}, "closed-forms",
                             "Against closed forms")}};
}

PageSection fem_section(const ValidationReport& report) {
  return {.heading = "Finite elements",
          .parts = {"A square punch of 10, 20 and 40 mm presses a block of 100 × 100 × 60 mm by 1 mm, with ν "
                    "of 0, 0.3 and 0.45. Each row is the worst of nine presses." +
                        source_sentence(report, "finite elements"),
                    table_of(report, {"finite elements"}, "finite-elements", "Against finite elements")}};
}

// The differences of all silicones at one of their strains, for example "3 to 12 % low".
std::string shortfall(const ValidationReport& report, std::size_t strain) {
  double least = std::numeric_limits<double>::infinity(), most = -least;
  for (const ValidationRow& row : report.rows) {
    if (row.group != "silicone" || row.quantity != silicone_quantity(strain)) continue;
    least = std::min(least, -100.0 * row.difference());
    most = std::max(most, -100.0 * row.difference());
  }
  if (!(least <= most)) return "not known";
  return fmt::format("{:.0f} to {:.0f} % low", least, most);
}

PageSection silicone_section(const ValidationReport& report) {
  PageSection section{.heading = "Silicone between plates", .parts = {}};
  section.parts.emplace_back(
      "A cylinder of 50 mm diameter and 30 mm height is compressed. Young's modulus is taken from the force "
      "at 5 % strain. Forces at 10, 20 and 30 % are predicted. The friction at the plates is not published. "
      "It changes the modulus and not the prediction, because a linear law is a straight line either way." +
      source_sentence(report, "silicone"));
  section.parts.emplace_back(
      fmt::format("Silicone stiffens under compression, and a linear law does not. Ours is {} at 10 % "
                  "strain, {} at 20 % and {} at 30 %. One just noticeable difference is {:.0f} %.",
                  shortfall(report, 1), shortfall(report, 2), shortfall(report, 3), 100.0 * kJndShare));
  if (auto figure =
          figure_of(report, "silicone",
                    "Force over strain, relative to the force at 5 %. Points: mean and standard deviation of "
                    "ten tests, moved sideways a little where they would hide one another. Line: ours."))
    section.parts.emplace_back(std::move(*figure));
  section.parts.emplace_back(table_of(report, {"silicone"}, "silicone", "Against measured compression"));
  section.parts.emplace_back(moduli_table(report));
  return section;
}

PageSection probing_section(const ValidationReport& report, const char* heading, const std::string& group,
                            const char* text, const char* caption) {
  PageSection section{.heading = heading, .parts = {text + source_sentence(report, group)}};
  if (auto figure = figure_of(report, group, caption)) section.parts.emplace_back(std::move(*figure));
  section.parts.emplace_back(table_of(report, {group}, group, "Against measured indentation"));
  return section;
}

std::vector<std::string> limits_of() {
  return {
      "Compared are forces at rest. Time dependence (creep, relaxation) is not part of the model.",
      "The samples' thickness and support (pork, liver), and the friction at the plates (silicone), are not "
      "published. Figures here are summaries of published data; the data themselves stay with their authors.",
      "The Truth Cube (Kerdok et al. 2003, 798 N/m, SD 4.4 %) is left out: the shape of its indenter is not "
      "on its page, and without it a stiffness has no prediction."};
}

}  // namespace

Page validation_page(const ValidationReport& report, bool quick) {
  const ValidationCount sum = count(report);
  Page page{
      .title = "hybrid validate: forces against what is known",
      .verdict = verdict(report),
      .mark = sum.failed == 0 ? PageMark::good : PageMark::bad,
      .summary = {quick ? "Quick: coarser grids, and without the cases that take minutes." : "All cases.",
                  "Where a case lies outside its bound, its row says why. A case that is not stated to hold "
                  "is shown all the same."}};
  page.sections.push_back(closed_section(report));
  page.sections.push_back(fem_section(report));
  page.sections.push_back(silicone_section(report));
  page.sections.push_back(probing_section(
      report, "Pork under a ball", "pork",
      "Ex-vivo pork, probed by a robot. Young's modulus is taken from the median force at 1 mm. It is stated "
      "that the force at 2 mm lies between the quartiles over the sites. The result depends on the fit: rows "
      "with the contact point fitted too, from 0.5 and 1 mm, are shown beside.",
      "Force over depth. Points: median and quartiles over the sites. Line: ours, through the median at 1 "
      "mm."));
  page.sections.push_back(probing_section(report, "Liver under a ball", "liver",
                                          "Ex-vivo pig liver, the same way. Nothing is stated: some of these "
                                          "sets stiffen much faster than a linear half-space.",
                                          "Force over depth. Points: median and quartiles over the sites. "
                                          "Line: ours, through the median at 1 mm."));
  page.sections.push_back(
      probing_section(report, "Cartilage under a sphere", "cartilage",
                      "Modulus and contact point are those of the authors' fit over 10 to 98 % of the load. "
                      "It is stated that forces from a hundredth of the radius on are within 6 %. This "
                      "checks the law; it is no prediction.",
                      "Force over depth. Points: loading of one site. Line: ours."));
  PageSection limits{.heading = "What this does not say", .parts = {}};
  for (const std::string& text : limits_of()) limits.parts.emplace_back(text);
  page.sections.push_back(std::move(limits));
  return page;
}

}  // namespace hybrid
