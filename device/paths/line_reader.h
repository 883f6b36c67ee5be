// SPDX-License-Identifier: GPL-3.0-or-later
// Reading numbers in columns from a text file, plain or compressed by gzip, with the place of every refusal.
#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "device/paths/path.h"

namespace device {

// Lines of a text file. Throws PathError: no such file, not readable, cut short, no text.
class LineReader {
 public:
  explicit LineReader(const std::filesystem::path& file);
  LineReader(const LineReader&) = delete;
  LineReader& operator=(const LineReader&) = delete;
  LineReader(LineReader&&) = delete;
  LineReader& operator=(LineReader&&) = delete;
  ~LineReader();

  // The next line that says something, without blanks at its ends; false at the end of the file. What begins
  // with '#' is a comment, and kept as the last one.
  bool next(std::string_view& line);
  // "file:line: what"
  [[noreturn]] void refuse(const std::string& what) const;
  [[nodiscard]] std::size_t line() const { return line_; }
  // The last comment before the line that was read, without its '#'; empty when there was none.
  [[nodiscard]] const std::string& comment() const { return comment_; }
  // A finite number, or refused.
  [[nodiscard]] double number(std::string_view field) const;

 private:
  bool next_raw(std::string_view& line);

  static constexpr std::size_t kMaxLineLength = 16'384;
  std::filesystem::path file_;
  void* stream_ = nullptr;  // gzFile
  std::size_t line_ = 0;
  std::string comment_;
  std::array<char, kMaxLineLength + 2> buffer_{};
};

// Without blanks and quotation marks at its ends.
std::string_view trimmed(std::string_view text);
// Between commas.
std::vector<std::string_view> comma_fields(std::string_view line);
// Four digits, for a message.
std::string short_number(double value);

struct Unit {
  std::string_view suffix;
  double in_si;
};
inline constexpr std::array<Unit, 4> kTimeUnits{{{"_s", 1.0}, {"_ms", 1e-3}, {"_us", 1e-6}, {"_ns", 1e-9}}};
inline constexpr std::array<Unit, 4> kLengthUnits{{{"_m", 1.0}, {"_cm", 1e-2}, {"_mm", 1e-3}, {"_um", 1e-6}}};
// Of the suffix of a column's name; none where it has none of these.
std::optional<double> unit_of(std::string_view name, std::span<const Unit> units);

// Steps of more than ten usual (median) ones, as an index of the sample before each.
struct Gaps {
  std::vector<std::size_t> before;
  double limit_s = 0.0, longest_s = 0.0;
  std::size_t longest_before = 0;
};
Gaps find_gaps(const std::vector<double>& t_s);
// In words for a note; empty when there are none.
std::string gaps_in_words(const std::string& file, const std::vector<double>& t_s, const Gaps& gaps);

}  // namespace device
