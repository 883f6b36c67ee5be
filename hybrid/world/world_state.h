// SPDX-License-Identifier: GPL-3.0-or-later
// Everything of a session that changes. A tick is a function of World, WorldState, input and dt, and a
// recording needs nothing else. Buffers that live for a single tick are in `scratch`.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <span>
#include <vector>

#include "device/loop/clock.h"
#include "device/loop/force_limit.h"
#include "device/loop/passivity.h"
#include "hybrid/feel/mixed_coupling.h"
#include "hybrid/feel/surface_feel.h"
#include "hybrid/map/occupancy_map.h"
#include "hybrid/world/async_relaxation.h"
#include "hybrid/world/body_state.h"
#include "hybrid/world/edited_values.h"
#include "hybrid/world/object_feel.h"
#include "hybrid/world/tick_scratch.h"
#include "hybrid/world/world.h"
#include "polygon/proxy/edge_crossing.h"
#include "polygon/proxy/neighbourhood.h"
#include "voxel/object/facet_contact.h"

namespace hybrid {

// A surface voxel of one soft object that lies over a facet of another soft object's surface.
struct FacetContact {
  std::uint32_t soft_pair = 0;  // index into World::soft_pairs
  voxel::PressedPair pressed;   // the facet that the voxel is over
  // Further facets that the voxel lies on, in a hollow; see voxel::lies_beside().
  std::array<voxel::PressedPair, 2> extra_facets{};
  std::size_t extra_count = 0;
  std::uint32_t surface_a = 0;
  bool held = false;  // near enough to press: only the contact moves its voxels
};

// Faults of a tick. The report describes each in words, and names the setting to raise if there is one.
enum FaultBit : std::uint32_t {
  fault_nonfinite_input = 1,  // the device gave a position that is not finite: the last valid one was used
  // More soft voxels near the tool than SoftObject::kMaxTouched: use a smaller tool or coarser voxels.
  fault_touch_overflow = 2,
  fault_triangle_overflow = 4,  // more triangles near the proxy than kMaxNear even at the smallest step
  fault_map_overflow = 8,       // a voxel moved where the map had no room for a brick
  fault_pair_overflow = 16,     // more pairs of soft voxels than fit: use coarser voxels
  fault_infeasible = 32,        // rigid planes left no room for the tool
  fault_nonfinite_body = 64,    // a non-finite force acted on a free body: the body stood still
  fault_body_squeezed = 128,    // tissue could not leave the way of a moving body: they overlapped
  fault_body_crowded = 256,     // a moving body came to more soft voxels than a tick can query
  fault_bodies_overlap = 512,   // a free body had no way out between rigid objects
  fault_tool_in_tissue = 1024,  // the tool's centre was in tissue that it did not press
};

inline constexpr std::size_t kMaxNear = 256;            // triangles considered at once
inline constexpr std::size_t kMaxPlanes = 1024;         // rigid planes and give-way bounds
inline constexpr std::size_t kMaxFacetContacts = 8192;  // contacts between soft objects
inline constexpr std::size_t kMaxMapHits = 32768;       // map entries read in one look-up

// Per rigid object: its pose, and the separating planes cached around the proxy.
struct RigidState {
  BodyFrame frame;               // the present pose
  Pose pose;                     // the same pose with a quaternion instead of a matrix
  FreeBodyState free;            // state, if the object is a free body
  Pose before;                   // pose before this tick, if the object presses tissue
  std::uint32_t rest_ticks = 0;  // consecutive ticks in which the object hardly moved
  polygon::Neighbourhood near;
  double margin_m = 0.0;                         // margin of the next survey
  double counted = 0.0, margin_counted_m = 0.0;  // number of elements in the last survey, and its margin
  polygon::CrossableEdges crossable_edges;       // of the element that last held the proxy alone
};

// An element that is an active constraint of the proxy.
struct ActiveElement {
  std::uint32_t object = 0, element = 0;
  glm::dvec3 force_N{0.0};  // on the proxy, scene frame
};

// Result of a surface voxel's last rigid-distance query.
struct ObstacleQuery {
  glm::vec3 from{0.0F};   // displacement of the voxel at the query (m)
  bool replaced = false;  // obstacle and query at rest are kept in obstacles_at_rest
  float clear_m = 0.0F;   // distance from the voxel's centre to the nearest surface; at most the search range
};

// Obstacle and query that a surface voxel had before a contact on nested patches moved it. They are restored
// when the contact ends, because the tissue is then at rest at once.
struct ObstacleAtRest {
  std::uint32_t surface_number = 0;
  voxel::Obstacle obstacle;
  ObstacleQuery query;
};

// State that is carried from tick to tick in plain values. Assignment copies it.
struct CarriedState {
  // ---- of the session ----
  EditedValues edited;
  glm::dvec3 proxy_m{0.0};   // scene frame
  glm::dvec3 device_m{0.0};  // last valid input
  device::ForceLimitState limit;
  device::PassivityState passive;
  std::uint64_t tick = 0;
  device::Clock clock;                // simulated time, on which the bodies' paths depend
  std::uint64_t nonfinite = 0;        // inputs or forces that were not finite
  std::uint32_t faults = 0;           // FaultBit, accumulated over the session
  std::uint64_t truncated_ticks = 0;  // ticks in which a bound on steps or work stopped the proxy early

