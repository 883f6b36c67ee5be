// SPDX-License-Identifier: GPL-3.0-or-later
// Figures and data in the form in which an HTML file holds them.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace hybrid {

std::string base64(std::string_view bytes);

// The <svg> element of a file of to_svg(), for a page with several: its ids and the references to them get
// the prefix, its own size and title are left out, and `label` names it for readers who do not see it.
std::string inline_svg(std::string_view svg, std::string_view prefix, std::string_view label);

// JSON that may stand in a <script> element: it has no '<'.
std::string json_for_script(const nlohmann::ordered_json& data);

}  // namespace hybrid
