// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "hybrid/view/overlay_parts.h"
#include "hybrid/view/tool_and_arrow.h"

namespace hybrid {
namespace {

constexpr float kLine = 1.6F;         // row pitch (em)
constexpr float kShareOfView = 0.5F;  // largest share of the view's height for the legend

// Column widths of the legend (pixels).
struct Columns {
  float name = 0.0F, kind = 0.0F, force = 0.0F, width = 0.0F;
};

float indent(const Pen& pen, const LegendRow& row) {
  return row.within ? 1.2F * pen.em : 0.0F;
}

Columns columns_of(const Pen& pen, std::span<const LegendRow> rows) {
  Columns c;
  c.kind = pen.width("punch");
  for (const LegendRow& row : rows) {
    c.name = std::max(c.name, indent(pen, row) + pen.width(row.name + row.more));
    c.force = std::max(c.force, pen.width(row.force));
  }
  c.width = 5.6F * pen.em + c.name + c.kind + c.force;
  return c;
}

void draw_swatch(const Pen& pen, float x, float y, const LegendRow& row) {
  if (row.swatch.empty()) return;
  const float em = pen.em;
  const bool one = row.swatch.size() == 1;
  const float stripe = em / static_cast<float>(row.swatch.size());
  for (std::size_t s = 0; s < row.swatch.size(); ++s) {
    const float left = x + stripe * static_cast<float>(s);
    pen.fill({left, y}, {left + stripe, y + em}, ink_of(row.swatch[s], row.alpha), one ? 2.0F : 0.0F);
  }
  pen.frame({x, y}, {x + em, y + em}, row.touched ? kInk : kEdge, 2.0F, row.touched ? 2.0F : 1.0F);
}

void draw_rows(const Pen& pen, const glm::vec2& low, std::span<const LegendRow> rows, const Columns& c) {
  const float em = pen.em;
  pen.plate(low.x, low.y, c.width, kLine * em * static_cast<float>(rows.size()) + em);
  const float x = low.x + 0.8F * em;
  float y = low.y + 0.7F * em;
  for (const LegendRow& row : rows) {
    const float in = indent(pen, row);
    draw_swatch(pen, x + in, y, row);
    pen.text(x + in + 1.6F * em, y, kInk, row.name + row.more);
    pen.text(x + 2.6F * em + c.name, y, kPaleInk, row.kind);
    pen.text(x + 3.2F * em + c.name + c.kind + c.force - pen.width(row.force), y,
             row.touched ? kInk : kPaleInk, row.force);
    y += kLine * em;
  }
}

// Boxes around the tool at the proxy and at the device, the arrow, and the label at its tip.
std::vector<PixelBox> boxes_to_keep_clear(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot,
                                          const OverlayContent& content) {
  const double per_pixel = content.camera.view_height_m() / content.height;
  const auto margin = 0.5F * pen.em;
  std::vector<PixelBox> boxes;
  const auto add = [&](const glm::dvec3& from_m, const glm::dvec3& to_m, double radius_m) {
    const auto from = content.camera.pixel(from_m, content.width, content.height);
    const auto to = content.camera.pixel(to_m, content.width, content.height);
    const auto reach = static_cast<float>(radius_m / per_pixel) + margin;
    if (!from || !to || !std::isfinite(from->x + from->y + to->x + to->y + reach)) return;
    boxes.push_back({glm::vec2(glm::min(*from, *to)) - reach, glm::vec2(glm::max(*from, *to)) + reach});
  };
  add(snapshot.proxy_m, snapshot.proxy_m, scene.tool_radius_m);
  add(snapshot.device_m, snapshot.device_m, scene.tool_radius_m);
  add(snapshot.proxy_m, arrow_tip(scene, snapshot, content.camera), 0.0);
  const PixelRect whole{0, 0, content.width, content.height};
  if (const auto label = force_label(pen, scene, snapshot, content.camera, whole)) {
    const glm::vec2 low(label->x - margin, label->y - margin);
    boxes.push_back({low, low + glm::vec2(pen.width(label->words), pen.em) + 2.0F * margin});
  }
  return boxes;
}

// Candidate places: top left, bottom left, then the right corners, first the one without the inset. They keep
// off the colour scale, the scale bar and the history, and stay on the picture if they fit.
std::vector<PixelBox> corners(const Pen& pen, const Furniture& furniture, const OverlayContent& content,
                              const glm::vec2& size) {
  const float em = pen.em;
  const float gap = 0.8F * em;
  const glm::vec2 whole(content.width, content.height);
  const float left = em;
  const float right_of = furniture.colour_scale ? furniture.colour_scale->low.x - gap : whole.x - em;
  const float right_low = content.inset ? static_cast<float>(content.inset->where.x) - gap : whole.x - em;
  const float lowest = std::max(furniture.above - gap - size.y, furniture.below);
  const float bottom =
      std::max(whole.y - (content.help.empty() ? 1.0F : 2.4F) * em - size.y, furniture.below);
  const glm::vec2 top_right(std::max(right_of - size.x, left), furniture.below);
  const glm::vec2 bottom_right(std::max(right_low - size.x, left), bottom);
  std::vector<PixelBox> places;
  for (const glm::vec2& low :
       {glm::vec2(left, furniture.below), glm::vec2(left, lowest), content.inset ? top_right : bottom_right,
        content.inset ? bottom_right : top_right}) {
    places.push_back({low, low + size});
  }
  return places;
}

}  // namespace

void draw_legend(const Pen& pen, const Furniture& furniture, const DrawnScene& scene,
                 const Snapshot& snapshot, const OverlayContent& content, std::optional<std::size_t>& last) {
  const float room = kShareOfView * static_cast<float>(content.height) / (kLine * pen.em);
  std::vector<LegendRow> rows = legend_rows(scene, snapshot, static_cast<std::size_t>(std::max(room, 6.0F)));
  for (LegendRow& row : rows) row.name = pen.fit(row.name, 22.0F * pen.em - pen.width(row.more));
  const Columns columns = columns_of(pen, rows);
  const glm::vec2 size(columns.width, kLine * pen.em * static_cast<float>(rows.size()) + pen.em);
  const std::vector<PixelBox> places = corners(pen, furniture, content, size);
  last = choose_place(places, boxes_to_keep_clear(pen, scene, snapshot, content), last);
  draw_rows(pen, places[*last].low, rows, columns);
}

}  // namespace hybrid
