// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <set>
#include <string>

#include "hybrid/base/number_text.h"
#include "hybrid/view/overlay_parts.h"
#include "hybrid/view/palette.h"

namespace hybrid {
namespace {

constexpr int kSteps = 160;           // bands of colour along a scale
constexpr float kRampHeight = 16.0F;  // of an upright scale (em)
constexpr float kRow = 1.5F;          // row pitch of the names (em)

std::string title_of(TissueColour colour) {
  switch (colour) {
    case TissueColour::strain:
      return "largest strain";
    case TissueColour::limits:
      return "links, of their limit";
    case TissueColour::difference:
      return "felt difference of two models";
    default:
      return "tissue moved by";
  }
}

std::string value_text(const ColourScale& scale, double share) {
  if (share == 0.0) return "0";
  if (scale.colour == TissueColour::displacement) return length_text(share * scale.end);
  // A few places may have a larger strain or difference than the scale's end.
  const bool more = scale.colour != TissueColour::limits && share == 1.0;
  const bool differs = scale.colour == TissueColour::difference;
  return (more ? "≥ " : "") + with_digits((differs ? 1.0 : 100.0) * share * scale.end, 3) +
         (differs ? " JND" : " %");
}

// The place on a scale of differences from which on a hand feels them, as a share; empty: no mark.
std::optional<float> mark_of(const ColourScale& scale) {
  if (scale.colour != TissueColour::difference || !(scale.end > 1.0)) return {};
  return static_cast<float>(1.0 / scale.end);
}

// Tissue that hardly moved keeps its own colour. The scale shows white in its place.
Ink ink_at(const ColourScale& scale, float share) {
  return ink_of(palette::of_displacement(glm::vec3(1.0F), share, scale.start()));
}

bool contains(const PixelRect& rect, const glm::vec2& at) {
  return at.x >= static_cast<float>(rect.x) && at.y >= static_cast<float>(rect.y) &&
         at.x <= static_cast<float>(rect.x + rect.width) && at.y <= static_cast<float>(rect.y + rect.height);
}

// The part of a line within a rectangle, as two shares of the line (Liang & Barsky 1984). first > last: no
// part.
std::pair<float, float> shares_within(const glm::vec2& from, const glm::vec2& to, const PixelRect& rect) {
  const glm::vec2 low(rect.x, rect.y), high(rect.x + rect.width, rect.y + rect.height), way = to - from;
  float first = 0.0F, last = 1.0F;
  for (int d = 0; d < 2; ++d) {
    if (way[d] == 0.0F) {
      if (from[d] < low[d] || from[d] > high[d]) return {1.0F, 0.0F};
      continue;
    }
    const float a = (low[d] - from[d]) / way[d], b = (high[d] - from[d]) / way[d];
    first = std::max(first, std::min(a, b));
    last = std::min(last, std::max(a, b));
  }
  return {first, last};
}

// The pieces of a line that lie within a rectangle and outside another one.
std::vector<std::pair<glm::vec2, glm::vec2>> seen_pieces(const glm::vec2& from, const glm::vec2& to,
                                                         const PixelRect& within,
                                                         const std::optional<PixelRect>& outside) {
  std::vector<std::pair<glm::vec2, glm::vec2>> pieces;
  const auto add = [&](float a, float b) {
    if (a < b) pieces.emplace_back(from + a * (to - from), from + b * (to - from));
  };
  const auto [first, last] = shares_within(from, to, within);
  const auto [hidden, shown] =
      outside ? shares_within(from, to, *outside) : std::pair<float, float>{1.0F, 0.0F};
  if (hidden >= shown) {
    add(first, last);
  } else {
    add(first, std::min(last, hidden));
    add(std::max(first, shown), last);
  }
  return pieces;
}

// Draws an upright scale with its title. Returns the height that it took.
float draw_upright(const Pen& pen, float x0, float y0, float width, const ColourScale& scale) {
  const float em = pen.em;
  float y = y0;
  for (const std::string& line : pen.wrap(title_of(scale.colour), width)) {
    pen.text(x0, y, pen.inks.text, line);
    y += 1.3F * em;
  }
  const float top = y + 0.5F * em, bottom = top + kRampHeight * em, right = x0 + 1.4F * em;
  for (int s = 0; s < kSteps; ++s) {
    const float a = static_cast<float>(s) / kSteps, b = static_cast<float>(s + 1) / kSteps;
    pen.fill({x0, bottom - b * (bottom - top)}, {right, bottom - a * (bottom - top)},
             ink_at(scale, 0.5F * (a + b)));
  }
  pen.frame({x0, top}, {right, bottom}, pen.inks.edge);
  if (const auto mark = mark_of(scale)) {
    const float at = bottom - *mark * (bottom - top);
    pen.line({x0 - 0.2F * em, at}, {right + 0.2F * em, at}, pen.inks.text, 2.0F);
  }
  for (int tick = 0; tick <= 4; ++tick) {
    const float at = bottom - 0.25F * static_cast<float>(tick) * (bottom - top);
    pen.line({right, at}, {right + 0.3F * em, at}, pen.inks.text);
    pen.text(right + 0.6F * em, at - 0.6F * em, pen.inks.text, value_text(scale, 0.25 * tick));
  }
  return bottom + 1.2F * em - y0;
}

}  // namespace

void draw_colour_scale(const Pen& pen, const PixelRect& where, const ColourScale& scale) {
  const float em = pen.em;
  const auto x0 = static_cast<float>(where.x), y0 = static_cast<float>(where.y);
  const auto w = static_cast<float>(where.width);
  pen.plate(x0, y0, w, static_cast<float>(where.height));
  pen.text(x0 + 0.8F * em, y0 + 0.5F * em, pen.inks.text, title_of(scale.colour));
  const float left = x0 + 0.8F * em, right = x0 + w - 0.8F * em;
  const float top = y0 + 2.0F * em, bottom = top + 0.9F * em;
  for (int s = 0; s < kSteps; ++s) {
    const float a = static_cast<float>(s) / kSteps, b = static_cast<float>(s + 1) / kSteps;
    pen.fill({left + a * (right - left), top}, {left + b * (right - left), bottom},
             ink_at(scale, 0.5F * (a + b)));
  }
  pen.frame({left, top}, {right, bottom}, pen.inks.edge);
  if (const auto mark = mark_of(scale)) {
    const float x = left + *mark * (right - left);
    pen.line({x, top - 0.2F * em}, {x, bottom + 0.2F * em}, pen.inks.text, 2.0F);
  }
  for (int tick = 0; tick <= 4; ++tick) {
    const float x = left + (right - left) * static_cast<float>(tick) / 4.0F;
    pen.line({x, bottom}, {x, bottom + 0.25F * em}, pen.inks.text);
    if (tick % 2 != 0) continue;
    const std::string words = value_text(scale, 0.25 * tick);
    const float wide = pen.width(words);
    pen.text(std::clamp(x - 0.5F * wide, left, right - wide), bottom + 0.4F * em, pen.inks.text, words);
  }
}

void draw_colour_key(const Pen& pen, const DrawnScene& scene, const OverlayContent& content) {
  const PixelRect& where = content.layout.key;
  if (where.width == 0) return;
  const float em = pen.em, x = static_cast<float>(where.x) + 0.7F * em;
  const float width = static_cast<float>(where.width) - 1.2F * em;
  const auto end = static_cast<float>(where.y + where.height);
  float y = static_cast<float>(where.y) + 0.3F * em;
  if (content.scale.end > 0.0) y += draw_upright(pen, x, y, width, content.scale);
  if (!content.names_materials) return;
  std::set<std::string> named;
  for (std::size_t o = 0; o < scene.objects.size(); ++o) {
    const std::vector<std::string>& names = scene.objects[o].inside.materials;
    const std::vector<glm::vec3> colours = palette::of_inside(scene, o);
    for (std::size_t m = 0; m < names.size() && y + kRow * em < end; ++m) {
      // An object of one material is known by its own name.
      const std::string& name = names.size() == 1 ? scene.objects[o].name : names[m];
      if (!named.insert(name).second) continue;
      pen.fill({x, y + 0.1F * em}, {x + em, y + 1.1F * em}, ink_of(colours[m]), 2.0F);
      pen.frame({x, y + 0.1F * em}, {x + em, y + 1.1F * em}, pen.inks.edge, 2.0F);
      pen.text(x + 1.4F * em, y, pen.inks.text, pen.fit(name, width - 1.4F * em));
      y += kRow * em;
    }
  }
}

void draw_slice_frames(const Pen& pen, const OverlayContent& content) {
  const PixelRect& where = content.layout.scene;
  const std::optional<PixelRect> inset =
      content.inset ? std::optional(content.layout.inset) : std::optional<PixelRect>();
  const auto pixel = [&](const glm::dvec3& at_m) -> std::optional<glm::vec2> {
    const auto at = content.layout.pixel(content.camera, at_m);
    if (!at) return {};
    return glm::vec2(*at);
  };
  for (const SliceFrame& frame : content.slices) {
    const Ink ink = ink_of(palette::axes[frame.axis]);
    for (std::size_t n = 0; n < 4; ++n) {
      const auto from = pixel(frame.corners_m[n]), to = pixel(frame.corners_m[(n + 1) % 4]);
      if (!from || !to) continue;
      for (const auto& [a, b] : seen_pieces(*from, *to, where, inset)) pen.line(a, b, ink, 1.5F);
    }
    const auto handle = pixel(frame.handle_m());
    if (!handle || !contains(where, *handle) || (inset && contains(*inset, *handle))) continue;
    const std::string name(1, "xyz"[frame.axis]);
    const float radius = kSliceHandle * pen.em;
    pen.fill(*handle - radius, *handle + radius, ink, radius);
    pen.text(handle->x - 0.5F * pen.width(name), handle->y - 0.62F * pen.em, ink_of(255, 255, 255), name);
  }
}

}  // namespace hybrid
