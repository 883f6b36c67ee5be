// SPDX-License-Identifier: GPL-3.0-or-later
// Places the unit shapes of unit_shapes.h: the tool, the force arrow, and moving rigid objects.
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include "hybrid/snapshot/snapshot.h"
#include "hybrid/view/camera.h"

namespace hybrid {

// Length of the force arrow at max_force_N, as a share of the view's height. max_force_N is the scene's limit
// or, without one, the present force.
inline constexpr double arrow_share_of_view = 0.30;

// Tip of the arrow (scene's frame, meters); the proxy when there is no force. The arrow starts at the proxy.
// Its length counts from the tool's surface, because the tool hides the part within it.
glm::dvec3 arrow_tip(const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera);

// Transforms of the unit cylinder and the unit cone to the arrow, relative to `origin_m`.
struct ArrowPlacement {
  bool visible = false;
  glm::mat4 shaft{1.0F}, head{1.0F};
};
ArrowPlacement place_arrow(const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera,
                           const glm::dvec3& origin_m);

// Greatest distance of a point of the arrow from the arrow's axis.
[[nodiscard]] double arrow_thickness_m(const Camera& camera);
// Greatest distance of a point of the tool from the tool's place.
[[nodiscard]] double tool_reach_m(const DrawnScene& scene);

// Transform of the unit ball (for a punch: the unit cylinder) to the tool. The lower face of a flat punch is
// the disc about `at_m`. Its body is above, along the scene's +z.
glm::mat4 place_tool(const DrawnScene& scene, const glm::dvec3& at_m, const glm::dvec3& origin_m);

// Transform of a rigid object from its rest pose to its pose in the snapshot, relative to `origin_m`. It is
// computed in doubles.
glm::mat4 place_rigid(const RigidPlace& place, const glm::dvec3& origin_m);

// Transform of the unit disc to a disc between the eye and the tool. The disc faces the camera, and its
// radius is at least 1.8 times the tool's. Rigid surfaces must not hide this disc. It lies well in front of
// the tool, so that a surface just below the tool is not in front of the disc.
glm::mat4 place_tool_disc(const DrawnScene& scene, const glm::dvec3& at_m, const Camera& camera,
                          const glm::dvec3& origin_m);

}  // namespace hybrid
