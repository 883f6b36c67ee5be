// SPDX-License-Identifier: GPL-3.0-or-later
// Where things are drawn: placements of the unit shapes of unit_shapes.h (tool and force arrow), and of
// rigid objects that move.
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include "hybrid/view/camera.h"
#include "hybrid/snapshot/snapshot.h"

namespace hybrid {

// Length of the force arrow in a view: max_force_N (the scene's, or what is felt where it has none) spans
// this share of the view's height.
inline constexpr double arrow_share_of_view = 0.30;

// Tip of the arrow (scene frame, meters); the proxy when there is no force. It springs from the proxy, and
// its length counts from the tool's surface, because the part within the tool is not seen.
glm::dvec3 arrow_tip(const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera);

// Unit cylinder and cone to arrow, relative to `origin_m`.
struct ArrowPlacement {
  bool visible = false;
  glm::mat4 shaft{1.0F}, head{1.0F};
};
ArrowPlacement place_arrow(const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera,
                           const glm::dvec3& origin_m);

// Unit ball (or, for a punch, unit cylinder) to tool. A flat punch touches with its lower face, the disc
// about `at_m`; its body stands above, along scene +z.
glm::mat4 place_tool(const DrawnScene& scene, const glm::dvec3& at_m, const glm::dvec3& origin_m);

// A rigid object from where it lies at rest to where it is, relative to `origin_m`; composed in doubles.
glm::mat4 place_rigid(const RigidPlace& place, const glm::dvec3& origin_m);

// Unit disc to a disc about the tool that faces the camera, a little larger than the tool: what rigid
// surfaces must not hide.
glm::mat4 place_tool_disc(const DrawnScene& scene, const glm::dvec3& at_m, const Camera& camera,
                          const glm::dvec3& origin_m);

}  // namespace hybrid
