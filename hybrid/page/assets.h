// SPDX-License-Identifier: GPL-3.0-or-later
// Style and script of a report page.
#pragma once

#include <string_view>

namespace hybrid {

std::string_view page_style();
// Script that sorts a table by a click on its head and copies the table as CSV. The page works without it.
std::string_view page_script();

}  // namespace hybrid
