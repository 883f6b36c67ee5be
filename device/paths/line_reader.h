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

// The lines of a text file that end with LF, CR LF or CR alone. Throws PathError: no such file, unreadable,
// truncated, not text, not UTF-8 by its byte-order mark.
class LineReader {
 public:
  explicit LineReader(const std::filesystem::path& file);
  LineReader(const LineReader&) = delete;
  LineReader& operator=(const LineReader&) = delete;
  LineReader(LineReader&&) = delete;
  LineReader& operator=(LineReader&&) = delete;
  ~LineReader();

  // The next line that is not blank, without its end; false at the end of the file. `line` holds until the
  // next call. A line that begins with '#' or '%' is a comment; the last one is kept.
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
  bool after_cr_ = false;            // a line feed that comes next belongs to the last line
  bool began_ = false;
};

// Without blanks and tabs at both ends.
std::string_view without_blanks(std::string_view text);
// Lower case, of ASCII letters alone: the same in every locale.
std::string lower_ascii(std::string_view text);
// At most 40 characters in quotation marks, for a message. A byte outside ASCII is shown as '?'.
std::string shown(std::string_view text);
// Four digits, for messages. The decimal mark is a point in every locale.
std::string short_number(double value);

}  // namespace device
