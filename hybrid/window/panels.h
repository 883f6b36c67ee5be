// SPDX-License-Identifier: GPL-3.0-or-later
// The panel beside the scene in a window: session, objects and their values, view, and charts of force and
// tick times. It draws with Dear ImGui and returns actions. It changes nothing itself.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hybrid/snapshot/map_boxes.h"
#include "hybrid/view/layout.h"
#include "hybrid/view/overlay_panel.h"
#include "hybrid/view/text_painter.h"
#include "hybrid/window/move_handles.h"
#include "hybrid/window/tick_history.h"
#include "hybrid/window/ui_input.h"
#include "hybrid/window/view_state.h"

namespace hybrid {

// A scene that the window offers to open.
struct OfferedScene {
  std::filesystem::path file;
  std::string words{};  // the first line of its comments
};

// How often something happened in a second, and the share of a processor that it took; negative: not known.
struct ThreadRate {
  std::string name{};
  double per_s = -1.0, busy = -1.0;
};

// Data that the session gives its window besides snapshots.
struct SessionNotes {
  bool real_device = false;         // slow motion is not possible
  double recorded_s = 0.0;          // length of the recording so far
  std::uint64_t refused_edits = 0;  // refused because too many edits waited
  std::uint64_t unseen_ticks = 0;   // ticks missing in the charts because a frame took too long
  std::string message{};            // result of the last action; empty: none
  std::string error{};              // error in the scene's file; empty: none
  // Ages of the kept states (s), the oldest first, and the memory of all of them.
  std::vector<double> kept_s{};
  std::size_t kept_bytes = 0;
  std::string building{};                         // progress of a changed scene that is built; empty: none
  std::optional<ChangeEffect> effect{};           // of the last change of the scene
  std::vector<OfferedScene> recent{}, shipped{};  // scenes to open
  bool begins = false;                            // nothing is played yet: a scene is to be chosen
  std::vector<ThreadRate> rates{};
  std::vector<MapBox> boxes{};  // near the tool, if the user asked for them
  std::string comparing{};      // progress of a comparison of two models; empty: none goes on
};

// The data that the panel shows in one frame.
struct PanelFrame {
  const ViewState& state;
  const TickHistory& history;
  const SessionNotes& notes;
  const UiInput& input;
  const Camera& camera;
  const PixelRect& scene_place;          // of the scene in the frame
  const MoveHandles* handles = nullptr;  // null: none are shown
};

struct PanelResult {
  std::vector<ViewAction> actions;
  bool wants_text = false;     // a control takes typed text, so keys are not shortcuts
  bool wants_presses = false;  // the list of forces between objects is open
};

class Panels final : public OverlayPanel {
 public:
  // Sets the data of the next frame. `frame` must live until that frame is drawn. Its input is read once.
  void show(const PanelFrame& frame) { frame_ = &frame; }
  // The actions that the user asked for since the last call.
  [[nodiscard]] PanelResult take_result() { return std::exchange(result_, {}); }

  void take_input() override;
  void draw(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot,
            const PixelRect& where) override;

