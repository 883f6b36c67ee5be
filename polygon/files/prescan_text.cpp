// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <charconv>
#include <cstring>
#include <limits>
#include <system_error>

#include "polygon/files/mesh_file.h"
#include "polygon/files/prescan.h"

namespace polygon {
namespace {

constexpr std::size_t kFirstBytes = 512;  // enough to tell binary files

bool is_space(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\v' || c == '\f';
}

}  // namespace

void refuse_mesh(const std::filesystem::path& file, const std::string& what_and_remedy) {
  throw MeshError(file.string() + ": " + what_and_remedy);
}

std::string_view without_byte_order_mark(std::string_view text) {
  constexpr std::string_view kMark = "\xEF\xBB\xBF";
  if (text.starts_with(kMark)) text.remove_prefix(kMark.size());
  return text;
}

std::string_view plain_text(const std::filesystem::path& file, std::span<char> bytes) {
  const std::string_view text(bytes.data(), bytes.size());
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF"))
    refuse_mesh(file, "is UTF-16 text, which is not read; save it as UTF-8 or plain text");
  if (text.substr(0, kFirstBytes).find('\0') != std::string_view::npos)
    refuse_mesh(file,
                "holds bytes of value 0, so it is no text; is it another kind of file under this name?");
  mend_line_ends(bytes);
  return without_byte_order_mark(text);
}

void mend_line_ends(std::span<char> text) {
  char* const end = text.data() + text.size();
  for (char* at = text.data(); at != end; ++at) {
    at = static_cast<char*>(std::memchr(at, '\r', static_cast<std::size_t>(end - at)));
    if (at == nullptr) return;
    if (at + 1 == end || at[1] != '\n') *at = '\n';
  }
}

void write_ply_dialect(PrescannedFile& prescanned, const std::string& faces) {
  constexpr std::size_t kHeader = 256;  // bytes of the header, at most
  std::string& dialect = prescanned.dialect;
  prescanned.openmesh_extension = "ply";
  dialect.reserve(kHeader + prescanned.coordinates.size() + faces.size());
  dialect = "ply\nformat binary_little_endian 1.0\nelement vertex ";
  append_integer(dialect, static_cast<std::int64_t>(prescanned.coordinates.size()));
  dialect += "\nproperty uchar nothing\nelement face ";
  append_integer(dialect, static_cast<std::int64_t>(prescanned.faces));
  dialect += "\nproperty list int int vertex_indices\nend_header\n";
  dialect.append(prescanned.coordinates.size(), '\0');
  dialect += faces;
}

std::string_view TextCursor::next_line() {
  const std::size_t end = rest_.find('\n');
  std::string_view line = rest_.substr(0, end);
  rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
  ++line_;
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

std::string_view TextCursor::next_word() {
  std::size_t begin = 0;
  for (; begin < rest_.size() && is_space(rest_[begin]); ++begin) line_ += rest_[begin] == '\n' ? 1 : 0;
  std::size_t end = begin;
  while (end < rest_.size() && !is_space(rest_[end])) ++end;
  const std::string_view word = rest_.substr(begin, end - begin);
  rest_.remove_prefix(end);
  return word;
}

std::string_view take_word(std::string_view& line) {
  std::size_t begin = 0;
  while (begin < line.size() && is_space(line[begin])) ++begin;
  std::size_t end = begin;
  while (end < line.size() && !is_space(line[end])) ++end;
  const std::string_view word = line.substr(begin, end - begin);
  line.remove_prefix(end);
  return word;
}

bool parse_number(std::string_view word, double& value) {
  if (word.starts_with('+')) word.remove_prefix(1);
  const char* end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(word.data(), end, value);
  if (stop != end || error == std::errc::invalid_argument) return false;
  if (error == std::errc::result_out_of_range) {
    const bool tiny = word.find("e-") != std::string_view::npos || word.find("E-") != std::string_view::npos;
    value = tiny ? 0.0 : std::numeric_limits<double>::infinity();
  }
  return true;
}

bool parse_integer(std::string_view word, std::int64_t& value) {
  if (word.starts_with('+')) word.remove_prefix(1);
  const char* end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(word.data(), end, value);
  return error == std::errc() && stop == end;
}

void append_integer(std::string& text, std::int64_t value) {
  std::array<char, 24> digits{};
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  (void)error;  // 24 digits are always enough
  text.append(digits.data(), end);
}

}  // namespace polygon
