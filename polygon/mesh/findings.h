// SPDX-License-Identifier: GPL-3.0-or-later
// Tallies of the findings of a check, or of the changes of a repair: their number and their place.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "polygon/mesh/mesh.h"

namespace polygon {

// "(0.01, -0.2, 3) m", with enough digits to find the place in any viewer.
[[nodiscard]] std::string point_in_words(const glm::dvec3& p);

// How often one finding occurred, and where.
struct FindingTally {
  std::size_t count = 0;
  FindingPlace place;

  void add(const glm::dvec3& where, std::optional<std::uint32_t> triangle = std::nullopt);
};

// Appends the finding, and adds its place to its text. Does nothing if the tally's count is 0. `text`
// continues the count, as "edges are open" continues "3".
void add_finding(std::vector<Finding>& findings, const char* id, Severity severity, const FindingTally& found,
                 const std::string& text);

}  // namespace polygon
