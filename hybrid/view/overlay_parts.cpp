// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/overlay_parts.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "hybrid/base/number_text.h"
#include "hybrid/view/tool_and_arrow.h"
#include "polygon/mesh/is_finite.h"

namespace hybrid {
namespace {

constexpr float kHairline = 1.0F;  // pixels; thin, so that it covers little of the scene

}  // namespace

bool shows_a_session(const DrawnScene& scene) {
  return !scene.objects.empty() || scene.tool_radius_m > 0.0;
}

void draw_heading(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot,
                  const OverlayContent& content) {
  const float em = pen.em;
  const float x = em;
  float y = 0.8F * em;
  std::string title = scene.title.empty() ? "untitled scene" : scene.title;
  // The title's font is twice as large as the body's, with which fit() measures.
  title = pen.fit(title, (static_cast<float>(content.width) - 2.0F * em) / 2.0F);
  pen.text(x, y, pen.inks.text, title, true);
  if (!shows_a_session(scene)) return;
  y += 2.2F * em;
  pen.text(x, y, pen.inks.text,
           "time " + with_decimals(snapshot.t_s, 3) + " s    force on the hand " +
               force_text(glm::length(snapshot.force_N)) + (content.paused ? "    PAUSED" : ""));
}

void draw_scale_bar(const Pen& pen, const Camera& camera, const PixelRect& where) {
  const double per_pixel = camera.view_height_m() / where.height;
  const double length = round_down(per_pixel * 0.24 * where.width);
  if (!(length > 0.0)) return;
  const float em = pen.em;
  const auto w = static_cast<float>(length / per_pixel);
  const float x = static_cast<float>(where.x) + 1.2F * em;
  const float y = static_cast<float>(where.y + where.height) - 1.4F * em;
  const std::string words = length_text(length);
  pen.fill({x - 0.5F * em, y - 1.9F * em}, {x + std::max(w, pen.width(words)) + 0.5F * em, y + 0.7F * em},
           pen.inks.paper, 3.0F);
  pen.fill({x, y - 1.0F}, {x + w, y + 1.0F}, pen.inks.text);
  for (const float end : {x, x + w}) pen.line({end, y - 5.0F}, {end, y + 5.0F}, pen.inks.text, 2.0F);
  pen.text(x, y - 1.6F * em, pen.inks.text, words);
}

void draw_force_label(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera,
                      const PixelRect& where) {
  const double force = glm::length(snapshot.force_N);
  if (!(force > 1e-3) || !std::isfinite(force) || !polygon::is_finite(snapshot.proxy_m)) return;
  const auto tip = camera.pixel(arrow_tip(scene, snapshot, camera), where.width, where.height);
  if (!tip) return;
  const std::string words = force_text(force);
  const float most_x = static_cast<float>(where.width) - pen.width(words) - 0.6F * pen.em;
  const float most_y = static_cast<float>(where.height) - 2.0F * pen.em;
  // If the arrow points left, the label is to the left of the tip: on the right it would cover the arrow.
  const auto base = camera.pixel(snapshot.proxy_m, where.width, where.height);
  const bool left = base && base->x - tip->x > 0.5 * std::abs(base->y - tip->y);
  const float aside = left ? -0.8F * pen.em - pen.width(words) : 0.8F * pen.em;
  const float x =
      std::clamp(static_cast<float>(tip->x) + aside, 0.5F * pen.em, std::max(most_x, 0.5F * pen.em));
  const float y =
      std::clamp(static_cast<float>(tip->y) - 0.6F * pen.em, 0.5F * pen.em, std::max(most_y, 0.5F * pen.em));
  pen.label(static_cast<float>(where.x) + x, static_cast<float>(where.y) + y, pen.inks.force, words);
}

void draw_inset_frame(const Pen& pen, const Snapshot& snapshot, const OverlayContent& content) {
  const PixelRect& r = content.layout.inset;
  const glm::vec2 a(static_cast<float>(r.x), static_cast<float>(r.y));
  const glm::vec2 b(a.x + static_cast<float>(r.width), a.y + static_cast<float>(r.height));
  if (const auto at = content.layout.pixel(content.camera, snapshot.proxy_m)) {
    const double per_pixel = content.camera.view_height_m() / content.layout.scene.height;
    const auto radius =
        std::max(static_cast<float>(0.5 * content.inset->camera.view_height_m() / per_pixel), 0.6F * pen.em);
    const glm::vec2 centre(static_cast<float>(at->x), static_cast<float>(at->y));
    const glm::vec2 corner(std::clamp(centre.x, a.x, b.x), std::clamp(centre.y, a.y, b.y));
    const glm::vec2 way = corner - centre;
    const float distance = glm::length(way);
    pen.circle(centre, radius, pen.inks.pale, kHairline);
    if (distance > radius) pen.line(centre + way / distance * radius, corner, pen.inks.pale, kHairline);
  }
  pen.frame(a, b, pen.inks.pale, 0.0F, kHairline);
  pen.label(a.x + 0.7F * pen.em, a.y + 0.6F * pen.em, pen.inks.text,
            "the contact, " + with_decimals(content.inset->nearer, 1) + " times nearer");
}

void draw_notice(const Pen& pen, const std::string& words, const PixelRect& where) {
  constexpr float line = 1.35F, margin = 0.8F, share = 0.62F;  // em; em; greatest width (unit: the scene's)
  const float em = pen.em;
  const std::vector<std::string> lines = pen.wrap(words, share * static_cast<float>(where.width));
  float widest = 0.0F;
  for (const std::string& text : lines) widest = std::max(widest, pen.width(text));
  const float x = static_cast<float>(where.x) + em;
  float y = static_cast<float>(where.y);
  pen.plate(x, y, widest + 2.0F * margin * em, (line * static_cast<float>(lines.size()) + margin) * em);
  y += 0.5F * margin * em;
  for (const std::string& text : lines) {
    pen.text(x + margin * em, y, pen.inks.text, text);
    y += line * em;
  }
}

}  // namespace hybrid
