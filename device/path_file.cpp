// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/path_file.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <optional>
#include <string_view>

namespace device {
namespace {

constexpr std::size_t kMaxLines = 10'000'000;  // 2.8 hours at 1 kHz; 320 MB in memory
constexpr std::size_t kMaxLineLength = 16'384;
constexpr double kGapFactor = 10.0;  // a step longer than this many median steps is a gap

std::string short_number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.4g", value);
  return text.data();
}

// Lines of a text file, through zlib, which reads plain files as they are.
class LineReader {
 public:
  explicit LineReader(const std::filesystem::path& file) : file_(file) {
    std::error_code ignored;
    if (!std::filesystem::exists(file, ignored)) {
      throw PathError(file.string() + ": no such file; check the path's file name");
    }
    if (!std::filesystem::is_regular_file(file, ignored)) {
      throw PathError(file.string() + ": is not a file; name a CSV file (.csv or .csv.gz)");
    }
    stream_ = gzopen(file.c_str(), "rb");
    if (stream_ == nullptr) {
      throw PathError(file.string() + ": cannot be opened; check that you may read it");
    }
  }
  LineReader(const LineReader&) = delete;
  LineReader& operator=(const LineReader&) = delete;
  LineReader(LineReader&&) = delete;
  LineReader& operator=(LineReader&&) = delete;
  ~LineReader() { gzclose_r(stream_); }

  // The next line that says something, without blanks at its ends; false at the end of the file.
  bool next(std::string_view& line) {
    while (next_raw(line)) {
      if (line_ == 1 && line.substr(0, 3) == "\xEF\xBB\xBF") line.remove_prefix(3);  // byte order mark
      line = trimmed(line);
      if (!line.empty() && line.front() != '#') return true;
    }
    return false;
  }

  [[noreturn]] void refuse(const std::string& what) const {
    throw PathError(file_.string() + ":" + std::to_string(line_) + ": " + what);
  }

  [[nodiscard]] std::size_t line() const { return line_; }

  static std::string_view trimmed(std::string_view text) {
    constexpr std::string_view kBlank = " \t\r\n\"";
    const std::size_t first = text.find_first_not_of(kBlank);
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
  }

 private:
  bool next_raw(std::string_view& line) {
    const bool got = gzgets(stream_, buffer_.data(), static_cast<int>(buffer_.size())) != nullptr;
    // Asked also when there is a line: the last one of a file that is cut short is a part of a line.
    int error = Z_OK;
    gzerror(stream_, &error);
    if (error != Z_OK) {
      ++line_;
      refuse("the file cannot be read further; it is cut short or damaged: fetch or write it again");
    }
    if (!got) return false;
    ++line_;
    line = buffer_.data();
    if (line_ > kMaxLines) {
      refuse("more than " + std::to_string(kMaxLines) +
             " lines; leave samples out, or cut the file in parts");
    }
    if (line.size() + 1 == buffer_.size() && line.back() != '\n') {
      refuse("a line longer than " + std::to_string(kMaxLineLength) + " characters; is this a CSV file?");
    }
    return true;
  }

  std::filesystem::path file_;
  gzFile stream_ = nullptr;
  std::size_t line_ = 0;
  std::array<char, kMaxLineLength + 2> buffer_{};
};

std::vector<std::string_view> fields(std::string_view line) {
  std::vector<std::string_view> result;
  while (true) {
    const std::size_t comma = line.find(',');
    result.push_back(LineReader::trimmed(line.substr(0, comma)));
    if (comma == std::string_view::npos) return result;
    line.remove_prefix(comma + 1);
  }
}

struct Unit {
  std::string_view suffix;
  double in_si;
};
constexpr std::array<Unit, 4> kTimeUnits{{{"_s", 1.0}, {"_ms", 1e-3}, {"_us", 1e-6}, {"_ns", 1e-9}}};
constexpr std::array<Unit, 4> kLengthUnits{{{"_m", 1.0}, {"_cm", 1e-2}, {"_mm", 1e-3}, {"_um", 1e-6}}};

struct Column {
  std::size_t index = 0;
  double in_si = 1.0;
};

std::optional<double> unit_of(std::string_view name, const std::array<Unit, 4>& units) {
  for (const Unit& unit : units) {
    if (name.ends_with(unit.suffix)) return unit.in_si;
  }
  return std::nullopt;
}

// The four columns t, x, y, z of a header.
std::array<Column, 4> find_columns(const LineReader& reader, std::string_view header, double unit_m,
                                   std::vector<std::string>& notes) {
  constexpr std::array<char, 4> kInitials{'t', 'x', 'y', 'z'};
  const std::vector<std::string_view> names = fields(header);
  std::array<Column, 4> columns;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const auto begins = [&](std::string_view name) {
      return !name.empty() && std::tolower(static_cast<unsigned char>(name.front())) == kInitials[i];
    };
    const auto found = std::find_if(names.begin(), names.end(), begins);
    if (found == names.end()) {
      reader.refuse(std::string("the header has no column whose name begins with '") + kInitials[i] +
                    "'; it must name t, x, y and z, with their units, as in t_s,x_mm,y_mm,z_mm");
    }
    const std::optional<double> told = unit_of(*found, i == 0 ? kTimeUnits : kLengthUnits);
    columns[i] = {static_cast<std::size_t>(found - names.begin()), told.value_or(i == 0 ? 1.0 : unit_m)};
    // 'x' alone says nothing of a unit; 'x_inch' says one that would be passed over in silence.
    if (!told && found->find('_') != std::string_view::npos) {
      notes.push_back("column '" + std::string(*found) + "' names no known unit: taken as " +
                      short_number(columns[i].in_si) + (i == 0 ? " s" : " m"));
    }
  }
  return columns;
}

