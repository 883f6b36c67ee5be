// SPDX-License-Identifier: GPL-3.0-or-later
// Lines of text: line ends, byte-order marks, comments, and files that are not plain text.
#include "device/paths/line_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/device/paths/text_files.h"

namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using namespace std::string_literals;

std::vector<std::string> lines_of(const std::string& bytes) {
  device::LineReader reader(tests::write_text(bytes));
  std::vector<std::string> lines;
  for (std::string_view line; reader.next(line);)
    lines.push_back(std::to_string(reader.line()) + ":" + std::string(line));
  return lines;
}

const std::string kRows = "t_s,x_mm,y_mm,z_mm\n0,1,2,3\n1,4,5,6\n";

std::string with_ends(const std::string& end, bool last = true) {
  std::string text;
  for (const char c : kRows) text += c == '\n' ? end : std::string(1, c);
  if (!last) text.resize(text.size() - end.size());
  return text;
}

TEST(LineReader, EndsOfEveryKindAreCountedAsOne) {
  EXPECT_THAT(lines_of("a\nb\r\nc\rd"), ElementsAre("1:a", "2:b", "3:c", "4:d"));
  EXPECT_THAT(lines_of("a\r\r\nb\n\rc\r"), ElementsAre("1:a", "3:b", "5:c"));
  EXPECT_THAT(lines_of(" \n\t\n# x\n% y\n\ta\t\n"), ElementsAre("5:\ta\t"))
      << "blank lines and comments are no rows";
  for (const std::size_t before :
       {65'534U, 65'535U, 65'536U, 131'071U}) {  // near the ends of the pieces in which a file is read
    std::string text;
    while (text.size() < before)
      text += std::string(std::min<std::size_t>(99, before - text.size()), '#') + "\n";
    text.resize(before);
    EXPECT_THAT(lines_of(text + "\r\na\r\nb"), testing::SizeIs(2)) << before;
  }
  for (const std::string& end : {"\n"s, "\r\n"s, "\r"s}) {
    for (const bool last : {true, false}) {
      const auto path = tests::path_of(with_ends(end, last));
      EXPECT_THAT(path.t_s, ElementsAre(0.0, 1.0));
      EXPECT_EQ(path.position_m[1], 1e-3 * glm::dvec3(4, 5, 6));
    }
  }
}

TEST(LineReader, AByteOrderMarkOfUtf8IsNoPartOfTheText) {
  for (const std::string& text : {kRows, "# a comment\n" + kRows, "\n" + kRows, "sep=,\n" + kRows})
    EXPECT_EQ(tests::path_of("\xEF\xBB\xBF" + text).t_s.size(), 2U);
  const auto packed = tests::write_text("", "packed.csv.gz");
  gzFile file = gzopen(packed.c_str(), "wb");
  const std::string bytes = "\xEF\xBB\xBF" + kRows;
  gzwrite(file, bytes.data(), static_cast<unsigned>(bytes.size()));
  gzclose(file);
  EXPECT_EQ(device::read_trajectory({.file = packed}).t_s.size(), 2U);
}

TEST(LineReader, TextOfTheFileIsShownInMessagesAsItIsAndSafely) {
  using device::shown;
  EXPECT_EQ(shown("größe 肝"), "'größe 肝'");
  EXPECT_EQ(shown("a\x1B[31m\tb\x7F"), "'a?[31m?b?'");
  EXPECT_EQ(shown("gr\xF6\xDF"
                  "e"),
            "'gr\?\?e'")
      << "Latin-1";
  EXPECT_EQ(shown("\xC2\x9B"
                  "31m\xE2\x80"),
            "'\?\?31m\?\?'")
      << "a control character, and a cut one";
  std::string forty;
  for (int i = 0; i < 40; ++i) forty += "ü";
  EXPECT_EQ(shown(forty + "x"), "'" + forty + "'");
}

TEST(LineReader, FilesThatAreNoPlainTextAreRefusedByName) {
  std::string wide, swapped;
  for (const char c : kRows) {
    wide += std::string(1, c) + '\0';
    swapped += '\0' + std::string(1, c);
  }
  EXPECT_THAT(tests::path_refusal("\xFF\xFE" + wide), AllOf(HasSubstr("UTF-16"), HasSubstr("UTF-8")));
  EXPECT_THAT(tests::path_refusal("\xFE\xFF" + swapped), HasSubstr("UTF-16"));
  EXPECT_THAT(tests::path_refusal(wide), HasSubstr("UTF-16")) << "without a byte-order mark";
  EXPECT_THAT(tests::path_refusal("\xFF\xFE\0\0t\0\0\0"s), HasSubstr("UTF-32"));
  EXPECT_THAT(tests::measured_refusal("\xFF\xFE" + wide), HasSubstr("UTF-16"));
  EXPECT_THAT(tests::path_refusal("PK\x03\x04 and more"), HasSubstr("workbook"));
  EXPECT_THAT(tests::path_refusal("version https://git-lfs.github.com/spec/v1\noid sha256:0\n"),
              HasSubstr("Git LFS pointer"));
  EXPECT_THAT(tests::path_refusal(kRows + "2,7,8,\0\n"s), HasSubstr(":4: a byte of value 0"));
}

}  // namespace
