// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/overlay.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <system_error>

#include "hybrid/base/number_text.h"
#include "hybrid/view/overlay_parts.h"

namespace hybrid {

struct Overlay::State {
  ImGuiContext* context = nullptr;
  Pen pen;
  FontAtlas atlas;

  // Takes a system font that is legible at any size and has more than Latin letters. If there is none, takes
  // the embedded font, which is drawn for 13 pixels and sharp only at multiples of 13.
  void choose_fonts(int height) {
    ImFontAtlas& fonts = *ImGui::GetIO().Fonts;
    ImFontConfig config;
    for (const char* file :
         {"/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf",
          "/usr/share/fonts/dejavu-sans-fonts/DejaVuSans.ttf", "/usr/share/fonts/TTF/DejaVuSans.ttf"}) {
      std::error_code ignored;
      if (!std::filesystem::is_regular_file(file, ignored)) continue;
      static constexpr std::array<ImWchar, 9> ranges{0x0020, 0x024F, 0x0370, 0x03FF, 0x0400,
                                                     0x04FF, 0x2010, 0x2265, 0};
      pen.em = text_height(height);
      pen.body = fonts.AddFontFromFileTTF(file, pen.em, &config, ranges.data());
      pen.head = fonts.AddFontFromFileTTF(file, std::round(1.6F * pen.em), &config, ranges.data());
      if (pen.body != nullptr && pen.head != nullptr) return;
    }
    fonts.Clear();
    pen.em = 13.0F * static_cast<float>(std::clamp((height + 350) / 1000, 1, 4));
    config.SizePixels = pen.em;
    pen.body = fonts.AddFontDefault(&config);
    config.SizePixels = 2.0F * pen.em;
    pen.head = fonts.AddFontDefault(&config);
  }
};

Overlay::Overlay(int height) : state_(std::make_unique<State>()) {
  IMGUI_CHECKVERSION();
  ImGuiContext* const before = ImGui::GetCurrentContext();
  state_->context = ImGui::CreateContext();
  ImGui::SetCurrentContext(state_->context);
  ImGuiIO& io = ImGui::GetIO();
  io.IniFilename = nullptr;  // ImGui must not leave a file behind
  io.LogFilename = nullptr;
  io.BackendFlags |= ImGuiBackendFlags_RendererHasVtxOffset;  // build() adds the offsets: there may be
                                                              // more than 65,536 vertices
  state_->choose_fonts(height);
  unsigned char* pixels = nullptr;
  io.Fonts->GetTexDataAsAlpha8(&pixels, &state_->atlas.width, &state_->atlas.height);
  state_->atlas.alpha = {
      pixels, static_cast<std::size_t>(state_->atlas.width) * static_cast<std::size_t>(state_->atlas.height)};
  ImGui::SetCurrentContext(before);
}

Overlay::~Overlay() {
  ImGui::DestroyContext(state_->context);
}

FontAtlas Overlay::font() const {
  return state_->atlas;
}

OverlayMesh Overlay::build(const DrawnScene& scene, const Snapshot& snapshot, const OverlayContent& content) {
  ImGuiContext* const before = ImGui::GetCurrentContext();
  ImGui::SetCurrentContext(state_->context);
  ImGuiIO& io = ImGui::GetIO();
  io.DisplaySize = {static_cast<float>(content.width), static_cast<float>(content.height)};
  io.DeltaTime = 1.0F / 60.0F;
  if (content.panel != nullptr) content.panel->take_input();
  ImGui::NewFrame();
  Pen& pen = state_->pen;
  pen.inks = content.dark ? kDarkInks : kLightInks;
  pen.list = ImGui::GetBackgroundDrawList();

  const PixelRect& view = content.layout.scene;
  if (content.inset) draw_inset_frame(pen, snapshot, content);
  draw_force_label(pen, scene, snapshot, content.camera, view);
  if (content.inset) {
    draw_force_label(pen, scene, snapshot, content.inset->camera, content.layout.inset);
    draw_scale_bar(pen, content.inset->camera, content.layout.inset);
  }
  draw_slice_frames(pen, content);
  draw_heading(pen, scene, snapshot, content);
  if (shows_a_session(scene)) draw_scale_bar(pen, content.camera, view);
  if (content.panel != nullptr) {
    content.panel->draw(pen, scene, snapshot, content.layout.column);
    draw_colour_key(pen, scene, content);
  } else {
    draw_column(pen, scene, snapshot, content);
  }
  if (!content.notice.empty()) draw_notice(pen, content.notice, view);
  if (!content.help.empty()) {
    pen.label(pen.em, static_cast<float>(content.height) - 1.7F * pen.em, pen.inks.pale,
              pen.fit(content.help, static_cast<float>(content.width) - 2.0F * pen.em));
  }

  ImGui::Render();
  OverlayMesh mesh;
  const ImDrawData* drawn = ImGui::GetDrawData();
  for (int l = 0; l < drawn->CmdListsCount; ++l) {
    const ImDrawList& list = *drawn->CmdLists[l];
    const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
    for (const ImDrawVert& v : list.VtxBuffer)
      mesh.vertices.push_back({v.pos.x, v.pos.y, v.uv.x, v.uv.y, v.col});
    for (const ImDrawCmd& command : list.CmdBuffer) {
      const PixelRect inside{static_cast<int>(command.ClipRect.x), static_cast<int>(command.ClipRect.y),
                             static_cast<int>(std::ceil(command.ClipRect.z - command.ClipRect.x)),
                             static_cast<int>(std::ceil(command.ClipRect.w - command.ClipRect.y))};
      mesh.batches.push_back({mesh.indices.size(), command.ElemCount, inside});
      for (unsigned i = 0; i < command.ElemCount; ++i) {
        const auto index = list.IdxBuffer[static_cast<int>(command.IdxOffset + i)];
        mesh.indices.push_back(base + command.VtxOffset + index);
      }
    }
  }
  ImGui::SetCurrentContext(before);
  return mesh;
}

std::string force_text(double force_N) {
  if (!std::isfinite(force_N)) return "not finite";
  const double size = std::abs(force_N);
  return with_decimals(force_N, size < 0.9995 ? 3 : (size < 99.95 ? 2 : 0)) + " N";
}

std::string length_text(double length_m) {
  if (!std::isfinite(length_m)) return "not finite";
  const double size = std::abs(length_m);
  const auto say = [&](double unit, const char* name) {
    return with_digits(length_m / unit, 3) + " " + name;
  };
  if (size >= 0.9995e3) return say(1e3, "km");
  if (size >= 0.9995) return say(1.0, "m");
  if (size >= 0.9995e-5 || size == 0.0) return say(1e-3, "mm");
  return size >= 0.9995e-7 ? say(1e-6, "µm") : say(1e-9, "nm");
}

double round_down(double value) {
  if (!(value > 0.0) || !std::isfinite(value)) return 0.0;
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  double best = power;
  for (const double step : {2.0, 5.0, 10.0}) {
    if (step * power <= value * (1.0 + 1e-9)) best = step * power;
  }
  return best;
}

}  // namespace hybrid
