// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>

namespace CLI {
class App;
}

namespace hybrid {

// The manual page hybrid(1), in the macros of man(7). Its text is that of the help of all commands.
std::string man_page(const CLI::App& app, const std::string& version);

// A script for bash. It completes commands, options, values of a known set, and names of files: of a SCENE
// only .toml, of a RECORDING only .rec. It needs nothing but bash 4.
std::string bash_completion(const CLI::App& app);

// The options --version, --man-page and --bash-completion. Each prints its text and ends the program.
void add_pages(CLI::App& app, const std::string& version);

}  // namespace hybrid
