// SPDX-License-Identifier: GPL-3.0-or-later
// State of moving rigid bodies that is kept between ticks: distance queries against tissue and against other
// bodies.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "hybrid/geometry/pose.h"
#include "voxel/object/soft_object.h"

namespace hybrid {

// A surface voxel's last distance query to one body.
struct BodyQuery {
  glm::vec3 u{0.0F};      // displacement of the voxel at the query (m)
  bool given_up = false;  // the voxel is deep in the body, and is left alone until it is outside
  // The next query is due when the following sum reaches this value (m): the body's travel since the session
  // began plus the voxel's motion since the last query.
  double until_m = 0.0;
};

// Obstacles that moving bodies give one soft object (hybrid/tick/bodies/bodies_press_tissue.h).
struct BodyObstacles {
  static constexpr std::uint32_t kNobody = 0xFFFFFFFFU;
  std::vector<voxel::Obstacle> standing;  // [surface voxel] half-space of fixed surfaces
  std::vector<voxel::Obstacle> moving;    // [surface voxel] half-space of the nearest body
  std::vector<std::uint32_t> whose;       // [surface voxel] rigid object that gives `moving`; kNobody: none
  std::vector<std::uint8_t> listed;       // [surface voxel] 1: in `near`
  std::vector<std::uint8_t> jammed;       // [surface voxel] 1: could not move out of a free body's way
  std::vector<std::uint32_t> near;        // surface voxels near a body
  std::vector<std::vector<BodyQuery>> queries;  // [rigid][surface voxel]; empty: the body presses no tissue
};

// The place of another object's surface that is nearest to a point, in the other object's frame.
struct NearestSurface {
  glm::dvec3 normal{0.0};  // outward
  glm::dvec3 at_m{0.0};    // the nearest point
  double gap_m = 0.0;      // negative: the point is inside
};
// A contact point's last query, and the way (straight path) of the point in this tick.
struct PointQuery : NearestSurface {
  double queried_at_m = -1e300;  // sum of both objects' travel at the query
  double slid_m = 0.0;           // displacement along the point's edge
  NearestSurface end;            // result at the end of the point's way in this tick
  std::uint64_t followed = 0;    // BodyCollisions::round in which `end` was set
};

// A free rigid body and another object that it may collide with (hybrid/tick/bodies/body_collisions.h).
struct BodyPair {
  std::uint32_t free = 0, other = 0;
  double size_m = 0.0, skin_m = 0.0;  // smaller object's diagonal; gap kept between surfaces
  double friction = 0.0;              // Coulomb's coefficient
  // Two values of the sum of both objects' travel (m). Before the sum reaches `until_m` the objects cannot
  // touch. At the last query the sum was `queried_at_m`.
  double until_m = -1e300, queried_at_m = -1e300;
  std::array<std::vector<PointQuery>, 2> queries;  // of the points of `free`, then of those of `other`
};
struct BodyCollisions {
  std::vector<BodyPair> pairs;
  std::vector<double> travel_m;  // [rigid] bound on the motion of any of its points since the session began
  std::vector<Pose> last;        // [rigid] pose at the end of the last tick
  std::uint64_t round = 0;
};

}  // namespace hybrid
