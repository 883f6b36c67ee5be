// SPDX-License-Identifier: GPL-3.0-or-later
// The viewer's window. It only reads snapshots. It reports the requests of mouse, keyboard, panel and
// scripts, and the session carries them out. Only this class and glfw_library.cpp know GLFW. All calls must
// come from the program's first thread. The keys are in README.md and in window_keys.h.
#pragma once

#include <filesystem>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <vector>

#include "hybrid/reference/live_reference.h"
#include "hybrid/snapshot/snapshot.h"
#include "hybrid/view/camera.h"
#include "hybrid/window/panels.h"
#include "hybrid/window/view_state.h"

namespace hybrid {

struct WindowOptions {
  int width = 1280, height = 960;  // (screen units; pixels on most displays)
  bool visible = true;             // false: a hidden window whose frames can be saved
  bool panels = true;
  double history_s = 5.0;  // time span of the charts
};

// User input that concerns the session rather than the view.
struct WindowInput {
  // Goal of the tool while it is dragged (scene's frame); empty: no drag.
  std::optional<glm::dvec3> dragged_goal_m;
  bool paused = false;
  bool wants_presses = false;  // the frame shows Snapshot::presses
  bool wants_boxes = false;    // the frame shows SessionNotes::boxes
  bool compares_with_rest = false;
  double speed = 1.0;
  std::uint32_t restarts = 0, single_ticks = 0;  // counted since the window opened
  double back_s = 0.0;                           // as ViewState::back_s
  std::shared_ptr<const AskedPoints> asked;      // points whose displacements the next frame needs, or null
  // ---- since the last call ----
  std::vector<Edit> edits;
  std::vector<SceneChange> changes;
  std::optional<ModelComparison> comparison;       // as ViewState::comparison
  std::vector<std::filesystem::path> opened;       // files that were dropped or chosen
  std::optional<std::filesystem::path> recording;  // recording to be saved; empty path: an unused name
  bool save_scene = false, reload = false, go_on = false;
};

// A frame's pixels: rows from the top, three bytes (RGB) each.
struct FramePicture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
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

  // Shows another scene from now on. View, looks and selection stay. Keeps a reference to the scene.
  // `changed_at_s`: time of the session at which it goes on in this scene; empty: a new session begins.
  void show_scene(const DrawnScene& scene, std::optional<double> changed_at_s = {});
  [[nodiscard]] const DrawnScene& scene() const;

  // Shows a snapshot and handles the input since the last call. Waits for the display's refresh. Returns
  // false if the user closed the window. Throws std::runtime_error if the driver fails or the window is lost.
  bool frame(const Snapshot& snapshot, const SessionNotes& notes = {});

  // Adds every tick since the last frame, and every force at rest, for the charts. `at_rest`: null for none.
  // Returns how many forces at rest there were.
  std::size_t add_ticks(TickSamples& samples, ForcesAtRest* at_rest = nullptr);
  // Does an action of a script in the next frame.
  void act(const ViewAction& action);
  // Returns the input since the last call.
  [[nodiscard]] WindowInput take_input();

  // The view. It may be changed between frames.
  [[nodiscard]] Camera& camera();

  // The last frame. Throws std::runtime_error if there is none yet.
  [[nodiscard]] FramePicture picture();
  // The file of the picture that the user asked for since the last call; empty path: an unused name.
  [[nodiscard]] std::optional<std::filesystem::path> take_screenshot();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace hybrid
