// SPDX-License-Identifier: GPL-3.0-or-later
// Draws the arrows by which an object is moved, and the box of the place to which it is moved.
#include <array>
#include <glm/geometric.hpp>

#include "hybrid/base/number_text.h"
#include "hybrid/view/palette.h"
#include "hybrid/window/panels.h"

namespace hybrid {
namespace {

// Colours of the axes x, y, z. They differ in lightness too (after Okabe & Ito 2008).
constexpr std::array<glm::vec3, 3> kAxes{
    {{0.84F, 0.37F, 0.00F}, {0.00F, 0.62F, 0.45F}, {0.03F, 0.38F, 0.93F}}};
constexpr std::array<const char*, 3> kNames{"x", "y", "z"};

std::string shift_text(const glm::dvec3& shift_m) {
  std::string words;
  for (int d = 0; d < 3; ++d) {
    const double mm = 1e3 * shift_m[d];
    words += std::string(d > 0 ? ", " : "") + (mm > 0.0 ? "+" : "") + with_digits(mm, 3);
  }
  return words + " mm";
}

void draw_box(const Pen& pen, const MoveHandles& handles, const Camera& camera, const PixelRect& where) {
  std::array<std::optional<glm::dvec2>, 8> corners;
  for (unsigned n = 0; n < 8; ++n) {
    glm::dvec3 corner = handles.shift_m;
    for (int d = 0; d < 3; ++d)
      corner[d] += (n >> d & 1U) != 0 ? handles.box.high_m[d] : handles.box.low_m[d];
    corners[n] = camera.pixel(corner, where.width, where.height);
    if (corners[n]) *corners[n] += glm::dvec2(where.x, where.y);
  }
  for (unsigned n = 0; n < 8; ++n) {
    for (unsigned d = 0; d < 3; ++d) {
      const unsigned other = n | 1U << d;
      if (other == n || !corners[n] || !corners[other]) continue;
      pen.line(glm::vec2(*corners[n]), glm::vec2(*corners[other]), pen.inks.force, 0.12F * pen.em);
    }
  }
}

}  // namespace

void draw_trail(const Pen& pen, const TickHistory& history, const Camera& camera, const PixelRect& where) {
  constexpr std::size_t places = 500;
  const std::vector<glm::dvec3> path = history.path_m(places);
  std::optional<glm::dvec2> last;
  for (std::size_t n = 0; n < path.size(); ++n) {
    const auto pixel = camera.pixel(path[n], where.width, where.height);
    if (pixel && last) {
      const float age = 1.0F - static_cast<float>(n) / static_cast<float>(path.size());
      const glm::vec2 corner(where.x, where.y);
      pen.line(corner + glm::vec2(*last), corner + glm::vec2(*pixel),
               ink_of(palette::device, 1.0F - 0.85F * age), 0.14F * pen.em);
    }
    last = pixel;
  }
}

void draw_move_handles(const Pen& pen, const MoveHandles& handles, const Camera& camera,
                       const PixelRect& where) {
  const bool moved = handles.shift_m != glm::dvec3(0.0);
  if (moved) draw_box(pen, handles, camera, where);
  const auto pixels = handles.pixels(camera, where, pen.em);
  const auto& middle = pixels[MoveHandles::kInView];
  if (!middle) return;
  const glm::vec2 from(*middle);
  const float radius = 0.45F * pen.em;
  for (std::size_t n = 0; n < kAxes.size(); ++n) {
    if (!pixels[n]) continue;
    const Ink ink = ink_of(kAxes[n]);
    const glm::vec2 tip(*pixels[n]);
    const float thick = (handles.held == n ? 0.3F : 0.2F) * pen.em;
    pen.line(from, tip, pen.inks.paper, 2.0F * thick);
    pen.line(from, tip, ink, thick);
    pen.fill(tip - radius, tip + radius, ink, radius);
    pen.label(tip.x + 0.9F * pen.em, tip.y - 0.6F * pen.em, ink, kNames[n]);
  }
  pen.fill(from - radius, from + radius, pen.inks.paper, radius);
  pen.circle(from, radius, pen.inks.text, 0.15F * pen.em);
  if (moved) pen.label(from.x + pen.em, from.y + pen.em, pen.inks.text, shift_text(handles.shift_m));
}

}  // namespace hybrid
