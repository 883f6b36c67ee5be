// SPDX-License-Identifier: GPL-3.0-or-later
// The choices of a window's user, and the actions that change them. Buttons, keys and scripts all become
// actions. Uses no graphics library.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hybrid/view/view_settings.h"

namespace hybrid {

enum class ViewVerb : std::uint8_t {
  pause,           // numbers: 1 on, 0 off, none: toggle
  step,            // does one tick while paused
  rest,            // numbers: 1 compares with the force at rest, 0 ends it, none: toggle
  stack,           // numbers: 1 the parts of the force as areas, 0 as lines, none: toggle
  watch,           // text: name of a number of the tick; begins to watch it, or ends
  speed,           // numbers: simulated time over real time
  restart,         // starts the hand's path again
  edit,            // object, quantity, numbers: the value in SI
  change,          // change: of the scene, which is built again
  difference,      // comparison: begins it, of two models over a surface; without an object: ends it
  look_back,       // numbers: seconds before now; 0: the present
  go_on,           // the session goes on from the past that is shown
  arrows,          // numbers: 1 shown, 0 hidden, none: toggle; they move the selected object
  select,          // object
  show,            // object, numbers: 1 visible, 0 hidden; text: a material of the object, or empty
  opacity,         // object, numbers: 0 to 1; text: as of show
  wires,           // numbers: 1 edges of triangles are drawn, 0 not, none: toggle
  clip,            // numbers: 1 on, 0 off, none: toggle
  clip_axis,       // numbers: 0 x, 1 y, 2 z
  clip_place,      // numbers: 0 to 1 along the axis
  clip_side,       // leaves out the other side
  slice,           // numbers: axis (0 x, 1 y, 2 z), place 0 to 1, or negative: off; none: all on or all off
  slice_grey,      // numbers: 1 grey values of the scan, 0 materials, none: toggle
  colour,          // numbers: TissueColour; none: the next one
  look,            // text: "all", "contact", "x", "y", "z"
  dark,            // numbers: 1 dark, 0 light, none: toggle
  panels,          // numbers: 1 shown, 0 hidden, none: toggle
  inset,           // numbers: 1 shown, 0 hidden, none: toggle
  map,             // numbers: 1 cells of the map and patches are drawn, 0 not, none: toggle
  trail,           // numbers: 1 the hand's path of the last seconds is drawn, 0 not, none: toggle
  open,            // text: a file, which is opened as if it were dropped onto the window
  screenshot,      // text: the file; empty: an unused name
  save_recording,  // text: the file; empty: an unused name
  save_scene,      // writes edits to the scene's file
  reload,          // reads the scene's file again
  key,             // text: name of a key; this and the next three occur in scripts only
  click,           // numbers: x, y (pixels)
  drag,            // numbers: x, y, to x, to y (pixels); text: "left", "middle" or "right" button
  wheel,           // numbers: turns away from the user
  quit,
};

struct ViewAction {
  ViewVerb verb = ViewVerb::pause;
  std::vector<double> numbers{};
  std::string text{};
  std::uint32_t object = Edit::kTool;
  EditedQuantity quantity = EditedQuantity::coupling_stiffness;
  SceneChange change{};
  ModelComparison comparison{};
};

struct ViewState {
  ViewSettings view;
  bool panels = true;
  std::uint32_t selected = Edit::kTool;
  bool moves = false;                  // arrows on the selected object are shown
  bool map = false;                    // cells of the map near the tool, and patches, are drawn
  bool trail = false;                  // the hand's path of the last seconds is drawn
  bool stacked = false;                // the chart of the force shows its parts as areas
  std::vector<std::string> watched{};  // names of numbers (watched_numbers.h)
  // ---- requests to the session; the owner of the session takes counters and lists ----
  bool paused = false, compares_with_rest = false;
  double speed = 1.0;
  std::uint32_t restarts = 0, single_ticks = 0;
  double back_s = 0.0;  // age of the shown state; the session pauses while it is shown; 0: the present
  bool go_on = false;
  std::vector<Edit> edits{};
  std::vector<SceneChange> changes{};
  std::optional<ModelComparison> comparison{};  // to begin; without an object: the present one ends
  std::optional<std::filesystem::path> screenshot{}, recording{};  // empty path: an unused name
  std::vector<std::filesystem::path> opened{};  // files to open, in the order in which they were dropped
  bool save_scene = false, reload = false, quit = false;
  std::string look{};  // the requested view, as the text of ViewVerb::look
};

// Greatest number of frames in which a requested change of the scene is shown although no scene is being
// built.
inline constexpr int kFramesUntilBuilding = 30;

// Least speed, as a share of real time. Speeds up to 1 are allowed.
inline constexpr double kLeastSpeed = 1e-3;

// Gives looks and selection to the objects of the same name in another scene.
void go_to_scene(ViewState& state, const DrawnScene& before, const DrawnScene& after);

// Applies an action. Only a window can apply key, click, drag and wheel.
void act(ViewState& state, const ViewAction& action);

}  // namespace hybrid
