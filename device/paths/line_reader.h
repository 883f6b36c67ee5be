// SPDX-License-Identifier: GPL-3.0-or-later
// Reads columns of numbers from a text file, plain or gzip. Every error names file and line.
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

// The lines of a text file. Throws PathError: no such file, unreadable, truncated, not text.
class LineReader {
 public:
  explicit LineReader(const std::filesystem::path& file);
  LineReader(const LineReader&) = delete;
  LineReader& operator=(const LineReader&) = delete;
  LineReader(LineReader&&) = delete;
  LineReader& operator=(LineReader&&) = delete;
  ~LineReader();

  // The next line that is not empty, trimmed; false at the end of the file. A line that begins with '#' is a
  // comment; the last one is kept.
  bool next(std::string_view& line);
  // Throws PathError "file:line: what".
  [[noreturn]] void refuse(const std::string& what) const;
  [[nodiscard]] std::size_t line() const { return line_; }
  // The last comment before the current line, without its '#'; empty if there was none.
  [[nodiscard]] const std::string& comment() const { return comment_; }
  // A finite number; otherwise refuse().
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

// Without blanks and quotation marks at both ends.
std::string_view trimmed(std::string_view text);
// The fields between commas.
std::vector<std::string_view> comma_fields(std::string_view line);
// Four digits, for messages.
std::string short_number(double value);

struct Unit {
  std::string_view suffix;
  double in_si;
};
inline constexpr std::array<Unit, 4> kTimeUnits{{{"_s", 1.0}, {"_ms", 1e-3}, {"_us", 1e-6}, {"_ns", 1e-9}}};
inline constexpr std::array<Unit, 4> kLengthUnits{{{"_m", 1.0}, {"_cm", 1e-2}, {"_mm", 1e-3}, {"_um", 1e-6}}};
// The unit given by the suffix of a column's name; empty if it has no known suffix.
std::optional<double> unit_of(std::string_view name, std::span<const Unit> units);

// Time steps longer than ten median steps, each by the index of the sample before it.
struct Gaps {
  std::vector<std::size_t> before;
  double limit_s = 0.0, longest_s = 0.0;
  std::size_t longest_before = 0;
};
Gaps find_gaps(const std::vector<double>& t_s);
// For a note; empty if there are no gaps.
std::string gaps_in_words(const std::string& file, const std::vector<double>& t_s, const Gaps& gaps);

}  // namespace device
