// SPDX-License-Identifier: GPL-3.0-or-later
// The rows of a text that names labels: CSV and TSV with a heading or without, and the tables of ITK-SNAP, 3D
// Slicer, FreeSurfer and BIDS. A colour beside a name is no part of it.
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

// `text`: lines that end with "\n". Lines that begin with '#' are comments. Throws ComposeError with the
// line.
[[nodiscard]] std::vector<LabelRow> label_rows(std::string_view text, const std::string& file);

// "5", and "5.0" as programs write it that keep all numbers alike.
[[nodiscard]] std::optional<long long> whole_number_of(std::string_view text);

}  // namespace hybrid
