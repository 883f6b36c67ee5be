// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/session/trace_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "hybrid/base/whole_file.h"

namespace hybrid {
namespace {

// A name of an object without the characters that separate or quote the fields of a CSV file.
std::string name_in_csv(std::string name) {
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c == ',' || c == ';' || c == '"' || c == '\t'; }, '_');
  return name;
}

std::string column_name(const World& world, const ObjectPair& pair) {
  const std::string other = pair.kind == ObjectPair::Kind::anchors ? "anchors"
                            : pair.kind == ObjectPair::Kind::rigid ? world.rigid[pair.other].name
                                                                   : world.soft[pair.other].name;
  return fmt::format("between_{}_{}_N", name_in_csv(world.soft[pair.soft].name), name_in_csv(other));
}

}  // namespace

std::vector<TraceColumn> pair_columns(const World& world, const ForcesCourse& between) {
  std::vector<TraceColumn> columns;
  if (!between.keep_every) return columns;
  for (const PairCourse& course : between.pairs) {
    TraceColumn column{.name = column_name(world, course.pair), .values = course.every_N};
    // Two objects may have the same name. Each later column of a name gets a number.
    const auto taken = [&](const std::string& name) {
      return std::any_of(columns.begin(), columns.end(),
                         [&](const TraceColumn& other) { return other.name == name; });
    };
    const std::string stem = column.name.substr(0, column.name.size() - 2);
    for (int n = 2; taken(column.name); ++n) column.name = fmt::format("{}_{}_N", stem, n);
    columns.push_back(std::move(column));
  }
  return columns;
}

void save_trace(const std::filesystem::path& file, std::span<const TraceRow> rows,
                std::span<const TraceColumn> more) {
  WholeFile out(file);
  std::string head =
      "t_s,device_x_m,device_y_m,device_z_m,proxy_x_m,proxy_y_m,proxy_z_m,"
      "force_x_N,force_y_N,force_z_N,rigid_N,soft_N,contacts,tick_us";
  for (const TraceColumn& column : more) head += ',' + column.name;
  out.write(head + '\n');
  for (std::size_t n = 0; n < rows.size(); ++n) {
    const TraceRow& r = rows[n];
    std::string line = fmt::format(
        "{:.6f},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.7g},{:.7g},{:.7g},{:.7g},{:.7g},{},{:.3f}",
        r.t_s, r.device_m.x, r.device_m.y, r.device_m.z, r.proxy_m.x, r.proxy_m.y, r.proxy_m.z, r.force_N.x,
        r.force_N.y, r.force_N.z, r.rigid_N, r.soft_N, r.contacts, r.tick_us);
    for (const TraceColumn& column : more) {
      line += ',';
      if (!std::isnan(column.values[n])) line += fmt::format("{:.7g}", column.values[n]);
    }
    out.write(line + '\n');
  }
  out.keep();
}

}  // namespace hybrid
