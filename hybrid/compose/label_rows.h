// SPDX-License-Identifier: GPL-3.0-or-later
// Reads the rows of a text that names labels: CSV and TSV with a heading or without, and the tables of
// ITK-SNAP, 3D Slicer, FreeSurfer and BIDS. A colour beside a name is skipped.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace hybrid {

struct LabelRow {
  std::size_t line = 0;  // counted from 1
  long long label = 0;
  std::string name;  // empty where the table says "n/a"
};

// Reads all rows. `text`: lines that end with "\n". Lines that begin with '#' are comments. Throws
// ComposeError that names the line.
[[nodiscard]] std::vector<LabelRow> label_rows(std::string_view text, const std::string& file);

// The whole number in `text`. Accepts "5" and also "5.0", because some programs store all numbers as
// decimals.
[[nodiscard]] std::optional<long long> whole_number_of(std::string_view text);

}  // namespace hybrid
