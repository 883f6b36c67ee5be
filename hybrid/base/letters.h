// SPDX-License-Identifier: GPL-3.0-or-later
// Operations on text that count characters, not bytes.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace hybrid {

// Number of characters of a UTF-8 text.
std::size_t letters(std::string_view text);

// The text cut to at most `most` characters, with an ellipsis; unchanged if `most` is below 4.
std::string shortened(const std::string& text, std::size_t most);

}  // namespace hybrid
