// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/compose/label_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <span>
#include <utility>

#include "hybrid/compose/label_names.h"

namespace hybrid {
namespace {

constexpr char kBlanks = ' ';                       // as a separator: any number of spaces and tabs
constexpr std::string_view kSeparators = ",;\t:=";  // other than blanks; the last two after a number alone
constexpr std::size_t kLeastColour = 3;             // red, green, blue
constexpr std::size_t kMostColour = 4;              // and opacity

struct RowField {
  std::string text;
  bool quoted = false;
};

bool is_blank(char c) {
  return c == ' ' || c == '\t';
}

std::string_view without_blanks(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

bool is_decimal(std::string_view word) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  const bool digits =
      !word.empty() && (std::isdigit(static_cast<unsigned char>(word.back())) != 0 || word.back() == '.');
  return error == std::errc() && end == word.data() + word.size() && digits;
}

// "#ff0080", with opacity or without.
bool is_hex_colour(std::string_view word) {
  return (word.size() == 7 || word.size() == 9) && word.front() == '#' &&
         std::all_of(word.begin() + 1, word.end(), [](unsigned char c) { return std::isxdigit(c) != 0; });
}

// Removes the first field and the separator after it from `row`, and returns the field. Within quotes, ""
// stands for one quote.
RowField take_field(std::string_view& row, char separator) {
  const auto ends = [&](char c) { return separator == kBlanks ? is_blank(c) : c == separator; };
  while (!row.empty() && is_blank(row.front()) && (separator != '\t' || row.front() == ' '))
    row.remove_prefix(1);
  RowField field;
  if (row.starts_with('"')) {
    field.quoted = true;
    row.remove_prefix(1);
    while (!row.empty()) {
      const char c = row.front();
      row.remove_prefix(1);
      if (c != '"') {
        field.text += c;
      } else if (row.starts_with('"')) {
        field.text += c;
        row.remove_prefix(1);
      } else {
        break;
      }
    }
  }
  std::size_t end = 0;
  while (end < row.size() && !ends(row[end])) ++end;
  field.text += without_blanks(row.substr(0, end));
  row.remove_prefix(std::min(end + 1, row.size()));
  if (separator == kBlanks) row = without_blanks(row);
  return field;
}

std::vector<RowField> fields_of(std::string_view row, char separator) {
  std::vector<RowField> fields;
  // A separator at the end of the row is followed by an empty field.
  const bool open = !row.empty() && row.back() == separator && separator != kBlanks;
  while (!row.empty()) fields.push_back(take_field(row, separator));
  if (open) fields.emplace_back();
  return fields;
}

std::string column_word(std::string_view text) {
  std::string word;
  for (const char c : text) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0)
      word += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return word;
}

// The separator after the first field of a row.
char separator_after_first(std::string_view row) {
  const std::size_t closing = row.starts_with('"') ? row.find('"', 1) : std::string_view::npos;
  row.remove_prefix(closing != std::string_view::npos ? closing + 1
                                                      : std::min(row.find_first_of(",;:=\t "), row.size()));
  row.remove_prefix(std::min(row.find_first_not_of(' '), row.size()));
  return !row.empty() && kSeparators.find(row.front()) != std::string_view::npos ? row.front() : kBlanks;
}

// A line like "sep=;", which spreadsheets write first.
bool states_separator(std::string_view row) {
  return row.size() == 5 && column_word(row) == "sep" && row[3] == '=';
}

// The separator and the columns of a table that has a heading.
struct RowColumns {
  char separator = ',';
  std::size_t label = 0, name = 1;
};

// Reads a row as a heading; empty if it is none. Words are listed in order of preference, because "label" is
// the number in one table and the name in another.
std::optional<RowColumns> heading_of(std::string_view row) {
  static constexpr std::array<std::string_view, 14> kNumbers{
      "index", "idx",    "id", "labelid", "labelvalue", "labelindex", "labelnumber",
      "value", "number", "no", "key",     "intensity",  "label",      "roi"};
  static constexpr std::array<std::string_view, 13> kNames{
      "name",   "labelname", "segmentname", "structurename", "roiname", "regionname", "structure",
      "region", "anatomy",   "organ",       "tissue",        "segment", "label"};
  RowColumns columns{.separator = kBlanks};
  for (const char candidate : {'\t', ';', ','}) {
    if (row.find(candidate) == std::string_view::npos) continue;
    columns.separator = candidate;
    break;
  }
  std::vector<std::string> words;
  for (const RowField& field : fields_of(row, columns.separator)) words.push_back(column_word(field.text));
  const auto column = [&](std::span<const std::string_view> known, std::size_t taken) {
    for (const std::string_view word : known) {
      const auto at = static_cast<std::size_t>(std::find(words.begin(), words.end(), word) - words.begin());
      if (at < words.size() && at != taken) return at;
    }
    return words.size();
  };
  columns.label = column(kNumbers, words.size());
  columns.name = column(kNames, columns.label);
  if (columns.label == words.size() && columns.name == words.size()) return std::nullopt;
  if (columns.label == words.size()) columns.label = columns.name == 0 ? 1 : 0;
  if (columns.name == words.size()) columns.name = columns.label == 0 ? 1 : 0;
  return columns;
}

// A row that was read. A colour after the name has not been removed yet.
struct OpenRow {
  LabelRow row;
  std::vector<std::string> words;  // words of the name, if the name was not in quotes
  [[nodiscard]] std::size_t numbers_at_end() const {
    const auto last = std::find_if_not(words.rbegin(), words.rend(), is_decimal);
    return static_cast<std::size_t>(last - words.rbegin());
  }
};

class RowReader {
 public:
  RowReader(std::string_view text, const std::string& file) : file_(file) {
    for (std::size_t line = 1; !text.empty(); ++line) {
      const std::string_view row = text.substr(0, text.find('\n'));
      text.remove_prefix(std::min(row.size() + 1, text.size()));
      const std::string_view content = without_blanks(row);
      if (content.empty() || (rows_.empty() && !columns_ && states_separator(content))) continue;
      const bool in_columns = columns_ && columns_->separator != kBlanks;
      if (content.front() == '#' && !(in_columns && begins_with_colour(row))) continue;
      if (in_columns) {
        read_columns(row, line);
      } else {
        read(content, line);
      }
    }
  }

