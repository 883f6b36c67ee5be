// SPDX-License-Identifier: GPL-3.0-or-later
// The fields of a row of text, and the numbers in them. Nothing here depends on the locale.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace device {

// Separator::blanks is any run of blanks and tabs.
enum class Separator : char { comma = ',', semicolon = ';', tab = '\t', blanks = ' ' };

// For messages: "commas", "semicolons", "tabs" or "blanks".
std::string_view separator_in_words(Separator separator);

// Sets `fields` to those of a line, without blanks at their ends. A field that begins with a quotation mark
// ends with one; separators in between belong to it. With Separator::tab, a line without tabs is split at
// blanks. False: a quotation mark is not closed.
bool split_fields(std::string_view line, Separator separator, std::vector<std::string_view>& fields);
// Splits a line of column names as split_fields() does. A unit in brackets stays with the name before it.
bool split_names(std::string_view line, Separator separator, std::vector<std::string_view>& fields);
// The separator of a row of numbers, judged by the row alone.
Separator separator_of_numbers(std::string_view line);

enum class DecimalMark : char { point = '.', comma = ',' };

// The decimal mark that a number shows. "0.5", "10,25" and "1,234.5" are clear; "10,000" and "10.000" are
// not.
enum class ShownMark : std::uint8_t { none, point, comma, unclear_point, unclear_comma };
ShownMark shown_mark(std::string_view field);

// Could the field be a number, with either decimal mark?
bool looks_like_number(std::string_view field);

// The number in a field. It may have groups of three digits, separated by the other one of point and comma,
// an apostrophe or a blank. Empty: no number, or not finite. A long double holds nanoseconds since 1970
// exactly.
template <typename Real>
std::optional<Real> number_in(std::string_view field, DecimalMark mark);
extern template std::optional<double> number_in<double>(std::string_view field, DecimalMark mark);
extern template std::optional<long double> number_in<long double>(std::string_view field, DecimalMark mark);

}  // namespace device
