// SPDX-License-Identifier: GPL-3.0-or-later
// Tables in plain text: every line of a fitted table is as wide as its columns, counted in characters.
#include "hybrid/base/table.h"

#include <gtest/gtest.h>

namespace hybrid {
namespace {

struct Row {
  std::string name;
  int count = 0;
};

Table<Row> two_columns(std::size_t width) {
  return Table<Row>({{{"name"}, width, Side::left, [](const Row& row) { return row.name; }},
                     {{"number", "of them"}, width, Side::right, [](const Row& row) {
                        return std::to_string(row.count);
                      }}});
}

TEST(Table, PadsToTheSideOfEachColumn) {
  const Table<Row> table = two_columns(7);
  EXPECT_EQ(table.head(), "name     number\n        of them\n");
  EXPECT_EQ(table.line({"ball", 12}), "ball         12\n");
  EXPECT_EQ(table.line({"ball", 12}, " note"), "ball         12 note\n");
}

TEST(Table, CountsLettersNotBytes) {
  const Table<Row> table = two_columns(7);
  EXPECT_EQ(letters(table.line({"Ångström", 1})), letters(table.line({"Angstrom", 1})));
}

TEST(Table, FitsColumnsToTheirWidestCell) {
  const std::vector<Row> rows{{"a", 1}, {"much longer than the title", 123456789}};
  const std::string text = two_columns(0).text(rows);
  EXPECT_EQ(text,
            "name                          number\n"
            "                             of them\n"
            "a                                  1\n"
            "much longer than the title 123456789\n");
}

TEST(Table, AWiderCellKeepsItsText) {
  EXPECT_EQ(two_columns(3).line({"longer", 7}), "longer   7\n");
}

}  // namespace
}  // namespace hybrid
