// SPDX-License-Identifier: GPL-3.0-or-later
// Rows of text: separators, quotation marks, and numbers with decimal marks and groups.
#include "device/paths/row_fields.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <clocale>
#include <string>

#include "device/paths/line_reader.h"
#include "tests/device/paths/text_files.h"

namespace {

using device::DecimalMark;
using device::number_in;
using device::Separator;
using device::ShownMark;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using Fields = std::vector<std::string_view>;

Fields split(std::string_view line, Separator separator) {
  Fields fields;
  EXPECT_TRUE(split_fields(line, separator, fields)) << line;
  return fields;
}

TEST(RowFields, AreSplitAtTheSeparatorOutsideQuotationMarks) {
  EXPECT_THAT(split(" 1, 2 ,\t3,", Separator::comma), ElementsAre("1", "2", "3", ""));
  EXPECT_THAT(split("\"1,000.5\", \"a \"\"b\"\", c\" ,3", Separator::comma),
              ElementsAre("1,000.5", "a \"\"b\"\", c", "3"));
  EXPECT_THAT(split("1;\"2;3\";4", Separator::semicolon), ElementsAre("1", "2;3", "4"));
  EXPECT_THAT(split("\t1\t\t2", Separator::tab), ElementsAre("", "1", "", "2"));
  EXPECT_THAT(split("  1 \t 2  3 ", Separator::blanks), ElementsAre("1", "2", "3"));
  EXPECT_THAT(split("1,5\" pipe,2", Separator::comma), ElementsAre("1", "5\" pipe", "2"));
  Fields fields;
  EXPECT_FALSE(split_fields("1,\"2,3", Separator::comma, fields));
  EXPECT_FALSE(split_fields("1 \"2 3", Separator::blanks, fields));
  EXPECT_TRUE(split_names("t [s]  x [mm]", Separator::blanks, fields));
  EXPECT_THAT(fields, ElementsAre("t [s]", "x [mm]"));
  EXPECT_TRUE(split_names("t / s x / mm", Separator::blanks, fields));
  EXPECT_THAT(fields, ElementsAre("t / s", "x / mm"));
}

TEST(RowFields, NumbersAreReadWithEitherMarkAndGroupsOfThree) {
  const auto point = [](std::string_view text) { return number_in<double>(text, DecimalMark::point); };
  const auto comma = [](std::string_view text) { return number_in<double>(text, DecimalMark::comma); };
  EXPECT_EQ(point("-1.5e3"), -1500.0);
  EXPECT_EQ(point("+.5"), 0.5);
  const std::string minus = "\xE2\x88\x92";  // the minus sign of Unicode
  EXPECT_EQ(point(minus + "1.5e" + minus + "3"), -1.5e-3);
  EXPECT_EQ(comma(minus + "1,5"), -1.5);
  EXPECT_FALSE(point("-" + minus + "2"));
  EXPECT_EQ(point("10,000.25"), 10000.25);
  EXPECT_EQ(point("1'234'567"), 1234567.0);
  EXPECT_EQ(point("12 345.5"), 12345.5);
  EXPECT_EQ(point("12\xE2\x80\xAF"
                  "345.5"),
            12345.5)
      << "a narrow no-break space";
  EXPECT_EQ(comma("-1,5e3"), -1500.0);
  EXPECT_EQ(comma("10.000,25"), 10000.25);
  EXPECT_EQ(comma("1.234.567"), 1234567.0);
  for (const char* text :
       {"",        "-",   "+-2", "--2",   "1,00.5", "1,0000", ",5", "1,234,56", "1,234'567", "1.2.3",
        "1.5,000", "nan", "inf", "1e999", "0x10",   "1.5x",   "1,", "12:30",    "1 2",       "1,234 "})
    EXPECT_FALSE(point(text)) << text;
  for (const char* text : {"1.5", "1.000.00", "1,5,5", "1.234,5.6"}) EXPECT_FALSE(comma(text)) << text;
  EXPECT_EQ(number_in<long double>("1617187200010000001", DecimalMark::point), 1617187200010000001.0L);
}

TEST(RowFields, ANumberShowsItsMarkWhereItIsClear) {
  for (const char* text : {"0.5", "9.85", "1,234.5", "1,234,567", "10.0000", "0.125", "1.5e3", "1234.567"})
    EXPECT_EQ(device::shown_mark(text), ShownMark::point) << text;
  for (const char* text : {"0,5", "9,85", "1.234,5", "1.234.567", "0,125", "-0,125", "1234,567", "1,500e3"})
    EXPECT_EQ(device::shown_mark(text), ShownMark::comma) << text;
  EXPECT_EQ(device::shown_mark("10,000"), ShownMark::unclear_comma);
  EXPECT_EQ(device::shown_mark("-9.850"), ShownMark::unclear_point);
  for (const char* text : {"", "12", "-3e4", "abc", "1,2,3.4.5"})
    EXPECT_EQ(device::shown_mark(text), ShownMark::none) << text;
}

TEST(RowFields, EverySeparatorIsFoundInAPathAndInAMeasurement) {
  const std::string csv = "t_s,x_mm,y_mm,z_mm,fx_N,fy_N,fz_N\n0.0,10,20,30,0,0,0.1\n0.5,10,20,29,0,0,0.1\n";
  for (const char* separator : {",", ";", "\t", " ", "   ", " ; ", ", "}) {
    SCOPED_TRACE(separator);
    std::string text;
    for (const char c : csv) text += c == ',' ? separator : std::string(1, c);
    EXPECT_EQ(tests::path_of(text).position_m[1], 1e-3 * glm::dvec3(10, 20, 29));
    EXPECT_EQ(tests::measured_of(text).force_N[1], glm::dvec3(0, 0, 0.1));
    for (char& c : text) c = c == '.' ? ',' : c;
    if (std::string_view(separator).find(',') != std::string_view::npos) continue;
    EXPECT_EQ(tests::path_of(text).t_s[1], 0.5) << "with decimal commas";
    EXPECT_EQ(tests::measured_of(text).force_N[1], glm::dvec3(0, 0, 0.1));
  }
  // Commas may stand in the names, and the first line may state the separator.
  EXPECT_EQ(tests::path_of("t, s;x, mm;y, mm;z, mm\n0;1,5;2;3\n").position_m[0],
            1e-3 * glm::dvec3(1.5, 2, 3));
  EXPECT_EQ(tests::path_of("sep=;\nt_s;x_mm;y_mm;z_mm\n0;1,5;2;3\n").position_m[0],
            1e-3 * glm::dvec3(1.5, 2, 3));
  EXPECT_EQ(tests::path_of("t [s] x [mm] y [mm] z [mm]\n0 1,5 2 3\n").position_m[0],
            1e-3 * glm::dvec3(1.5, 2, 3));
  // A file without names, with blanks between the numbers and decimal commas.
  EXPECT_EQ(tests::measured_of("0,5 1,5 2,5 3,5 0,1 0,2 0,3\n").position_m[0],
            1e-3 * glm::dvec3(1.5, 2.5, 3.5));
}

TEST(RowFields, AUnitRowBelowTheNamesIsRead) {
  const auto plain = tests::path_of("time;x;y;z\n[ms];[cm];[cm];[cm]\n0;1;2;3\n500;1;2;4\n");
  EXPECT_DOUBLE_EQ(plain.t_s[1], 0.5);
  EXPECT_EQ(plain.position_m[1], 1e-2 * glm::dvec3(1, 2, 4));
  const auto measured = tests::measured_of("t,x,y,z,fx,fy,fz\ns,m,m,m,mN,mN,mN\n0,1,2,3,100,0,0\n");
  EXPECT_EQ(measured.position_m[0], glm::dvec3(1, 2, 3));
  EXPECT_DOUBLE_EQ(measured.force_N[0].x, 0.1);
  EXPECT_THAT(tests::path_refusal("t,x,y,z\ns,mm,mm,furlong\n0,1,2,3\n"),
              HasSubstr("'s' is not a finite number"));
}

TEST(RowFields, ARowWithMoreFieldsThanNamesIsRefused) {
  const std::string header = "t_s,x_mm,y_mm,z_mm\n0,1,2,3\n";
  EXPECT_THAT(tests::path_refusal(header + "0,5,1,5,2,5,3,5\n"),
              AllOf(HasSubstr("a file.csv:3: 8 columns where 4 are named"), HasSubstr("commas")));
  EXPECT_THAT(tests::path_refusal(header + "1,1,2,3,4\n"), HasSubstr("5 columns where 4 are named"));
  EXPECT_THAT(tests::measured_refusal("0 1 2 3 4 5 6\n1 1 2 3 4 5 6 7\n"), HasSubstr("8 columns where 7"));
  EXPECT_THAT(tests::measured_refusal("0 1 2 3 4 5 6 7 8\n", {.columns = "t_s,x_m,y_m,z_m,fx,fy,fz"}),
              HasSubstr("9 columns where 7 are named"));
  EXPECT_EQ(tests::path_of(header + "1,1,2,3,\n,,,\n").t_s.size(), 2U) << "separators alone hold nothing";
  EXPECT_THAT(tests::path_refusal(header + "1,\"2,3,4\n"), HasSubstr("not closed"));
}

TEST(RowFields, ThousandSeparatorsAndDecimalCommasAreToldApart) {
  const std::string names = "t_s,x_um,y_um,z_um\n";
  const glm::dvec3 expected = 1e-6 * glm::dvec3(10000, 20000, 9850);
  EXPECT_EQ(tests::path_of(names + "0.01,\"10,000.0\",\"20,000.0\",\"9,850.0\"\n").position_m[0], expected);
  EXPECT_EQ(tests::path_of(names + "0.01,\"10,000\",\"20,000\",\"9,850\"\n").position_m[0], expected)
      << "the time shows a decimal point";
  EXPECT_EQ(tests::path_of(names + "\"0,01\",\"10.000,0\",\"20.000\",\"9.850\"\n").position_m[0], expected);
  EXPECT_EQ(tests::path_of(names + "0.01,10'000,20'000,9'850\n").position_m[0], expected);
  EXPECT_EQ(
      tests::path_of("t_s;x_um;y_um;z_um\n0;10.000;20.000;9.850\n1;10.000,0;20.000;9.850\n").position_m[0],
      expected)
      << "a later row shows a decimal comma";
  EXPECT_EQ(tests::path_of("t_s;x_mm;y_mm;z_mm\n0;10.000;20.000;9.850\n").position_m[0],
            1e-3 * glm::dvec3(10, 20, 9.85));
  EXPECT_THAT(tests::path_refusal("t_s;x_mm;y_mm;z_mm\n0;10,000;20,000;9,850\n"),
              AllOf(HasSubstr("a file.csv:2: '10,000'"), HasSubstr("thousands")));
  EXPECT_THAT(tests::path_refusal("t_s;x_mm;y_mm;z_mm\n0,5;10;20;30\n0.75;10;20;30\n"),
              HasSubstr("decimal comma"));
  // A column of text does not affect the choice of the decimal mark.
  EXPECT_EQ(tests::path_of("note;t_s;x_mm;y_mm;z_mm\n0,5;0.5;1.5;2;3\n").position_m[0],
            1e-3 * glm::dvec3(1.5, 2, 3));
}

TEST(RowFields, NothingDependsOnTheLocale) {
  const char* german = std::setlocale(LC_ALL, "de_DE.UTF-8");
  if (german == nullptr) german = std::setlocale(LC_ALL, "fr_FR.UTF-8");
  EXPECT_EQ(tests::path_of("t_s,x_mm,y_mm,z_mm\n0.5,1.5,2,3\n").position_m[0], 1e-3 * glm::dvec3(1.5, 2, 3));
  EXPECT_EQ(tests::path_of("t_s;x_mm;y_mm;z_mm\n0,5;1,5;2;3\n").position_m[0], 1e-3 * glm::dvec3(1.5, 2, 3));
  EXPECT_EQ(device::short_number(0.5), "0.5");
  EXPECT_EQ(device::short_number(12345.678), "1.235e+04");
  std::setlocale(LC_ALL, "C");
  if (german == nullptr) GTEST_SKIP() << "skipped in part: no locale with a decimal comma is installed";
}

}  // namespace
