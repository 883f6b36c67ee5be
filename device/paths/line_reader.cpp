// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/paths/line_reader.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <system_error>
#include <utility>

namespace device {
namespace {

using namespace std::string_view_literals;

constexpr std::size_t kMaxLines = 10'000'000;  // 2.8 hours at 1 kHz; 320 MB in memory
constexpr std::size_t kMaxLineLength = 16'384;
constexpr std::size_t kChunk = 65'536;  // bytes read at once

constexpr std::string_view kUtf8Mark = "\xEF\xBB\xBF"sv;
constexpr std::string_view kUtf16Remedy = "save it as UTF-8 (iconv -f UTF-16 -t UTF-8)"sv;

// Formats other than plain UTF-8 text, by their first bytes.
struct OtherFormat {
  std::string_view begins, is;
};
constexpr std::array<OtherFormat, 7> kOtherFormats{
    {{"\xFF\xFE\0\0"sv, "is UTF-32 text; save it as UTF-8 (iconv -f UTF-32 -t UTF-8)"sv},
     {"\0\0\xFE\xFF"sv, "is UTF-32 text; save it as UTF-8 (iconv -f UTF-32 -t UTF-8)"sv},
     {"\xFF\xFE"sv, "is UTF-16 text; save it as UTF-8 (iconv -f UTF-16 -t UTF-8)"sv},
     {"\xFE\xFF"sv, "is UTF-16 text; save it as UTF-8 (iconv -f UTF-16 -t UTF-8)"sv},
     {"PK\x03\x04"sv, "is a ZIP file or a workbook (.xlsx, .ods); export its table as CSV"sv},
     {"\xD0\xCF\x11\xE0"sv, "is a workbook (.xls); export its table as CSV"sv},
     {"version https://git-lfs"sv, "is a Git LFS pointer; fetch the file itself (git lfs pull)"sv}}};

// The length in bytes of the character of UTF-8 (RFC 3629) at `at`. 0 if the bytes are no such character, or
// one that may not be printed as it is. Those are control characters, separators of lines, and marks that
// turn the direction of text.
std::size_t printable_at(std::string_view text, std::size_t at) {
  constexpr std::array<std::uint32_t, 5> kLeast{0, 0, 0x80, 0x800, 0x10000};  // [length] code point
  const auto byte = [&](std::size_t i) -> std::uint32_t { return static_cast<unsigned char>(text[at + i]); };
  const std::uint32_t lead = byte(0);
  const std::size_t length = lead < 0x80   ? 1
                             : lead < 0xC0 ? 0
                             : lead < 0xE0 ? 2
                             : lead < 0xF0 ? 3
                             : lead < 0xF8 ? 4
                                           : 0;
  if (length == 0 || length > text.size() - at) return 0;
  std::uint32_t code = length == 1 ? lead : lead & (0x7FU >> length);
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0U) != 0x80U) return 0;
    code = code << 6U | (byte(i) & 0x3FU);
  }
  const auto within = [code](std::uint32_t first, std::uint32_t last) {
    return first <= code && code <= last;
  };
  const bool none = code < kLeast[length] || code > 0x10FFFF || within(0xD800, 0xDFFF);
  const bool hidden = code < 0x20 || within(0x7F, 0x9F) || within(0x2028, 0x202E) || within(0x2066, 0x2069);
  return none || hidden ? 0 : length;
}

gzFile zlib(void* stream) {
  return static_cast<gzFile>(stream);
}

}  // namespace

LineReader::LineReader(const std::filesystem::path& file) : file_(file), buffer_(kChunk) {
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

LineReader::~LineReader() {
  gzclose_r(zlib(stream_));
}

bool LineReader::next(std::string_view& line) {
  while (next_raw()) {
    const std::string_view content = without_blanks(text_);
    if (content.empty()) continue;
    if (content.front() != '#' && content.front() != '%') {
      line = text_;
      return true;
    }
    comment_ = without_blanks(content.substr(1));
  }
  return false;
}

void LineReader::refuse(const std::string& what, std::size_t line) const {
  throw PathError(file_.string() + ":" + std::to_string(line == 0 ? line_ : line) + ": " + what);
}

bool LineReader::next_raw() {
  text_.clear();
  for (bool ended = false; !ended;) {
    if (at_ == filled_ && !fill()) {
      if (text_.empty()) return false;
      break;  // the last line ends with the file
    }
    const char* const begin = buffer_.data() + at_;
    const char* const end = buffer_.data() + filled_;
    if (std::exchange(after_cr_, false) && *begin == '\n') {
      ++at_;
      continue;
    }
    const char* const stop = std::find_if(begin, end, [](char c) { return c == '\n' || c == '\r'; });
    text_.append(begin, stop);
    at_ += static_cast<std::size_t>(stop - begin);
    if (stop != end) {
      ended = true;
      after_cr_ = *stop == '\r';
      ++at_;
    }
    if (text_.size() > kMaxLineLength) {
      ++line_;
      refuse("a line longer than " + std::to_string(kMaxLineLength) + " characters; is this a CSV file?");
    }
  }
  ++line_;
  if (line_ > kMaxLines) {
    refuse("more than " + std::to_string(kMaxLines) + " lines; leave samples out, or cut the file in parts");
  }
  if (text_.find('\0') != std::string::npos) {
    refuse("a byte of value 0, so this is no plain text; if it is UTF-16, " + std::string(kUtf16Remedy));
  }
  return true;
}

// Reads more bytes into the buffer; false at the end of the file.
bool LineReader::fill() {
  at_ = 0;
  const int got = gzread(zlib(stream_), buffer_.data(), static_cast<unsigned>(buffer_.size()));
  filled_ = got > 0 ? static_cast<std::size_t>(got) : 0;
  // Errors are checked even if bytes were read, because a truncated file still yields some bytes.
  int error = Z_OK;
  gzerror(zlib(stream_), &error);
  if (error != Z_OK) {
    ++line_;
    refuse("the file cannot be read further; it is cut short or damaged: fetch or write it again");
  }
  if (!std::exchange(began_, true)) {
    refuse_other_formats();
    if (std::string_view(buffer_.data(), filled_).starts_with(kUtf8Mark)) at_ = kUtf8Mark.size();
  }
  return at_ < filled_;
}

void LineReader::refuse_other_formats() const {
  for (const OtherFormat& format : kOtherFormats) {
    if (!std::string_view(buffer_.data(), filled_).starts_with(format.begins)) continue;
    throw PathError(file_.string() + ": " + std::string(format.is));
  }
}

std::string_view without_blanks(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\n";
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

std::string lower_ascii(std::string_view text) {
  std::string out(text);
  for (char& c : out) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return out;
}

std::string shown(std::string_view text) {
  constexpr std::size_t kMost = 40;  // characters
  std::string out = "'";
  for (std::size_t at = 0, count = 0; at < text.size() && count < kMost; ++count) {
    const std::size_t length = printable_at(text, at);
    out += length > 0 ? text.substr(at, length) : "?"sv;
    at += std::max<std::size_t>(length, 1);
  }
  return out + "'";
}

std::string short_number(double value) {
  std::array<char, 32> text{};
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, 4).ptr;
  return {text.data(), end};
}

}  // namespace device
