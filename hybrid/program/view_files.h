// SPDX-License-Identifier: GPL-3.0-or-later
// The files that the user of a window asks for: pictures and recordings. What cannot be written is said in
// the window, and the session goes on.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "hybrid/program/commands.h"
#include "hybrid/session/player.h"
#include "hybrid/window/window.h"

namespace hybrid {

// Content of a text file. Throws std::runtime_error: not readable.
[[nodiscard]] std::string text_of(const std::filesystem::path& file);

class ViewFiles {
 public:
  // `scene_text`: of the scene's file, as it was loaded. Throws std::runtime_error if --record cannot be
  // written.
  ViewFiles(const ViewCommand& command, const std::string& scene_text);

  // `hold`: stops the session, so that its state can be read; false if it does not answer.
  void save_what_was_asked(Window& window, const WindowInput& input, const Player& player,
                           const std::function<bool()>& hold);
  // The recording of --record. False if it was asked for and not written; the reason is on standard error.
  [[nodiscard]] bool save_at_end(const Player& player) const;

  // The last thing that was done, for a few seconds; empty: nothing.
  [[nodiscard]] std::string message() const;

 private:
  template <class Save>
  void attempt(const std::string& what, std::filesystem::path file, const char* ending, const Save& save);
  [[nodiscard]] std::filesystem::path free_name(const char* ending) const;
  void say(std::string words);

  const ViewCommand& command_;
  const std::string& scene_text_;
  std::string message_;
  std::chrono::steady_clock::time_point said_{};
};

}  // namespace hybrid
