// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/paths/line_reader.h"

#include <zlib.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>

namespace device {
namespace {

constexpr std::size_t kMaxLines = 10'000'000;  // 2.8 hours at 1 kHz; 320 MB in memory
constexpr double kGapFactor = 10.0;            // a step longer than this many median steps is a gap

gzFile zlib(void* stream) {
  return static_cast<gzFile>(stream);
}

}  // namespace

LineReader::LineReader(const std::filesystem::path& file) : file_(file) {
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
  while (next_raw(line)) {
    if (line_ == 1 && line.substr(0, 3) == "\xEF\xBB\xBF") line.remove_prefix(3);  // byte order mark
    line = trimmed(line);
    if (line.empty()) continue;
    if (line.front() != '#') return true;
    comment_ = trimmed(line.substr(1));
  }
  return false;
}

void LineReader::refuse(const std::string& what) const {
  throw PathError(file_.string() + ":" + std::to_string(line_) + ": " + what);
}

bool LineReader::next_raw(std::string_view& line) {
  const bool got = gzgets(zlib(stream_), buffer_.data(), static_cast<int>(buffer_.size())) != nullptr;
  // Checked also if a line was read, because a truncated file ends with a partial line.
  int error = Z_OK;
  gzerror(zlib(stream_), &error);
  if (error != Z_OK) {
    ++line_;
    refuse("the file cannot be read further; it is cut short or damaged: fetch or write it again");
  }
  if (!got) return false;
  ++line_;
  line = buffer_.data();
  if (line_ > kMaxLines) {
    refuse("more than " + std::to_string(kMaxLines) + " lines; leave samples out, or cut the file in parts");
  }
  if (line.size() + 1 == buffer_.size() && line.back() != '\n') {
    refuse("a line longer than " + std::to_string(kMaxLineLength) + " characters; is this a CSV file?");
  }
  return true;
}

double LineReader::number(std::string_view field) const {
  std::string_view digits = field;
  if (digits.size() > 1 && digits[0] == '+' && digits[1] != '-')
    digits.remove_prefix(1);  // from_chars accepts no '+'
  double value = 0.0;
  const char* const end = digits.data() + digits.size();
  const auto [stopped, error] = std::from_chars(digits.data(), end, value);
  if (error != std::errc() || stopped != end || digits.empty() || !std::isfinite(value)) {
    refuse(std::string(1, '\'').append(field.substr(0, 40)) +
           "' is not a finite number; correct or leave out the line");
  }
  return value;
}

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\n\"";
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

std::vector<std::string_view> comma_fields(std::string_view line) {
  std::vector<std::string_view> result;
  while (true) {
    const std::size_t comma = line.find(',');
    result.push_back(trimmed(line.substr(0, comma)));
    if (comma == std::string_view::npos) return result;
    line.remove_prefix(comma + 1);
  }
}

std::string short_number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.4g", value);
  return text.data();
}

std::optional<double> unit_of(std::string_view name, std::span<const Unit> units) {
  for (const Unit& unit : units) {
    if (name.ends_with(unit.suffix)) return unit.in_si;
  }
  return std::nullopt;
}

Gaps find_gaps(const std::vector<double>& t_s) {
  Gaps gaps;
  if (t_s.size() < 3) return gaps;
  std::vector<double> steps(t_s.size() - 1);
  for (std::size_t i = 0; i < steps.size(); ++i) steps[i] = t_s[i + 1] - t_s[i];
  std::vector<double> sorted = steps;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  gaps.limit_s = kGapFactor * *middle;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (steps[i] <= gaps.limit_s) continue;
    gaps.before.push_back(i);
    if (steps[i] > gaps.longest_s) {
      gaps.longest_s = steps[i];
      gaps.longest_before = i;
    }
  }
  return gaps;
}

std::string gaps_in_words(const std::string& file, const std::vector<double>& t_s, const Gaps& gaps) {
  if (gaps.before.empty()) return "";
  return file + ": " + std::to_string(gaps.before.size()) + (gaps.before.size() == 1 ? " gap" : " gaps") +
         " of more than " + short_number(gaps.limit_s) + " s (10 usual steps), the longest " +
         short_number(gaps.longest_s) + " s at t = " + short_number(t_s[gaps.longest_before]) +
         " s; the hand moves straight across";
}

}  // namespace device
