// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/camera.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <limits>
#include <numbers>

#include "polygon/mesh/is_finite.h"

namespace hybrid {
namespace {

constexpr double degree = std::numbers::pi / 180.0;
constexpr double kNearTools = 3.5;  // half of the height that the nearer view covers, in tool radii
constexpr double kFilled = 0.9;     // share of the view that the scene fills

// Visits every `stride`-th finite vertex of the scene in its present state. The stride bounds the cost for
// large meshes.
template <class Visit>
void for_some_vertices(const DrawnScene& scene, const Snapshot& snapshot, const Visit& visit) {
  constexpr std::size_t at_most = 100'000;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const auto& rest = scene.objects[i].surface.vertices;
    const bool moved = i < snapshot.soft_moved_m.size() && snapshot.soft_moved_m[i].size() == rest.size();
    const RigidPlace place = snapshot.place_of(i);
    const std::size_t stride = rest.size() / at_most + 1;
    for (std::size_t v = 0; v < rest.size(); v += stride) {
      const glm::dvec3 at = moved ? rest[v] + glm::dvec3(snapshot.soft_moved_m[i][v]) : place(rest[v]);
      if (polygon::is_finite(at)) visit(at);
    }
  }
}

// Bounding box of the points that are finite.
struct Bounds {
  glm::dvec3 lower{std::numeric_limits<double>::infinity()}, upper{-std::numeric_limits<double>::infinity()};

  void add(const glm::dvec3& at) {
    if (!polygon::is_finite(at)) return;
    lower = glm::min(lower, at);
    upper = glm::max(upper, at);
  }
  [[nodiscard]] SceneBounds ball() const {
    SceneBounds bounds;
    if (!(lower.x <= upper.x)) return bounds;  // no finite point: an empty picture about the origin
    bounds.centre_m = 0.5 * (lower + upper);
    bounds.radius_m = 0.5 * glm::length(upper - lower);
    // A scene that is a single point still needs a view of some size.
    if (!(bounds.radius_m > 0.0)) bounds.radius_m = std::max(1e-3, 1e-9 * glm::length(bounds.centre_m));
    return bounds;
  }
};

// Box around every vertex and the tool along a path. With a snapshot, also the tool at the proxy and at the
// device.
Bounds box_of(const DrawnScene& scene, const Snapshot* snapshot, std::span<const glm::dvec3> path_m) {
  Bounds box;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const RigidPlace place = snapshot != nullptr ? snapshot->place_of(i) : RigidPlace{};
    for (const glm::dvec3& at : scene.objects[i].surface.vertices) box.add(place(at));
  }
  const auto add_tool = [&](const glm::dvec3& at) {
    box.add(at - scene.tool_radius_m);
    box.add(at + scene.tool_radius_m);
  };
  if (snapshot != nullptr) {
    add_tool(snapshot->proxy_m);
    add_tool(snapshot->device_m);
  }
  std::ranges::for_each(path_m, add_tool);
  return box;
}

struct Candidate {
  double azimuth, elevation;
  glm::dvec3 toward_eye;
  double hidden = 0.0;  // weighted share of the view cone that is covered
};

