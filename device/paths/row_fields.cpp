// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/paths/row_fields.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>

#include "device/paths/line_reader.h"

namespace device {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view kBlanks = " \t";
constexpr std::size_t kGroup = 3;      // digits between two grouping marks
constexpr std::size_t kLongest = 128;  // characters of a number

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

// The length in bytes of the minus at `at`, a hyphen or the minus sign of Unicode; 0: there is none.
std::size_t minus_at(std::string_view field, std::size_t at) {
  for (const std::string_view minus : {"-"sv, "\xE2\x88\x92"sv}) {
    if (field.substr(at).starts_with(minus)) return minus.size();
  }
  return 0;
}

// The length in bytes of the grouping mark at `at`; 0: there is none. `mark` is the decimal mark.
std::size_t grouping_at(std::string_view field, std::size_t at, DecimalMark mark) {
  const std::string_view other = mark == DecimalMark::point ? ","sv : "."sv;
  // The other one of point and comma, apostrophes, a blank, and in UTF-8 the no-break, narrow no-break and
  // thin spaces.
  for (const std::string_view parts :
       {other, "'"sv, " "sv, "\xE2\x80\x99"sv, "\xC2\xA0"sv, "\xE2\x80\xAF"sv, "\xE2\x80\x89"sv}) {
    if (field.substr(at).starts_with(parts)) return parts.size();
  }
  return 0;
}

// The number in the form that std::from_chars reads, in `text`. Empty: its groups are malformed, or it is too
// long.
std::string_view ungrouped(std::string_view field, DecimalMark mark, std::array<char, kLongest>& text) {
  if (field.empty() || field.size() > text.size()) return {};
  std::size_t size = 0, at = 0;
  if (const std::size_t length = minus_at(field, 0); length > 0) {
    text[size++] = '-';
    at = length;
  } else if (field.front() == '+') {
    at = 1;
  }
  if (at < field.size() && (minus_at(field, at) > 0 || field[at] == '+')) return {};
  std::string_view grouping;
  while (true) {
    std::size_t run = 0;
    for (; at < field.size() && is_digit(field[at]); ++run) text[size++] = field[at++];
    const std::size_t length = grouping_at(field, at, mark);
    if (!grouping.empty() && run != kGroup) return {};
    if (length == 0) break;
    const std::string_view found = field.substr(at, length);
    if (grouping.empty() ? run < 1 || run > kGroup : found != grouping) return {};
    grouping = found;
    at += length;
  }
  for (bool marked = false; at < field.size();) {
    const bool is_mark = !marked && field[at] == static_cast<char>(mark);
    if (!is_mark && (field[at] == ',' || field[at] == '.')) return {};
    marked = marked || is_mark;
    const std::size_t minus = minus_at(field, at);
    text[size++] = is_mark ? '.' : minus > 0 ? '-' : field[at];
    at += std::max<std::size_t>(minus, 1);
  }
  return {text.data(), size};
}

template <typename Split>
bool split_at_blanks(std::string_view line, std::vector<std::string_view>& fields, const Split& belongs) {
  for (std::size_t at = line.find_first_not_of(kBlanks); at != std::string_view::npos;) {
    std::size_t end = std::string_view::npos;
    if (line[at] == '"') {
      end = line.find('"', at + 1);
      if (end == std::string_view::npos) return false;
      fields.push_back(without_blanks(line.substr(at + 1, end - at - 1)));
      ++end;
    } else {
      end = std::min(line.find_first_of(kBlanks, at), line.size());
      if (!fields.empty() && belongs(fields.back(), line.substr(at, end - at))) {
        const char* const begin = fields.back().data();
        fields.back() = {begin, static_cast<std::size_t>(line.data() + end - begin)};
      } else {
        fields.push_back(line.substr(at, end - at));
      }
    }
    at = line.find_first_not_of(kBlanks, end);
  }
  return true;
}

// The closing mark of the quotation that begins at `at`. A doubled mark is part of the quotation.
std::size_t quotation_end(std::string_view line, std::size_t at) {
  std::size_t end = line.find('"', at + 1);
  while (end != std::string_view::npos && line.substr(end).starts_with("\"\"")) end = line.find('"', end + 2);
  return end;
}

}  // namespace

std::string_view separator_in_words(Separator separator) {
  switch (separator) {
    case Separator::comma:
      return "commas";
    case Separator::semicolon:
      return "semicolons";
    case Separator::tab:
      return "tabs";
    case Separator::blanks:
      break;
  }
  return "blanks";
}

