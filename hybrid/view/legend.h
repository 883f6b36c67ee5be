// SPDX-License-Identifier: GPL-3.0-or-later
// The rows of the legend and the corner in which it stands. Knows no graphics library.
#pragma once

#include <cstddef>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hybrid/snapshot/snapshot.h"

namespace hybrid {

struct LegendRow {
  std::vector<glm::vec3> swatch{};              // colours side by side; empty: no swatch
  std::string name{}, more{}, kind{}, force{};  // `more` follows the name, and is never shortened
  bool touched = false;
  bool within = false;  // a material of the object above
  float alpha = 1.0F;   // of the swatch
};

// One row for each object and for each material that its surface shows, then tool and force; about `most`
// rows. Rows that do not fit are counted in a last row: first the materials with the least surface, then
// rigid objects that nothing touches, then other objects. Many untouched rigid objects share one row from the
// start. A material under the tool is marked like its object.
std::vector<LegendRow> legend_rows(const DrawnScene& scene, const Snapshot& snapshot, std::size_t most);

struct PixelBox {
  glm::vec2 low{0.0F}, high{0.0F};
};

// Index of the place that the legend takes: the last one as long as it covers nothing of `clear`, else the
// first place that covers nothing, else the place that covers least.
std::size_t choose_place(std::span<const PixelBox> places, std::span<const PixelBox> clear,
                         std::optional<std::size_t> last);

}  // namespace hybrid
