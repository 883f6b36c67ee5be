// SPDX-License-Identifier: GPL-3.0-or-later
// What graphics may know of a session: fixed surfaces once, and a snapshot of what moves. The core never
// opens a window; picture and viewer read these and nothing else.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "hybrid/world/object_feel.h"
#include "polygon/mesh/mesh.h"

namespace hybrid {

struct DrawnObject {
  std::string name;
  bool soft = false;
  polygon::TriangleMesh surface;  // scene frame, meters, at rest
  // Of a soft object whose surface is of several materials, else both empty: their names, the one with the
  // most surface first, and for each vertex which of them lies beneath it.
  std::vector<std::string> materials{};
  std::vector<std::uint8_t> vertex_material{};
};

struct DrawnScene {
  std::string title;
  std::vector<DrawnObject> objects;
  bool tool_is_punch = false;
  double tool_radius_m = 0.0;
  double max_force_N = 0.0;  // scale of the force arrow
};

// Where a rigid object is now, against where it lies at rest: a turn about a point that goes along with it.
struct RigidPlace {
  bool moved = false;
  glm::dvec3 about_m{0.0}, way_m{0.0};  // scene frame
  glm::dquat turn{1.0, 0.0, 0.0, 0.0};

  [[nodiscard]] glm::dvec3 operator()(const glm::dvec3& at_rest_m) const {
    return moved ? about_m + way_m + turn * (at_rest_m - about_m) : at_rest_m;
  }
};

// Points of a soft object near the tool, at rest, and how far they are from there (scene frame, meters).
struct SoftPatch {
  std::vector<glm::vec3> at_rest_m, moved_m;
};

// How far the points of a soft object are from rest, on nested boxes of nodes, the finest first: what a point
// lies in first says where it is, between its nodes.
struct SoftDent {
  struct Box {
    std::array<int, 3> first{}, count{};  // where node (0, 0, 0) is (unit: spacing of the object); how many
    int step = 1;                         // from one to the next; likewise
    // Does the object go on beyond it there? Else what is beyond, which is less than half a step, is as at
    // the last node.
    std::array<bool, 3> open_low{}, open_high{};
    std::size_t stride = 0, plane = 0;
    std::array<std::vector<float>, 3> moved_m{};  // [axis of the object][k · plane + j · stride + i]
  };
  bool used = false;       // by this object; where there is no box it is at rest
  glm::dmat3 to_scene{1};  // of the object's axes
  glm::dvec3 origin_m{0.0}, spacing_m{1.0};
  std::size_t count = 0;  // of boxes; others are kept for their room
  std::vector<Box> boxes{};

  // Of a point at rest (scene frame, meters).
  [[nodiscard]] glm::vec3 at(const glm::dvec3& at_rest_m) const noexcept;
};

// [object][vertex of its surface] displacement (scene frame, meters); empty for a rigid object.
using MovedSurfaces = std::vector<std::vector<glm::vec3>>;

struct Snapshot {
  std::uint64_t tick = 0;
  double t_s = 0.0;
  glm::dvec3 device_m{0.0}, proxy_m{0.0}, force_N{0.0};  // scene frame
  std::vector<ObjectFeel> feel;                          // one an object
  // One an object: empty for a rigid one; for a soft one how far each vertex of its surface is from rest
  // (scene frame, meters). Displacements, because a float position 1,000 km from the origin is off by
  // centimeters.
  MovedSurfaces soft_moved_m;
  // One an object; of those whose tissue is relaxed on a thread of its own, which says where the rest is.
  std::vector<SoftPatch> patches{};
  // One an object, or none at all: of those whose contact is on a composite grid, in place of soft_moved_m.
  std::vector<SoftDent> dents{};
  std::vector<RigidPlace> rigid_place;  // one an object; fewer: the rest have not moved
  double tick_us = 0.0;

  [[nodiscard]] RigidPlace place_of(std::size_t object) const {
    return object < rigid_place.size() ? rigid_place[object] : RigidPlace{};
  }
};

// One row of a trace: what was felt in one tick.
struct TraceRow {
  double t_s = 0.0;
  glm::dvec3 device_m{0.0}, proxy_m{0.0}, force_N{0.0};
  double rigid_N = 0.0, soft_N = 0.0;
  std::uint32_t contacts = 0;  // bit per object (objects beyond 32 share the last bit)
  double tick_us = 0.0;
};

}  // namespace hybrid
