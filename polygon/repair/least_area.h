// SPDX-License-Identifier: GPL-3.0-or-later
// The triangulation of least area of a closed loop of points in space (Barequet & Sharir, Filling gaps in the
// boundary of a polyhedron, 1995).
#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "polygon/mesh/mesh.h"

namespace polygon {

// The triangles of a loop with the least cost. The cost is the total area, so that nothing folds over, plus a
// small term for long inner edges. This term decides in a flat loop, where every triangulation has the same
// area. No triangle is degenerate, and `forbidden` is false for each inner edge. The triangles run in the
// loop's direction. n points take n³ steps and n² memory. Empty if there is no such triangulation.
[[nodiscard]] std::vector<TriangleIndices> least_area_triangles(
    std::span<const std::uint32_t> loop, std::span<const glm::dvec3> points,
    const std::function<bool(std::uint32_t, std::uint32_t)>& forbidden);

}  // namespace polygon
