// SPDX-License-Identifier: GPL-3.0-or-later
// The viewer's window. It reads snapshots only. It reports what the mouse asks of the tool, and does not act
// on it. The only part of the project that knows GLFW. All calls must come from one thread, the program's
// first.
//   left drag: orbit    middle drag: pan    wheel: zoom    right drag, or shift + left: the tool
//   space: pause        R: restart          F: frame       Esc: quit
#pragma once

#include <filesystem>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>

#include "hybrid/snapshot/snapshot.h"
#include "hybrid/view/camera.h"

namespace hybrid {

struct WindowOptions {
  int width = 1280, height = 960;  // (screen units; pixels on most displays)
  bool visible = true;             // false: a hidden window whose frames can be saved
  double history_s = 5.0;          // length of the force chart
};

// User input that concerns the session rather than the view.
struct WindowInput {
  std::optional<glm::dvec3> dragged_goal_m;  // goal of the tool's drag (scene frame); empty: no drag
  bool paused = false;
  bool restart = false;  // once per press of R
};

class Window {
 public:
  // Keeps a reference to the scene. Throws std::runtime_error that names the remedy: no display, no OpenGL
  // 3.3.
  explicit Window(const DrawnScene& scene, const WindowOptions& options = {});
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;
  Window(Window&&) = delete;
  Window& operator=(Window&&) = delete;
  ~Window();

  // Shows a snapshot and handles the input since the last call. Waits for the display's refresh. Returns
  // false when the user closed the window. Throws std::runtime_error when the driver fails.
  bool frame(const Snapshot& snapshot);

  // Returns the input since the last call; a restart is returned once.
  [[nodiscard]] WindowInput take_input();

  // The view; may be changed between frames.
  [[nodiscard]] Camera& camera();

  // Writes the last frame as PNG. Throws std::runtime_error: no frame yet, file not writable.
  void save_frame(const std::filesystem::path& png);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace hybrid