  std::vector<LabelRow> rows() && {
    // All rows of a table have colours of the same length. So the shortest run of numbers is the colour, and
    // longer runs begin with numbers of the name.
    std::size_t colour = kMostColour;
    for (const OpenRow& open : rows_) {
      if (open.numbers_at_end() >= kLeastColour) colour = std::min(colour, open.numbers_at_end());
    }
    std::vector<LabelRow> rows;
    for (OpenRow& open : rows_) {
      if (!open.words.empty() && is_hex_colour(open.words.back())) open.words.pop_back();
      if (open.numbers_at_end() >= kLeastColour) open.words.resize(open.words.size() - colour);
      for (const std::string& word : open.words) open.row.name += (open.row.name.empty() ? "" : " ") + word;
      open.row.name = without_blanks(open.row.name);
      if (open.row.name.empty() && open.row.label != 0) refuse(open.row.line, "the row has no name");
      if (open.row.name == "n/a") open.row.name.clear();
      rows.push_back(std::move(open.row));
    }
    return rows;
  }

 private:
  [[noreturn]] void refuse(std::size_t line, const std::string& what) const {
    throw ComposeError(fmt::format(
        "{}:{}: {}; a row has a whole number and a name, as in 5,liver; correct it", file_, line, what));
  }

  [[nodiscard]] bool begins_with_colour(std::string_view row) const {
    return is_hex_colour(take_field(row, columns_->separator).text);
  }

  void read(std::string_view content, std::size_t line) {
    const char separator = separator_after_first(content);
    const std::vector<RowField> fields = fields_of(content, separator);
    const auto label = whole_number_of(fields[0].text);
    if (!label) {
      if (!rows_.empty() || columns_ || !(columns_ = heading_of(content)))
        refuse(line, fmt::format("\"{}\" is neither a whole number nor a heading known here (index, name)",
                                 fields[0].text));
      return;
    }
    if (separator == kBlanks) {
      read_words(*label, fields, line);
    } else {
      read_fields(*label, fields, line);
    }
  }

  void read_columns(std::string_view content, std::size_t line) {
    const std::vector<RowField> fields = fields_of(content, columns_->separator);
    const auto label =
        columns_->label < fields.size() ? whole_number_of(fields[columns_->label].text) : std::nullopt;
    if (!label) refuse(line, "the row has no whole number in the column of the labels");
    OpenRow open{.row = {.line = line, .label = *label, .name = {}}, .words = {}};
    if (columns_->name < fields.size()) open.row.name = fields[columns_->name].text;
    rows_.push_back(std::move(open));
  }

  // Reads a number followed by fields. The first field that is no colour is the name.
  void read_fields(long long label, const std::vector<RowField>& fields, std::size_t line) {
    OpenRow open{.row = {.line = line, .label = label, .name = {}}, .words = {}};
    std::size_t numbers = 0;
    for (std::size_t f = 1; f < fields.size(); ++f) {
      const RowField& field = fields[f];
      const bool number = !field.quoted && is_decimal(field.text);
      numbers += number ? 1 : 0;
      if (number || field.text.empty() || (!field.quoted && is_hex_colour(field.text))) continue;
      if (field.quoted) {
        open.row.name = field.text;
      } else {
        for (const RowField& word : fields_of(field.text, kBlanks)) open.words.push_back(word.text);
      }
      rows_.push_back(std::move(open));
      return;
    }
    // The only other field is a number: it is the name.
    if (numbers == 1 && fields.size() == 2) open.row.name = fields[1].text;
    rows_.push_back(std::move(open));
  }

  // Reads a number followed by words. The name is in quotes, or before the colour, or after it.
  void read_words(long long label, const std::vector<RowField>& fields, std::size_t line) {
    OpenRow open{.row = {.line = line, .label = label, .name = {}}, .words = {}};
    const auto quoted =
        std::find_if(fields.begin() + 1, fields.end(), [](const RowField& f) { return f.quoted; });
    if (quoted != fields.end()) {
      open.row.name = quoted->text;
    } else {
      auto first = std::find_if_not(fields.begin() + 1, fields.end(), [](const RowField& f) {
        return is_decimal(f.text) || is_hex_colour(f.text);
      });
      if (first - (fields.begin() + 1) < static_cast<std::ptrdiff_t>(kLeastColour) &&
          !(fields.size() > 1 && is_hex_colour(fields[1].text)))
        first = fields.begin() + 1;
      for (; first != fields.end(); ++first) open.words.push_back(first->text);
    }
    rows_.push_back(std::move(open));
  }

  std::string file_;
  std::optional<RowColumns> columns_;
  std::vector<OpenRow> rows_;
};

}  // namespace

std::optional<long long> whole_number_of(std::string_view text) {
  const std::size_t point = text.find('.');
  if (point != std::string_view::npos && point > 0 &&
      text.find_first_not_of('0', point + 1) == std::string_view::npos)
    text = text.substr(0, point);
  long long number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

std::vector<LabelRow> label_rows(std::string_view text, const std::string& file) {
  return RowReader(text, file).rows();
}

}  // namespace hybrid
