// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/tool_and_arrow.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

namespace hybrid {
namespace {

// Thickness of the arrow, as a share of the view's height. head_thick: that of its head (unit: the arrow's).
constexpr double least_thick = 0.0035, most_thick = 0.007, head_thick = 2.4;
constexpr double punch_height = 3.0;  // height of the body above the face, in radii
// Distance of the tool's disc from the tool towards the eye, in radii of the disc. The surface that the tool
// lies on does not cut the disc if the eye is more than 20° above the surface.
constexpr double disc_nearer = 2.0;

glm::mat4 placed(const glm::dvec3& at, const glm::dmat3& axes) {
  glm::dmat4 m(axes);
  m[3] = glm::dvec4(at, 1.0);
  return {m};
}

glm::dmat3 axes_along(const glm::dvec3& z) {
  const glm::dvec3 side = std::abs(z.x) < 0.7 ? glm::dvec3(1.0, 0.0, 0.0) : glm::dvec3(0.0, 1.0, 0.0);
  const glm::dvec3 x = glm::normalize(glm::cross(side, z));
  return {x, glm::cross(z, x), z};
}

}  // namespace

glm::dvec3 arrow_tip(const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera) {
  const double force = glm::length(snapshot.force_N);
  if (!(force > 1e-3) || !std::isfinite(force)) return snapshot.proxy_m;
  const double full = scene.max_force_N > 0.0 ? scene.max_force_N : force;
  const double length = arrow_share_of_view * camera.view_height_m() * std::min(force / full, 1.0);
  // The tool hides the part of the arrow within it, so that part does not count as length.
  const glm::dvec3 along = snapshot.force_N / force;
  double inside = scene.tool_radius_m;
  if (scene.tool_is_punch) {
    const double to_side = scene.tool_radius_m / std::max(std::hypot(along.x, along.y), 1e-3);
    const double to_end = along.z > 0.0 ? punch_height * scene.tool_radius_m / std::max(along.z, 1e-3) : 0.0;
    inside = std::min(to_side, to_end);
  }
  return snapshot.proxy_m + along * (length + inside);
}

ArrowPlacement place_arrow(const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera,
                           const glm::dvec3& origin_m) {
  ArrowPlacement arrow;
  const glm::dvec3 along = arrow_tip(scene, snapshot, camera) - snapshot.proxy_m;
  const double length = glm::length(along);
  if (!(length > 0.0) || !std::isfinite(length)) return arrow;
  // The shaft is thinner than the tool, but thick enough to be seen.
  const double thick = std::clamp(0.4 * scene.tool_radius_m, least_thick * camera.view_height_m(),
                                  most_thick * camera.view_height_m());
  const double head = std::min(0.5 * length, 5.0 * thick);
  const double thin = std::min(thick, 0.4 * head);
  const glm::dmat3 axes = axes_along(along / length);
  const glm::dvec3 start = snapshot.proxy_m - origin_m;
  arrow.visible = true;
  arrow.shaft = placed(start, {axes[0] * thin, axes[1] * thin, axes[2] * (length - head)});
  arrow.head = placed(start + axes[2] * (length - head),
                      {axes[0] * (head_thick * thin), axes[1] * (head_thick * thin), axes[2] * head});
  return arrow;
}

double arrow_thickness_m(const Camera& camera) {
  return head_thick * most_thick * camera.view_height_m();
}

double tool_reach_m(const DrawnScene& scene) {
  return scene.tool_is_punch ? std::hypot(1.0, punch_height) * scene.tool_radius_m : scene.tool_radius_m;
}

glm::mat4 place_tool(const DrawnScene& scene, const glm::dvec3& at_m, const glm::dvec3& origin_m) {
  const double r = scene.tool_radius_m;
  const double height = scene.tool_is_punch ? punch_height * r : r;
  return placed(at_m - origin_m, {r, 0.0, 0.0, 0.0, r, 0.0, 0.0, 0.0, height});
}

glm::mat4 place_rigid(const RigidPlace& place, const glm::dvec3& origin_m) {
  if (!place.moved) return glm::mat4(1.0F);
  const glm::dmat3 turn = glm::mat3_cast(place.turn);
  const glm::dvec3 about = place.about_m - origin_m;
  glm::dmat4 placed(turn);
  placed[3] = glm::dvec4(about + place.shift_m - turn * about, 1.0);
  return glm::mat4(placed);
}

glm::mat4 place_tool_disc(const DrawnScene& scene, const glm::dvec3& at_m, const Camera& camera,
                          const glm::dvec3& origin_m) {
  const double r = std::max(1.8 * scene.tool_radius_m, 0.015 * camera.view_height_m());
  const glm::dvec3 middle = at_m + disc_nearer * r * camera.toward_eye();
  return placed(middle - origin_m, {camera.right() * r, camera.up() * r, camera.toward_eye() * r});
}

}  // namespace hybrid
