// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/overlay_parts.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "hybrid/base/number_text.h"
#include "hybrid/view/palette.h"
#include "hybrid/view/tool_and_arrow.h"
#include "polygon/mesh/is_finite.h"

namespace hybrid {
namespace {

// Colours of the soft objects, at most six: the first of each object, then the materials with the most
// surface.
std::vector<glm::vec3> colours_at_rest(const DrawnScene& scene) {
  constexpr std::size_t most = 6;
  std::vector<std::vector<glm::vec3>> of_object;
  std::size_t longest = 0;
  for (std::size_t i = 0; i < scene.objects.size() && of_object.size() < most; ++i) {
    if (!scene.objects[i].soft) continue;
    of_object.push_back(palette::of_materials(scene, i));
    longest = std::max(longest, of_object.back().size());
  }
  std::vector<glm::vec3> colours;
  for (std::size_t rank = 0; rank < longest; ++rank) {
    for (const auto& own : of_object) {
      if (rank >= own.size() || colours.size() == most) continue;
      if (std::ranges::find(colours, own[rank]) == colours.end()) colours.push_back(own[rank]);
    }
  }
  return colours;
}

}  // namespace

float draw_heading(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot,
                   const OverlayContent& content) {
  const float em = pen.em;
  const float x = em;
  float y = 0.8F * em;
  std::string title = scene.title.empty() ? "untitled scene" : scene.title;
  // The head font is twice the body's, and fit() measures with the body's.
  title = pen.fit(title, (static_cast<float>(content.width) - 2.0F * em) / 2.0F);
  pen.text(x, y, kInk, title, true);
  y += 2.2F * em;
  pen.text(x, y, kInk,
           "time " + with_decimals(snapshot.t_s, 3) + " s    force on the hand " +
               force_text(glm::length(snapshot.force_N)) + (content.paused ? "    PAUSED" : ""));
  return y + 2.0F * em;
}

std::optional<PixelBox> draw_colour_scale(const Pen& pen, const DrawnScene& scene,
                                          const OverlayContent& content) {
  if (!(content.displacement_scale_m > 0.0)) return {};
  const float em = pen.em;
  const std::vector<glm::vec3> soft = colours_at_rest(scene);
  if (soft.empty()) return {};
  const float bar_width = 1.1F * em;
  const float bar_height = 12.0F * em;
  const std::string title = "tissue moved by";
  const float bars =
      bar_width * static_cast<float>(soft.size()) + 0.25F * em * static_cast<float>(soft.size() - 1);
  const float w = std::max(pen.width(title), bars + 0.6F * em + pen.width("0.00 mm")) + 1.6F * em;
  const float x0 = static_cast<float>(content.width) - w - em;
  const float y0 = 4.2F * em;
  pen.plate(x0, y0, w, bar_height + 4.0F * em);
  pen.text(x0 + 0.8F * em, y0 + 0.7F * em, kInk, title);
  const float top = y0 + 2.8F * em;
  float x = x0 + 0.8F * em;
  for (const glm::vec3& own : soft) {
    constexpr int steps = 40;
    for (int s = 0; s < steps; ++s) {
      const float a = top + bar_height * static_cast<float>(s) / static_cast<float>(steps);
      const float b = top + bar_height * static_cast<float>(s + 1) / static_cast<float>(steps);
      const float share = 1.0F - (static_cast<float>(s) + 0.5F) / static_cast<float>(steps);
      pen.fill({x, a}, {x + bar_width, b}, ink_of(palette::of_displacement(own, share)));
    }
    pen.frame({x, top}, {x + bar_width, top + bar_height}, kEdge);
    x += bar_width + 0.25F * em;
  }
  for (int tick = 0; tick <= 4; ++tick) {
    const float y = top + bar_height * (1.0F - static_cast<float>(tick) / 4.0F);
    pen.line({x - 0.25F * em, y}, {x + 0.1F * em, y}, kInk);
    pen.text(x + 0.35F * em, y - 0.5F * em, kInk,
             tick == 0 ? "0" : length_text(content.displacement_scale_m * tick / 4.0));
  }
  return PixelBox{{x0, y0}, {x0 + w, y0 + bar_height + 4.0F * em}};
}

std::optional<PixelBox> draw_scale_bar(const Pen& pen, const Camera& camera, const PixelRect& where) {
  const double per_pixel = camera.view_height_m() / where.height;
  const double length = round_down(per_pixel * 0.24 * where.width);
  if (!(length > 0.0)) return {};
  const float em = pen.em;
  const auto w = static_cast<float>(length / per_pixel);
  const float x = static_cast<float>(where.x) + 1.2F * em;
  const float y = static_cast<float>(where.y + where.height) - 1.4F * em;
  const std::string words = length_text(length);
  const PixelBox box{{x - 0.5F * em, y - 1.9F * em},
                     {x + std::max(w, pen.width(words)) + 0.5F * em, y + 0.7F * em}};
  pen.fill(box.low, box.high, kPaper, 3.0F);
  pen.fill({x, y - 2.0F}, {x + w, y + 2.0F}, kInk);
  for (const float end : {x, x + w}) pen.line({end, y - 5.0F}, {end, y + 5.0F}, kInk, 2.0F);
  pen.text(x, y - 1.6F * em, kInk, words);
  return box;
}

std::optional<ForceLabel> force_label(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot,
                                      const Camera& camera, const PixelRect& where) {
  const double force = glm::length(snapshot.force_N);
  if (!(force > 1e-3) || !std::isfinite(force) || !polygon::is_finite(snapshot.proxy_m)) return {};
  const auto tip = camera.pixel(arrow_tip(scene, snapshot, camera), where.width, where.height);
  if (!tip) return {};
  const std::string words = force_text(force);
  const float most_x = static_cast<float>(where.width) - pen.width(words) - 0.6F * pen.em;
  const float most_y = static_cast<float>(where.height) - 2.0F * pen.em;
  // For an arrow that points left, the label goes to the left of the tip: on the right it would cover the
  // arrow.
  const auto base = camera.pixel(snapshot.proxy_m, where.width, where.height);
  const bool left = base && base->x - tip->x > 0.5 * std::abs(base->y - tip->y);
  const float aside = left ? -0.8F * pen.em - pen.width(words) : 0.8F * pen.em;
  const float x =
      std::clamp(static_cast<float>(tip->x) + aside, 0.5F * pen.em, std::max(most_x, 0.5F * pen.em));
  const float y =
      std::clamp(static_cast<float>(tip->y) - 0.6F * pen.em, 0.5F * pen.em, std::max(most_y, 0.5F * pen.em));
  return ForceLabel{static_cast<float>(where.x) + x, static_cast<float>(where.y) + y, words};
}

void draw_force_label(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera,
                      const PixelRect& where) {
  const auto label = force_label(pen, scene, snapshot, camera, where);
  if (label) pen.label(label->x, label->y, ink_of(palette::force), label->words);
}

void draw_inset_frame(const Pen& pen, const Snapshot& snapshot, const OverlayContent& content) {
  const PixelRect& r = content.inset->where;
  const glm::vec2 a(static_cast<float>(r.x), static_cast<float>(r.y));
  const glm::vec2 b(a.x + static_cast<float>(r.width), a.y + static_cast<float>(r.height));
  // A ring in the large view marks the region that the inset shows; a line connects the two.
  if (const auto at = content.camera.pixel(snapshot.proxy_m, content.width, content.height)) {
    const double per_pixel = content.camera.view_height_m() / content.height;
    const auto radius =
        std::max(static_cast<float>(0.5 * content.inset->camera.view_height_m() / per_pixel), 0.6F * pen.em);
    const glm::vec2 centre(static_cast<float>(at->x), static_cast<float>(at->y));
    const glm::vec2 corner(std::clamp(centre.x, a.x, b.x), std::clamp(centre.y, a.y, b.y));
    const float dx = corner.x - centre.x;
    const float dy = corner.y - centre.y;
    const float distance = std::sqrt(dx * dx + dy * dy);
    pen.circle(centre, radius, kInk, 1.5F);
    if (distance > radius) {
      pen.line({centre.x + dx / distance * radius, centre.y + dy / distance * radius}, corner, kInk, 1.5F);
    }
  }
  pen.frame(a, b, kInk, 0.0F, 2.0F);
  pen.label(a.x + 0.7F * pen.em, a.y + 0.6F * pen.em, kInk, "the contact, nearer");
}

std::optional<PixelBox> draw_history(const Pen& pen, const OverlayContent& content) {
  if (content.history.size() < 2) return {};
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
  // End of the axis: the largest round number not above the maximum, or twice that number if the maximum
  // exceeds it.
  double top = most > 0.0 ? round_down(most) : 1.0;
  while (top < most) top += round_down(most);
  pen.plate(x0, y0, w, h);
  pen.text(x0 + 0.6F * em, y0 + 0.4F * em, kInk,
           "force, last " + with_decimals(span, 1) + " s  (top " + force_text(top) + ")");
  const float low = y0 + h - 0.5F * em;
  const float high = y0 + 1.9F * em;
  pen.line({x0 + 2.0F, high}, {x0 + w - 2.0F, high}, kEdge);
  pen.line({x0 + 2.0F, low}, {x0 + w - 2.0F, low}, kEdge);
  // Largest force in each pixel column; a gap where it is not finite.
  const auto columns = static_cast<std::size_t>(w) - 4;
  std::vector<double> column(columns, -1.0);
  for (const ForceSample& sample : content.history) {
    if (!std::isfinite(sample.force_N)) continue;
    const double share = std::clamp((sample.t_s - (end - span)) / span, 0.0, 1.0);
    double& at = column[static_cast<std::size_t>(share * static_cast<double>(columns - 1))];
    at = std::max(at, sample.force_N);
  }
  std::optional<glm::vec2> last;
  for (std::size_t c = 0; c < columns; ++c) {
    if (column[c] < 0.0) continue;
    const glm::vec2 at(x0 + 2.0F + static_cast<float>(c),
                       low - static_cast<float>(column[c] / top) * (low - high));
    if (last) pen.line(*last, at, ink_of(palette::force), 1.5F);
    last = at;
  }
  return PixelBox{{x0, y0}, {x0 + w, y0 + h}};
}

}  // namespace hybrid
