// SPDX-License-Identifier: GPL-3.0-or-later
// Files that the user of a window drops onto it or chooses: a scene is opened in place of the old one, which
// goes on until the new one is ready, and after an error.
#pragma once

#include <filesystem>
#include <future>
#include <memory>
#include <string>
#include <utility>

#include "hybrid/program/view/view_command.h"
#include "hybrid/program/view/viewed_scene.h"

namespace hybrid {

// A scene that is ready to be played on a simulated device, and the command that names it.
struct OpenedScene {
  ViewCommand command;
  std::unique_ptr<ViewedScene> viewed;
};

class SceneOpener {
 public:
  // `command`: of the window. The options that name the files of one scene do not apply to another one.
  explicit SceneOpener(const ViewCommand& command) : command_(command) {}
  SceneOpener(const SceneOpener&) = delete;
  SceneOpener& operator=(const SceneOpener&) = delete;
  SceneOpener(SceneOpener&&) = delete;
  SceneOpener& operator=(SceneOpener&&) = delete;
  ~SceneOpener() = default;  // the future waits

  // Loads a scene on a thread of its own. A file that is asked for meanwhile is refused.
  void ask(const std::filesystem::path& file);
  // Call once a frame. Returns the scene once, when it is ready.
  [[nodiscard]] std::unique_ptr<OpenedScene> poll();
  [[nodiscard]] bool loading() const { return next_.valid(); }
  // Why a file was not opened, once; empty: there is no error.
  [[nodiscard]] std::string take_error() { return std::exchange(error_, {}); }

 private:
  ViewCommand command_;
  std::string error_;
  std::future<std::unique_ptr<OpenedScene>> next_;
};

// The kinds of file that a user may drop.
enum class DroppedKind : std::uint8_t { scene, mesh, volume, other };
[[nodiscard]] DroppedKind kind_of_file(const std::filesystem::path& file);
// Why a file of the last two kinds is not opened, and what to do with it.
[[nodiscard]] std::string why_not_opened(const std::filesystem::path& file);

}  // namespace hybrid
