// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/bench/occupancy_queries.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <utility>

#include "hybrid/bench/meshes.h"
#include "hybrid/bench/paths.h"

namespace hybrid::bench {
namespace {

constexpr double kJitter = 0.3;  // cells; largest offset of a voxel from the middle of its cell

// Height of a ball's column at (x, y): the greatest z of the lattice in the ball; -1: none.
int height(double squared_radius, int x, int y) {
  const double left = squared_radius - double{1} * x * x - double{1} * y * y;
  return left < 0.0 ? -1 : static_cast<int>(std::sqrt(left));
}

// Calls visit(x, y, z) for the voxels with a free face, or for all. It goes column by column, in the order of
// a lattice's voxels.
template <class Visit>
void each_voxel(double radius, bool all, const Visit& visit) {
  const double r2 = radius * radius;
  const int most = static_cast<int>(radius);
  for (int x = -most; x <= most; ++x) {
    for (int y = -most; y <= most; ++y) {
      const int top = height(r2, x, y);
      if (top < 0) continue;
      const int beside =
          std::min({height(r2, x - 1, y), height(r2, x + 1, y), height(r2, x, y - 1), height(r2, x, y + 1)});
      const int from = all ? 0 : std::min(top, beside + 1);
      for (int z = -top; z <= -from; ++z) visit(x, y, z);
      for (int z = std::max(from, 1); z <= top; ++z) visit(x, y, z);
    }
  }
}

OccupancyBall ball_of(double radius, bool all) {
  OccupancyBall ball;
  ball.what = all ? OccupancyWhat::voxels_all : OccupancyWhat::voxels_surface;
  ball.radius_m = radius * kBallCell_m;
  ball.object_voxels = static_cast<std::size_t>(4.0 / 3.0 * std::numbers::pi * radius * radius * radius);
  SplitMix64 random(1);
  each_voxel(radius, all, [&](int x, int y, int z) {
    const double dx = random.unit(), dy = random.unit(), dz = random.unit();
    ball.points.push_back(kBallCell_m *
                          (glm::dvec3(x, y, z) + 0.5 + kJitter * (2.0 * glm::dvec3(dx, dy, dz) - 1.0)));
  });
  return ball;
}

double radius_of_volume(std::size_t voxels) {
  return std::cbrt(3.0 * static_cast<double>(voxels) / (4.0 * std::numbers::pi));
}

}  // namespace

const char* what_name(OccupancyWhat what) {
  switch (what) {
    case OccupancyWhat::voxels_surface:
      return "voxels-surface";
    case OccupancyWhat::voxels_all:
      return "voxels-all";
    case OccupancyWhat::triangles:
      break;
  }
  return "triangles";
}

const char* pattern_name(OccupancyPattern pattern) {
  switch (pattern) {
    case OccupancyPattern::empty:
      return "empty";
    case OccupancyPattern::coherent:
      return "coherent";
    case OccupancyPattern::random:
      break;
  }
  return "random";
}

OccupancyBall make_ball(OccupancyWhat what, std::size_t count) {
  const auto wanted = static_cast<double>(count);
  if (what == OccupancyWhat::voxels_all) return ball_of(radius_of_volume(count), true);
  if (what == OccupancyWhat::voxels_surface) {
    // Counts the voxels at a radius that is about right, and then scales in proportion to the area.
    const double guess = std::max(3.0, std::sqrt(wanted / 12.0));
    double counted = 0.0;
    each_voxel(guess, false, [&counted](int, int, int) { counted += 1.0; });
    return ball_of(std::max(3.0, guess * std::sqrt(wanted / counted)), false);
  }
  OccupancyBall ball;
  ball.what = what;
  ball.radius_m = kSphereRadius_m;
  ball.mesh = make_geodesic_mesh(ball.radius_m, std::max(1, static_cast<int>(std::sqrt(wanted / 20.0))));
  // A surface of area A touches 1.5 A / cell² cells, averaged over its directions.
  ball.cell_m =
      ball.radius_m * std::sqrt(6.0 * std::numbers::pi / static_cast<double>(ball.mesh.triangles.size()));
  return ball;
}

OccupancyBall make_ball_surface_of(std::size_t count) {
  return ball_of(radius_of_volume(count), false);
}

std::vector<glm::dvec3> places(const OccupancyBall& ball, OccupancyPattern pattern, std::size_t count) {
  std::vector<glm::dvec3> at(count);
  SplitMix64 random(2);
  for (std::size_t n = 0; n < count; ++n) {
    // A voxel's position is in the middle of its cell, half a cell from its lattice point. The outermost
    // surface voxels are up to a cell below the radius.
    const double surface_m =
        ball.what == OccupancyWhat::triangles ? ball.radius_m : ball.radius_m - 0.5 * kBallCell_m;
    const glm::dvec3 middle(ball.what == OccupancyWhat::triangles ? 0.0 : 0.5 * kBallCell_m);
    if (pattern == OccupancyPattern::empty) {
      // Near the corners of the ball's box: 1.2 to 1.4 radii from the middle, and further away for a small
      // ball.
      const glm::dvec3 d = random.direction();
      const glm::dvec3 corner(d.x < 0.0 ? -1.0 : 1.0, d.y < 0.0 ? -1.0 : 1.0, d.z < 0.0 ? -1.0 : 1.0);
      at[n] = std::max(ball.radius_m * (1.2 + 0.2 * random.unit()), ball.radius_m + 8.0 * ball.cell_m) *
              glm::normalize(corner + 0.2 * d);
    } else if (pattern == OccupancyPattern::random) {
      at[n] = middle + surface_m * random.direction();
    } else {
      const double way = 0.2 * ball.cell_m / ball.radius_m * static_cast<double>(n);
      const double latitude = 0.2 + 0.3 * std::sin(0.37 * way);
      at[n] = middle + surface_m * glm::dvec3(std::cos(latitude) * std::cos(way),
                                              std::cos(latitude) * std::sin(way), std::sin(latitude));
    }
  }
  return at;
}

}  // namespace hybrid::bench
