// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "device/loop/stop_signal.h"
#include "hybrid/base/table.h"
#include "hybrid/program/commands.h"
#include "hybrid/scene/table_reader.h"
#include "hybrid/session/outputs.h"
#include "hybrid/session/report.h"

namespace hybrid {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostNamed = 24;  // names in one line at most

// Quotes an argument for a shell.
std::string in_shell(const std::string& text) {
  const bool plain = !text.empty() && text.find_first_not_of(
                                          "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                          "0123456789_-./+=@%,:") == std::string::npos;
  if (plain) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

void print_table(std::FILE* out, const std::vector<ComposedPart>& rows) {
  const auto number = [](std::size_t n) { return n == 0 ? std::string("-") : std::to_string(n); };
  const Table<ComposedPart> table({
      {{"name"}, 0, Side::left, [](const ComposedPart& row) { return row.name; }},
      {{"as"}, 0, Side::left, [](const ComposedPart& row) { return row.rigid ? "rigid" : "soft"; }},
      {{"voxels"}, 0, Side::right, [&](const ComposedPart& row) { return number(row.voxels); }},
      {{"triangles"}, 0, Side::right, [&](const ComposedPart& row) { return number(row.triangles); }},
      {{"size (mm)"},
       0,
       Side::left,
       [](const ComposedPart& row) {
         const glm::dvec3 mm = row.size_m * 1e3;
         return fmt::format("{:.4g} x {:.4g} x {:.4g}", mm.x, mm.y, mm.z);
       }},
      {{"E (kPa)"},
       0,
       Side::right,
       [](const ComposedPart& row) { return row.rigid ? "-" : fmt::format("{:.4g}", row.young_Pa / 1e3); }},
      {{"nu"},
       0,
       Side::right,
       [](const ComposedPart& row) { return row.rigid ? "-" : fmt::format("{:.2f}", row.poisson); }},
      {{"source"}, 0, Side::left, [](const ComposedPart& row) { return row.source; }},
  });
  fmt::print(out, "{}", table.text(rows));
}

void print_not_pressed(std::FILE* out, const PressPath& path) {
  for (const bool hidden : {true, false}) {
    std::vector<std::string_view> names;
    for (const NotPressed& n : path.not_pressed) {
      if (n.hidden == hidden) names.push_back(n.what);
    }
    if (names.empty()) continue;
    const std::size_t more = names.size() - std::min(names.size(), kMostNamed);
    names.resize(names.size() - more);
    fmt::print(out, "not pressed, {}: {}{}\n", not_pressed_why(hidden), joined(names),
               more > 0 ? fmt::format(" and {} more", more) : "");
  }
}

Json composition_report(const Composed& composed) {
  Json json = report_head("compose");
  json["scene"] = composed.scene.string();
  json["objects"] = Json::array();
  for (const ComposedPart& row : composed.rows) {
    Json object{{"name", row.name},
                {"kind", row.rigid ? "rigid" : "soft"},
                {"voxels", row.voxels},
                {"triangles", row.triangles},
                {"size_m", {row.size_m.x, row.size_m.y, row.size_m.z}}};
    if (!row.rigid)
      object.update({{"young_Pa", row.young_Pa}, {"poisson", row.poisson}, {"source", row.source}});
    json["objects"].push_back(object);
  }
  json["presses"] = Json::array();
  for (const Press& press : composed.path.presses)
    json["presses"].push_back({{"what", press.what}, {"from", press.where}});
  json["not_pressed"] = Json::array();
  for (const NotPressed& n : composed.path.not_pressed)
    json["not_pressed"].push_back({{"what", n.what}, {"hidden", n.hidden}});
  json["path_s"] = composed.path_s;
  json["tool_radius_m"] = composed.tool_radius_m;
  json["notes"] = composed.notes;
  json["places"] = composed.places;
  return json;
}

}  // namespace

int compose(const ComposeCommand& command) {
  Outputs outputs;
  outputs.ask_json(command.json);
  const device::StopOnSignal stop;  // after a signal, unfinished files are removed
  const Composed composed = compose(command.options, progress_on_terminal());
  end_progress();
  outputs.write_json(command.json, composition_report(composed));
  std::FILE* words = outputs.words();
  for (const std::string& note : composed.notes) fmt::print(stderr, "note: {}\n", note);
  if (!composed.rows.empty()) print_table(words, composed.rows);
  if (!composed.places.empty()) fmt::print(words, "\n");
  for (const std::string& place : composed.places) fmt::print(words, "{}\n", place);
  if (!composed.path.presses.empty()) {
    fmt::print(words, "\nthe path presses, with a ball of {:.3g} mm radius:\n", composed.tool_radius_m * 1e3);
    for (const Press& press : composed.path.presses) fmt::print(words, "  {}, {}\n", press.what, press.where);
  }
  print_not_pressed(words, composed.path);
  const std::string scene = composed.scene.string();
  fmt::print(words, "\n{}: written; its path takes {:.0f} s\nnext: hybrid run {} --picture {}\n", scene,
             composed.path_s, in_shell(scene),
             in_shell((composed.scene.parent_path() / "scene.png").string()));
  return outputs.failed() ? 1 : 0;
}

}  // namespace hybrid
