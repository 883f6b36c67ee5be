// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/overlay.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <glm/geometric.hpp>
#include <numeric>
#include <system_error>

#include "hybrid/felt_geometry.h"
#include "hybrid/palette.h"

namespace hybrid {
namespace {

ImU32 colour(const glm::vec3& c, float alpha = 1.0F) {
  return ImGui::ColorConvertFloat4ToU32({c.r, c.g, c.b, alpha});
}

const ImU32 ink = IM_COL32(28, 33, 41, 255);
const ImU32 pale_ink = IM_COL32(92, 101, 114, 255);
const ImU32 paper = IM_COL32(255, 255, 255, 222);
const ImU32 edge = IM_COL32(160, 168, 178, 255);

std::string number(double value, const char* format) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), format, value);  // NOLINT(clang-diagnostic-format-nonliteral)
  return text.data();
}

std::string force_text(double force_N) {
  if (!std::isfinite(force_N)) return "not finite";
  const double size = std::abs(force_N);
  return number(force_N, size < 0.9995 ? "%.3f N" : (size < 99.95 ? "%.2f N" : "%.0f N"));
}

bool finite(const glm::dvec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

// Draws with one list; keeps the two fonts and the unit of space.
struct Pen {
  ImDrawList* list = nullptr;
  ImFont* body = nullptr;
  ImFont* head = nullptr;
  float em = 13.0F;  // height of body text (pixels)

  [[nodiscard]] float width(const std::string& text, bool large = false) const {
    ImFont* font = large ? head : body;
    return font->CalcTextSizeA(font->FontSize, 1e9F, 0.0F, text.c_str(), text.c_str() + text.size()).x;
  }
  void text(float x, float y, ImU32 ink_colour, const std::string& words, bool large = false) const {
    ImFont* font = large ? head : body;
    list->AddText(font, font->FontSize, {std::round(x), std::round(y)}, ink_colour, words.c_str(),
                  words.c_str() + words.size());
  }
  // On a light plate, for words over the scene.
  void label(float x, float y, ImU32 ink_colour, const std::string& words) const {
    list->AddRectFilled({x - 0.35F * em, y - 0.2F * em}, {x + width(words) + 0.35F * em, y + 1.2F * em},
                        paper, 3.0F);
    text(x, y, ink_colour, words);
  }
  void plate(float x, float y, float w, float h) const {
    list->AddRectFilled({x, y}, {x + w, y + h}, paper, 5.0F);
    list->AddRect({x, y}, {x + w, y + h}, edge, 5.0F);
  }
  // Shortened at the end so that it is at most `most` pixels wide; cuts between UTF-8 characters.
  [[nodiscard]] std::string fit(std::string words, float most) const {
    if (width(words) <= most) return words;
    while (!words.empty() && width(words + "...") > most) {
      do {
        const bool continuation = (static_cast<unsigned char>(words.back()) & 0xC0U) == 0x80U;
        words.pop_back();
        if (!continuation) break;
      } while (!words.empty());
    }
    return words + "...";
  }
};

float draw_heading(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot,
                   const OverlayContent& content) {
  const float em = pen.em;
  const float x = em;
  float y = 0.8F * em;
  std::string title = scene.title.empty() ? "untitled scene" : scene.title;
  // The head font is twice the body's: fit() measures the body's.
  title = pen.fit(title, (static_cast<float>(content.width) - 2.0F * em) / 2.0F);
  pen.text(x, y, ink, title, true);
  y += 2.2F * em;
  pen.text(x, y, ink,
           "time " + number(snapshot.t_s, "%.3f s") + "    force on the hand " +
               force_text(glm::length(snapshot.force_N)) + (content.paused ? "    PAUSED" : ""));
  return y + 2.0F * em;
}

void draw_legend(const Pen& pen, float top, const DrawnScene& scene, const Snapshot& snapshot,
                 const OverlayContent& content) {
  const float em = pen.em;
  struct Row {
    ImU32 swatch;
    std::string name, kind, force;
    bool touched;
  };
  std::vector<Row> rows;
  // What does not fit is counted, not dropped in silence; what is touched and what is soft goes first.
  const std::size_t most =
      static_cast<std::size_t>(std::max(3.0F, (0.55F * static_cast<float>(content.height)) / (1.6F * em)));
  const auto feel_of = [&snapshot](std::size_t i) {
    return i < snapshot.feel.size() ? snapshot.feel[i] : ObjectFeel{};
  };
  std::vector<std::size_t> shown(scene.objects.size());
  std::iota(shown.begin(), shown.end(), std::size_t{0});
  if (shown.size() > most) {
    const auto rank = [&](std::size_t i) { return feel_of(i).contact ? 0 : scene.objects[i].soft ? 1 : 2; };
    std::stable_sort(shown.begin(), shown.end(),
                     [&](std::size_t a, std::size_t b) { return rank(a) < rank(b); });
    shown.resize(std::min<std::size_t>(most, 10));  // a list that is cut anyway need not hide the scene
  }
  for (const std::size_t i : shown) {
    const DrawnObject& object = scene.objects[i];
    const ObjectFeel feel = feel_of(i);
    rows.push_back({colour(palette::of_object(scene, i)), pen.fit(object.name, 22.0F * em),
                    object.soft ? "soft" : "rigid", feel.contact ? force_text(feel.force_N) : "-",
                    feel.contact});
  }
  if (scene.objects.size() > shown.size()) {
    rows.push_back(
        {0, "and " + std::to_string(scene.objects.size() - shown.size()) + " more", "", "", false});
  }
  rows.push_back(
      {colour(palette::tool), "tool, as felt (proxy)", scene.tool_is_punch ? "punch" : "ball", "", false});
  rows.push_back({colour(palette::device, 0.45F), "tool, where the device is", "",
                  finite(snapshot.device_m - snapshot.proxy_m)
                      ? length_text(glm::length(snapshot.device_m - snapshot.proxy_m)) + " off"
                      : "not finite",
                  false});
  rows.push_back(
      {colour(palette::force), "force on the hand", "", force_text(glm::length(snapshot.force_N)), false});
  float name_width = 0.0F;
  float force_width = 0.0F;
  for (const Row& row : rows) {
    name_width = std::max(name_width, pen.width(row.name));
    force_width = std::max(force_width, pen.width(row.force));
  }
  const float kind_width = pen.width("punch");
  const float w = 2.6F * em + name_width + em + kind_width + em + force_width + em;
  pen.plate(em, top, w, 1.6F * em * static_cast<float>(rows.size()) + em);
  float y = top + 0.7F * em;
  for (const Row& row : rows) {
    const float x = em + 0.8F * em;
    if (row.swatch != 0) {
      pen.list->AddRectFilled({x, y}, {x + em, y + em}, row.swatch, 2.0F);
      pen.list->AddRect({x, y}, {x + em, y + em}, row.touched ? ink : edge, 2.0F, 0,
                        row.touched ? 2.0F : 1.0F);
    }
    pen.text(x + 1.6F * em, y, ink, row.name);
    pen.text(x + 2.6F * em + name_width, y, pale_ink, row.kind);
    pen.text(x + 3.0F * em + name_width + kind_width + force_width - pen.width(row.force) + 0.2F * em, y,
             row.touched ? ink : pale_ink, row.force);
    y += 1.6F * em;
  }
}

void draw_colour_scale(const Pen& pen, const DrawnScene& scene, const OverlayContent& content) {
  if (!(content.displacement_scale_m > 0.0)) return;
  const float em = pen.em;
  std::vector<std::size_t> soft;
  for (std::size_t i = 0; i < scene.objects.size() && soft.size() < 6; ++i) {
    if (scene.objects[i].soft) soft.push_back(i);
  }
  if (soft.empty()) return;
  const float bar_width = 1.1F * em;
  const float bar_height = 12.0F * em;
  const std::string title = "tissue moved by";
  const float bars =
      bar_width * static_cast<float>(soft.size()) + 0.25F * em * static_cast<float>(soft.size() - 1);
  const float w = std::max(pen.width(title), bars + 0.6F * em + pen.width("0.00 mm")) + 1.6F * em;
  const float x0 = static_cast<float>(content.width) - w - em;
  const float y0 = 4.2F * em;
  pen.plate(x0, y0, w, bar_height + 4.0F * em);
  pen.text(x0 + 0.8F * em, y0 + 0.7F * em, ink, title);
  const float top = y0 + 2.8F * em;
  float x = x0 + 0.8F * em;
  for (const std::size_t i : soft) {
    constexpr int steps = 40;
    const glm::vec3 own = palette::of_object(scene, i);
    for (int s = 0; s < steps; ++s) {
      const float a = top + bar_height * static_cast<float>(s) / static_cast<float>(steps);
      const float b = top + bar_height * static_cast<float>(s + 1) / static_cast<float>(steps);
      const float share = 1.0F - (static_cast<float>(s) + 0.5F) / static_cast<float>(steps);
      pen.list->AddRectFilled({x, a}, {x + bar_width, b}, colour(palette::of_displacement(own, share)));
    }
    pen.list->AddRect({x, top}, {x + bar_width, top + bar_height}, edge);
    x += bar_width + 0.25F * em;
  }
  for (int tick = 0; tick <= 4; ++tick) {
    const float y = top + bar_height * (1.0F - static_cast<float>(tick) / 4.0F);
    pen.list->AddLine({x - 0.25F * em, y}, {x + 0.1F * em, y}, ink);
    pen.text(x + 0.35F * em, y - 0.5F * em, ink,
             tick == 0 ? "0" : length_text(content.displacement_scale_m * tick / 4.0));
  }
}

// A bar of a round length at the depth of the view's target.
void draw_scale_bar(const Pen& pen, const Camera& camera, const PixelRect& where) {
  const double per_pixel = camera.view_height_m() / where.height;
  const double length = round_down(per_pixel * 0.24 * where.width);
  if (!(length > 0.0)) return;
  const float em = pen.em;
  const auto w = static_cast<float>(length / per_pixel);
  const float x = static_cast<float>(where.x) + 1.2F * em;
  const float y = static_cast<float>(where.y + where.height) - 1.4F * em;
  const std::string words = length_text(length);
  pen.list->AddRectFilled({x - 0.5F * em, y - 1.9F * em},
                          {x + std::max(w, pen.width(words)) + 0.5F * em, y + 0.7F * em}, paper, 3.0F);
  pen.list->AddRectFilled({x, y - 2.0F}, {x + w, y + 2.0F}, ink);
  for (const float end : {x, x + w}) pen.list->AddLine({end, y - 5.0F}, {end, y + 5.0F}, ink, 2.0F);
  pen.text(x, y - 1.6F * em, ink, words);
}

void draw_force_label(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera,
                      const PixelRect& where) {
  const double force = glm::length(snapshot.force_N);
  if (!(force > 1e-3) || !std::isfinite(force) || !finite(snapshot.proxy_m)) return;
  const auto tip = camera.pixel(arrow_tip(scene, snapshot, camera), where.width, where.height);
  if (!tip) return;
  const std::string words = force_text(force);
  const float most_x = static_cast<float>(where.width) - pen.width(words) - 0.6F * pen.em;
  const float most_y = static_cast<float>(where.height) - 2.0F * pen.em;
  // Beyond the tip of an arrow to the left: beside it, the words would lie on the arrow.
  const auto base = camera.pixel(snapshot.proxy_m, where.width, where.height);
  const bool left = base && base->x - tip->x > 0.5 * std::abs(base->y - tip->y);
  const float aside = left ? -0.8F * pen.em - pen.width(words) : 0.8F * pen.em;
  const float x =
      std::clamp(static_cast<float>(tip->x) + aside, 0.5F * pen.em, std::max(most_x, 0.5F * pen.em));
  const float y =
      std::clamp(static_cast<float>(tip->y) - 0.6F * pen.em, 0.5F * pen.em, std::max(most_y, 0.5F * pen.em));
  pen.label(static_cast<float>(where.x) + x, static_cast<float>(where.y) + y, colour(palette::force), words);
}

void draw_inset_frame(const Pen& pen, const Snapshot& snapshot, const OverlayContent& content) {
  const PixelRect& r = content.inset->where;
  const ImVec2 a(static_cast<float>(r.x), static_cast<float>(r.y));
  const ImVec2 b(a.x + static_cast<float>(r.width), a.y + static_cast<float>(r.height));
  // What the inset shows is ringed in the large view, and tied to it.
  if (const auto at = content.camera.pixel(snapshot.proxy_m, content.width, content.height)) {
    const double per_pixel = content.camera.view_height_m() / content.height;
    const auto radius =
        std::max(static_cast<float>(0.5 * content.inset->camera.view_height_m() / per_pixel), 0.6F * pen.em);
    const ImVec2 centre(static_cast<float>(at->x), static_cast<float>(at->y));
    const ImVec2 corner(std::clamp(centre.x, a.x, b.x), std::clamp(centre.y, a.y, b.y));
    const float dx = corner.x - centre.x;
    const float dy = corner.y - centre.y;
    const float apart = std::sqrt(dx * dx + dy * dy);
    pen.list->AddCircle(centre, radius, ink, 48, 1.5F);
    if (apart > radius) {
      pen.list->AddLine({centre.x + dx / apart * radius, centre.y + dy / apart * radius}, corner, ink, 1.5F);
    }
  }
  pen.list->AddRect(a, b, ink, 0.0F, 0, 2.0F);
  pen.label(a.x + 0.7F * pen.em, a.y + 0.6F * pen.em, ink, "the contact, nearer");
}

void draw_history(const Pen& pen, const OverlayContent& content) {
  if (content.history.size() < 2) return;
  const float em = pen.em;
  const float w = std::min(30.0F * em, 0.4F * static_cast<float>(content.width));
  const float h = 7.0F * em;
  const float x0 = em;
  const float y0 = static_cast<float>(content.height) - h - 6.2F * em;
  const double end = content.history.back().t_s;
  const double span = std::max(end - content.history.front().t_s, 1e-3);
  double most = 0.0;
  for (const ForceSample& sample : content.history) {
    if (std::isfinite(sample.force_N)) most = std::max(most, sample.force_N);
  }
  // The end of the axis: twice the largest round number below, or that number where it is enough.
  double top = most > 0.0 ? round_down(most) : 1.0;
  while (top < most) top += round_down(most);
  pen.plate(x0, y0, w, h);
  pen.text(x0 + 0.6F * em, y0 + 0.4F * em, ink,
           "force, last " + number(span, "%.1f s") + "  (top " + force_text(top) + ")");
  const float low = y0 + h - 0.5F * em;
  const float high = y0 + 1.9F * em;
  pen.list->AddLine({x0 + 2.0F, high}, {x0 + w - 2.0F, high}, edge);
  pen.list->AddLine({x0 + 2.0F, low}, {x0 + w - 2.0F, low}, edge);
  // The largest force in each pixel column; a gap where it was not finite.
  const auto columns = static_cast<std::size_t>(w) - 4;
  std::vector<double> column(columns, -1.0);
  for (const ForceSample& sample : content.history) {
    if (!std::isfinite(sample.force_N)) continue;
    const double share = std::clamp((sample.t_s - (end - span)) / span, 0.0, 1.0);
    double& at = column[static_cast<std::size_t>(share * static_cast<double>(columns - 1))];
    at = std::max(at, sample.force_N);
  }
  std::optional<ImVec2> last;
  for (std::size_t c = 0; c < columns; ++c) {
    if (column[c] < 0.0) continue;
    const ImVec2 at(x0 + 2.0F + static_cast<float>(c),
                    low - static_cast<float>(column[c] / top) * (low - high));
    if (last) pen.list->AddLine(*last, at, colour(palette::force), 1.5F);
    last = at;
  }
}

}  // namespace

