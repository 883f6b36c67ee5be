// SPDX-License-Identifier: GPL-3.0-or-later
// Counts what a check finds or a repair does, with where.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "polygon/mesh/mesh.h"

namespace polygon {

// "(0.01, -0.2, 3) m": enough digits to find the place in any viewer.
[[nodiscard]] std::string point_in_words(const glm::dvec3& p);

struct Found {
  std::size_t count = 0;
  FindingPlace place;

  void add(const glm::dvec3& where, std::optional<std::uint32_t> triangle = std::nullopt);
};

// The finding, its place in its words too; nothing when the count is 0. `text` follows the count.
void add_finding(std::vector<Finding>& findings, const char* id, Severity severity, const Found& found,
                 const std::string& text);

}  // namespace polygon
