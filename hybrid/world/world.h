// SPDX-License-Identifier: GPL-3.0-or-later
// A scene ready to be touched: the half that never changes in a session. WorldState (world_state.h) is the
// other half. The tick takes `World` as const.
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
#include <string>
#include <vector>

#include "device/loop/force_limit.h"
#include "device/loop/passivity.h"
#include "hybrid/feel/surface_feel.h"
#include "hybrid/geometry/pose.h"
#include "hybrid/scene/tool.h"
#include "hybrid/world/contact_points.h"
#include "hybrid/world/rigid_motion.h"
#include "polygon/surface/rigid_surface.h"
#include "voxel/object/facet_contact.h"
#include "voxel/object/soft_object.h"

namespace hybrid {

struct RigidObject {
  std::string name;
  std::shared_ptr<const polygon::RigidSurface> surface;  // body frame; never changes
  Pose pose;                                             // body to scene; at the start if the object moves
  std::shared_ptr<const polygon::TriangleMesh> drawn;    // body frame; the mesh that is rasterised and drawn
  RigidMotion motion{};                                  // fixed by default
  SurfaceFeel feel{};                                    // hard and smooth by default
  bool surface_is_drawn = false;                         // `surface` is made of `drawn` and shares its memory
  bool presses_tissue = false;                           // it moves, and the scene has soft objects
  std::vector<SurfacePoint> points{};  // contact points with other rigid objects; empty if no body is free

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

struct SoftBody {  // the constant half of a soft object; WorldState::soft is the other one
  std::string name;
  voxel::BodyPose pose;                               // volume frame to scene
  std::uint32_t first_number = 0;                     // its first surface voxel's number in the occupancy map
  std::uint32_t budget = 0;                           // background voxel updates a tick
  polygon::TriangleMesh drawn;                        // volume frame, at rest
  std::size_t thinned = 0;                            // voxels that thinning left out
  std::vector<std::array<std::uint8_t, 2>> struts{};  // {label that thinning gave, label before}

  [[nodiscard]] glm::dvec3 to_body(const glm::dvec3& in_scene) const {
    return glm::inverse(pose.rotation) * (in_scene - pose.origin);
  }
  [[nodiscard]] glm::dvec3 to_scene(const glm::dvec3& in_body) const {
    return pose.origin + pose.rotation * in_body;
  }
};

// A rigid body's present pose, body to scene, with a matrix because the tick transforms many points.
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
  std::optional<device::PassivityOptions> passivity;  // empty: no passivity controller
  // A point tool is treated as a ball of this radius: 1e-7 of the scene's extent, far above rounding and far
  // below anything felt.
  double skin_m = 0.0;
  double extent_m = 0.0;    // diagonal of the box of all objects
  double rounding_m = 0.0;  // bound of the rounding error of a scene coordinate
  double encoder_m = 0.0;   // resolution of the device's position
  bool use_map = true;      // false: every object is queried in every tick; the baseline for the map's timing
  bool damping_account = true;  // false: sampled damping without correction; the baseline with a known theory
  // Pairs of soft objects that may meet. Surface voxels of the first object (the finer one) are stopped by
  // the surface of the second.
  std::vector<std::array<std::uint32_t, 2>> soft_pairs;

  [[nodiscard]] std::size_t object_count() const { return rigid.size() + soft.size(); }
  // Radius of the tool's ball at rigid surfaces (m).
  [[nodiscard]] double contact_radius_m() const { return std::max(tool.radius_m, skin_m); }
  // Sets extent_m, rounding_m and skin_m for objects within the box.
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

}  // namespace hybrid
