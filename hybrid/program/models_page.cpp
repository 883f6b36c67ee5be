// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/program/models_page.h"

#include <fmt/format.h>

#include <sstream>

#include "hybrid/models/models_text.h"

namespace hybrid {
namespace {

PageCell error_cell(const FeltError& error, double FeltError::*which) {
  return number_cell(error.ticks > 0 ? std::optional(error.*which) : std::nullopt, 2);
}

PageCell told_cell(const ModelRow& row, const ObjectModels& object) {
  std::string text;
  for (const std::string& by : told_apart_by(row, object)) text += (text.empty() ? "" : ", ") + by;
  return {.text = text.empty() ? "nothing" : text, .mark = text.empty() ? PageMark::good : PageMark::none};
}

std::vector<PageCell> model_cells(const ModelRow& row, const ObjectModels& object) {
  const auto off = stiffness_off(row, object);
  return {{.text = row.name},
          {.text = row.words},
          told_cell(row, object),
          number_cell(row.felt.force_p50_N, 3),
          number_cell(row.felt.force_max_N, 3),
          error_cell(row.felt.error.moving, &FeltError::p99_jnd),
          error_cell(row.felt.error.still, &FeltError::p99_jnd),
          number_cell(row.felt.direction_p99_deg, 1),
          number_cell(row.felt.stiffness_N_per_m, 0),
          number_cell(off ? std::optional(100.0 * *off) : std::nullopt, 0),
          number_cell(onset_later_ms(row, object), 0),
          number_cell(row.tick_us.p50, 1),
          number_cell(row.tick_us.p999, 1),
          number_cell(row.tick_us.max, 1),
          number_cell(1e-6 * static_cast<double>(row.memory_bytes), 1),
          number_cell(row.load_s, 2)};
}

PageTable object_table(const ObjectModels& object, std::size_t number) {
  PageTable table{.name = fmt::format("models-{}", number),
                  .caption = fmt::format("The models of \"{}\" against the reference", object.object),
                  .head = {"model", "values", "told apart by", "force median (N)", "force largest (N)",
                           "moving 99 % (JND)", "still 99 % (JND)", "direction 99 % (°)", "stiffness (N/m)",
                           "stiffness off (%)", "felt later (ms)", "tick median (µs)", "tick 99.9 % (µs)",
                           "tick largest (µs)", "memory (MB)", "load (s)"},
                  .rows = {}};
  for (const ModelRow& row : object.rows) {
    if (row.left_out.empty()) table.rows.push_back(model_cells(row, object));
  }
  return table;
}

PageSection object_section(const ModelsInScene& models, std::size_t o) {
  const ObjectModels& object = models.objects[o];
  PageSection section{.heading = object.object, .parts = {object_table(object, o + 1)}};
  for (const ModelRow& row : object.rows) {
    if (!row.left_out.empty())
      section.parts.emplace_back(fmt::format("Not played: {}: {}.", row.name, row.left_out));
    for (const std::string& fault : row.faults)
      section.parts.emplace_back(fmt::format("Fault of {}: {}", row.name, fault));
  }
  return section;
}

}  // namespace

Page models_in_scene_page(const ModelsInScene& models, const std::string& title) {
  Page page{.title = title, .verdict = models_verdict(models, models.objects.front()), .summary = {}};
  for (std::size_t o = 1; o < models.objects.size(); ++o)
    page.summary.push_back(models_verdict(models, models.objects[o]));
  for (std::size_t o = 0; o < models.objects.size(); ++o) page.sections.push_back(object_section(models, o));
  page.sections.push_back(
      {.heading = "Forces",
       .parts = {
           PageFigure{.name = "models",
                      .caption = "Force of each model and its difference from the reference over time; "
                                 "force over depth, for each contact.",
                      .alternative = "Forces of the models along the path; the tables have the differences",
                      .svg = to_svg(models_figure(models, title))}}});
  PageSection meaning{.heading = "Reference and meaning", .parts = {}};
  std::istringstream lines(models_legend(models));
  for (std::string line; std::getline(lines, line);) meaning.parts.emplace_back(line);
  page.sections.push_back(std::move(meaning));
  return page;
}

}  // namespace hybrid
