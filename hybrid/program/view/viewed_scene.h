// SPDX-License-Identifier: GPL-3.0-or-later
// A scene with all that is needed to show and play it in a window. While it is played, SceneReload loads the
// scene's file again, and SceneChanger builds a scene that the window's user changed.
#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "hybrid/program/view/view_command.h"
#include "hybrid/session/player.h"

namespace hybrid {

struct ViewedScene {
  std::string text;                    // of this scene
  std::string file_text;               // of the scene's file when it was loaded
  std::string began_with;              // of the scene with which the session began
  std::vector<std::string> changes{};  // changes since the scene was loaded, in words
  Scene scene;
  BuiltScene built;
  DrawnScene drawn;
  std::unique_ptr<Player> player;  // null until the session begins
};

// Positions of the hand along the whole path (m).
[[nodiscard]] std::vector<glm::dvec3> places_along(const device::Path& path);
// Content of a text file. Throws std::runtime_error if it is not readable.
[[nodiscard]] std::string text_of(const std::filesystem::path& file);

// Reads the file. Throws SceneError, std::runtime_error.
[[nodiscard]] std::unique_ptr<ViewedScene> read_viewed_scene(const ViewCommand& command);
// Reads and builds the scene, with a player on a simulated device. Throws SceneError, std::exception: also if
// the scene has a real device.
[[nodiscard]] std::unique_ptr<ViewedScene> load_for_window(const ViewCommand& command);
// Builds the scene that was read. Throws SceneError.
void build_viewed_scene(const ViewCommand& command, ViewedScene& viewed, const Progress& progress);

// Builds scenes that differ from the one that is played, on a thread of its own.
class SceneChanger {
 public:
  explicit SceneChanger(const ViewCommand& command) : command_(command) {}
  SceneChanger(const SceneChanger&) = delete;
  SceneChanger& operator=(const SceneChanger&) = delete;
  SceneChanger(SceneChanger&&) = delete;
  SceneChanger& operator=(SceneChanger&&) = delete;
  ~SceneChanger() { cancel(); }

  // Changes that are asked for while a scene is built are made together.
  void ask(const SceneChange& change) { asked_.push_back(change); }
  // The same: adds a rigid object with this mesh (text_with_mesh()).
  void add_mesh(const std::filesystem::path& mesh) { meshes_.push_back(mesh); }
  // Call once a frame. Returns the changed scene, without a player, when it is built, otherwise null. Throws
  // std::exception, once, if the scene cannot be changed that way.
  [[nodiscard]] std::unique_ptr<ViewedScene> poll(const ViewedScene& played);
  // Waits for the scene; null if no change was asked for.
  [[nodiscard]] std::unique_ptr<ViewedScene> wait(const ViewedScene& played);
  // The step of building, in words; empty: nothing is built.
  [[nodiscard]] std::string building() const;
  // Forgets the changes that were asked for. Waits until nothing is built.
  void cancel();

 private:
  void start(const ViewedScene& played);

  const ViewCommand& command_;
  std::vector<SceneChange> asked_;
  std::vector<std::filesystem::path> meshes_;
  std::size_t built_ = 0, meshes_built_ = 0;  // those of asked_ and meshes_ that the scene in `next_` has
  mutable std::mutex guard_;
  std::string step_;  // of building; guard_ protects it
  std::future<std::unique_ptr<ViewedScene>> next_;
};

// Compares the forces before and after a change, on a thread of its own, while the session goes on. Keeps the
// scene before the change until then.
class ChangeComparison {
 public:
  ChangeComparison() = default;
  ChangeComparison(const ChangeComparison&) = delete;
  ChangeComparison& operator=(const ChangeComparison&) = delete;
  ChangeComparison(ChangeComparison&&) = delete;
  ChangeComparison& operator=(ChangeComparison&&) = delete;
  ~ChangeComparison() { cancel(); }

  // `now`: the scene after the change. It must live until cancel(), or until the forces are known.
  void begin(std::unique_ptr<ViewedScene> before, const ViewedScene& now, std::unique_ptr<WorldState> after);
  // poll() returns the forces once, when they are known. wait() waits for them, and returns nothing if
  // nothing is compared.
  [[nodiscard]] std::optional<ComparedForces> poll();
  [[nodiscard]] std::optional<ComparedForces> wait();
  // Ends the comparison, if there is one. Call it before the scene after the change is dropped.
  void cancel();

 private:
  std::unique_ptr<ViewedScene> before_;
  std::unique_ptr<WorldState> after_;
  std::atomic<bool> stop_{false};
  std::future<std::optional<ComparedForces>> forces_;
};

// Loads the scene again when its file has changed, on a thread of its own. The old session goes on meanwhile,
// and also after an error.
class SceneReload {
 public:
  SceneReload(const ViewCommand& command, std::string loaded_text)
      : command_(command), tried_text_(std::move(loaded_text)) {}

  // Loads the scene even if its file has not changed.
  void ask() { asked_ = true; }
  // Call once a frame. Returns a scene when it is ready to be played on a simulated device, otherwise null.
  [[nodiscard]] std::unique_ptr<ViewedScene> poll();
  [[nodiscard]] bool loading() const { return next_.valid(); }
  // The error in the present file, with its line; empty if there is none.
  [[nodiscard]] const std::string& error() const { return error_; }

 private:
  [[nodiscard]] bool file_changed();
  void start();

  const ViewCommand& command_;
  std::string tried_text_, error_;  // the text that was loaded last; error of a later text
  bool asked_ = false;
  std::chrono::steady_clock::time_point looked_{};
  std::filesystem::file_time_type written_{};
  std::future<std::unique_ptr<ViewedScene>> next_;
};

// Begins and ends the comparison with the force at rest, as the window's user wishes.
class RestWish {
 public:
  // `says` tells the user why the comparison cannot begin. `between` calls its argument between two ticks. If
  // `between` does not call its argument, the next follow() tries again.
  template <class Says, class Between>
  void follow(bool wished, Player& player, Says& says, const Between& between) {
    if (wished == on_) return;
    std::string why_not;
    between([&] {
      why_not = player.compare_with_rest(wished);
      on_ = wished;
    });
    if (!why_not.empty()) says.say("Not compared with the force at rest: " + why_not + ".");
  }

 private:
  bool on_ = false;
};

}  // namespace hybrid
