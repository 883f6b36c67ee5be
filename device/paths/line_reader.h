// SPDX-License-Identifier: GPL-3.0-or-later
// Reads a text file line by line, plain or gzip. Every error names file and line.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "device/paths/path.h"

namespace device {

// Reads lines that end with LF, CR LF or CR alone. Throws PathError if the file is missing, unreadable,
// truncated or not text, or if its byte-order mark is that of UTF-16 or UTF-32.
class LineReader {
 public:
  explicit LineReader(const std::filesystem::path& file);
  LineReader(const LineReader&) = delete;
  LineReader& operator=(const LineReader&) = delete;
  LineReader(LineReader&&) = delete;
  LineReader& operator=(LineReader&&) = delete;
  ~LineReader();

  // Sets `line` to the next line that is neither blank nor a comment, without its end; false at the end of
  // the file. `line` is valid until the next call. A comment begins with '#' or '%'. The last comment is
  // kept.
  bool next(std::string_view& line);
  // Throws PathError "file:line: what"; by default at the current line.
  [[noreturn]] void refuse(const std::string& what, std::size_t line = 0) const;
  [[nodiscard]] std::size_t line() const { return line_; }
  // The last comment before the current line, without its mark; empty if there was none.
  [[nodiscard]] const std::string& comment() const { return comment_; }

 private:
  bool next_raw();
  bool fill();
  void refuse_other_formats() const;

  std::filesystem::path file_;
  void* stream_ = nullptr;  // gzFile
  std::size_t line_ = 0;
  std::string text_, comment_;
  std::vector<char> buffer_;
  std::size_t at_ = 0, filled_ = 0;  // in buffer_
  bool after_cr_ = false;            // a line feed that follows belongs to the end of the last line
  bool began_ = false;
};

// The text without blanks, tabs and line ends at both ends.
std::string_view without_blanks(std::string_view text);
// Turns ASCII letters, and only these, into lower case: the same in every locale.
std::string lower_ascii(std::string_view text);
// At most 40 characters in quotation marks, for a message. Control characters, and bytes that are not UTF-8,
// are shown as '?'.
std::string shown(std::string_view text);
// The number with four significant digits, for messages. The decimal mark is a point in every locale.
std::string short_number(double value);

}  // namespace device
