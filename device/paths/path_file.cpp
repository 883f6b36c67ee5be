// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/paths/path_file.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string_view>

#include "device/paths/line_reader.h"

namespace device {
namespace {

struct Column {
  std::size_t index = 0;
  double in_si = 1.0;
};

// The columns t, x, y, z of a header.
std::array<Column, 4> find_columns(const LineReader& reader, std::string_view header, double unit_m,
                                   std::vector<std::string>& notes) {
  constexpr std::array<char, 4> kInitials{'t', 'x', 'y', 'z'};
  const std::vector<std::string_view> names = comma_fields(header);
  std::array<Column, 4> columns;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const auto begins = [&](std::string_view name) {
      return !name.empty() && std::tolower(static_cast<unsigned char>(name.front())) == kInitials[i];
    };
    const auto found = std::find_if(names.begin(), names.end(), begins);
    if (found == names.end()) {
      reader.refuse(std::string("the header has no column whose name begins with '") + kInitials[i] +
                    "'; it must name t, x, y and z, with their units, as in t_s,x_mm,y_mm,z_mm");
    }
    const std::optional<double> unit = unit_of(*found, i == 0 ? kTimeUnits : kLengthUnits);
    columns[i] = {static_cast<std::size_t>(found - names.begin()), unit.value_or(i == 0 ? 1.0 : unit_m)};
    // A name without '_' states no unit. An unknown suffix such as in 'x_inch' is reported instead of
    // ignored.
    if (!unit && found->find('_') != std::string_view::npos) {
      notes.push_back("column '" + std::string(*found) + "' names no known unit: taken as " +
                      short_number(columns[i].in_si) + (i == 0 ? " s" : " m"));
    }
  }
  return columns;
}

}  // namespace

Trajectory read_trajectory(const CsvPath& csv) {
  if (!(csv.unit_m > 0.0) || !std::isfinite(csv.unit_m)) {
    throw PathError(csv.file.string() + ": its unit must be a positive number of meters");
  }
  LineReader reader(csv.file);
  Trajectory result;
  std::string_view line;
  if (!reader.next(line)) {
    throw PathError(csv.file.string() + ": is empty; it must have a header (t_s,x_m,y_m,z_m) and rows");
  }
  const std::array<Column, 4> columns = find_columns(reader, line, csv.unit_m, result.notes);
  std::size_t last_column = 0;
  for (const Column& column : columns) last_column = std::max(last_column, column.index);

  double first_t_s = 0.0;
  std::size_t repeated = 0, first_repeated_line = 0;
  while (reader.next(line)) {
    const std::vector<std::string_view> row = comma_fields(line);
    if (row.size() <= last_column) {
      reader.refuse("only " + std::to_string(row.size()) + " columns where " +
                    std::to_string(last_column + 1) + " are needed; complete or leave out the line");
    }
    std::array<double, 4> value{};
    for (std::size_t i = 0; i < value.size(); ++i) {
      value[i] = reader.number(row[columns[i].index]) * columns[i].in_si;
    }
    if (result.t_s.empty()) first_t_s = value[0];
    const double t_s = value[0] - first_t_s;
    const glm::dvec3 position = glm::dvec3(value[1], value[2], value[3]) + csv.offset_m;
    const bool finite = std::isfinite(t_s) && std::isfinite(position.x) && std::isfinite(position.y) &&
                        std::isfinite(position.z);
    if (!finite) reader.refuse("a value too large to be used; correct or leave out the line");
    if (!result.t_s.empty() && t_s < result.t_s.back()) {
      reader.refuse("time runs backwards, by " + short_number(result.t_s.back() - t_s) +
                    " s; sort the rows by time, or cut the file where a new recording begins");
    }
    if (!result.t_s.empty() && t_s == result.t_s.back()) {
      if (repeated++ == 0) first_repeated_line = reader.line();
      result.position_m.back() = position;
      continue;
    }
    result.t_s.push_back(t_s);
    result.position_m.push_back(position);
  }
  if (result.t_s.empty()) throw PathError(csv.file.string() + ": has a header but no rows");

  if (first_t_s != 0.0) {
    result.notes.push_back(csv.file.filename().string() + ": its first time, " + short_number(first_t_s) +
                           " s, is taken as 0");
  }
  if (repeated > 0) {
    result.notes.push_back(csv.file.filename().string() + ": " + std::to_string(repeated) +
                           (repeated == 1 ? " sample repeats" : " samples repeat") +
                           " the time of the one before and stand in its place (the first in line " +
                           std::to_string(first_repeated_line) + ")");
  }
  if (const std::string words =
          gaps_in_words(csv.file.filename().string(), result.t_s, find_gaps(result.t_s));
      !words.empty()) {
    result.notes.push_back(words);
  }
  return result;
}

}  // namespace device
