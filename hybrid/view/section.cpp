// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/section.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "hybrid/view/palette.h"
#include "polygon/mesh/is_finite.h"

namespace hybrid {
namespace {

// Number of squares along a voxel's edge; enough that slanted borders look straight.
constexpr double kSquaresPerVoxel = 3.0;
constexpr double kMostSquares = 300.0;  // greatest number of squares along an edge of the face

VertexColour bytes_of(const glm::vec3& colour) {
  const glm::vec3 byte = glm::round(255.0F * colour);
  return {static_cast<std::uint8_t>(byte.r), static_cast<std::uint8_t>(byte.g),
          static_cast<std::uint8_t>(byte.b), 255};
}

}  // namespace

std::optional<Cut> choose_cut(const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera,
                              std::size_t object) {
  const bool touched = object < snapshot.feel.size() && snapshot.feel[object].contact;
  const bool known = object < snapshot.inside.size() && snapshot.inside[object].used;
  if (!touched || !known || scene.objects[object].inside.of_voxel.empty()) return {};
  if (!polygon::is_finite(snapshot.proxy_m)) return {};
  const double force = glm::length(snapshot.force_N);
  const glm::dvec3 along =
      force > 0.0 && std::isfinite(force) ? snapshot.force_N / force : glm::dvec3(0.0, 0.0, 1.0);
  const glm::dvec3 toward = camera.toward_eye();
  const glm::dvec3 across = toward - glm::dot(toward, along) * along;
  // If the camera looks along the force, it sees every plane along the force edge-on.
  if (!(glm::length(across) > 0.1)) return {};
  return Cut{snapshot.proxy_m, glm::normalize(across)};
}

SectionMesh make_section(const DrawnScene& scene, const Snapshot& snapshot, std::size_t object,
                         const Cut& cut, const glm::dvec3& origin_m) {
  const DrawnInside& inside = scene.objects[object].inside;
  const SoftDent& moved = snapshot.inside[object];
  const glm::dvec3 side =
      std::abs(cut.toward_eye.z) < 0.9 ? glm::dvec3(0.0, 0.0, 1.0) : glm::dvec3(1.0, 0.0, 0.0);
  const glm::dvec3 a = glm::normalize(glm::cross(side, cut.toward_eye));
  const glm::dvec3 b = glm::cross(cut.toward_eye, a);
  glm::dvec2 low(0.0), high(0.0);
  for (const glm::dvec3& v : scene.objects[object].surface.vertices) {
    const glm::dvec2 at(glm::dot(v - cut.point_m, a), glm::dot(v - cut.point_m, b));
    if (!std::isfinite(at.x + at.y)) continue;
    low = glm::min(low, at);
    high = glm::max(high, at);
  }
  const double spacing = std::min({inside.spacing_m.x, inside.spacing_m.y, inside.spacing_m.z});
  const double step =
      std::max(spacing / kSquaresPerVoxel, std::max(high.x - low.x, high.y - low.y) / kMostSquares);
  const auto columns = static_cast<int>(std::ceil((high.x - low.x) / step));
  const auto rows = static_cast<int>(std::ceil((high.y - low.y) / step));
  std::vector<VertexColour> of_material;
  for (const glm::vec3& c : palette::of_inside(scene, object)) of_material.push_back(bytes_of(c));
  const auto at_rest = [&](double i, double j) {
    return cut.point_m + (low.x + i * step) * a + (low.y + j * step) * b;
  };
  SectionMesh section;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const auto material = inside.material_at(at_rest(i + 0.5, j + 0.5));
      if (!material) continue;
      const auto first = static_cast<std::uint32_t>(section.mesh.vertices.size());
      for (int corner = 0; corner < 4; ++corner) {
        const glm::dvec3 rest = at_rest(i + (corner & 1), j + (corner >> 1));
        // Displacements are projected into the plane, so that the face stays flat.
        glm::dvec3 by(moved.at(rest));
        by -= glm::dot(by, cut.toward_eye) * cut.toward_eye;
        section.mesh.vertices.push_back({glm::vec3(rest + by - origin_m), glm::vec3(cut.toward_eye), 0.0F});
        section.colours.push_back(of_material[*material]);
      }
      for (const std::uint32_t corner : {0U, 1U, 3U, 0U, 3U, 2U})
        section.mesh.indices.push_back(first + corner);
    }
  }
  return section;
}

}  // namespace hybrid
