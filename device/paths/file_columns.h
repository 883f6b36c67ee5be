// SPDX-License-Identifier: GPL-3.0-or-later
// Which column of a text file holds what, in which unit, and how its rows are written. One reader for paths
// and for measured forces.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "device/paths/line_reader.h"
#include "device/paths/row_fields.h"
#include "device/paths/trajectory_file.h"

namespace device {

enum Role : std::size_t {
  role_time,
  role_x,
  role_y,
  role_z,
  role_fx,
  role_fy,
  role_fz,
  role_strength,
  roles
};

struct FileColumn {
  std::size_t index = 0;
  double in_si = 1.0;
  bool unit_is_stated = false;
};

struct FileColumns {
  std::array<std::optional<FileColumn>, roles> role{};
  std::size_t count = 0;   // fields of a row
  std::size_t needed = 0;  // fields up to the last column that is read
  Separator separator = Separator::comma;
  DecimalMark mark = DecimalMark::point;
  bool has_row = false;  // `line` holds the first row
  std::vector<std::string> notes;
};

// Reads the heading, if there is one, and the units below it; else the columns are those of
// `measured.columns`, of a comment, or of their count. `line` is the file's first. Refuses what is not clear.
FileColumns find_file_columns(const MeasuredFile& measured, LineReader& reader, std::string_view& line);

// The fields of a row; empty for a row of separators alone. Refuses fields without a name, and too few.
void split_row(const LineReader& reader, const FileColumns& columns, std::string_view line,
               std::vector<std::string_view>& fields);

}  // namespace device
