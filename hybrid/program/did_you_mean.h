// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace hybrid {

// What a wrong command or option was probably meant to be, as a line of its own; empty where nothing is near.
std::string did_you_mean(const CLI::App& app, const std::vector<std::string>& arguments);

// Why a name is refused that is none of `known`: the nearest of them, if one is near, and all; empty if it is
// one.
std::string unknown_name(const std::string& name, const std::vector<std::string>& known);

}  // namespace hybrid
