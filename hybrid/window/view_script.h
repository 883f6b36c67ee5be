// SPDX-License-Identifier: GPL-3.0-or-later
// A script acts as the user of a window, for tutorials and tests: keys, clicks, edits and views at given
// times. Uses no graphics library.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "hybrid/window/view_state.h"

namespace hybrid {

class Window;

// A line has a time, a command and its arguments, separated by spaces. Names with spaces are in quotes, and #
// begins a comment. The time is in seconds since the window opened; with --frames each frame counts 1/30 s.
// Times never fall. README.md lists the commands.
class ViewScript {
 public:
  ViewScript() = default;
  // Throws std::runtime_error that names file and line: unknown command, object or key; wrong number; falling
  // time.
  ViewScript(const std::string& text, const std::string& file, const DrawnScene& scene);

  // Plays all actions up to this time that have not been played yet.
  void play(double t_s, Window& window);
  // Returns the actions that play() would play, without a window.
  [[nodiscard]] std::vector<ViewAction> due(double t_s);
  [[nodiscard]] std::size_t size() const { return actions_.size(); }

 private:
  struct Timed {
    double t_s = 0.0;
    ViewAction action;
  };
  std::vector<std::string> objects_;  // names of the objects of `scene`
  std::vector<Timed> actions_;
  std::size_t next_ = 0;
};

}  // namespace hybrid
