// SPDX-License-Identifier: GPL-3.0-or-later
// A scene ready to be touched. `World` is what does not change in a session, `WorldState` what does; the tick
// takes the first as const and the second as its own.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "device/loop/clock.h"
#include "device/loop/force_limit.h"
#include "device/loop/passivity.h"
#include "hybrid/map/occupancy_map.h"
#include "hybrid/tick/tissue/async_relaxation.h"
#include "hybrid/world/rigid_motion.h"
#include "hybrid/scene/scene.h"
#include "hybrid/snapshot/snapshot.h"
#include "hybrid/feel/surface_feel.h"
#include "hybrid/world/contact_points.h"
#include "polygon/surface/rigid_surface.h"
#include "polygon/proxy/neighbourhood.h"
#include "polygon/proxy/minimise_on_planes.h"
#include "polygon/proxy/edge_crossing.h"
#include "voxel/object/facet_contact.h"
#include "voxel/object/soft_object.h"

namespace hybrid {

struct RigidObject {
  std::string name;
  std::shared_ptr<const polygon::RigidSurface> surface;  // body frame; never changes
  Pose pose;                                             // body to scene; of a moving object, where it begins
  std::shared_ptr<const polygon::TriangleMesh> drawn;    // body frame; what is rasterised and drawn
  RigidMotion motion{};                                  // fixed unless the scene says otherwise
  SurfaceFeel feel{};                                    // hard and smooth unless the scene says otherwise
  bool surface_is_drawn = false;                         // the surface is of that very mesh, and shares it
  bool presses_tissue = false;                           // it moves, beside soft objects
  std::vector<SurfacePoint> points{};  // for where it meets others; none where no body is free

  [[nodiscard]] glm::dvec3 to_body(const glm::dvec3& in_scene) const {
    return glm::inverse(pose.rotation) * (in_scene - pose.position_m);
  }
  [[nodiscard]] glm::dvec3 to_scene(const glm::dvec3& in_body) const {
    return pose.position_m + pose.rotation * in_body;
  }
  [[nodiscard]] std::size_t memory_bytes() const {
    if (drawn == nullptr || surface_is_drawn) return surface->memory_bytes();
    return surface->memory_bytes() + drawn->vertices.capacity() * sizeof(glm::dvec3) +
           drawn->triangles.capacity() * sizeof(polygon::TriangleIndices);
  }
};

struct SoftBody {  // the constant half of a soft object; the moving one is in WorldState::soft
  std::string name;
  voxel::BodyPose pose;                               // volume frame to scene
  std::uint32_t first_number = 0;                     // of its surface voxels in the occupancy map
  std::uint32_t budget = 0;                           // background voxel updates a tick
  polygon::TriangleMesh drawn;                        // volume frame, at rest
  std::size_t thinned = 0;                            // voxels that thinning left out
  std::vector<std::array<std::uint8_t, 2>> struts{};  // {label that thinning gave, label there was}

  [[nodiscard]] glm::dvec3 to_body(const glm::dvec3& in_scene) const {
    return glm::inverse(pose.rotation) * (in_scene - pose.origin);
  }
  [[nodiscard]] glm::dvec3 to_scene(const glm::dvec3& in_body) const {
    return pose.origin + pose.rotation * in_body;
  }
};

// Where a rigid body is now: body to scene. As a matrix, because the tick turns many points.
struct BodyFrame {
  glm::dmat3 rotation{1.0};
  glm::dvec3 position_m{0.0};

