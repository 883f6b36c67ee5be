// SPDX-License-Identifier: GPL-3.0-or-later
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "hybrid/base/table.h"
#include "hybrid/bench/occupancy.h"

namespace hybrid::bench {
namespace {

std::string ns_text(double ns) {
  return ns < 100.0 ? fmt::format("{:.1f}", ns)
         : ns < 1e5 ? fmt::format("{:.0f}", ns)
         : ns < 1e7 ? fmt::format("{:.0f}k", ns / 1e3)
                    : fmt::format("{:.4g}M", ns / 1e6);
}

// The row of another engine for the same question; nullptr if there is none.
const OccupancyRow* same_query(const std::vector<OccupancyRow>& rows, const OccupancyRow& row,
                               OccupancyEngine engine) {
  for (const OccupancyRow& other : rows) {
    if (other.op == row.op && other.engine == engine && other.pattern == row.pattern &&
        other.what == row.what && other.elements == row.elements && other.box_cells == row.box_cells)
      return &other;
  }
  return nullptr;
}

std::string name_of(const OccupancyRow& row) {
  const std::string box = row.box_cells > 0 ? fmt::format(", box of {}", row.box_cells) : std::string();
  return fmt::format("{} {} of {} {}{}", row.op, pattern_name(row.pattern), row.elements, what_name(row.what),
                     box);
}

// One line for each size: the ball with all its voxels against the ball with only its surface.
std::string all_against_surface(const std::vector<OccupancyRow>& rows) {
  const auto of_tool = [](const OccupancyRow& row) {
    return row.engine == OccupancyEngine::map && row.op == "lookup" && row.box_cells == 5 &&
           row.pattern == OccupancyPattern::coherent;
  };
  std::string text;
  for (const OccupancyRow& all : rows) {
    if (!of_tool(all) || all.what != OccupancyWhat::voxels_all) continue;
    for (const OccupancyRow& surface : rows) {
      if (!of_tool(surface) || surface.what != OccupancyWhat::voxels_surface ||
          surface.object_voxels != all.object_voxels)
        continue;
      const double all_MB = 1e-6 * all.bytes_per_cell * static_cast<double>(all.cells),
                   surface_MB = 1e-6 * surface.bytes_per_cell * static_cast<double>(surface.cells);
      text += fmt::format(
          "a ball of {} voxels: all in the map {:.3g} MB, its {} surface voxels {:.3g} MB ({:.2g} times "
          "less); "
          "a tool's box {:.0f} against {:.0f} ns, {:.0f} against {:.0f} voxels found\n",
          all.elements, all_MB, surface.elements, surface_MB, all_MB / surface_MB, all.p50_ns, surface.p50_ns,
          all.found_mean, surface.found_mean);
      break;
    }
  }
  return text;
}

const Table<OccupancyRow>& occupancy_table() {
  const auto judged = [](std::size_t OccupancyRow::*value) {
    return [value](const OccupancyRow& row) {
      return row.reference.empty() ? std::string("-") : std::to_string(row.*value);
    };
  };
  static const Table<OccupancyRow> table({
      {{"op"}, 7, Side::left, [](const OccupancyRow& row) { return row.op; }},
      {{"engine"},
       9,
       Side::left,
       [](const OccupancyRow& row) { return std::string(engine_name(row.engine)); }},
      {{"what"}, 14, Side::left, [](const OccupancyRow& row) { return std::string(what_name(row.what)); }},
      {{"pattern"},
       8,
       Side::left,
       [](const OccupancyRow& row) { return std::string(pattern_name(row.pattern)); }},
      {{"elements"}, 10, Side::right, [](const OccupancyRow& row) { return std::to_string(row.elements); }},
      {{"cells"}, 9, Side::right, [](const OccupancyRow& row) { return std::to_string(row.cells); }},
      {{"box"},
       3,
       Side::right,
       [](const OccupancyRow& row) { return row.box_cells > 0 ? std::to_string(row.box_cells) : "-"; }},
      {{"p50"}, 9, Side::right, [](const OccupancyRow& row) { return ns_text(row.p50_ns); }},
      {{"p99"}, 9, Side::right, [](const OccupancyRow& row) { return ns_text(row.p99_ns); }},
      {{"B/cell"},
       7,
       Side::right,
       [](const OccupancyRow& row) { return fmt::format("{:.1f}", row.bytes_per_cell); }},
      {{"found"},
       7,
       Side::right,
       [](const OccupancyRow& row) {
         return row.op == "lookup" ? fmt::format("{:.1f}", row.found_mean) : std::string("-");
       }},
      {{"checked"}, 7, Side::right, judged(&OccupancyRow::checked)},
      {{"missed"}, 6, Side::right, judged(&OccupancyRow::missed)},
      {{"extra"}, 6, Side::right, judged(&OccupancyRow::extra)},
  });
  return table;
}

}  // namespace

nlohmann::ordered_json to_json(const OccupancyRow& row) {
  nlohmann::ordered_json json;
  json["op"] = row.op;
  json["engine"] = engine_name(row.engine);
  json["pattern"] = pattern_name(row.pattern);
  json["cells"] = row.cells;
  json["p50_ns"] = row.p50_ns;
  json["p99_ns"] = row.p99_ns;
  json["bytes_per_cell"] = row.bytes_per_cell;
  json["what"] = what_name(row.what);
  json["elements"] = row.elements;
  if (row.object_voxels > 0) json["object_voxels"] = row.object_voxels;
  json["batch"] = row.batch;
  json["batches"] = row.batches;
  if (row.box_cells > 0) {
    json["box_cells"] = row.box_cells;
    json["found_mean"] = row.found_mean;
  }
  json["reference"] =
      row.reference.empty() ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(row.reference);
  if (!row.reference.empty()) {
    json["checked"] = row.checked;
    json["missed"] = row.missed;
    json["extra"] = row.extra;
  }
  if (!row.note.empty()) json["note"] = row.note;
  return json;
}

std::string occupancy_table_head() {
  return occupancy_table().head();
}

std::string occupancy_table_line(const OccupancyRow& row) {
  return occupancy_table().line(row, row.note.empty() ? std::string() : "  " + row.note);
}

std::string occupancy_summary(const std::vector<OccupancyRow>& rows) {
  std::string text = all_against_surface(rows), worse;
  std::size_t missed = 0, compared = 0;
  double least_memory = 1e300, most_memory = 0.0;
  for (const OccupancyRow& row : rows) {
    missed += row.missed;
    if (row.engine != OccupancyEngine::map) continue;
    for (const OccupancyEngine engine : {OccupancyEngine::cgal_aabb, OccupancyEngine::brute}) {
      const OccupancyRow* other = same_query(rows, row, engine);
      if (other == nullptr) continue;
      ++compared;
      if (engine == OccupancyEngine::cgal_aabb && other->bytes_per_cell > 0.0 && row.op == "lookup") {
        const double ratio = row.bytes_per_cell / other->bytes_per_cell;
        least_memory = std::min(least_memory, ratio);
        most_memory = std::max(most_memory, ratio);
      }
      if (row.p50_ns > other->p50_ns)
        worse += fmt::format("  {}: {} ns, {} {} ns\n", name_of(row), ns_text(row.p50_ns),
                             engine_name(engine), ns_text(other->p50_ns));
    }
  }
  if (compared > 0)
    text += worse.empty() ? fmt::format("the map is faster in all {} comparisons\n", compared)
                          : fmt::format("of {} comparisons the map is slower in these:\n{}", compared, worse);
  if (most_memory > 0.0)
    text +=
        fmt::format("memory of the map over that of the tree: {:.2g} to {:.2g}\n", least_memory, most_memory);
  return rows.empty() ? text : text + fmt::format("missed: {}\n", missed);
}

}  // namespace hybrid::bench