  // ---- of the proxy ----
  double learnt_stiffness_N_per_m = 0.0;  // tissue stiffness in excess of the pressed voxels' model
  // Half-spaces of voxels that could not leave the tool's way when last pressed (scene frame).
  std::vector<polygon::ContactPlane> jammed;
  std::vector<RigidState> rigid;          // [rigid]
  glm::dvec3 swept_to_m{0.0};             // end of the last sweep; the cached planes are valid there
  std::array<ActiveElement, 3> active{};  // the proxy's active constraints
  std::uint32_t active_count = 0;
  bool stuck = false;          // friction keeps the proxy on the active elements
  bool sliding = false;        // friction lets the proxy slide on the active elements
  bool pushed = false;         // since the last sweep a body moved the proxy, possibly off the elements
  glm::dvec3 friction_N{0.0};  // force on the proxy that friction and shading add to the normal force
  std::uint32_t rubbed = 0;    // rigid object that exerts friction_N and carries the proxy
  DampingState damping;
  MixedCoupling mixed;  // in a scene where objects have stiffnesses of their own, else not pressed
  // `look_mask`: the rigid objects that the map lists within `look_m` of `look_at` along each axis.
  glm::dvec3 look_at{0.0};
  double look_m = -1.0;
  std::uint64_t look_mask = 0;

  // ---- of arbitration ----
  std::vector<voxel::Reaction> reactions;  // [soft] reaction on the tool when it last pressed, scene frame
  std::vector<FacetContact> facet_contacts;
  std::vector<std::vector<std::uint8_t>> paired;               // [soft pair][surface voxel] 1: in contact
  std::vector<std::vector<ObstacleQuery>> obstacle_queries;    // [soft][surface voxel]
  std::vector<std::vector<ObstacleAtRest>> obstacles_at_rest;  // [soft] replaced since the contact began
  std::vector<std::uint32_t> cursor, obstacle_cursor;          // [soft] next surface voxel to visit
  std::vector<std::uint32_t> pair_cursor;                      // [soft pair]
  std::vector<BodyObstacles> body_obstacles;                   // [soft]; empty where no body presses tissue
  // For bodies that press tissue. Bounds on the motion of any point (m): since the session began, and in this
  // tick.
  std::vector<double> body_travel_m, body_moved_m;  // [rigid]
  BodyCollisions collisions;
};

struct WorldState : CarriedState {
  WorldState(const World& world, OccupancyMap occupancy);
  // Call after `soft` is filled: allocates every buffer whose size depends on it.
  void prepare(const World& world);

  std::vector<std::unique_ptr<voxel::SoftObject>> soft;  // one for each World::soft
  AsyncRelaxation async;                                 // of the objects that are relaxed asynchronously
  OccupancyMap map;
  OccupancyMap::Trail map_trail;  // of the tick's look-ups; a cache, without effect on results
  TickScratch scratch;

  // ---- results of the last tick, beside TickResult ----
  std::vector<ObjectFeel> feel;           // [rigid…, soft…]
  std::vector<glm::dvec3> rigid_force_N;  // [rigid] on the proxy, scene frame
  // For tests: the corners of the last sweep's path, as many as fit.
  std::span<glm::dvec3> trail;
  std::size_t trail_count = 0;

 private:
  void prepare_body_obstacles(const World& world);
};

// ---- values that may have been edited (edits.h) ----
inline double tool_stiffness_N_per_m(const World& world, const CarriedState& state) noexcept {
  return state.edited.coupling_N_per_m.value_or(world.tool.stiffness_N_per_m);
}
// Force of the coupling over its length.
inline double coupling_N_per_m(const World& world, const CarriedState& state) noexcept {
  return state.mixed.pressed() ? state.mixed.force_per_depth_N_per_m : tool_stiffness_N_per_m(world, state);
}
// The force of the virtual coupling on the hand.
inline glm::dvec3 coupling_force_N(const World& world, const CarriedState& state,
                                   const glm::dvec3& device_m) noexcept {
  return coupling_N_per_m(world, state) * (state.proxy_m - device_m);
}
inline double max_force_N(const World& world, const CarriedState& state) noexcept {
  return state.edited.max_force_N.value_or(world.limits.max_force_N);
}
inline const SurfaceFeel& feel_of(const World& world, const CarriedState& state,
                                  std::uint32_t rigid) noexcept {
  const std::optional<SurfaceFeel>& edited = state.edited.feel[rigid];
  return edited ? *edited : world.rigid[rigid].feel;
}

// Appends to the body contacts of this tick. If there is no room, sets a fault and returns false.
inline bool add_contact(WorldState& state, const BodyContact& contact) noexcept {
  std::vector<BodyContact>& contacts = state.scratch.body_contacts;
  if (contacts.size() == contacts.capacity()) {
    state.faults |= fault_body_crowded;
    return false;
  }
  contacts.push_back(contact);
  return true;
}

}  // namespace hybrid
