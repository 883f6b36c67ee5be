// SPDX-License-Identifier: GPL-3.0-or-later
// What `hybrid bench occupancy` puts into the map, and where it asks: a ball of voxels, only its surface or
// all of it, or its surface as triangles, all by closed formulas.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "polygon/mesh/mesh.h"

namespace hybrid::bench {

enum class OccupancyWhat : std::uint8_t { voxels_surface, voxels_all, triangles };
enum class OccupancyPattern : std::uint8_t { empty, coherent, random };
const char* what_name(OccupancyWhat what);
const char* pattern_name(OccupancyPattern pattern);

inline constexpr double kBallCell_m = 1e-3;  // of the map, and between voxels

struct OccupancyBall {
  OccupancyWhat what = OccupancyWhat::voxels_surface;
  double radius_m = 0.0;           // about the scene's origin
  double cell_m = kBallCell_m;     // of the map; of triangles such that there are about as many cells
  std::vector<glm::dvec3> points;  // of voxels: each in a cell of its own, off its middle by up to 0.3 cells
  polygon::TriangleMesh mesh;
  std::size_t object_voxels = 0;  // of voxels: of the whole ball, in the map or not
};

// About `count` elements.
OccupancyBall make_ball(OccupancyWhat what, std::size_t count);
// Only the surface of a ball of which all voxels are about `count`.
OccupancyBall make_ball_surface_of(std::size_t count);

// Middles of boxes to ask about. Coherent: along the surface in steps of a fifth of a cell, as a tool at
// 0.2 m/s does in a tick of 1 ms. Random: anywhere on the surface. Empty: outside of the ball, most
// of it within its bounding box.
std::vector<glm::dvec3> places(const OccupancyBall& ball, OccupancyPattern pattern, std::size_t count);

}  // namespace hybrid::bench
