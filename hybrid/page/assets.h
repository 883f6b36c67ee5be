// SPDX-License-Identifier: GPL-3.0-or-later
// Style and script of a report page.
#pragma once

#include <string_view>

namespace hybrid {

std::string_view page_style();
// Sorts a table by a click on its head, and copies it as CSV. Without it the page lacks nothing else.
std::string_view page_script();

}  // namespace hybrid