bool split_fields(std::string_view line, Separator separator, std::vector<std::string_view>& fields) {
  fields.clear();
  const bool blanks = separator == Separator::blanks ||
                      (separator == Separator::tab && line.find('\t') == std::string_view::npos);
  if (blanks) return split_at_blanks(line, fields, [](auto, auto) { return false; });
  const char mark = static_cast<char>(separator);
  for (std::size_t at = 0;;) {
    const std::size_t first = std::min(line.find_first_not_of(' ', at), line.size());
    std::size_t from = at;
    if (first < line.size() && line[first] == '"') {
      from = quotation_end(line, first);
      if (from == std::string_view::npos) return false;
    }
    const std::size_t end = std::min(line.find(mark, from), line.size());
    std::string_view field = without_blanks(line.substr(at, end - at));
    if (field.size() > 1 && field.front() == '"' && field.back() == '"')
      field = without_blanks(field.substr(1, field.size() - 2));
    fields.push_back(field);
    if (end == line.size()) return true;
    at = end + 1;
  }
}

bool split_names(std::string_view line, Separator separator, std::vector<std::string_view>& fields) {
  if (separator != Separator::blanks) return split_fields(line, separator, fields);
  fields.clear();
  return split_at_blanks(line, fields, [](std::string_view before, std::string_view field) {
    return before.ends_with('/') || "[({</"sv.find(field.front()) != std::string_view::npos;
  });
}

Separator separator_of_numbers(std::string_view line) {
  for (const Separator separator : {Separator::semicolon, Separator::tab}) {
    if (line.find(static_cast<char>(separator)) != std::string_view::npos) return separator;
  }
  if (line.find(',') == std::string_view::npos) return Separator::blanks;
  // If every field between blanks is a number with a decimal comma, the separator is blanks.
  std::vector<std::string_view> fields;
  if (!split_fields(line, Separator::blanks, fields) || fields.size() < 2) return Separator::comma;
  const bool decimal = std::all_of(fields.begin(), fields.end(), [](std::string_view field) {
    return number_in<double>(field, DecimalMark::comma).has_value();
  });
  return decimal ? Separator::blanks : Separator::comma;
}

ShownMark shown_mark(std::string_view field) {
  if (!looks_like_number(field)) return ShownMark::none;
  const std::string_view digits = field.substr(0, field.find_first_of("eE"));
  const auto points = std::count(digits.begin(), digits.end(), '.');
  const auto commas = std::count(digits.begin(), digits.end(), ',');
  const std::size_t last = digits.find_last_of(".,");
  if (last == std::string_view::npos) return ShownMark::none;
  const bool is_point = digits[last] == '.';
  const auto of_last = is_point ? points : commas, others = is_point ? commas : points;
  if (of_last > 1) return is_point ? ShownMark::comma : ShownMark::point;  // the last mark is for groups
  const std::size_t begin = digits.find_first_of("0123456789.,");
  const std::size_t before = last - begin;
  const bool could_be_group = digits.size() - last - 1 == kGroup && field.size() == digits.size() &&
                              before >= 1 && before <= kGroup && digits[begin] != '0';
  if (others == 0 && could_be_group) return is_point ? ShownMark::unclear_point : ShownMark::unclear_comma;
  return is_point ? ShownMark::point : ShownMark::comma;
}

bool looks_like_number(std::string_view field) {
  if (number_in<double>(field, DecimalMark::point) || number_in<double>(field, DecimalMark::comma))
    return true;
  const std::string lower =
      lower_ascii(field.substr(field.starts_with('-') || field.starts_with('+') ? 1 : 0));
  return lower == "nan" || lower == "inf" || lower == "infinity";
}

template <typename Real>
std::optional<Real> number_in(std::string_view field, DecimalMark mark) {
  std::array<char, kLongest> text{};
  const std::string_view digits = ungrouped(field, mark, text);
  Real value = 0;
  const char* const end = digits.data() + digits.size();
  const auto [stopped, error] = std::from_chars(digits.data(), end, value);
  if (digits.empty() || error != std::errc() || stopped != end || !std::isfinite(value)) return std::nullopt;
  return value;
}
template std::optional<double> number_in<double>(std::string_view field, DecimalMark mark);
template std::optional<long double> number_in<long double>(std::string_view field, DecimalMark mark);

}  // namespace device
