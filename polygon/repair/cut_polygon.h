// SPDX-License-Identifier: GPL-3.0-or-later
// Cuts a polygon in space into triangles between its corners. The triangles lie inside the polygon, whatever
// its shape and its first corner. CGAL decides with exact predicates.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "polygon/mesh/mesh.h"

namespace polygon {

enum class PolygonCut : std::uint8_t {
  inside,    // the triangles cover the polygon, and nothing else
  flat,      // more than three corners, all on one line: a fan of triangles without area keeps the polygon's
             // edges
  crossing,  // it crosses itself, seen along its normal: no triangles cover it exactly, so a triangulation of
             // little area is used
  nothing,   // fewer than three different corners: no triangle
};

// Appends the triangles, in the polygon's direction. The polygon is planar or nearly so. Its boundary may
// touch itself or run along itself, for example along a cut that leads to a hole. Corners with the same
// coordinates count as one.
PolygonCut cut_polygon(std::span<const glm::dvec3> points, std::span<const std::uint32_t> corners,
                       std::vector<TriangleIndices>& triangles);

}  // namespace polygon
