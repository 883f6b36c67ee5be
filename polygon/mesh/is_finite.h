// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cmath>
#include <glm/vec3.hpp>

namespace polygon {

// Are all three components finite?
template <typename T, glm::qualifier Q>
[[nodiscard]] bool is_finite(const glm::vec<3, T, Q>& v) noexcept {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

}  // namespace polygon
