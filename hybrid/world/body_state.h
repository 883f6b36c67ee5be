// SPDX-License-Identifier: GPL-3.0-or-later
// State of rigid bodies that move: what tissue and other bodies know of them from tick to tick.
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
  bool given_up = false;  // the voxel is deep in the body, and is left alone until it is out of it
  // No query is needed until the body's travel reaches this (m), or the voxel moves.
  double until_m = 0.0;
};

// Obstacles that moving bodies are to one soft object (hybrid/tick/bodies/bodies_press_tissue.h).
struct BodyObstacles {
  static constexpr std::uint32_t kNobody = 0xFFFFFFFFU;
  std::vector<voxel::Obstacle> standing;  // [surface voxel] half-space of fixed surfaces
  std::vector<voxel::Obstacle> moving;    // [surface voxel] half-space of the nearest body
  std::vector<std::uint32_t> whose;       // [surface voxel] the rigid object of `moving`; kNobody: none
  std::vector<std::uint8_t> listed;       // [surface voxel] 1: in `near`
  std::vector<std::uint8_t> jammed;       // [surface voxel] 1: it could not leave the way of a free body
  std::vector<std::uint32_t> near;        // surface voxels near a body
  std::vector<std::vector<BodyQuery>> queries;  // [rigid object][surface voxel]; empty: it presses no tissue
};

// Another object's surface nearest to a point, in that object's frame.
struct NearestSurface {
  glm::dvec3 normal{0.0};  // outward
  glm::dvec3 at_m{0.0};    // the nearest place
  double gap_m = 0.0;      // negative: the point is inside
};
// A contact point's last query, and its way in this tick.
struct PointQuery : NearestSurface {
  double seen_m = -1e300;      // travel of both objects at the query
  double slid_m = 0.0;         // along the point's edge
  NearestSurface end;          // where its way ends in this tick
  std::uint64_t followed = 0;  // the round in which that way was followed
};

// A free rigid body and another one that it may collide with (hybrid/tick/bodies/body_collisions.h).
struct BodyPair {
  std::uint32_t free = 0, other = 0;
  double size_m = 0.0, skin_m = 0.0;  // of the smaller one; the distance at which they are kept
  double friction = 0.0;              // Coulomb's coefficient
  // Travel of both in sum: up to `until_m` they do not touch; the last query was at `seen_m`.
  double until_m = -1e300, seen_m = -1e300;
  std::array<std::vector<PointQuery>, 2> queries;  // of the points of the one, then of the other
};
struct BodyCollisions {
  std::vector<BodyPair> pairs;
  std::vector<double> travel_m;  // [rigid] no point of it has moved further since the session began
  std::vector<Pose> last;        // [rigid] as the last tick left them
  std::uint64_t round = 0;
};

}  // namespace hybrid
