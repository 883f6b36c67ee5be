// SPDX-License-Identifier: GPL-3.0-or-later
// The rows of the legend. Uses no graphics library.
#pragma once

#include <cstddef>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "hybrid/snapshot/snapshot.h"

namespace hybrid {

struct LegendRow {
  std::vector<glm::vec3> swatch{};              // colours side by side; empty: no swatch
  std::string name{}, more{}, kind{}, force{};  // `more` follows the name and is never shortened
  bool touched = false;
  bool within = false;  // a material of the object in a row above
  float alpha = 1.0F;   // of the swatch
};

// One row for each object and for each material that its surface shows. Then follow the rows of the pairs of
// objects that press on each other, and those of tool and force. There are about `most` rows. If they do not
// fit, some are left out, and a last row counts them. The first to be left out are the materials with the
// least surface, then the pairs with the least force, then rigid objects that nothing touches, then other
// objects. Many untouched rigid objects always share one row. A material under the tool is marked like its
// object.
std::vector<LegendRow> legend_rows(const DrawnScene& scene, const Snapshot& snapshot, std::size_t most);

}  // namespace hybrid
