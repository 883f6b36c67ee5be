// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <span>
#include <vector>

#include "hybrid/view/overlay_parts.h"

namespace hybrid {
namespace {

constexpr float kLine = 1.6F;       // row pitch (em)
constexpr float kPartGap = 0.6F;    // between the parts of the column (em)
constexpr float kLeastRows = 6.0F;  // least rows of the legend, even if they cover the parts below

// Column widths of the legend (pixels). They do not depend on the forces, so that nothing jumps in a window.
struct Columns {
  float name = 0.0F, kind = 0.0F, force = 0.0F, width = 0.0F;
};

float indent(const Pen& pen, const LegendRow& row) {
  return row.within ? 1.2F * pen.em : 0.0F;
}

Columns columns_of(const Pen& pen, float width) {
  Columns c;
  c.kind = pen.width("rigid");
  c.force = pen.width("88.8 mm off");
  c.width = width;
  c.name = std::max(width - 4.8F * pen.em - c.kind - c.force, 4.0F * pen.em);
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
  pen.frame({x, y}, {x + em, y + em}, row.touched ? pen.inks.text : pen.inks.edge, 2.0F,
            row.touched ? 2.0F : 1.0F);
}

void draw_rows(const Pen& pen, const glm::vec2& low, std::span<const LegendRow> rows, const Columns& c) {
  const float em = pen.em;
  pen.plate(low.x, low.y, c.width, kLine * em * static_cast<float>(rows.size()) + em);
  const float x = low.x + 0.8F * em;
  float y = low.y + 0.7F * em;
  for (const LegendRow& row : rows) {
    const float in = indent(pen, row);
    draw_swatch(pen, x + in, y, row);
    pen.text(x + in + 1.6F * em, y, pen.inks.text, row.name + row.more);
    pen.text(x + 2.2F * em + c.name, y, pen.inks.pale, row.kind);
    pen.text(low.x + c.width - 0.8F * em - pen.width(row.force), y,
             row.touched ? pen.inks.text : pen.inks.pale, row.force);
    y += kLine * em;
  }
}

}  // namespace

void draw_column(const Pen& pen, const DrawnScene& scene, const Snapshot& snapshot,
                 const OverlayContent& content) {
  const PixelRect& column = content.layout.column;
  if (column.width == 0) return;
  const float em = pen.em;
  const float width = static_cast<float>(column.width) - kPartGap * em;
  const auto left = static_cast<float>(column.x);
  const auto part = [&](float top, float height_em) {
    return PixelRect{column.x, static_cast<int>(top), static_cast<int>(width),
                     static_cast<int>(height_em * em)};
  };
  const float end = static_cast<float>(content.inset ? content.layout.inset.y : column.y + column.height);
  const bool scale = content.scale.end > 0.0;
  const float charts = scale ? kColourScaleHeight + kPartGap : 0.0F;
  const float room = (end - static_cast<float>(column.y)) / em - charts - kPartGap;
  const float rows_fit = (room - 1.0F) / kLine;
  std::vector<LegendRow> rows =
      legend_rows(scene, snapshot, static_cast<std::size_t>(std::max(rows_fit, kLeastRows)));
  const Columns columns = columns_of(pen, width);
  for (LegendRow& row : rows)
    row.name = pen.fit(row.name, columns.name - indent(pen, row) - pen.width(row.more));
  draw_rows(pen, {left, static_cast<float>(column.y)}, rows, columns);
  const float y =
      static_cast<float>(column.y) + em * (kLine * static_cast<float>(rows.size()) + 1.0F + kPartGap);
  if (scale) {
    if (y + kColourScaleHeight * em < end) draw_colour_scale(pen, part(y, kColourScaleHeight), content.scale);
  }
}

}  // namespace hybrid
