// SPDX-License-Identifier: GPL-3.0-or-later
// `hybrid compare` with two or more scenes.
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "hybrid/base/table.h"
#include "hybrid/compare/compare_scenes.h"
#include "hybrid/feel/just_noticeable.h"
#include "hybrid/plot/scenes_plot.h"
#include "hybrid/program/commands.h"
#include "hybrid/program/compare_page.h"
#include "hybrid/program/report_page.h"
#include "hybrid/session/outputs.h"
#include "hybrid/session/report.h"

namespace hybrid {
namespace {

nlohmann::ordered_json number_or_null(const std::optional<double>& value, double factor = 1.0) {
  return value ? nlohmann::ordered_json(factor * *value) : nlohmann::ordered_json(nullptr);
}

nlohmann::ordered_json difference_json(const ScenesDifference& d) {
  return {{"ticks", d.ticks},
          {"jnd_p50", d.p50_jnd},
          {"jnd_p99", d.p99_jnd},
          {"jnd_max", d.max_jnd},
          {"max_t_s", d.ticks > 0 ? nlohmann::ordered_json(d.max_t_s) : nlohmann::ordered_json(nullptr)}};
}

nlohmann::ordered_json own_error_json(const ForceError& error) {
  if (error.all.samples == 0) return {{"samples", 0}, {"not_measured", error.not_measured}};
  return {{"samples", error.all.samples},
          {"jnd_p99", error.p99_jnd},
          {"moving_jnd_max", error.moving.max_jnd},
          {"still_jnd_max", error.still.max_jnd}};
}

nlohmann::ordered_json scenes_report(const CompareCommand& command, const ScenesComparison& comparison) {
  nlohmann::ordered_json j = report_head("compare");
  j["reference"] = comparison.scenes.front().name;
  j["jnd"] = {{"share", kJndShare}, {"floor_N", comparison.jnd_floor_N}};
  j["notes"] = comparison.notes;
  j["scenes"] = nlohmann::ordered_json::array();
  for (std::size_t s = 0; s < comparison.scenes.size(); ++s) {
    const ComparedScene& scene = comparison.scenes[s];
    nlohmann::ordered_json row{{"name", scene.name}, {"file", command.scenes[s].string()}};
    row["peak_force_N"] = scene.peak_N;
    row["difference"] = difference_json(scene.all);
    row["difference_moving"] = difference_json(scene.moving);
    row["difference_still"] = difference_json(scene.still);
    row["direction_p99_deg"] = number_or_null(scene.direction_p99_deg);
    row["onset_s"] = number_or_null(scene.onset_s);
    row["onset_later_ms"] = number_or_null(scene.onset_later_s, 1e3);
    row["own_error"] = own_error_json(scene.own_error);
    row["tick_us"] = to_json(scene.tick_us);
    row["load_s"] = scene.load_s;
    row["memory_bytes"] = scene.memory_bytes;
    row["soft_voxels"] = scene.soft_voxels;
    if (s > 0) row["verdict"] = verdict(comparison, s);
    j["scenes"].push_back(std::move(row));
  }
  return j;
}

Figure drawn_scenes(const ScenesComparison& comparison) {
  std::vector<ComparedModel> drawn;
  std::string title;
  for (const ComparedScene& scene : comparison.scenes) {
    drawn.push_back({scene.name, scene.rows, {}, false});
    title += (title.empty() ? "" : ", ") + scene.name;
  }
  title += " along the path of " + comparison.scenes.front().name;
  return scenes_figure(drawn, title,
                       {.reference = 0, .jnd_share = kJndShare, .jnd_floor_N = comparison.jnd_floor_N});
}

std::string cell(const std::optional<double>& value, double factor, int decimals) {
  return value ? fmt::format("{:.{}f}", factor * *value, decimals) : "-";
}

std::string cells(const ScenesDifference& d) {
  return d.ticks > 0 ? fmt::format("{:.2f}/{:.2f}/{:.2f}", d.p50_jnd, d.p99_jnd, d.max_jnd) : "-";
}

std::string own_error_cells(const ForceError& error) {
  if (error.all.samples == 0) return "-";
  return fmt::format("{:.2f}/{:.2f}", error.moving.max_jnd, error.still.max_jnd);
}

void print_scenes(std::FILE* words, const ScenesComparison& comparison, bool own_error) {
  const ComparedScene* const first = comparison.scenes.data();
  const auto difference = [first](auto cell) {
    return [first, cell](const ComparedScene& s) { return &s == first ? std::string("reference") : cell(s); };
  };
  const auto beside = [first](auto cell) {
    return [first, cell](const ComparedScene& s) { return &s == first ? std::string("-") : cell(s); };
  };
  const Table<ComparedScene> table({
      {{"scene"}, 0, Side::left, [](const ComparedScene& s) { return s.name; }},
      {{"peak N"}, 7, Side::right, [](const ComparedScene& s) { return fmt::format("{:.3f}", s.peak_N); }},
      {{"moving JND", "p50/p99/max"}, 15, Side::right, difference([](const ComparedScene& s) {
         return cells(s.moving);
       })},
      {{"still JND", "p50/p99/max"}, 15, Side::right, difference([](const ComparedScene& s) {
         return cells(s.still);
       })},
      {{"max at", "s"}, 7, Side::right, beside([](const ComparedScene& s) {
         return s.all.max_jnd == 0.0 ? "-" : fmt::format("{:.3f}", s.all.max_t_s);
       })},
      {{"dir p99", "deg"}, 7, Side::right, beside([](const ComparedScene& s) {
         return cell(s.direction_p99_deg, 1.0, 2);
       })},
      {{"onset ms", "later"}, 8, Side::right, beside([](const ComparedScene& s) {
         return cell(s.onset_later_s, 1e3, 0);
       })},
      {{"own error", "moving/still"},
       12,
       Side::right,
       [](const ComparedScene& s) { return own_error_cells(s.own_error); }},
      {{"tick us", "p50/p99/p99.9/max"},
       20,
       Side::right,
       [](const ComparedScene& s) { return in_words(s.tick_us); }},
      {{"MB"},
       7,
       Side::right,
       [](const ComparedScene& s) {
         return fmt::format("{:.1f}", 1e-6 * static_cast<double>(s.memory_bytes));
       }},
      {{"load s"}, 7, Side::right, [](const ComparedScene& s) { return fmt::format("{:.2f}", s.load_s); }},
      {{"voxels"}, 9, Side::right, [](const ComparedScene& s) { return std::to_string(s.soft_voxels); }},
  });
  fmt::print(words, "{}", table.text(comparison.scenes));
  const std::string own = own_error ? fmt::format(
                                          "greatest JND against the same scene along the same path, {} "
                                          "times slower; -: nothing soft was felt",
                                          kQuickSlower)
                                    : "not measured, as --samples is 0: the times stand without it";
  fmt::print(words,
             "\ndifferences are from {}; 1 JND = max({:.0f} % of its force, {:.2f} N)\nown error: {}\n"
             "ticks: timed on this machine, not pinned to a core, in alternating order; compare ratios\n",
             comparison.scenes.front().name, 100.0 * kJndShare, comparison.jnd_floor_N, own);
  for (std::size_t s = 1; s < comparison.scenes.size(); ++s)
    fmt::print(words, "{}\n", verdict(comparison, s));
}

}  // namespace

int compare_whole_scenes(const CompareCommand& command) {
  Outputs outputs;
  outputs.ask_plot(command.plot);
  ask_report(outputs, command.report);
  outputs.ask_json(command.json);
  std::vector<Scene> scenes;
  for (const std::filesystem::path& file : command.scenes) scenes.push_back(load_scene(file));
  const ScenesComparison comparison = compare_scenes(scenes, command.samples != "0", progress_on_terminal());
  end_progress();
  const nlohmann::ordered_json report = scenes_report(command, comparison);
  outputs.write_json(command.json, report);
  outputs.write("plot", command.plot,
                [&](const std::filesystem::path& file) { save_svg(file, drawn_scenes(comparison)); });
  outputs.attempt([&] {
    if (command.report.folder.empty()) return;
    const Figure figure = drawn_scenes(comparison);
    write_report(outputs, command.report, scenes_page(comparison, figure, figure.title), report);
  });
  std::FILE* words = outputs.words();
  fmt::print(
      words,
      "{} whole scenes along the path of {}, each on an ideal device: the tool is at the same places in "
      "all, and no force is limited\n\n",
      scenes.size(), comparison.scenes.front().name);
  for (const std::string& note : comparison.notes) fmt::print(words, "note: {}\n", note);
  print_scenes(words, comparison, command.samples != "0");
  outputs.say_files();
  return outputs.failed() ? 1 : 0;
}

}  // namespace hybrid
