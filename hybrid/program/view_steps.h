// SPDX-License-Identifier: GPL-3.0-or-later
// Parts that the two ways to show a session share: frames of fixed time (view_frames.cpp) and a live window
// (view_live.cpp). Both play one session, change its scene, and show its kept states.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "hybrid/program/commands.h"
#include "hybrid/program/view/model_difference.h"
#include "hybrid/program/view/open_scene.h"
#include "hybrid/program/view/viewed_scene.h"
#include "hybrid/program/view_files.h"
#include "hybrid/window/view_script.h"
#include "hybrid/window/window.h"

namespace hybrid {

// Plays frames that each cover a fixed time, so that the pictures are the same on any machine. Returns the
// exit status.
[[nodiscard]] int play_frames(const ViewCommand& command, std::unique_ptr<ViewedScene> viewed, Window& window,
                              ViewScript& script);
// How a live session ended: with another scene, which the window shows already, or with the exit status.
struct LiveEnd {
  int status = 0;
  std::unique_ptr<OpenedScene> next{};
};
// Plays the session in a window until it is closed or the user opens another scene. `began`: when the window
// opened; times of the script count from then.
[[nodiscard]] LiveEnd play_live(const ViewCommand& command, std::unique_ptr<ViewedScene> viewed,
                                Window& window, ViewScript& script,
                                std::chrono::steady_clock::time_point began);

// Converts the window's input to a request for the session.
[[nodiscard]] PlayRequest request_of(const WindowInput& input);

[[nodiscard]] SessionNotes notes_of(const Player& player, double t_s, const std::string& message,
                                    const std::optional<ChangeEffect>& effect);

// Shows the scene in which the session goes on. The previous scene is kept until the forces of both are
// compared.
[[nodiscard]] ChangeEffect show_changed(Window& window, std::unique_ptr<ViewedScene>& viewed,
                                        std::unique_ptr<ViewedScene> next, ChangeMade made,
                                        ChangeComparison& comparison);

// Says in the window why two models could not be compared.
void say_error(ModelDifference& difference, ViewFiles& files);

// The past states that the window shows, and from which the session goes on.
class PastView {
 public:
  // Fills the notes with the kept states. `now_s`: time of the session.
  static void add_notes(const Player& player, double now_s, SessionNotes& notes);
  // The kept state that is shown; empty: the present.
  [[nodiscard]] static std::optional<std::size_t> shown(const Player& player, double now_s, double back_s);
  // The picture of that state. It is filled again only if the state or the points have changed.
  const Snapshot& snapshot(const Player& player, std::size_t n, const AskedPoints* asked,
                           const std::shared_ptr<const FeltDifference>& difference);
  // Call when the kept states have changed.
  void forget() { state_ = nullptr; }
  // The window shows the present again.
  static void leave(Window& window);

 private:
  const WorldState* state_ = nullptr;  // of snapshot_
  Snapshot snapshot_;
};

}  // namespace hybrid
