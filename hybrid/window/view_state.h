// SPDX-License-Identifier: GPL-3.0-or-later
// What the user of a window has chosen, and the actions that change it. Buttons, keys and scripts all become
// actions. Knows no graphics library.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hybrid/view/view_settings.h"

namespace hybrid {

enum class ViewVerb : std::uint8_t {
  pause,           // numbers: 1 on, 0 off, none: the other state
  step,            // one tick while paused
  speed,           // numbers: simulated time over real time
  restart,         // of the hand's path
  edit,            // object, quantity, numbers: the value in SI
  select,          // object
  show,            // object, numbers: 1 visible, 0 hidden
  opacity,         // object, numbers: 0 to 1
  clip,            // numbers: 1 on, 0 off, none: the other state
  clip_axis,       // numbers: 0 x, 1 y, 2 z
  clip_place,      // numbers: 0 to 1 along the axis
  clip_side,       // the other side is left out
  look,            // text: "all", "contact", "x", "y", "z"
  dark,            // numbers: 1 dark, 0 light, none: the other theme
  panels,          // numbers: 1 shown, 0 hidden, none: the other state
  inset,           // numbers: 1 shown, 0 hidden, none: the other state
  screenshot,      // text: the file; empty: a name that is free
  save_recording,  // text: the file; empty: a name that is free
  save_scene,      // edits are written to the scene's file
  reload,          // of the scene's file
  key,             // text: name of a key; scripts only, as the following
  click,           // numbers: x, y (pixels)
  drag,            // numbers: x, y, to x, to y (pixels); text: the button, "left", "middle" or "right"
  wheel,           // numbers: turns away from the user
  quit,
};

struct ViewAction {
  ViewVerb verb = ViewVerb::pause;
  std::vector<double> numbers{};
  std::string text{};
  std::uint32_t object = Edit::kTool;
  EditedQuantity quantity = EditedQuantity::coupling_stiffness;
};

struct ViewState {
  ViewSettings view;
  bool panels = true;
  std::uint32_t selected = Edit::kTool;
  // ---- requests to the session; counters and lists are taken by the owner of the session ----
  bool paused = false;
  double speed = 1.0;
  std::uint32_t restarts = 0, single_ticks = 0;
  std::vector<Edit> edits{};
  std::optional<std::filesystem::path> screenshot{}, recording{};  // empty path: a name that is free
  bool save_scene = false, reload = false, quit = false;
  std::string look{};  // the view that is asked for, of ViewVerb::look
};

// Allowed speeds: real time and slow motion.
inline constexpr double kLeastSpeed = 1e-3;

// Applies an action, except those that only a window can (key, click, drag, wheel).
void act(ViewState& state, const ViewAction& action);

}  // namespace hybrid
