// SPDX-License-Identifier: GPL-3.0-or-later
// The files that a window's user asks for: pictures, recordings, and edited values in the scene's file. If a
// file cannot be written, the window shows the error, and the session goes on.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <string>

#include "hybrid/program/commands.h"
#include "hybrid/program/view/viewed_scene.h"
#include "hybrid/window/window.h"

namespace hybrid {

// Writes the last frame as a PNG file. Throws std::runtime_error: no frame yet, file not writable.
void save_frame(Window& window, const std::filesystem::path& png);

class ViewFiles {
 public:
  // Throws std::runtime_error if --record cannot be written.
  explicit ViewFiles(const ViewCommand& command);

  // `hold`: stops the session, so that its state can be read. Returns false if the session does not answer.
  void save_what_was_asked(Window& window, const WindowInput& input, const ViewedScene& viewed,
                           const Snapshot& snapshot, const std::function<bool()>& hold);
  // Writes the recording of --record. Returns false if it was asked for and could not be written; the reason
  // is on standard error.
  [[nodiscard]] bool save_at_end(const ViewedScene& viewed) const;

  void say(std::string words);
  // Says why something failed, for longer than a result.
  void say_error(std::string words);
  // The result of the last action, for some seconds; then empty.
  [[nodiscard]] std::string message() const;

 private:
  template <class Save>
  void attempt(const std::string& what, std::filesystem::path file, const char* ending, const Save& save);
  [[nodiscard]] std::filesystem::path free_name(const char* ending) const;
  void save_scene(const ViewedScene& viewed, const Snapshot& snapshot);

  const ViewCommand& command_;
  std::string message_;
  std::chrono::steady_clock::time_point shown_until_{};
};

}  // namespace hybrid
