// SPDX-License-Identifier: GPL-3.0-or-later
// Characters of UTF-8: the bytes of a character, and the characters that may be printed.
#include "hybrid/base/letters.h"

#include <gtest/gtest.h>

#include <string>

namespace {

using hybrid::character_at;
using hybrid::is_printable;
using hybrid::printable_at;
using hybrid::whole_characters;

// The bytes of a code point by the definition of UTF-8, surrogates and larger numbers too.
std::string encoded(unsigned code) {
  const auto byte = [](unsigned value) { return std::string(1, static_cast<char>(value)); };
  const auto tail = [&](int at) {
    return byte(0x80U | ((code >> (6U * static_cast<unsigned>(at))) & 0x3FU));
  };
  if (code < 0x80U) return byte(code);
  if (code < 0x800U) return byte(0xC0U | (code >> 6U)) + tail(0);
  if (code < 0x10000U) return byte(0xE0U | (code >> 12U)) + tail(1) + tail(0);
  return byte(0xF0U | (code >> 18U)) + tail(2) + tail(1) + tail(0);
}

TEST(Letters, EveryCodePointIsOneCharacterAndOfTheseSomeAreNotPrinted) {
  for (unsigned code = 0; code < 0x110800U; ++code) {
    const std::string text = encoded(code);
    const bool is_character = code < 0xD800U || (code > 0xDFFFU && code < 0x110000U);
    ASSERT_EQ(character_at(text, 0), is_character ? text.size() : 0U) << std::hex << code;
    const bool hidden = code < 0x20U || (code >= 0x7FU && code < 0xA0U) ||
                        (code >= 0x2028U && code <= 0x202EU) || (code >= 0x2066U && code <= 0x2069U);
    ASSERT_EQ(is_printable(text), is_character && !hidden) << std::hex << code;
  }
}

TEST(Letters, BytesThatAreNoCharacterAreTold) {
  for (const std::string bytes :
       {"\xC0\x80", "\xE0\x80\x80", "\xF0\x80\x80\x80", "\x80", "\xC3", "\xE2\x82", "\xFF"})
    EXPECT_EQ(character_at(bytes, 0), 0U) << bytes;
  EXPECT_EQ(printable_at("a\xC3\xA4", 1), 2U);
  EXPECT_TRUE(is_printable(""));
  EXPECT_FALSE(is_printable("a\x1B[31m"));
}

TEST(Letters, TextIsCutBetweenCharacters) {
  EXPECT_EQ(whole_characters("Sch\xC3\xA4"
                             "del",
                             4),
            "Sch");
  EXPECT_EQ(whole_characters("Sch\xC3\xA4"
                             "del",
                             5),
            "Sch\xC3\xA4");
  EXPECT_EQ(whole_characters("liver", 9), "liver");
  EXPECT_EQ(whole_characters("\xFF\xFF", 1), "\xFF") << "no character, and passed on";
}

}  // namespace
