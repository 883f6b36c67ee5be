// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace hybrid {

// A line that suggests the command or option that was probably meant; empty if no name is similar.
std::string did_you_mean(const CLI::App& app, const std::vector<std::string>& arguments);

// A message that refuses a name which is not in `known`. It suggests the most similar known name, if one is
// similar, and lists all known names. Empty if `known` has the name.
std::string unknown_name(const std::string& name, const std::vector<std::string>& known);

}  // namespace hybrid
