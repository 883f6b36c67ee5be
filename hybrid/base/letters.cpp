// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/base/letters.h"

#include <algorithm>
#include <array>
#include <cstdint>

namespace hybrid {
namespace {

bool starts_letter(char c) {
  return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;
}

// A code point, and its length in bytes; 0: the bytes are not UTF-8.
struct Character {
  std::uint32_t code = 0;
  std::size_t length = 0;
};

Character decoded(std::string_view text, std::size_t at) {
  constexpr std::array<std::uint32_t, 5> kLeast{0, 0, 0x80, 0x800, 0x10000};  // [length] code point
  if (at >= text.size()) return {};
  const auto byte = [&](std::size_t i) -> std::uint32_t { return static_cast<unsigned char>(text[at + i]); };
  const std::uint32_t lead = byte(0);
  const std::size_t length = lead < 0x80   ? 1
                             : lead < 0xC0 ? 0
                             : lead < 0xE0 ? 2
                             : lead < 0xF0 ? 3
                             : lead < 0xF8 ? 4
                                           : 0;
  if (length == 0 || length > text.size() - at) return {};
  std::uint32_t code = length == 1 ? lead : lead & (0x7FU >> length);
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0U) != 0x80U) return {};
    code = code << 6U | (byte(i) & 0x3FU);
  }
  const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
  if (code < kLeast[length] || code > 0x10FFFF || surrogate) return {};
  return {code, length};
}

}  // namespace

std::size_t character_at(std::string_view text, std::size_t at) {
  return decoded(text, at).length;
}

std::size_t printable_at(std::string_view text, std::size_t at) {
  const auto [code, length] = decoded(text, at);
  const bool control = code < 0x20 || (code >= 0x7F && code <= 0x9F);
  const bool separates_or_turns = (code >= 0x2028 && code <= 0x202E) || (code >= 0x2066 && code <= 0x2069);
  return control || separates_or_turns ? 0 : length;
}

bool is_printable(std::string_view text) {
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = printable_at(text, at);
    if (length == 0) return false;
    at += length;
  }
  return true;
}

std::string_view whole_characters(std::string_view text, std::size_t most) {
  std::size_t end = 0;
  while (end < text.size()) {
    const std::size_t next = end + std::max<std::size_t>(character_at(text, end), 1);
    if (next > most) break;
    end = next;
  }
  return text.substr(0, end);
}

std::size_t letters(std::string_view text) {
  return static_cast<std::size_t>(std::ranges::count_if(text, starts_letter));
}

std::string shortened(const std::string& text, std::size_t most) {
  if (letters(text) <= most || most < 4) return text;
  std::string out;
  std::size_t count = 0;
  for (const char c : text) {
    if (starts_letter(c) && ++count > most - 1) break;
    out += c;
  }
  return out + "…";
}

}  // namespace hybrid
