// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/base/letters.h"

#include <algorithm>

namespace hybrid {
namespace {

bool starts_letter(char c) {
  return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;
}

}  // namespace

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
