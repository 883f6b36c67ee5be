// SPDX-License-Identifier: GPL-3.0-or-later
// The controls, with Dear ImGui.
#include "hybrid/window/controls.h"

#include <imgui.h>

#include <algorithm>

#include "hybrid/view/overlay.h"

namespace hybrid::controls {
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

}  // namespace hybrid::controls
