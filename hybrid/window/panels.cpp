// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/window/panels.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>

#include "hybrid/base/number_text.h"
#include "hybrid/view/legend.h"
#include "hybrid/view/overlay.h"
#include "hybrid/view/palette.h"
#include "hybrid/window/controls.h"
#include "hybrid/window/panel_words.h"

namespace hybrid {
namespace {

// Maps the keys that ImGui knows to the numbers that the window uses, those of UiKey.
void map_keys(ImGuiIO& io) {
  constexpr std::array<ImGuiKey, kUiKeys> keys{
      ImGuiKey_Tab,    ImGuiKey_LeftArrow, ImGuiKey_RightArrow, ImGuiKey_UpArrow, ImGuiKey_DownArrow,
      ImGuiKey_PageUp, ImGuiKey_PageDown,  ImGuiKey_Home,       ImGuiKey_End,     ImGuiKey_Insert,
      ImGuiKey_Delete, ImGuiKey_Backspace, ImGuiKey_Space,      ImGuiKey_Enter,   ImGuiKey_Escape,
      ImGuiKey_A,      ImGuiKey_C,         ImGuiKey_V,          ImGuiKey_X,       ImGuiKey_Y,
      ImGuiKey_Z};
  for (std::size_t k = 0; k < kUiKeys; ++k) io.KeyMap[keys[k]] = static_cast<int>(k);
}

void hand_over(ImGuiIO& io, const UiInput& input) {
  io.DeltaTime = std::max(input.dt_s, 1e-4F);
  io.MousePos = {input.x, input.y};
  for (std::size_t b = 0; b < input.buttons.size(); ++b) io.MouseDown[b] = input.buttons[b];
  io.MouseWheel = input.wheel;
  for (std::size_t k = 0; k < kUiKeys; ++k) io.KeysDown[k] = input.keys[k];
  io.KeyCtrl = input.control;
  io.KeyShift = input.shift;
  io.KeyAlt = input.alt;
  for (const char32_t c : input.typed) io.AddInputCharacter(static_cast<unsigned int>(c));
}

constexpr const char* kPanelName = "panel";
// heights (unit: body text)
constexpr float kTickChart_em = 6.0F, kStageRow_em = 1.25F;
constexpr std::array<double, 4> kSpeeds{1.0, 0.1, 0.01,
                                        kLeastSpeed};  // of the session, relative to real time

ImVec4 colour_of(Ink ink, float alpha = 1.0F) {
  ImVec4 colour = ImGui::ColorConvertU32ToFloat4(ink);
  colour.w = alpha;
  return colour;
}

void set_style(const Pen& pen, bool dark) {
  ImGuiStyle& style = ImGui::GetStyle();
  if (dark) {
    ImGui::StyleColorsDark(&style);
  } else {
    ImGui::StyleColorsLight(&style);
  }
  const float em = pen.em;
  style.WindowPadding = {0.6F * em, 0.5F * em};
  style.FramePadding = {0.45F * em, 0.22F * em};
  style.ItemSpacing = {0.5F * em, 0.35F * em};
  style.ItemInnerSpacing = {0.4F * em, 0.3F * em};
  style.CellPadding = {0.3F * em, 0.1F * em};
  style.ScrollbarSize = 0.8F * em;
  style.GrabMinSize = 0.7F * em;
  style.WindowRounding = style.FrameRounding = style.GrabRounding = 0.25F * em;
  style.WindowBorderSize = 1.0F;
  style.Colors[ImGuiCol_WindowBg] = colour_of(pen.inks.paper);
  style.Colors[ImGuiCol_Text] = colour_of(pen.inks.text);
  style.Colors[ImGuiCol_TextDisabled] = colour_of(pen.inks.pale);
  style.Colors[ImGuiCol_Border] = colour_of(pen.inks.edge, 0.7F);
  style.Colors[ImGuiCol_CheckMark] = colour_of(pen.inks.force);
  // The value is written in the middle of a slider, so the grab must be translucent.
  style.Colors[ImGuiCol_SliderGrab] = colour_of(pen.inks.force, 0.45F);
  style.Colors[ImGuiCol_SliderGrabActive] = colour_of(pen.inks.force, 0.7F);
  style.Colors[ImGuiCol_FrameBg] = colour_of(pen.inks.edge, 0.28F);
  style.Colors[ImGuiCol_FrameBgHovered] = colour_of(pen.inks.edge, 0.45F);
  style.Colors[ImGuiCol_FrameBgActive] = colour_of(pen.inks.edge, 0.6F);
  style.Colors[ImGuiCol_Button] = colour_of(pen.inks.edge, 0.35F);
  style.Colors[ImGuiCol_ButtonHovered] = colour_of(pen.inks.force, 0.35F);
  style.Colors[ImGuiCol_ButtonActive] = colour_of(pen.inks.force, 0.55F);
  style.Colors[ImGuiCol_Header] = colour_of(pen.inks.force, 0.16F);
  style.Colors[ImGuiCol_HeaderHovered] = colour_of(pen.inks.force, 0.26F);
  style.Colors[ImGuiCol_HeaderActive] = colour_of(pen.inks.force, 0.36F);
  style.Colors[ImGuiCol_PopupBg] = colour_of(pen.inks.paper);
  style.Colors[ImGuiCol_NavHighlight] = colour_of(pen.inks.force);
}

// One button of a row of `of` buttons with equal widths. Returns whether it was pressed.
bool wide_button(const char* words, int of, bool lit = false) {
  const float gap = ImGui::GetStyle().ItemSpacing.x;
  const float width =
      (ImGui::GetContentRegionAvail().x - static_cast<float>(of - 1) * gap) / static_cast<float>(of);
  if (lit) ImGui::PushStyleColor(ImGuiCol_Button, ImGui::GetStyleColorVec4(ImGuiCol_ButtonActive));
  const bool pressed = ImGui::Button(words, {std::max(width, 1.0F), 0.0F});
  if (lit) ImGui::PopStyleColor();
  return pressed;
}

bool open_section(const char* name, bool open = true) {
  return ImGui::CollapsingHeader(name, open ? ImGuiTreeNodeFlags_DefaultOpen : 0);
}

}  // namespace

namespace controls {
namespace {

constexpr float kLabel_em = 9.2F;  // width of the column of labels (unit: body text)

}  // namespace

PixelRect take_place(float height) {
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const float width = ImGui::GetContentRegionAvail().x;
  ImGui::Dummy({width, height});
  return {static_cast<int>(at.x), static_cast<int>(at.y), static_cast<int>(width), static_cast<int>(height)};
}
void label_beside(const Pen& pen, const std::string& words) {
  label(words);
  ImGui::SameLine(kLabel_em * pen.em);
  ImGui::SetNextItemWidth(-0.1F * pen.em);
}
void label(const std::string& words) {
  ImGui::AlignTextToFramePadding();
  ImGui::TextUnformatted(words.c_str());
}
void tick_beside(const Pen& pen, const std::string& words, const glm::vec3& colour, bool& on) {
  swatch(pen, colour);
  ImGui::SameLine();
  const std::string id = "##shown " + words;
  ImGui::Checkbox(id.c_str(), &on);
  ImGui::SameLine();
  const float left = ImGui::GetCursorPosX();
  label(pen.fit(words, kLabel_em * pen.em - left));
  ImGui::SameLine(kLabel_em * pen.em);
  ImGui::SetNextItemWidth(-0.1F * pen.em);
}
void swatch(const Pen& pen, const glm::vec3& colour) {
  const ImVec2 at = ImGui::GetCursorScreenPos();
  const float top = at.y + 0.5F * (ImGui::GetFrameHeight() - pen.em);
  const ImVec2 end{at.x + pen.em, top + pen.em};
  ImGui::GetWindowDrawList()->AddRectFilled({at.x, top}, end, ink_of(colour), 2.0F);
  ImGui::GetWindowDrawList()->AddRect({at.x, top}, end, pen.inks.edge, 2.0F);
  ImGui::Dummy({pen.em, pen.em});
}
void same_line() {
  ImGui::SameLine();
}
void begin_fixed(bool fixed) {
  ImGui::BeginDisabled(fixed);
}
void end_fixed() {
  ImGui::EndDisabled();
}
bool button(const char* id, float width) {
  return ImGui::Button(id, {width, 0.0F});
}
bool tick_box(const char* id, bool& on) {
  return ImGui::Checkbox(id, &on);
}
bool radio(const char* id, bool on) {
  return ImGui::RadioButton(id, on);
}

std::optional<std::size_t> choose(const char* id, const std::string& shown,
                                  std::span<const std::string> choices) {
  std::optional<std::size_t> taken;
  if (!ImGui::BeginCombo(id, shown.c_str())) return taken;
  for (std::size_t n = 0; n < choices.size(); ++n) {
    if (ImGui::Selectable(choices[n].c_str(), choices[n] == shown)) taken = n;
  }
  ImGui::EndCombo();
  return taken;
}

Slid slide(const char* id, float& value, float low, float high, const std::string& format, bool logarithmic) {
  const int flags = ImGuiSliderFlags_AlwaysClamp | (logarithmic ? ImGuiSliderFlags_Logarithmic : 0);
  const bool changed = ImGui::SliderFloat(id, &value, low, high, format.c_str(), flags);
  return {changed, ImGui::IsItemActive(), ImGui::IsItemDeactivatedAfterEdit()};
}
void tip(const std::string& words) {
  if (ImGui::IsItemHovered() && !ImGui::IsItemActive()) ImGui::SetTooltip("%s", words.c_str());
}

void write(const std::string& words, bool pale) {
  ImGui::PushTextWrapPos();
  if (pale) {
    ImGui::TextDisabled("%s", words.c_str());
  } else {
    ImGui::TextUnformatted(words.c_str());
  }
  ImGui::PopTextWrapPos();
}
void write_rows(const Pen& pen, const char* id, std::span<const std::array<std::string, 3>> rows) {
  if (!ImGui::BeginTable(id, 3)) return;
  ImGui::TableSetupColumn("what", ImGuiTableColumnFlags_WidthStretch);
  for (const char* column : {"first", "second"})
    ImGui::TableSetupColumn(column, ImGuiTableColumnFlags_WidthFixed, pen.width("8 888 888 N"));
  for (const auto& row : rows) {
    ImGui::TableNextRow();
    for (std::size_t n = 0; n < row.size(); ++n) {
      ImGui::TableNextColumn();
      const float left = n > 0 ? ImGui::GetContentRegionAvail().x - pen.width(row[n]) : 0.0F;
      ImGui::SetCursorPosX(ImGui::GetCursorPosX() + std::max(left, 0.0F));
      ImGui::TextUnformatted(row[n].c_str());
    }
  }
  ImGui::EndTable();
}

float free_width() {
  return ImGui::GetContentRegionAvail().x;
}
float gap() {
  return ImGui::GetStyle().ItemSpacing.x;
}

}  // namespace controls

void Panels::draw_session(const PanelFrame& frame, const Snapshot& snapshot, const TickTimes& times,
                          PanelResult& result) const {
  const ViewState& state = frame.state;
  const auto ask = [&](ViewVerb verb, std::vector<double> numbers = {}) {
    result.actions.push_back({.verb = verb, .numbers = std::move(numbers)});
  };
  if (wide_button(state.paused ? "Play" : "Pause", 3, state.paused)) ask(ViewVerb::pause);
  ImGui::SameLine();
  if (wide_button("One tick", 2)) ask(ViewVerb::step);
  ImGui::SameLine();
  if (wide_button("Restart", 1)) ask(ViewVerb::restart);
  ImGui::BeginDisabled(frame.notes.real_device);
  for (std::size_t n = 0; n < kSpeeds.size(); ++n) {
    static constexpr std::array<const char*, kSpeeds.size()> words{"real time", "1/10", "1/100", "1/1000"};
    if (n > 0) ImGui::SameLine();
    if (wide_button(words[n], static_cast<int>(kSpeeds.size() - n), state.speed == kSpeeds[n]))
      ask(ViewVerb::speed, {kSpeeds[n]});
  }
  ImGui::EndDisabled();
  if (wide_button("Recording", 3)) ask(ViewVerb::save_recording);
  if (ImGui::IsItemHovered())
    ImGui::SetTooltip("Saves the session from its beginning; hybrid replay plays it");
  ImGui::SameLine();
  if (wide_button("Picture", 2)) ask(ViewVerb::screenshot);
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("Saves this frame as a PNG file");
  ImGui::SameLine();
  if (wide_button("Save scene", 1)) ask(ViewVerb::save_scene);
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("Writes the edited values into the scene's file");
  ImGui::TextDisabled("tick %llu, %s s recorded", static_cast<unsigned long long>(snapshot.tick),
                      with_decimals(frame.notes.recorded_s, 1).c_str());
  const std::string late = times.late == 0 ? "none late" : std::to_string(times.late) + " late";
  ImGui::TextDisabled("last %s s: %s, 99 %% of ticks within %s",
                      with_decimals(frame.history.seconds(), 0).c_str(), late.c_str(),
                      tick_time_text(times.p99_us).c_str());
  if (frame.notes.refused_edits > 0)
    ImGui::TextDisabled("%llu edits came too fast and were left out",
                        static_cast<unsigned long long>(frame.notes.refused_edits));
}

void Panels::draw_objects(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot,
                          const PanelFrame& frame, PanelResult& result) const {
  constexpr int most_rows = 8;
  const int rows = std::min(static_cast<int>(scene.objects.size()) + 1, most_rows);
  const float height = static_cast<float>(rows) * (ImGui::GetFrameHeight() + 0.2F * pen.em);
  if (!ImGui::BeginTable("objects", 4, ImGuiTableFlags_ScrollY, {0.0F, height + 0.2F * pen.em})) return;
  ImGui::TableSetupColumn("shown", ImGuiTableColumnFlags_WidthFixed, ImGui::GetFrameHeight());
  ImGui::TableSetupColumn("colour", ImGuiTableColumnFlags_WidthFixed, pen.em);
  ImGui::TableSetupColumn("name", ImGuiTableColumnFlags_WidthStretch);
  ImGui::TableSetupColumn("force", ImGuiTableColumnFlags_WidthFixed, pen.width("88.88 N"));
  const auto row = [&](std::uint32_t object, const glm::vec3& colour, const std::string& force) {
    ImGui::PushID(static_cast<int>(object));
    ImGui::TableNextRow();
    ImGui::TableNextColumn();
    if (object != Edit::kTool) {
      bool visible = frame.state.view.look_of(object).visible;
      if (ImGui::Checkbox("##shown", &visible))
        result.actions.push_back(
            {.verb = ViewVerb::show, .numbers = {visible ? 1.0 : 0.0}, .object = object});
    }
    ImGui::TableNextColumn();
    controls::swatch(pen, colour);
    ImGui::TableNextColumn();
    ImGui::AlignTextToFramePadding();
    const std::string name = pen.fit(object_name(scene, object), ImGui::GetContentRegionAvail().x);
    if (ImGui::Selectable((name + "##name").c_str(), frame.state.selected == object))
      result.actions.push_back({.verb = ViewVerb::select, .object = object});
    ImGui::TableNextColumn();
    ImGui::AlignTextToFramePadding();
    ImGui::SetCursorPosX(ImGui::GetCursorPosX() + ImGui::GetContentRegionAvail().x - pen.width(force));
    ImGui::TextUnformatted(force.c_str());
    ImGui::PopID();
  };
  row(Edit::kTool, frame.state.view.dark ? palette::dark_tool : palette::tool,
      force_text(glm::length(snapshot.force_N)));
  for (std::uint32_t o = 0; o < scene.objects.size(); ++o) {
    const bool felt = o < snapshot.feel.size() && snapshot.feel[o].contact;
    row(o, palette::of_object(scene, o), felt ? force_text(snapshot.feel[o].force_N) : std::string());
  }
  ImGui::EndTable();
}

// The rows keep their order and number while the tool moves, so that a reader can follow one of them.
void Panels::draw_presses(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot,
                          const PanelFrame& frame) const {
  if (frame.notes.real_device && !frame.state.paused) {
    ImGui::TextDisabled("Pause to see them.");
    return;
  }
  if (snapshot.presses.empty()) {
    ImGui::TextDisabled("None: no tissue is pressed.");
    return;
  }
  constexpr int most_rows = 6;
  const int rows = std::min(static_cast<int>(snapshot.presses.size()), most_rows);
  const float height = static_cast<float>(rows) * (ImGui::GetTextLineHeight() + 0.35F * pen.em);
  if (!ImGui::BeginTable("presses", 2, ImGuiTableFlags_ScrollY, {0.0F, height + 0.2F * pen.em})) return;
  ImGui::TableSetupColumn("pair", ImGuiTableColumnFlags_WidthStretch);
  ImGui::TableSetupColumn("force", ImGuiTableColumnFlags_WidthFixed, pen.width("not known"));
  for (const PairPress& press : snapshot.presses) {
    const std::string other =
        press.other == PairPress::kAnchors ? "its anchors" : object_name(scene, press.other);
    const std::string force = press.force_N ? force_text(*press.force_N) : "not known";
    ImGui::TableNextRow();
    ImGui::TableNextColumn();
    ImGui::TextUnformatted(
        pen.fit(object_name(scene, press.soft) + " – " + other, ImGui::GetContentRegionAvail().x).c_str());
    ImGui::TableNextColumn();
    ImGui::SetCursorPosX(ImGui::GetCursorPosX() + ImGui::GetContentRegionAvail().x - pen.width(force));
    ImGui::TextUnformatted(force.c_str());
  }
  ImGui::EndTable();
}

void Panels::take_input() {
  ImGuiIO& io = ImGui::GetIO();
  io.ConfigFlags |= ImGuiConfigFlags_NavEnableKeyboard;
  map_keys(io);
  hand_over(io, frame_->input);
}

void Panels::draw(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot, const PixelRect& where) {
  const PanelFrame& frame = *frame_;
  PanelResult& result = result_;
  set_style(pen, frame.state.view.dark);
  ImGui::PushFont(pen.body);
  Pen behind = pen;
  behind.list = ImGui::GetBackgroundDrawList();
  const PixelRect& scene_place = frame.scene_place;
  behind.list->PushClipRect({static_cast<float>(scene_place.x), static_cast<float>(scene_place.y)},
                            {static_cast<float>(scene_place.x + scene_place.width),
                             static_cast<float>(scene_place.y + scene_place.height)});
  if (frame.state.map) draw_map_boxes(behind, frame.notes.boxes, frame.camera, frame.scene_place);
  if (frame.state.trail) draw_trail(behind, frame.history, frame.camera, frame.scene_place);
  if (frame.handles != nullptr) draw_move_handles(behind, *frame.handles, frame.camera, frame.scene_place);
  behind.list->PopClipRect();
  ImGui::SetNextWindowPos({static_cast<float>(where.x), static_cast<float>(where.y)});
  ImGui::SetNextWindowSize({static_cast<float>(where.width), static_cast<float>(where.height)});
  constexpr ImGuiWindowFlags flags = ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize |
                                     ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings;
  if (ImGui::Begin(kPanelName, nullptr, flags)) {
    if (frame.input.by_keyboard && !ImGui::IsWindowFocused(ImGuiFocusedFlags_ChildWindows))
      ImGui::SetWindowFocus();
    const TickTimes times = frame.history.times();
    if (frame.notes.begins) {
      if (open_section("Open")) draw_open(frame, result);
    } else {
      draw_sections(pen, scene, snapshot, frame, times, result);
    }
  }
  ImGui::End();
  result.wants_text = ImGui::GetIO().WantTextInput;
  ImGui::PopFont();
}

void Panels::draw_sections(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot,
                           const PanelFrame& frame, const TickTimes& times, PanelResult& result) {
  if (open_section("Session")) {
    draw_session(frame, snapshot, times, result);
    draw_past(pen, frame, result);
  }
  if (open_section("Objects")) draw_objects(pen, scene, snapshot, frame, result);
  if (has_soft(scene) && open_section("Forces between objects")) {
    result.wants_presses = true;
    draw_presses(pen, scene, snapshot, frame);
  }
  const std::string values = "Values: " + object_name(scene, frame.state.selected) + "###values";
  if (open_section(values.c_str())) draw_values(pen, scene, snapshot, frame, result);
  if ((frame.notes.effect || !frame.notes.building.empty()) && open_section("Before and after"))
    draw_effect(pen, frame);
  if (open_section("View")) draw_view(pen, scene, frame, result);
  if (has_soft(scene) && open_section("Difference of two models", false))
    draw_difference(pen, scene, snapshot, frame, result);
  Pen chart = pen;
  chart.list = ImGui::GetWindowDrawList();
  if (open_section("Force")) draw_force(chart, scene, frame, result);
  if (open_section("Ticks")) {
    draw_tick_times(chart, controls::take_place(kTickChart_em * pen.em), times);
    draw_stage_times(chart, controls::take_place(kStageRow_em * pen.em * static_cast<float>(kStages)), times);
    draw_rates(pen, frame);
    if (frame.notes.unseen_ticks > 0)
      ImGui::TextDisabled("%llu ticks are not in the charts",
                          static_cast<unsigned long long>(frame.notes.unseen_ticks));
  }
  if (open_section("Numbers of the tick", !frame.state.watched.empty())) draw_watch(pen, frame, result);
  const bool offers = !frame.notes.recent.empty() || !frame.notes.shipped.empty();
  if (offers && open_section("Open", false)) draw_open(frame, result);
}

}  // namespace hybrid
