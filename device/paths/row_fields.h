// SPDX-License-Identifier: GPL-3.0-or-later
// The fields of a row of text, and the numbers in them. Nothing here depends on the locale.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace device {

// Blanks stand for any run of blanks and tabs.
enum class Separator : char { comma = ',', semicolon = ';', tab = '\t', blanks = ' ' };

// For messages: "commas", "semicolons", "tabs" or "blanks".
std::string_view separator_in_words(Separator separator);

// Sets the fields of a line, without blanks at their ends. A field that begins with a quotation mark ends
// with one, and separators in between belong to it. A row without a tab in a file of tabs is parted at
// blanks. False: a quotation mark is not closed.
bool split_fields(std::string_view line, Separator separator, std::vector<std::string_view>& fields);
// The same for names: a unit in brackets is not parted from the name before it.
bool split_names(std::string_view line, Separator separator, std::vector<std::string_view>& fields);
// How the numbers of a row without names are parted.
Separator separator_of_numbers(std::string_view line);

enum class DecimalMark : char { point = '.', comma = ',' };

// The decimal mark that a number shows: "0.5", "10,25" and "1,234.5" are clear, "10,000" and "10.000" are
// not.
enum class ShownMark : std::uint8_t { none, point, comma, unclear_point, unclear_comma };
ShownMark shown_mark(std::string_view field);

// Could the field be a number, with either mark?
bool looks_like_number(std::string_view field);

// The number, which may have groups of three digits (parted by the other mark, an apostrophe or a blank).
// Empty if it is none, or not finite. A long double holds nanoseconds since 1970 exactly.
template <typename Real>
std::optional<Real> number_in(std::string_view field, DecimalMark mark);
extern template std::optional<double> number_in<double>(std::string_view field, DecimalMark mark);
extern template std::optional<long double> number_in<long double>(std::string_view field, DecimalMark mark);

}  // namespace device
