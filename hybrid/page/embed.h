// SPDX-License-Identifier: GPL-3.0-or-later
// Figures and data in the form in which an HTML file contains them.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace hybrid {

std::string base64(std::string_view bytes);

// Converts a file of to_svg() for a page with several figures, and returns its <svg> element. Ids and
// references to them get the prefix. Width, height and title are left out. `label` names the figure for
// readers who do not see it.
std::string inline_svg(std::string_view svg, std::string_view prefix, std::string_view label);

// JSON for a <script> element, without the character '<'.
std::string json_for_script(const nlohmann::ordered_json& data);

}  // namespace hybrid