  BodyFrame() = default;
  explicit BodyFrame(const Pose& pose)
      : rotation(glm::mat3_cast(pose.rotation)), position_m(pose.position_m) {}
  [[nodiscard]] glm::dvec3 to_body(const glm::dvec3& in_scene) const {
    return (in_scene - position_m) * rotation;  // v · R is Rᵀ v
  }
  [[nodiscard]] glm::dvec3 to_scene(const glm::dvec3& in_body) const {
    return position_m + rotation * in_body;
  }
};

struct World {
  std::vector<RigidObject> rigid;
  std::vector<SoftBody> soft;
  Tool tool;
  device::ForceLimits limits;
  std::optional<device::PassivityOptions> passivity;  // empty: no controller
  // A point is a ball too, of this radius: 1e-7 of the scene, far above rounding and far below anything felt.
  double skin_m = 0.0;
  double extent_m = 0.0;        // diagonal of all objects' box
  double rounding_m = 0.0;      // what a coordinate of the scene may be off by
  double encoder_m = 0.0;       // what the device's position is rounded to
  bool use_map = true;          // false: every object is asked every time; a baseline to time the map against
  bool damping_account = true;  // false: sampled damping as it is; a baseline that theory is known for
  // Pairs of soft objects that may meet: the voxels of the first, the finer one, meet the surface of the
  // second.
  std::vector<std::array<std::uint32_t, 2>> meeting;