struct Overlay::State {
  ImGuiContext* context = nullptr;
  Pen pen;
  FontAtlas atlas;

  // A font of the system where there is one that is known to be good (legible at any size, and it knows more
  // than Latin letters); else the embedded one, which is drawn for 13 pixels and sharp only at multiples of
  // it.
  void choose_fonts(int height) {
    ImFontAtlas& fonts = *ImGui::GetIO().Fonts;
    ImFontConfig config;
    for (const char* file :
         {"/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf",
          "/usr/share/fonts/dejavu-sans-fonts/DejaVuSans.ttf", "/usr/share/fonts/TTF/DejaVuSans.ttf"}) {
      std::error_code ignored;
      if (!std::filesystem::is_regular_file(file, ignored)) continue;
      static constexpr std::array<ImWchar, 9> ranges{0x0020, 0x024F, 0x0370, 0x03FF, 0x0400,
                                                     0x04FF, 0x2010, 0x2264, 0};
      pen.em = std::round(std::clamp(static_cast<float>(height) / 58.0F, 13.0F, 64.0F));
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
  io.IniFilename = nullptr;  // leaves no file behind
  io.LogFilename = nullptr;
  io.BackendFlags |= ImGuiBackendFlags_RendererHasVtxOffset;  // build() adds the offsets: no limit of 65,536
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
  ImGui::NewFrame();
  Pen& pen = state_->pen;
  pen.list = ImGui::GetForegroundDrawList();

  const PixelRect whole{0, 0, content.width, content.height};
  if (content.inset) draw_inset_frame(pen, snapshot, content);
  draw_force_label(pen, scene, snapshot, content.camera, whole);
  if (content.inset) {
    draw_force_label(pen, scene, snapshot, content.inset->camera, content.inset->where);
    draw_scale_bar(pen, content.inset->camera, content.inset->where);
  }
  const float below = draw_heading(pen, scene, snapshot, content);
  draw_legend(pen, below, scene, snapshot, content);
  draw_colour_scale(pen, scene, content);
  PixelRect bar = whole;
  if (!content.help.empty()) bar.height -= static_cast<int>(1.8F * pen.em);
  draw_scale_bar(pen, content.camera, bar);
  draw_history(pen, content);
  if (!content.help.empty()) {
    pen.label(pen.em, static_cast<float>(content.height) - 1.7F * pen.em, pale_ink,
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
      for (unsigned i = 0; i < command.ElemCount; ++i) {
        const auto index = list.IdxBuffer[static_cast<int>(command.IdxOffset + i)];
        mesh.indices.push_back(base + command.VtxOffset + index);
      }
    }
  }
  ImGui::SetCurrentContext(before);
  return mesh;
}

std::string length_text(double length_m) {
  if (!std::isfinite(length_m)) return "not finite";
  const double size = std::abs(length_m);
  const auto say = [&](double unit, const char* name) { return number(length_m / unit, "%.3g ") + name; };
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