double number(const LineReader& reader, std::string_view field) {
  std::string_view digits = field;
  if (digits.size() > 1 && digits[0] == '+' && digits[1] != '-')
    digits.remove_prefix(1);  // from_chars knows no '+'
  double value = 0.0;
  const char* const end = digits.data() + digits.size();
  const auto [stopped, error] = std::from_chars(digits.data(), end, value);
  if (error != std::errc() || stopped != end || digits.empty() || !std::isfinite(value)) {
    reader.refuse(std::string(1, '\'').append(field.substr(0, 40)) +
                  "' is not a finite number; correct or leave out the line");
  }
  return value;
}

void note_gaps(const CsvPath& csv, Trajectory& trajectory) {
  const std::vector<double>& t = trajectory.t_s;
  if (t.size() < 3) return;
  std::vector<double> steps(t.size() - 1);
  for (std::size_t i = 0; i < steps.size(); ++i) steps[i] = t[i + 1] - t[i];
  std::vector<double> sorted = steps;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  const double limit = kGapFactor * *middle;
  const auto gaps = std::count_if(steps.begin(), steps.end(), [&](double step) { return step > limit; });
  if (gaps == 0) return;
  const auto longest = std::max_element(steps.begin(), steps.end());
  trajectory.notes.push_back(
      csv.file.filename().string() + ": " + std::to_string(gaps) + (gaps == 1 ? " gap" : " gaps") +
      " of more than " + short_number(limit) + " s (10 usual steps), the longest " + short_number(*longest) +
      " s at t = " + short_number(t[static_cast<std::size_t>(longest - steps.begin())]) +
      " s; the hand moves straight across");
}

}  // namespace

Trajectory read_trajectory(const CsvPath& csv) {
  if (!(csv.unit_m > 0.0) || !std::isfinite(csv.unit_m)) {
    throw PathError(csv.file.string() + ": its unit must be a positive number of meters");
  }
  LineReader reader(csv.file);
  Trajectory result;
  std::string_view line;
  if (!reader.next(line)) {
    throw PathError(csv.file.string() + ": is empty; it must have a header (t_s,x_m,y_m,z_m) and rows");
  }
  const std::array<Column, 4> columns = find_columns(reader, line, csv.unit_m, result.notes);
  std::size_t last_column = 0;
  for (const Column& column : columns) last_column = std::max(last_column, column.index);

  double first_t_s = 0.0;
  std::size_t repeated = 0, first_repeated_line = 0;
  while (reader.next(line)) {
    const std::vector<std::string_view> row = fields(line);
    if (row.size() <= last_column) {
      reader.refuse("only " + std::to_string(row.size()) + " columns where " +
                    std::to_string(last_column + 1) + " are needed; complete or leave out the line");
    }
    std::array<double, 4> value{};
    for (std::size_t i = 0; i < value.size(); ++i) {
      value[i] = number(reader, row[columns[i].index]) * columns[i].in_si;
    }
    if (result.t_s.empty()) first_t_s = value[0];
    const double t_s = value[0] - first_t_s;
    const glm::dvec3 position = glm::dvec3(value[1], value[2], value[3]) + csv.offset_m;
    const bool finite = std::isfinite(t_s) && std::isfinite(position.x) && std::isfinite(position.y) &&
                        std::isfinite(position.z);
    if (!finite) reader.refuse("a value too large to be used; correct or leave out the line");
    if (!result.t_s.empty() && t_s < result.t_s.back()) {
      reader.refuse("time runs backwards, by " + short_number(result.t_s.back() - t_s) +
                    " s; sort the rows by time, or cut the file where a new recording begins");
    }
    if (!result.t_s.empty() && t_s == result.t_s.back()) {
      if (repeated++ == 0) first_repeated_line = reader.line();
      result.position_m.back() = position;
      continue;
    }
    result.t_s.push_back(t_s);
    result.position_m.push_back(position);
  }
  if (result.t_s.empty()) throw PathError(csv.file.string() + ": has a header but no rows");

  if (first_t_s != 0.0) {
    result.notes.push_back(csv.file.filename().string() + ": its first time, " + short_number(first_t_s) +
                           " s, is taken as 0");
  }
  if (repeated > 0) {
    result.notes.push_back(csv.file.filename().string() + ": " + std::to_string(repeated) +
                           (repeated == 1 ? " sample repeats" : " samples repeat") +
                           " the time of the one before and stand in its place (the first in line " +
                           std::to_string(first_repeated_line) + ")");
  }
  note_gaps(csv, result);
  return result;
}

}  // namespace device
