// SPDX-License-Identifier: GPL-3.0-or-later
// The contents of the map and the places of look-ups in `hybrid bench occupancy`, all from closed formulas.
// The contents are a ball. The map holds it in one of three forms: all of its voxels, its surface voxels, or
// its surface as triangles.
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

inline constexpr double kBallCell_m = 1e-3;  // edge of the map's cells, and spacing of voxels

struct OccupancyBall {
  OccupancyWhat what = OccupancyWhat::voxels_surface;
  double radius_m = 0.0;  // the middle is the scene's origin
  // For triangles the size is such that there are about as many cells as triangles.
  double cell_m = kBallCell_m;
  std::vector<glm::dvec3> points;  // voxels: each is in its own cell, up to 0.3 cells off its middle
  polygon::TriangleMesh mesh;
  std::size_t object_voxels = 0;  // voxels of the whole ball, whether they are in the map or not
};

// A ball of about `count` elements.
OccupancyBall make_ball(OccupancyWhat what, std::size_t count);
// The surface voxels of a ball that has about `count` voxels in all.
OccupancyBall make_ball_surface_of(std::size_t count);

// Middles of boxes to look up. coherent: along the surface in steps of a fifth of a cell, as a tool at 0.2
// m/s moves in a tick of 1 ms. random: anywhere on the surface. empty: outside the ball, mostly within its
// bounding box.
std::vector<glm::dvec3> places(const OccupancyBall& ball, OccupancyPattern pattern, std::size_t count);

}  // namespace hybrid::bench
