// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/program/help/program_pages.h"

#include <CLI/CLI.hpp>
#include <sstream>

namespace hybrid {

void add_pages(CLI::App& app, const std::string& version) {
  app.set_version_flag("--version", version);
  // CLI11 prints the text of this exception and ends with status 0, whatever else is on the line.
  const auto print = [](const std::string& text) { throw CLI::CallForVersion(text, 0); };
  app.add_flag_callback(
      "--man-page", [&app, version, print] { print(man_page(app, version)); },
      "Print the manual page (roff); `hybrid --man-page | man -l -` shows it");
  app.add_flag_callback(
      "--bash-completion", [&app, print] { print(bash_completion(app)); },
      "Print completions for bash; `source <(hybrid --bash-completion)` turns them on");
}

}  // namespace hybrid