 private:
  void draw_sections(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot,
                     const PanelFrame& frame, const TickTimes& times, PanelResult& result);
  void draw_session(const PanelFrame& frame, const Snapshot& snapshot, const TickTimes& times,
                    PanelResult& result) const;
  void draw_objects(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot,
                    const PanelFrame& frame, PanelResult& result) const;
  void draw_presses(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot,
                    const PanelFrame& frame) const;
  // ---- panel_values.cpp ----
  void draw_values(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot, const PanelFrame& frame,
                   PanelResult& result);
  void draw_slider(const Pen& pen, std::size_t index, const EditableValue& value, double now,
                   PanelResult& result);
  // ---- panel_materials.cpp ----
  void draw_materials(const Pen& pen, const DrawnScene& scene, const PanelFrame& frame,
                      PanelResult& result) const;
  // ---- panel_choices.cpp ----
  void draw_choices(const Pen& pen, const DrawnScene& scene, const PanelFrame& frame, PanelResult& result);
  // A value whose change needs a new world, and the range of its slider (SI).
  struct BuiltValue {
    SceneChange::Key key = SceneChange::Key::young;
    std::string name{};  // of the material; empty: of the tool
    std::string label{}, tip{};
    double in_scene = 0.0, low = 0.0, high = 0.0;
    double unit_SI = 1.0;  // the unit of the shown number
    std::string unit_words{};
  };
  void draw_built_value(const Pen& pen, const BuiltValue& value, PanelResult& result);
  void draw_limits(const Pen& pen, const std::vector<MaterialChoice>& materials, PanelResult& result);
  void draw_tool_size(const Pen& pen, const DrawnScene& scene, const PanelFrame& frame, PanelResult& result);
  void forget_asked_value(const PanelFrame& frame);
  void draw_effect(const Pen& pen, const PanelFrame& frame) const;
  // ---- panel_force.cpp ----
  void draw_force(const Pen& chart, const DrawnScene& scene, const PanelFrame& frame,
                  PanelResult& result) const;
  void draw_watch(const Pen& pen, const PanelFrame& frame, PanelResult& result) const;
  // ---- panel_difference.cpp ----
  void draw_difference(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot,
                       const PanelFrame& frame, PanelResult& result);
  // ---- panel_open.cpp ----
  void draw_open(const PanelFrame& frame, PanelResult& result) const;
  void draw_rates(const Pen& pen, const PanelFrame& frame) const;
  // ---- panel_view.cpp ----
  void draw_past(const Pen& pen, const PanelFrame& frame, PanelResult& result) const;
  void draw_view(const Pen& pen, const DrawnScene& scene, const PanelFrame& frame, PanelResult& result);
  void draw_tissue_view(const Pen& pen, const ViewSettings& view, PanelResult& result) const;

  const PanelFrame* frame_ = nullptr;
  // The scene to which bounds_ and box_ belong. They are kept, because computing them visits every vertex.
  const DrawnScene* bounds_of_ = nullptr;
  SceneBounds bounds_;
  SoftBox box_;
  PanelResult result_;
  // The slider that the user moves, and the last value that the panel requested. The session applies it a
  // frame later.
  std::size_t moved_ = static_cast<std::size_t>(-1);
  float moved_to_ = 0.0F;
  // A value that the user gives to a material or to the tool, until the changed scene is there.
  struct AskedValue {
    SceneChange::Key key = SceneChange::Key::young;
    std::string name{};
    float shown = 0.0F;   // in the slider's unit
    int frames_left = 0;  // number of frames in which it is shown although no scene is being built
  };
  std::optional<AskedValue> asked_value_;
  std::string limits_of_{};  // the material whose limits are shown
  // The models of an object that the user chose to compare.
  struct ChosenModels {
    const DrawnScene* scene = nullptr;
    std::uint32_t object = Edit::kTool;
    std::size_t a = 0, b = 1;  // indices in model_options()
    float depth_mm = 0.0F;
  };
  ChosenModels chosen_;
};

// Draws the arrows by which an object is moved (panel_handles.cpp).
void draw_move_handles(const Pen& pen, const MoveHandles& handles, const Camera& camera,
                       const PixelRect& where);

// Draws cells of the map (rigid: orange, soft: green) and patches (blue, the coarser the paler)
// (panel_map.cpp).
void draw_map_boxes(const Pen& pen, const std::vector<MapBox>& boxes, const Camera& camera,
                    const PixelRect& where);

// Draws the path of the hand as the history has it, the oldest part pale (panel_handles.cpp).
void draw_trail(const Pen& pen, const TickHistory& history, const Camera& camera, const PixelRect& where);

// ---- charts (panel_charts.cpp) ----
// Draws the force of the last seconds. Each pixel column has a line from the least to the largest force in
// it.
void draw_force_chart(const Pen& pen, const PixelRect& where, const TickHistory& history);
// Draws the parts of the force as stacked areas. A part that adds to the force lies above zero, a part that
// reduces it below. A line shows the force on the hand.
void draw_force_parts(const Pen& pen, const PixelRect& where, const TickHistory& history);
// Draws tick times on a logarithmic axis, with a line at the servo period.
void draw_tick_times(const Pen& pen, const PixelRect& where, const TickTimes& times);
// Draws the mean time of each stage as a bar.
void draw_stage_times(const Pen& pen, const PixelRect& where, const TickTimes& times);

}  // namespace hybrid
