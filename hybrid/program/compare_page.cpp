// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/program/compare_page.h"

#include <fmt/format.h>

#include <algorithm>

#include "hybrid/feel/just_noticeable.h"

namespace hybrid {
namespace {

// A time in µs. 0 means that it was not measured.
PageCell time_cell(double us) {
  return number_cell(us > 0.0 ? std::optional(us) : std::nullopt, 1);
}

std::string jnd_words(double floor_N) {
  return fmt::format(
      "One JND, the difference that a hand just notices, is {:.0f} % of the reference's force and at least "
      "{:.3f} N.",
      100.0 * kJndShare, floor_N);
}

PageTable models_table(const Comparison& comparison) {
  PageTable table{
      .name = "models",
      .caption = "Difference of each model's force from the reference, and the time of its ticks",
      .head = {"model", "rms (N)", "largest (N)", "median (JND)", "99 % (JND)", "above 1 JND (%)",
               "direction, 99 % (°)", "work (J)", "tick median (µs)", "tick 99 % (µs)", "tick largest (µs)"},
      .rows = {}};
  for (std::size_t m = 0; m < comparison.models.size(); ++m) {
    const ModelResult& model = comparison.models[m];
    const std::string mark = m == comparison.reference ? " (reference)" : "";
    table.rows.push_back({{.text = model.name + mark},
                          number_cell(model.rms_N, 4),
                          number_cell(model.max_N, 4),
                          number_cell(model.jnd_p50, 2),
                          number_cell(model.jnd_p99, 2),
                          number_cell(100.0 * model.share_above_1_jnd, 1),
                          number_cell(model.direction_p99_deg, 2),
                          {.text = fmt::format("{:.2g}", model.work_J), .value = model.work_J},
                          time_cell(model.tick_us.p50),
                          time_cell(model.tick_us.p99),
                          time_cell(model.tick_us.max)});
  }
  return table;
}

// The models whose p99 of the difference is within 1 JND, or (`within` false) all others, for example "a (0.4
// JND), b (0.8 JND)".
std::string models_within(const Comparison& comparison, bool within) {
  std::string list;
  for (std::size_t m = 0; m < comparison.models.size(); ++m) {
    const ModelResult& model = comparison.models[m];
    if (m == comparison.reference || (model.jnd_p99 <= 1.0) != within) continue;
    list += fmt::format("{}{} ({:.3g} JND)", list.empty() ? "" : ", ", model.name, model.jnd_p99);
  }
  return list;
}

std::string models_verdict(const Comparison& comparison) {
  const std::string alike = models_within(comparison, true), apart = models_within(comparison, false);
  std::string text = fmt::format("\"{}\": a hand ", comparison.object);
  const std::string& reference = comparison.models[comparison.reference].name;
  if (!alike.empty()) text += fmt::format("cannot tell {} from {}", alike, reference);
  if (!alike.empty() && !apart.empty()) text += "; it ";
  if (!apart.empty()) text += fmt::format("can tell {}{}", apart, alike.empty() ? " from " + reference : "");
  return text + ".";
}

PageTable scenes_table(const ScenesComparison& comparison) {
  PageTable table{.name = "scenes",
                  .caption = "Each scene: difference of its force from the reference, and what it costs",
                  .head = {"scene", "peak (N)", "moving, largest (JND)", "still, largest (JND)", "99 % (JND)",
                           "direction, 99 % (°)", "felt later (ms)", "own error (JND)", "tick median (µs)",
                           "tick 99.9 % (µs)", "memory (MB)", "load (s)", "soft voxels"},
                  .rows = {}};
  for (std::size_t s = 0; s < comparison.scenes.size(); ++s) {
    const ComparedScene& scene = comparison.scenes[s];
    const auto difference = [s](double value, std::uint64_t ticks) {
      return number_cell(s > 0 && ticks > 0 ? std::optional(value) : std::nullopt, 2);
    };
    const auto later_ms = scene.onset_later_s ? std::optional(1e3 * *scene.onset_later_s) : std::nullopt;
    const bool own = scene.own_error.all.samples > 0;
    table.rows.push_back({{.text = scene.name + (s == 0 ? " (reference)" : "")},
                          number_cell(scene.peak_N, 3),
                          difference(scene.moving.max_jnd, scene.moving.ticks),
                          difference(scene.still.max_jnd, scene.still.ticks),
                          difference(scene.all.p99_jnd, scene.all.ticks),
                          number_cell(s > 0 ? scene.direction_p99_deg : std::nullopt, 2),
                          number_cell(s > 0 ? later_ms : std::nullopt, 0),
                          number_cell(own ? std::optional(scene.own_error.all.max_jnd) : std::nullopt, 2),
                          number_cell(scene.tick_us.p50, 1),
                          number_cell(scene.tick_us.p999, 1),
                          number_cell(1e-6 * static_cast<double>(scene.memory_bytes), 1),
                          number_cell(scene.load_s, 2),
                          count_cell(scene.soft_voxels)});
  }
  return table;
}

}  // namespace

Page comparison_page(const Comparison& comparison, const Figure& figure, const std::string& title,
                     const std::string& about) {
  Page page{.title = title + ": models side by side",
            .verdict = models_verdict(comparison),
            .summary = {"The difference in JND is the one that 99 % of ticks stay below.", about,
                        "Errors are against: " + comparison.reference_text + ".",
                        jnd_words(comparison.jnd_floor_N)}};
  if (!comparison.note.empty()) page.summary.push_back(comparison.note);
  page.sections.push_back({.heading = "Errors and times", .parts = {models_table(comparison)}});
  page.sections.push_back(
      {.heading = "Force of each model",
       .parts = {
           PageFigure{.name = "models",
                      .caption = "Force over time and difference from the reference, for each model; force "
                                 "over depth for each press, over path length for each stroke.",
                      .alternative = "Forces of the models along the motion; the table has the differences",
                      .svg = to_svg(figure)}}});
  return page;
}

Page scenes_page(const ScenesComparison& comparison, const Figure& figure, const std::string& title) {
  Page page{.title = title,
            .verdict = comparison.scenes.size() > 1 ? verdict(comparison, 1) : "One scene alone.",
            .summary = {}};
  for (std::size_t s = 2; s < comparison.scenes.size(); ++s) page.summary.push_back(verdict(comparison, s));
  page.summary.emplace_back(
      "Each scene is on an ideal device: the tool is at the same places in all, and no force is limited.");
  page.summary.push_back(jnd_words(comparison.jnd_floor_N));
  page.sections.push_back(
      {.heading = "Differences and costs",
       .parts = {scenes_table(comparison),
                 fmt::format("Own error: against the same scene along the same path, {} times slower. Ticks "
                             "are timed in alternating order, not pinned to a core.",
                             kQuickSlower)}});
  page.sections.push_back(
      {.heading = "Force of each scene",
       .parts = {
           PageFigure{.name = "scenes",
                      .caption = "Force over time, and difference of each scene from the reference. Within "
                                 "the band a hand does not feel it.",
                      .alternative = "Forces of the scenes along the motion; the table has the differences",
                      .svg = to_svg(figure)}}});
  PageSection notes{.heading = "Notes", .parts = {}};
  for (const std::string& note : comparison.notes) notes.parts.emplace_back(note);
  if (!notes.parts.empty()) page.sections.push_back(std::move(notes));
  return page;
}

}  // namespace hybrid
