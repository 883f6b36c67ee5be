// SPDX-License-Identifier: GPL-3.0-or-later
// A scene ready to be touched. `World` is what does not change in a session, `WorldState` what does; the tick
// takes the first as const and the second as its own.
#pragma once

#include <array>
#include <cstdint>
#include <glm/gtc/quaternion.hpp>
#include <memory>
#include <string>
#include <vector>

#include "device/force_limit.h"
#include "hybrid/occupancy.h"
#include "hybrid/scene.h"
#include "hybrid/snapshot.h"
#include "polygon/contact.h"
#include "polygon/proxy.h"
#include "voxel/pair_contact.h"
#include "voxel/soft_object.h"

namespace hybrid {

struct RigidObject {
  std::string name;
  std::shared_ptr<const polygon::RigidSurface> surface;  // body frame; never changes
  Pose pose;                                             // body to scene
  polygon::TriangleMesh drawn;                           // body frame; what is rasterised and drawn

  [[nodiscard]] glm::dvec3 to_body(const glm::dvec3& in_scene) const {
    return glm::inverse(pose.rotation) * (in_scene - pose.position_m);
  }
  [[nodiscard]] glm::dvec3 to_scene(const glm::dvec3& in_body) const {
    return pose.position_m + pose.rotation * in_body;
  }
  // The same object for another world, without what is drawn.
  [[nodiscard]] RigidObject shared() const {
    return {.name = name, .surface = surface, .pose = pose, .drawn = {}};
  }
};

struct SoftBody {  // the constant half of a soft object; the moving one is in WorldState::soft
  std::string name;
  voxel::BodyPose pose;            // volume frame to scene
  std::uint32_t first_number = 0;  // of its surface voxels in the occupancy map
  std::uint32_t budget = 0;        // background voxel updates a tick
  polygon::TriangleMesh drawn;     // volume frame, at rest

  [[nodiscard]] glm::dvec3 to_body(const glm::dvec3& in_scene) const {
    return glm::inverse(pose.rotation) * (in_scene - pose.origin);
  }
  [[nodiscard]] glm::dvec3 to_scene(const glm::dvec3& in_body) const {
    return pose.origin + pose.rotation * in_body;
  }
};

struct World {
  std::vector<RigidObject> rigid;
  std::vector<SoftBody> soft;
  Tool tool;
  device::ForceLimits limits;
  // Pairs of soft objects that may meet: {smaller index, larger index}.
  std::vector<std::array<std::uint32_t, 2>> meeting;

  [[nodiscard]] std::size_t object_count() const { return rigid.size() + soft.size(); }
};

// A pair of surface voxels of two soft objects that press on one another.
struct VoxelPair {
  std::uint32_t meeting = 0;  // index into World::meeting
  voxel::VoxelId a = 0, b = 0;
  std::uint32_t surface_a = 0;
};

// Named faults of a tick: each says which setting to raise.
enum FaultBit : std::uint32_t {
  fault_nonfinite_input = 1,  // the device gave a position that is not finite: the last good one held
  fault_touch_overflow =
      2,  // more soft voxels near the tool than SoftObject::kMaxTouched: use a smaller tool or coarser voxels
  fault_triangle_overflow = 4,  // more triangles near the proxy than kMaxNear even at the smallest step
  fault_map_overflow = 8,       // a voxel moved where the map had no room for a brick
  fault_pair_overflow = 16,     // more pairs of soft voxels than fit: use coarser voxels
  fault_infeasible = 32,        // rigid planes left no room for the tool
};

inline constexpr std::size_t kMaxNear = 256;     // triangles considered at once
inline constexpr std::size_t kMaxPlanes = 1024;  // rigid planes and give-way bounds
inline constexpr std::size_t kMaxPairs = 8192;
inline constexpr std::size_t kMaxFound = 32768;  // map entries read in one look-up

// Everything the tick writes. Buffers are sized when the world is built, and never after.
struct WorldState {
  WorldState(const World& world, OccupancyMap occupancy);
  // Sizes what depends on `soft`, once that is filled.
  void prepare(const World& world);

  // ---- of the session ----
  std::vector<std::unique_ptr<voxel::SoftObject>> soft;  // one a World::soft
  OccupancyMap map;
  glm::dvec3 proxy_m{0.0};   // scene frame
  glm::dvec3 device_m{0.0};  // last good input
  device::ForceLimitState limit;
  std::uint64_t tick = 0;
  std::uint64_t nonfinite = 0;        // inputs or forces that were not finite
  std::uint32_t faults = 0;           // FaultBit, ever
  std::uint64_t truncated_ticks = 0;  // ticks that ended before the proxy arrived, by a bound on its steps
  double hidden_stiffness_N_per_m = 0.0;  // what tissue showed beyond the model of its pressed voxels
  double gather_step_m = 0.0;             // how far the proxy may look, adapted to how crowded it is

  // ---- of arbitration ----
  std::vector<VoxelPair> pairs;
  std::vector<std::vector<std::uint8_t>> paired;  // [meeting][surface voxel of a]
  std::vector<std::vector<glm::vec3>>
      obstacle_seen;                  // [soft][surface voxel] displacement at which its obstacle was made
  std::vector<std::uint32_t> cursor;  // [soft] round-robin over surface voxels
  std::vector<std::uint32_t> pair_cursor;  // [meeting]

  // ---- of the current tick ----
  std::vector<ObjectFeel> feel;            // [rigid…, soft…]
  std::vector<glm::dvec3> rigid_force_N;   // [rigid], scene frame
  std::vector<voxel::Reaction> reactions;  // [soft], scene frame
  std::vector<polygon::NearPoint> near;    // scratch
  std::vector<polygon::ContactPlane> planes;
  std::vector<voxel::ToolBound> bounds;
  std::vector<std::uint32_t> found;
  std::vector<std::vector<voxel::VoxelId>> touched;  // [soft]
};

}  // namespace hybrid
