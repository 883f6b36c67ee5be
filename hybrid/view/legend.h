// SPDX-License-Identifier: GPL-3.0-or-later
// What the legend says and in which corner it stands. Knows no graphics library.
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
  std::vector<glm::vec3> swatch{};              // its colours side by side; none: no swatch
  std::string name{}, more{}, kind{}, force{};  // `more` follows the name, and is never shortened
  bool touched = false;
  bool within = false;  // a material, of the object above
  float alpha = 1.0F;   // of the swatch
};

// Objects, each with the materials that its surface shows, then tool and force; about `most` rows. What does
// not fit is counted, not dropped in silence: materials with the least surface, rigid objects that nothing
// touches (where there are many they share one row from the start), and last objects at all. A material that
// lies beneath the tool is marked as its object is.
std::vector<LegendRow> legend_rows(const DrawnScene& scene, const Snapshot& snapshot, std::size_t most);

struct PixelBox {
  glm::vec2 low{0.0F}, high{0.0F};
};

// Which of the places the legend takes: the one it had while that covers nothing of `clear`, else the first
// that covers nothing, else the one that covers least.
std::size_t choose_place(std::span<const PixelBox> places, std::span<const PixelBox> clear,
                         std::optional<std::size_t> last);

}  // namespace hybrid
