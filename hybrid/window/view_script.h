// SPDX-License-Identifier: GPL-3.0-or-later
// A script plays the user of a window: keys, clicks, edits and views at given times, for tutorials and tests.
// Knows no graphics library.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "hybrid/window/view_state.h"

namespace hybrid {

class Window;

// A line has a time (s, since the window opened; with --frames 1/30 s a frame), a command and its arguments,
// apart by spaces; names with spaces stand in quotes, # begins a comment. Times do not fall. The commands are
// in README.md.
class ViewScript {
 public:
  ViewScript() = default;
  // Throws std::runtime_error with file and line: unknown command, object or key, wrong number, falling time.
  ViewScript(const std::string& text, const std::string& file, const DrawnScene& scene);

  // Plays all actions up to this time that were not played yet.
  void play(double t_s, Window& window);
  // The same without a window.
  [[nodiscard]] std::vector<ViewAction> due(double t_s);
  [[nodiscard]] std::size_t size() const { return actions_.size(); }

 private:
  struct Timed {
    double t_s = 0.0;
    ViewAction action;
  };
  std::vector<Timed> actions_;
  std::size_t next_ = 0;
};

}  // namespace hybrid