  [[nodiscard]] std::size_t object_count() const { return rigid.size() + soft.size(); }
  // Of the ball that rigid surfaces keep out.
  [[nodiscard]] double contact_radius_m() const { return std::max(tool.radius_m, skin_m); }
  // Sets skin_m and rounding_m for rigid objects and soft ones within the box.
  void set_scale(const glm::dvec3& low, const glm::dvec3& high) {
    extent_m = glm::length(high - low);
    const double furthest = glm::length(glm::max(glm::abs(low), glm::abs(high)));
    rounding_m = 8.0 * std::numeric_limits<double>::epsilon() * std::max(furthest, extent_m);
    skin_m = std::max(1e-7 * extent_m, 1e2 * rounding_m);
  }
};

inline bool is_free(const World& world, std::uint32_t rigid) noexcept {
  return world.rigid[rigid].motion.kind() == RigidMotion::Kind::free;
}

// A surface voxel of one soft object, and the other's surface that it presses on.
struct VoxelPair {
  std::uint32_t meeting = 0;   // index into World::meeting
  voxel::PressedPair pressed;  // the facet that the voxel is over
  // Others that it lies on as well, in a hollow; see voxel::lies_beside().
  std::array<voxel::PressedPair, 2> beside{};
  std::size_t besides = 0;
  std::uint32_t surface_a = 0;
  bool held = false;  // near enough to press: its voxels are moved with it, and by nobody else
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
  fault_nonfinite_body = 64,    // a free body was pushed by something that is not finite: it stood still
  fault_body_squeezed = 128,    // tissue could not leave the way of a body that moves: they overlapped
  fault_body_crowded = 256,     // a body that moves came to more soft voxels than a tick looks at
  fault_bodies_overlap = 512,   // a free body had no way out between rigid objects
};

inline constexpr std::size_t kMaxNear = 256;     // triangles considered at once
inline constexpr std::size_t kMaxPlanes = 1024;  // rigid planes and give-way bounds
inline constexpr std::size_t kMaxPairs = 8192;
inline constexpr std::size_t kMaxFound = 32768;  // map entries read in one look-up

// What the proxy knows of one rigid object, and where that is.
struct RigidNear {
  BodyFrame frame;               // now
  Pose pose;                     // the same
  FreeBodyState free;            // of a free body
  Pose before;                   // of one that presses tissue: where it was before this tick
  std::uint32_t calm_ticks = 0;  // … and since when it rests, as far as can be told
  polygon::Neighbourhood near;
  double margin_m = 0.0;  // of the next survey, adapted to how crowded the last one was:
  double counted = 0.0, margin_counted_m = 0.0;  // elements, and how far it looked
  polygon::Ridges ridges;                        // of the element that last held the proxy alone
};

// An element that holds the proxy.
struct ActiveElement {
  std::uint32_t object = 0, element = 0;
  glm::dvec3 force_N{0.0};  // on the proxy, scene frame
};

// One plane of the proxy's problem, and whose it is.
struct HeldElement {
  std::uint32_t object = 0, element = 0;
  polygon::SeparatingPlane in_body;
  bool own_plane = true;  // the element's own plane may be used
  bool flat = false;      // and it is what in_body says, from wherever it is seen
  bool touching = false;  // the proxy where the last sweep left it is known to lie on it
};
inline constexpr std::uint32_t kMaxHeld = 32;

// What was seen from a surface voxel when rigid surfaces were last looked for there.
struct SurfaceSeen {
  glm::vec3 from{0.0F};  // its displacement then (m)
  float clear_m = 0.0F;  // from its centre to the nearest of them, or how far was looked
};

// When a surface voxel has to be looked at again for one body.
struct BodySight {
  glm::vec3 u{0.0F};      // displacement when it was last looked at
  bool given_up = false;  // it is deep in the body, and left alone until it is out of it
  double until_m = 0.0;   // it is not near the body before that has travelled so far, or the voxel moved
};

// What bodies that move ask of one soft object (hybrid/tick/bodies/bodies_press_tissue.h).
struct BesideBodies {
  static constexpr std::uint32_t kNobody = 0xFFFFFFFFU;
  std::vector<voxel::Obstacle> standing;       // [surface voxel] what fixed surfaces ask of it
  std::vector<voxel::Obstacle> moving;         // [surface voxel] what the nearest body asks of it
  std::vector<std::uint32_t> whose;            // [surface voxel] the rigid object that this is; kNobody: none
  std::vector<std::uint8_t> listed;            // [surface voxel] 1: in `near`
  std::vector<std::uint8_t> blocked;           // [surface voxel] 1: it could not leave the way of a free body
  std::vector<std::uint32_t> near;             // surface voxels that a body is near to
  std::vector<std::vector<BodySight>> sights;  // [rigid object][surface voxel]; empty: it does not press
};

// What a point of one rigid object sees of another's surface, in the other one's frame.
struct SeenSurface {
  glm::dvec3 normal{0.0};  // out of it
  glm::dvec3 at_m{0.0};    // its nearest place
  double gap_m = 0.0;      // negative: within it
};
struct PointSight : SeenSurface {
  double seen_m = -1e300;      // how far both objects had travelled then
  double slid_m = 0.0;         // along the point's edge
  SeenSurface end;             // where its way ends in this tick …
  std::uint64_t followed = 0;  // … as it was followed in that round
};

// A free rigid body and another one, free or not, that it may collide with (hybrid/tick/bodies/body_collisions.h).
struct PairOfBodies {
  std::uint32_t free = 0, other = 0;
  double size_m = 0.0, skin_m = 0.0;         // of the smaller one; how far apart they are kept
  double friction = 0.0;                     // Coulomb's coefficient
  double until_m = -1e300, seen_m = -1e300;  // they do not touch before both have travelled so far in sum
  std::array<std::vector<PointSight>, 2> sights;  // of the points of the one, then of the other
};
struct BodyCollisions {
  std::vector<PairOfBodies> pairs;
  std::vector<double> travel_m;  // [rigid] no point of it has moved further since the session began
  std::vector<Pose> last;        // [rigid] as the last tick left them
  std::uint64_t round = 0;
};

// Of all that acts on free bodies, what acts on one by itself: the first of it, and how much of it are
// springs.
struct OwnContacts {
  std::size_t first = 0, springs = 0;
};
// Of the current tick: free bodies that step together.
struct Colliding {
  std::vector<SteppedBody> stepped;
  std::vector<OwnContacts> own;          // [stepped]
  std::vector<std::uint32_t> object;     // [stepped] which rigid object it is
  std::vector<std::uint32_t> member;     // [rigid] which of `stepped`
  std::vector<BodyFrame> before, after;  // [rigid]
  std::vector<Pose> next;                // [rigid]
  std::vector<double> moves_m;           // [rigid]
  std::vector<FreeBody> alone;           // each by itself: nothing but contacts acts on it
  std::vector<SteppedBody> still;        // … and it has no speed
  BodySystem system;
};

// A surface voxel that may be near a body; those with the least left come first.
struct BodyLook {
  double left_m = 0.0;
  std::uint32_t body = 0, surface_number = 0;
  bool operator<(const BodyLook& other) const noexcept {
    if (left_m != other.left_m) return left_m < other.left_m;
    return body != other.body ? body < other.body : surface_number < other.surface_number;
  }
};

// What goes from tick to tick as plain values: assigning it is taking over the state.
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
  std::uint64_t truncated_ticks = 0;  // ticks that ended before the proxy arrived, by a bound on its steps
  double hidden_stiffness_N_per_m = 0.0;  // what tissue showed beyond the model of its pressed voxels
  // Half-spaces of voxels that could not leave the tool's way, when they were last pressed (scene frame).
  std::vector<polygon::ContactPlane> blocked;
  std::vector<RigidNear> rigid;           // [rigid]
  glm::dvec3 swept_to_m{0.0};             // where the last sweep ended: what is known is known from there
  std::array<ActiveElement, 3> active{};  // elements that held the proxy last
  std::uint32_t active_count = 0;
  bool stuck = false;          // friction holds the proxy on what is active
  bool sliding = false;        // or lets it slide
  bool pushed = false;         // a body moved the proxy since, to where what is active may not be
  glm::dvec3 friction_N{0.0};  // on the proxy: what friction and shading add to what presses
  std::uint32_t rubbed = 0;    // the rigid object that this comes from, and that carries the proxy
  DampingState damping;
  // The rigid objects with surface within `look_m` of `look_at`, along each axis, as the map said.
  glm::dvec3 look_at{0.0};
  double look_m = -1.0;
  std::uint64_t look_mask = 0;

