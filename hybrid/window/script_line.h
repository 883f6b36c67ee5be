// SPDX-License-Identifier: GPL-3.0-or-later
// One line of a script (view_script.h): reads its command and arguments. Uses no graphics library.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "hybrid/window/view_state.h"

namespace hybrid {

// The words of a line, without a comment at its end.
[[nodiscard]] std::vector<std::string> words_of_script_line(std::string_view line);

// Reads the line's action. `place`: file and line, for refusals. Throws std::runtime_error.
struct ReadScriptLine {
  double t_s = 0.0;
  ViewAction action;
};
[[nodiscard]] ReadScriptLine read_script_line(std::vector<std::string> words, const std::string& place,
                                              const DrawnScene& scene);

}  // namespace hybrid
