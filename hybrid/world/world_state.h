// SPDX-License-Identifier: GPL-3.0-or-later
// Everything of a session that changes. A tick is a function of World, WorldState, input and dt, and a
// recording needs no more than these. Buffers of a single tick are apart, in `scratch`.
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
#include "hybrid/feel/surface_feel.h"
#include "hybrid/map/occupancy_map.h"
#include "hybrid/world/async_relaxation.h"
#include "hybrid/world/body_state.h"
#include "hybrid/world/object_feel.h"
#include "hybrid/world/tick_scratch.h"
#include "hybrid/world/world.h"
#include "polygon/proxy/edge_crossing.h"
#include "polygon/proxy/neighbourhood.h"
#include "voxel/object/facet_contact.h"

namespace hybrid {

// A surface voxel of one soft object over a facet of another one's surface.
struct FacetContact {
  std::uint32_t soft_pair = 0;  // index into World::soft_pairs
  voxel::PressedPair pressed;   // the facet that the voxel is over
  // Further facets that it lies on, in a hollow; see voxel::lies_beside().
  std::array<voxel::PressedPair, 2> beside{};
  std::size_t extra_facets = 0;
  std::uint32_t surface_a = 0;
  bool held = false;  // near enough to press: the contact alone moves its voxels
};

// Named faults of a tick; the report says each in words, with the setting to raise where there is one.
enum FaultBit : std::uint32_t {
  fault_nonfinite_input = 1,  // the device gave a position that is not finite: the last good one held
  fault_touch_overflow =
      2,  // more soft voxels near the tool than SoftObject::kMaxTouched: use a smaller tool or coarser voxels
  fault_triangle_overflow = 4,  // more triangles near the proxy than kMaxNear even at the smallest step
  fault_map_overflow = 8,       // a voxel moved where the map had no room for a brick
  fault_pair_overflow = 16,     // more pairs of soft voxels than fit: use coarser voxels
  fault_infeasible = 32,        // rigid planes left no room for the tool
  fault_nonfinite_body = 64,    // a free body was pushed by something that is not finite: it stood still
  fault_body_squeezed = 128,    // tissue could not leave the way of a body that moves: they overlapped
  fault_body_crowded = 256,     // a body that moves came to more soft voxels than a tick looks at
  fault_bodies_overlap = 512,   // a free body had no way out between rigid objects
};

inline constexpr std::size_t kMaxNear = 256;     // triangles considered at once
inline constexpr std::size_t kMaxPlanes = 1024;  // rigid planes and give-way bounds
inline constexpr std::size_t kMaxFacetContacts = 8192;
inline constexpr std::size_t kMaxMapHits = 32768;  // map entries read in one look-up

// Per rigid object: its pose, and the separating planes cached around the proxy.
struct RigidState {
  BodyFrame frame;               // now
  Pose pose;                     // the same
  FreeBodyState free;            // of a free body
  Pose before;                   // of one that presses tissue: its pose before this tick
  std::uint32_t calm_ticks = 0;  // ticks since it came to rest
  polygon::Neighbourhood near;
  double margin_m = 0.0;  // of the next survey, adapted to how crowded the last one was:
  double counted = 0.0, margin_counted_m = 0.0;  // its elements, and how far it looked
  polygon::CrossableEdges crossable_edges;                        // of the element that last held the proxy alone
};

// An element that holds the proxy.
struct ActiveElement {
  std::uint32_t object = 0, element = 0;
  glm::dvec3 force_N{0.0};  // on the proxy, scene frame
};

// Result of a surface voxel's last rigid-distance query.
struct ObstacleQuery {
  glm::vec3 from{0.0F};  // displacement of the voxel at the query (m)
  float clear_m = 0.0F;  // from its centre to the nearest surface, or to the end of the search
};

// State that goes from tick to tick as plain values: assigning it takes over the state.
struct CarriedState {
  // ---- of the session ----
  glm::dvec3 proxy_m{0.0};   // scene frame
  glm::dvec3 device_m{0.0};  // last good input
  device::ForceLimitState limit;
  device::PassivityState passive;
  std::uint64_t tick = 0;
  device::Clock clock;                // simulated, of the bodies' paths
  std::uint64_t nonfinite = 0;        // inputs or forces that were not finite
  std::uint32_t faults = 0;           // FaultBit, ever
  std::uint64_t truncated_ticks = 0;  // ticks that a bound on the proxy's steps ended before it arrived

  // ---- of the proxy ----
  double learnt_stiffness_N_per_m = 0.0;  // of tissue, beyond the model of its pressed voxels
  // Half-spaces of voxels that could not leave the tool's way when they were last pressed (scene frame).
  std::vector<polygon::ContactPlane> jammed;
  std::vector<RigidState> rigid;          // [rigid]
  glm::dvec3 swept_to_m{0.0};             // end of the last sweep, from which cached planes are known
  std::array<ActiveElement, 3> active{};  // elements that held the proxy last
  std::uint32_t active_count = 0;
  bool stuck = false;          // friction holds the proxy on the active elements
  bool sliding = false;        // or lets it slide
  bool pushed = false;         // a body moved the proxy since, possibly off the active elements
  glm::dvec3 friction_N{0.0};  // on the proxy: what friction and shading add to the normal force
  std::uint32_t rubbed = 0;    // the rigid object of `friction_N`, which carries the proxy
  DampingState damping;
  // The rigid objects with surface within `look_m` of `look_at`, along each axis, as the map said.
  glm::dvec3 look_at{0.0};
  double look_m = -1.0;
  std::uint64_t look_mask = 0;

  // ---- of arbitration ----
  std::vector<voxel::Reaction> reactions;  // [soft] to the tool where it last pressed, scene frame
  std::vector<FacetContact> facet_contacts;
  std::vector<std::vector<std::uint8_t>> paired;             // [soft pair][surface voxel of the first]
  std::vector<std::vector<ObstacleQuery>> obstacle_queries;  // [soft][surface voxel]
  std::vector<std::uint32_t> cursor, obstacle_cursor;        // [soft] round-robin over surface voxels
  std::vector<std::uint32_t> pair_cursor;                    // [soft pair]
  std::vector<BodyObstacles> body_obstacles;                 // [soft]; empty where no body presses tissue
  // Of bodies that press tissue: how far any point of them moved since the session began, and in this tick.
  std::vector<double> body_travel_m, body_moved_m;  // [rigid]
  BodyCollisions collisions;
};

struct WorldState : CarriedState {
  WorldState(const World& world, OccupancyMap occupancy);
  // Call after `soft` is filled: allocates every buffer whose size depends on it.
  void prepare(const World& world);

  std::vector<std::unique_ptr<voxel::SoftObject>> soft;  // one for each World::soft
  AsyncRelaxation async;                                 // of those that are relaxed by another thread
  OccupancyMap map;
  OccupancyMap::Trail map_trail;  // of the tick's look-ups: hints only
  TickScratch scratch;

  // ---- results of the last tick, beside TickResult ----
  std::vector<ObjectFeel> feel;           // [rigid…, soft…]
  std::vector<glm::dvec3> rigid_force_N;  // [rigid] on the proxy, scene frame
  // For tests: the corners of the last sweep's way, as many as there is room for.
  std::span<glm::dvec3> trail;
  std::size_t trail_count = 0;

 private:
  void prepare_body_obstacles(const World& world);
};

// Appends to the body contacts of this tick; false, and a fault, where there is no more room.
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
