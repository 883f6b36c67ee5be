// SPDX-License-Identifier: GPL-3.0-or-later
// The columns of a text file: their quantities and units, and the notation of the rows. Paths and measured
// forces share this reader.
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
  std::size_t count = 0;   // number of named columns
  std::size_t needed = 0;  // fields that a row needs: up to the last column that is read
  Separator separator = Separator::comma;
  DecimalMark mark = DecimalMark::point;
  bool has_row = false;  // `line` holds the first row
  std::vector<std::string> notes;
};

// Finds the columns. They are those of `measured.columns` if it is not empty, otherwise those of the heading,
// which may have a row of units below it. Without a heading the columns follow from a comment, or from their
// number. `line` is the first line of the file, and afterwards the first row. Refuses ambiguous columns
// (PathError).
FileColumns find_file_columns(const MeasuredFile& measured, LineReader& reader, std::string_view& line);

// Sets `fields` to the fields of a row; empty for a row of separators alone. Throws PathError for too few
// fields, or for fields beyond the named columns.
void split_row(const LineReader& reader, const FileColumns& columns, std::string_view line,
               std::vector<std::string_view>& fields);

}  // namespace device
