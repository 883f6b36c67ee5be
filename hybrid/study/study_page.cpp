// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>

#include "hybrid/plot/cost_error_plot.h"
#include "hybrid/study/study_report.h"

namespace hybrid {
namespace {

bool any_tuned(const Study& study) {
  return std::ranges::any_of(study.scans, [](const StudiedScan& s) { return s.judged.tuned.has_value(); });
}

std::string outlier_cell(const StudiedScan& scan) {
  std::string text;
  for (const Outlier& outlier : scan.outliers)
    text += fmt::format("{}{} × {:.1f}", text.empty() ? "" : ", ", outlier.figure, outlier.times_median);
  return text.empty() ? "–" : text;
}

std::vector<PageCell> scan_cells(const StudiedScan& scan, bool tuned) {
  const JudgedScan& s = scan.judged;
  const bool whole = s.failed.empty(), felt = whole && s.session.not_measured.empty();
  const auto number = [](bool has, double value, int decimals) {
    return number_cell(has ? std::optional(value) : std::nullopt, decimals);
  };
  const auto text = [](bool has, const std::string& words) { return PageCell{.text = has ? words : "–"}; };
  std::vector<PageCell> cells{{.text = s.pair.name},
                              {.text = scan_verdict(s), .mark = s.good() ? PageMark::good : PageMark::bad},
                              number(felt, s.session.p99_jnd, 2),
                              number(felt, s.session.moving_max_jnd, 2),
                              number(felt, s.session.still_max_jnd, 2),
                              text(felt && !s.session.worst_near.empty(), s.session.worst_near),
                              number(whole, s.session.tick_us.p50, 1),
                              number(whole, s.session.tick_us.p99, 0),
                              number(whole, s.session.tick_us.p999, 0),
                              {.text = outlier_cell(scan)}};
  if (!tuned) return cells;
  const bool chosen = s.tuned && s.tuned->not_tuned.empty();
  cells.push_back(text(chosen, chosen ? s.tuned->words : ""));
  cells.push_back(number(chosen, chosen ? s.tuned->error_jnd : 0.0, 2));
  cells.push_back(number(chosen, chosen ? s.tuned->p999_us : 0.0, 0));
  return cells;
}

PageTable scans_table(const Study& study) {
  PageTable table{.name = "scans",
                  .caption = "Failed scans first, then by how far error or tick are beyond their bounds",
                  .head = {"scan", "verdict", "error 99 % (JND)", "moving largest (JND)",
                           "still largest (JND)", "largest error near", "tick median (µs)", "tick 99 % (µs)",
                           "tick 99.9 % (µs)", "far above the median"},
                  .rows = {}};
  const bool tuned = any_tuned(study);
  if (tuned)
    table.head.insert(table.head.end(), {"chosen setting", "its error (JND)", "its tick 99.9 % (µs)"});
  for (const StudiedScan& scan : study.scans) table.rows.push_back(scan_cells(scan, tuned));
  return table;
}

PageTable sizes_table(const Study& study) {
  PageTable table{.name = "sizes",
                  .caption = "Scenes of the scans that did not fail",
                  .head = {"scan", "memory (MB)", "load (s)", "soft voxels", "soft objects on patches",
                           "rigid objects", "path (s)", "largest force (N)"},
                  .rows = {}};
  for (const StudiedScan& scan : study.scans) {
    const JudgedScan& s = scan.judged;
    if (!s.failed.empty()) continue;
    table.rows.push_back({{.text = s.pair.name},
                          number_cell(1e-6 * static_cast<double>(s.memory_bytes), 0),
                          number_cell(s.load_s, 1),
                          count_cell(s.soft_voxels),
                          {.text = fmt::format("{} of {}", s.soft_on_patches, s.soft_objects)},
                          count_cell(s.rigid_objects),
                          number_cell(s.session.seconds, 1),
                          number_cell(s.session.max_force_N, 2)});
  }
  return table;
}

// Why a scan failed, was not tuned, or cannot be trusted.
PageTable reasons_table(const Study& study) {
  PageTable table{.name = "reasons",
                  .caption = "Failures, faults of sessions, and searches without a result",
                  .head = {"scan", "what", "why"},
                  .rows = {}};
  for (const StudiedScan& scan : study.scans) {
    const JudgedScan& s = scan.judged;
    const auto add = [&](const char* what, const std::string& why) {
      if (!why.empty()) table.rows.push_back({{.text = s.pair.name}, {.text = what}, {.text = why}});
    };
    add("failed", s.failed);
    for (const std::string& fault : s.faults) add("fault", fault);
    add("no error", s.failed.empty() ? s.session.not_measured : "");
    if (s.tuned) add("not tuned", s.tuned->not_tuned);
  }
  return table;
}

PageTable sources_table(const Study& study) {
  PageTable table{.name = "sources",
                  .caption = "Files of each scan, its scene, and what the composition assumed or left out",
                  .head = {"scan", "volume", "labels", "scene", "notes"},
                  .rows = {}};
  for (const StudiedScan& scan : study.scans) {
    const JudgedScan& s = scan.judged;
    std::string notes;
    for (const std::string& note : s.notes) notes += (notes.empty() ? "" : "; ") + note;
    const auto cell = [](const std::string& text) { return PageCell{.text = text.empty() ? "–" : text}; };
    table.rows.push_back({cell(s.pair.name), cell(s.pair.scan.string()), cell(s.pair.labels.string()),
                          cell(s.scene.string()), cell(notes)});
  }
  return table;
}

PageTable choices_table(const Study& study) {
  PageTable table{
      .name = "choices",
      .caption = "The choice of hybrid tune for each scene; its page lies in the scan's folder, in tune/",
      .head = {"scan", "choice and reason"},
      .rows = {}};
  for (const StudiedScan& scan : study.scans) {
    const auto& tuned = scan.judged.tuned;
    if (!tuned || !tuned->not_tuned.empty()) continue;
    table.rows.push_back(
        {{.text = scan.judged.pair.name},
         {.text = tuned->verdict, .mark = tuned->accurate_in_time ? PageMark::good : PageMark::bad}});
  }
  return table;
}

std::string outliers_meaning(const Study& study) {
  const auto whole =
      std::ranges::count_if(study.scans, [](const StudiedScan& s) { return s.judged.failed.empty(); });
  if (static_cast<std::size_t>(whole) < kFewestForOutliers) {
    return fmt::format("With fewer than {} scans that did not fail, no scan is called an outlier.",
                       kFewestForOutliers);
  }
  return fmt::format(
      "\"Far above the median\" lists figures of a scan that are unlike those of the others: their modified "
      "z-score (of the logarithm) is above {:.1f}.",
      kOutlierScore);
}

}  // namespace

std::string study_svg(const Study& study, const std::string& title) {
  CostErrorFigure figure{.title = title,
                         .subtitle =
                             "Error against the same path played slowly over the cost of a tick. "
                             "Orange: beyond a bound; area of a mark: memory.",
                         .error_jnd = study.error_jnd,
                         .error_axis = "error of the soft force, p99 (JND)"};
  for (const StudiedScan& scan : study.scans) {
    const JudgedScan& s = scan.judged;
    if (!s.failed.empty() || !s.session.not_measured.empty()) continue;
    figure.budget_us = s.bounds.budget_us;
    figure.marks.push_back({.words = s.pair.name,
                            .cost_us = s.session.tick_us.p999,
                            .error_jnd = s.session.p99_jnd,
                            .memory_bytes = s.memory_bytes,
                            .kind = s.good() ? CostErrorMark::Kind::usual : CostErrorMark::Kind::alarming});
  }
  return figure.marks.empty() ? std::string() : cost_error_svg(figure);
}

Page study_page(const Study& study, const std::string& title) {
  const bool all_good =
      std::ranges::all_of(study.scans, [](const StudiedScan& s) { return s.judged.good(); });
  Page page{
      .title = title,
      .verdict = study_verdict(study),
      .mark = all_good ? PageMark::good : PageMark::bad,
      .summary = {"Each scan was composed into a scene, and the scene's own path was played once, as by "
                  "hybrid run. Errors are differences of the soft force from that of the same path "
                  "played slowly, so that tissue has time to come to rest.",
                  outliers_meaning(study)}};
  PageSection scans{.heading = "Scans", .parts = {}};
  const std::string svg = study_svg(study, title);
  if (!svg.empty()) {
    scans.parts.emplace_back(
        PageFigure{.name = "scans",
                   .caption = "Error of each scan over the 99.9th percentile of its "
                              "tick. The lines are the bounds.",
                   .alternative = "Error over cost of the scans; the table has the figures",
                   .svg = svg});
  }
  scans.parts.emplace_back(scans_table(study));
  page.sections.push_back(std::move(scans));
  const auto add = [&](const char* heading, PageTable table) {
    if (!table.rows.empty()) page.sections.push_back({.heading = heading, .parts = {std::move(table)}});
  };
  add("Settings", choices_table(study));
  add("Sizes", sizes_table(study));
  add("Failures and faults", reasons_table(study));
  add("Sources", sources_table(study));
  return page;
}

}  // namespace hybrid