  // ---- of arbitration ----
  std::vector<VoxelPair> pairs;
  std::vector<std::vector<std::uint8_t>> paired;        // [meeting][surface voxel of a]
  std::vector<std::vector<SurfaceSeen>> obstacle_seen;  // [soft][surface voxel]
  std::vector<std::uint32_t> cursor, obstacle_cursor;   // [soft] round-robin over surface voxels
  std::vector<std::uint32_t> pair_cursor;               // [meeting]
  std::vector<BesideBodies> beside_bodies;              // [soft]; none where no body presses tissue
  // Of bodies that press tissue: how far any point of them moved since the session began, and in this tick.
  std::vector<double> body_travel_m, body_moved_m;  // [rigid]
  BodyCollisions collisions;
};

// Everything the tick writes. Buffers are sized when the world is built, and never after.
struct WorldState : CarriedState {
  WorldState(const World& world, OccupancyMap occupancy);
  // Sizes what depends on `soft`, once that is filled.
  void prepare(const World& world);
  void prepare_beside_bodies(const World& world);

  std::vector<std::unique_ptr<voxel::SoftObject>> soft;  // one a World::soft
  Apart apart;                                           // those of them that are relaxed apart
  OccupancyMap map;
  OccupancyMap::Trail map_trail;  // of the tick's questions to it: hints only
  // For tests: the corners of the last sweep's way, as many as there is room for.
  std::span<glm::dvec3> trail;
  std::size_t trail_count = 0;

  // ---- of the current tick ----
  std::vector<ObjectFeel> feel;            // [rigid…, soft…]
  std::vector<glm::dvec3> rigid_force_N;   // [rigid], scene frame
  std::vector<voxel::Reaction> reactions;  // [soft], scene frame
  std::vector<polygon::NearPoint> near;    // scratch
  std::array<HeldElement, kMaxHeld> held{};
  std::vector<polygon::ContactPlane> planes;
  std::vector<voxel::ToolBound> bounds;
  std::vector<std::uint32_t> found;
  std::vector<std::vector<voxel::VoxelId>> touched;  // [soft]
  std::vector<BodyLook> due;                         // surface voxels that bodies may be near to
  std::vector<std::uint32_t> in_the_way;             // … and that are in one
  std::vector<BodyContact> body_contacts;            // what presses on free bodies
  Colliding colliding;                               // … which are these
  std::vector<std::uint32_t> at_body;                // surface voxels of one object that do …
  std::vector<voxel::VoxelId> held_by_body;          // … these voxels
  std::vector<voxel::HeldLoad> held_loads;           // … and what with
};

// Appends to state.body_contacts; false, and a fault, where there is no more room.
inline bool add_contact(WorldState& state, const BodyContact& contact) noexcept {
  if (state.body_contacts.size() == state.body_contacts.capacity()) {
    state.faults |= fault_body_crowded;
    return false;
  }
  state.body_contacts.push_back(contact);
  return true;
}

}  // namespace hybrid