// Measures how far triangles hide the tool in each candidate direction. Adds the solid angle that they cover
// in a cone about the direction, seen from the tool.
void add_hidden(const DrawnScene& scene, const Snapshot& snapshot, std::span<Candidate> candidates) {
  constexpr double cone = 12.0 * degree;
  constexpr std::size_t at_most = 60'000;
  const double cos_cone = std::cos(cone);
  const double cone_angle = 2.0 * std::numbers::pi * (1.0 - cos_cone);
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const DrawnObject& object = scene.objects[i];
    // A rigid object in front is drawn transparent, so it weighs less than tissue.
    const double weight = object.soft ? 1.0 : 0.35;
    const auto& vertices = object.surface.vertices;
    const RigidPlace place = snapshot.place_of(i);
    const std::size_t stride = object.surface.triangles.size() / at_most + 1;
    for (std::size_t t = 0; t < object.surface.triangles.size(); t += stride) {
      const auto& corner = object.surface.triangles[t];
      if (std::max({corner[0], corner[1], corner[2]}) >= vertices.size()) continue;
      const glm::dvec3 a = place(vertices[corner[0]]), b = place(vertices[corner[1]]),
                       c = place(vertices[corner[2]]);
      const glm::dvec3 to = (a + b + c) / 3.0 - snapshot.proxy_m;
      const double distance = glm::length(to);
      if (!(distance > 1.5 * scene.tool_radius_m) || !std::isfinite(distance)) continue;
      const glm::dvec3 direction = to / distance;
      const double area = 0.5 * std::abs(glm::dot(glm::cross(b - a, c - a), direction));
      const double angle = std::min(area / (distance * distance), cone_angle) * static_cast<double>(stride);
      for (Candidate& candidate : candidates) {
        if (glm::dot(direction, candidate.toward_eye) > cos_cone)
          candidate.hidden += weight * angle / cone_angle;
      }
    }
  }
}

}  // namespace

glm::dvec3 Camera::toward_eye() const {
  return {std::cos(elevation_rad) * std::cos(azimuth_rad), std::cos(elevation_rad) * std::sin(azimuth_rad),
          std::sin(elevation_rad)};
}

glm::dvec3 Camera::eye_m() const {
  return target_m + distance_m * toward_eye();
}

glm::dvec3 Camera::right() const {
  return {-std::sin(azimuth_rad), std::cos(azimuth_rad), 0.0};
}

glm::dvec3 Camera::up() const {
  return glm::cross(toward_eye(), right());
}

double Camera::view_height_m() const {
  return 2.0 * distance_m * std::tan(0.5 * fov_y_rad);
}

std::optional<glm::dvec2> Camera::pixel(const glm::dvec3& point_m, double width, double height) const {
  const glm::dvec3 from_eye = point_m - eye_m();
  const double depth = -glm::dot(from_eye, toward_eye());
  if (!(depth > 1e-6 * distance_m)) return std::nullopt;
  const double per_pixel = 2.0 * depth * std::tan(0.5 * fov_y_rad) / height;
  return glm::dvec2(0.5 * width + glm::dot(from_eye, right()) / per_pixel,
                    0.5 * height - glm::dot(from_eye, up()) / per_pixel);
}

glm::dvec3 Camera::point_at(const glm::dvec2& pixel_xy, double width, double height,
                            const glm::dvec3& through_m) const {
  const double depth = std::max(-glm::dot(through_m - eye_m(), toward_eye()), 1e-6 * distance_m);
  const double per_pixel = 2.0 * depth * std::tan(0.5 * fov_y_rad) / height;
  return eye_m() - depth * toward_eye() + right() * ((pixel_xy.x - 0.5 * width) * per_pixel) +
         up() * ((0.5 * height - pixel_xy.y) * per_pixel);
}

glm::dmat4 Camera::clip_from_scene(double aspect, const glm::dvec3& origin_m, const glm::dvec3& centre_m,
                                   double radius_m) const {
  const double depth = -glm::dot(centre_m - eye_m(), toward_eye());
  const double far_m = std::max(depth + radius_m, 2.0 * distance_m);
  const double near_m = std::max(depth - radius_m, 1e-3 * std::min(distance_m, far_m));
  const glm::dmat4 projection = glm::perspective(fov_y_rad, aspect, 0.99 * near_m, 1.01 * far_m);
  return projection * glm::lookAt(eye_m() - origin_m, target_m - origin_m, glm::dvec3(0.0, 0.0, 1.0));
}

SceneBounds bounds_of(const polygon::TriangleMesh& surface) {
  Bounds box;
  for (const glm::dvec3& at : surface.vertices) box.add(at);
  return box.ball();
}

SceneBounds bounds_of(const DrawnScene& scene, const Snapshot* snapshot) {
  return box_of(scene, snapshot, {}).ball();
}

