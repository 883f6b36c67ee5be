// SPDX-License-Identifier: GPL-3.0-or-later
// Operations on text that count characters, not bytes.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace hybrid {

// Length in bytes of the character that begins at byte `at`; 0: the bytes there are not UTF-8 (RFC 3629).
std::size_t character_at(std::string_view text, std::size_t at);

// The same, but also 0 for a character that must not be printed as it is. These are control characters, line
// and paragraph separators, and marks that turn the direction of the text.
std::size_t printable_at(std::string_view text, std::size_t at);
bool is_printable(std::string_view text);

// The longest beginning of the text that holds whole characters, and at most `most` bytes.
std::string_view whole_characters(std::string_view text, std::size_t most);

// Number of characters of a UTF-8 text.
std::size_t letters(std::string_view text);

// The text cut to at most `most` characters, with an ellipsis; unchanged if `most` is below 4.
std::string shortened(const std::string& text, std::size_t most);

}  // namespace hybrid
