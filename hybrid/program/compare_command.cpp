// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "hybrid/base/file_ending.h"
#include "hybrid/base/table.h"
#include "hybrid/compare/compare.h"
#include "hybrid/plot/compare_plot.h"
#include "hybrid/program/commands.h"
#include "hybrid/program/compare_page.h"
#include "hybrid/program/report_page.h"
#include "hybrid/session/outputs.h"
#include "hybrid/session/report.h"

namespace hybrid {
namespace {

nlohmann::ordered_json comparison_report(const Scene& scene, const Comparison& comparison) {
  nlohmann::ordered_json j = report_head("compare");
  j["scene"] = scene.file.string();
  j["object"] = comparison.object;
  if (!comparison.note.empty()) j["note"] = comparison.note;
  j["jnd"] = {{"share", kJndShare}, {"floor_N", comparison.jnd_floor_N}};
  j["models"] = nlohmann::ordered_json::array();
  for (const ModelResult& m : comparison.models) {
    nlohmann::ordered_json row{{"name", m.name}, {"reference", comparison.reference_text}};
    row["force_error"] = {{"rms_N", m.rms_N},
                          {"max_N", m.max_N},
                          {"jnd_p50", m.jnd_p50},
                          {"jnd_p99", m.jnd_p99},
                          {"share_above_1_jnd", m.share_above_1_jnd}};
    row["direction_error_deg"] = {{"p50", m.direction_p50_deg}, {"p99", m.direction_p99_deg}};
    row["work_J"] = m.work_J;
    row["tick_us"] = m.tick_us.max > 0.0 ? to_json(m.tick_us) : nlohmann::ordered_json(nullptr);
    j["models"].push_back(row);
  }
  return j;
}

void print_models(std::FILE* words, const Comparison& comparison) {
  fmt::print(words, "errors against: {}; 1 JND = max(7 %, {:.2f} N)\n\n", comparison.reference_text,
             comparison.jnd_floor_N);
  if (!comparison.note.empty()) fmt::print(words, "{}\n\n", comparison.note);
  const auto figure = [](const char* form, double ModelResult::*value, double factor = 1.0) {
    return [=](const ModelResult& m) { return fmt::format(fmt::runtime(form), factor * m.*value); };
  };
  const auto time = [](double Percentiles::*which) {
    return [which](const ModelResult& m) {
      return m.tick_us.max > 0.0 ? fmt::format("{:.1f}", m.tick_us.*which) : "-";
    };
  };
  const Table<ModelResult> table({
      {{"model"}, 0, Side::left, [](const ModelResult& m) { return m.name; }},
      {{"rms N"}, 8, Side::right, figure("{:.4f}", &ModelResult::rms_N)},
      {{"max N"}, 8, Side::right, figure("{:.4f}", &ModelResult::max_N)},
      {{"JND p50"}, 8, Side::right, figure("{:.2f}", &ModelResult::jnd_p50)},
      {{"JND p99"}, 8, Side::right, figure("{:.2f}", &ModelResult::jnd_p99)},
      {{">1 JND"}, 8, Side::right, figure("{:.1f} %", &ModelResult::share_above_1_jnd, 100.0)},
      {{"dir p99"}, 9, Side::right, figure("{:.2f}°", &ModelResult::direction_p99_deg)},
      {{"work J"}, 9, Side::right, figure("{:.2g}", &ModelResult::work_J)},
      {{"p50 us"}, 9, Side::right, time(&Percentiles::p50)},
      {{"p99 us"}, 9, Side::right, time(&Percentiles::p99)},
      {{"max us"}, 9, Side::right, time(&Percentiles::max)},
  });
  fmt::print(words, "{}", table.text(comparison.models));
}

std::string title_of_comparison(const Scene& scene, const Comparison& comparison) {
  return fmt::format("{}: {}", scene.title.empty() ? scene.file.stem().string() : scene.title,
                     comparison.object);
}

Figure comparison_figure(const CompareCommand& command, const Scene& scene, const Comparison& comparison) {
  std::vector<ComparedModel> models;
  std::size_t reference = 0;
  for (std::size_t m = 0; m < comparison.models.size(); ++m) {
    const ModelResult& model = comparison.models[m];
    const bool classic = model.name == kThesisModel;
    if (classic && !command.classic) continue;
    if (m == comparison.reference) reference = models.size();
    models.push_back({model.name, model.rows, model.depth_m, classic});
  }
  return compare_figure(
      models, {}, title_of_comparison(scene, comparison),
      {.reference = reference, .jnd_share = kJndShare, .jnd_floor_N = comparison.jnd_floor_N});
}

// Writes all files. They come before the text for people, because its reader may stop reading.
void write_files(const CompareCommand& command, const Scene& scene, const Comparison& comparison,
                 const nlohmann::ordered_json& report, const std::string& about, Outputs& outputs) {
  outputs.write_json(command.json, report);
  outputs.write("plot", command.plot, [&](const std::filesystem::path& file) {
    save_svg(file, comparison_figure(command, scene, comparison));
  });
  if (command.report.folder.empty()) return;
  outputs.attempt([&] {
    const Page page = comparison_page(comparison, comparison_figure(command, scene, comparison),
                                      title_of_comparison(scene, comparison), about);
    write_report(outputs, command.report, page, report);
  });
}

int compare_with_measured(const CompareCommand& command, const Scene& scene, Outputs& outputs) {
  MeasuredOptions options = command.measured;
  // .traj files are in millimeters; a CSV file without units has the scene's unit.
  if (lower_ending(options.measured.file) != ".traj") options.measured.unit_m = scene.unit_m;
  const MeasuredComparison result = compare_measured(scene, options, progress_on_terminal());
  end_progress();
  for (const std::string& note : result.notes) std::fprintf(stderr, "note: %s\n", note.c_str());
  nlohmann::ordered_json j = comparison_report(scene, result.comparison);
  j["measured"] = {{"file", options.measured.file.string()},
                   {"along", options.along.empty() ? nlohmann::ordered_json(nullptr)
                                                   : nlohmann::ordered_json(options.along.string())},
                   {"rms_N", result.rms_N},
                   {"ticks", result.samples},
                   {"ticks_in_gaps", result.in_gaps},
                   {"notes", result.notes}};
  write_files(
      command, scene, result.comparison, j,
      fmt::format("The whole scene {} along a measured motion, {} ticks. RMS force error over all of them: "
                  "{:.4f} N.",
                  scene.file.filename().string(), result.samples, result.rms_N),
      outputs);
  std::FILE* words = outputs.words();
  const std::string file = options.measured.file.filename().string();
  fmt::print(words, "{} along {}, {} ticks\n", scene.file.filename().string(),
             options.along.empty() ? file : options.along.filename().string(), result.samples);
  print_models(words, result.comparison);
  fmt::print(words, "\nRMS force error over all ticks, in contact or not: {:.4f} N\n", result.rms_N);
  if (result.in_gaps > 0)
    fmt::print(words, "{} ticks lie in gaps of the measurement, and are left out\n", result.in_gaps);
  outputs.say_files();
  return outputs.failed() ? 1 : 0;
}

}  // namespace

int compare(const CompareCommand& command) {
  if (command.scenes.size() > 1) return compare_whole_scenes(command);
  if (command.models) return compare_models_in_scene(command);
  const Scene scene = load_scene(command.scenes.front());
  Outputs outputs;
  outputs.ask_plot(command.plot);
  ask_report(outputs, command.report);
  outputs.ask_json(command.json);
  if (!command.measured.measured.file.empty()) return compare_with_measured(command, scene, outputs);
  const Comparison comparison = compare_models(scene, command.object, progress_on_terminal());
  end_progress();
  const std::string about = fmt::format(
      "\"{}\" alone along the path of {}: no other objects, an ideal device, tissue relaxed in the tick (the "
      "models in the whole scene: --models)",
      comparison.object, scene.file.filename().string());
  write_files(command, scene, comparison, comparison_report(scene, comparison), about + ".", outputs);
  std::FILE* words = outputs.words();
  fmt::print(words, "{}\n", about);
  print_models(words, comparison);
  outputs.say_files();
  return outputs.failed() ? 1 : 0;
}

}  // namespace hybrid