Camera frame_scene(const DrawnScene& scene, const Snapshot& snapshot, double aspect,
                   std::span<const glm::dvec3> path_m) {
  Camera camera;
  const SceneBounds bounds = box_of(scene, &snapshot, path_m).ball();
  camera.target_m = bounds.centre_m;

  const double force = glm::length(snapshot.force_N);
  const glm::dvec3 pushed =
      force > 1e-6 && std::isfinite(force) ? snapshot.force_N / force : glm::dvec3(0.0, 0.0, 1.0);
  std::vector<Candidate> candidates;
  for (const double elevation : {-20.0, 12.0, 25.0, 40.0}) {
    for (int turn = -6; turn < 6; ++turn) {
      Camera at;
      at.azimuth_rad = 30.0 * turn * degree;
      at.elevation_rad = elevation * degree;
      candidates.push_back({at.azimuth_rad, at.elevation_rad, at.toward_eye()});
    }
  }
  if (polygon::is_finite(snapshot.proxy_m)) add_hidden(scene, snapshot, candidates);

  // Preferred directions: on the side to which the force points, because the tool is there, but oblique to
  // the force, so that depth shows. Also a little above the horizon, and from the front.
  const auto cost = [&](const Candidate& candidate) {
    return std::min(candidate.hidden, 1.5) + 0.8 * std::abs(glm::dot(candidate.toward_eye, pushed) - 0.4) +
           0.004 * std::abs(candidate.elevation / degree - 25.0) +
           0.05 * (1.0 - std::cos(candidate.azimuth + 60.0 * degree));
  };
  const auto best = std::ranges::min_element(candidates, {}, cost);
  camera.azimuth_rad = best->azimuth;
  camera.elevation_rad = best->elevation;

  // The shortest distance at which everything still fits, with room for the scale bar.
  const double tan_y = kFilled * std::tan(0.5 * camera.fov_y_rad);
  const double tan_x = tan_y * std::max(aspect, 0.1);
  double distance = 0.0;
  const auto fit = [&](const glm::dvec3& at) {
    const glm::dvec3 offset = at - camera.target_m;
    const double toward = glm::dot(offset, camera.toward_eye());
    distance = std::max({distance, toward + std::abs(glm::dot(offset, camera.up())) / tan_y,
                         toward + std::abs(glm::dot(offset, camera.right())) / tan_x});
  };
  for_some_vertices(scene, snapshot, fit);
  const auto fit_tool = [&](const glm::dvec3& at) {
    if (!polygon::is_finite(at)) return;
    for (const glm::dvec3& side :
         {camera.toward_eye(), camera.up(), -camera.up(), camera.right(), -camera.right()})
      fit(at + side * scene.tool_radius_m);
  };
  fit_tool(snapshot.proxy_m);
  fit_tool(snapshot.device_m);
  std::ranges::for_each(path_m, fit_tool);
  camera.distance_m = std::max(distance, 1.05 * bounds.radius_m);
  return camera;
}

Camera frame_contact(const DrawnScene& scene, const Snapshot& snapshot, const Camera& overview) {
  Camera camera = overview;
  if (!polygon::is_finite(snapshot.proxy_m)) return camera;
  camera.target_m = snapshot.proxy_m;
  double offset_m = glm::length(snapshot.device_m - snapshot.proxy_m);
  if (!std::isfinite(offset_m)) offset_m = 0.0;
  const double half_height =
      std::max({kNearTools * scene.tool_radius_m, 1.6 * offset_m, 1e-6 * overview.distance_m});
  camera.distance_m = half_height / std::tan(0.5 * camera.fov_y_rad);
  return camera;
}

void look_along(Camera& camera, int axis) {
  constexpr double quarter = 0.5 * std::numbers::pi, steepest = 89.0 * std::numbers::pi / 180.0;
  camera.elevation_rad = axis == 2 ? steepest : 0.0;
  camera.azimuth_rad = axis == 0 ? 0.0 : axis == 1 ? quarter : -quarter;
}

}  // namespace hybrid
