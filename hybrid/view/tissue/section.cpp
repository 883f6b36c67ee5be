// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/tissue/section.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

#include "polygon/mesh/is_finite.h"
#include "voxel/lattice/lattice.h"

namespace hybrid {
namespace {

// Pixels along a voxel's edge; enough that slanted borders look straight.
constexpr double kPixelsPerVoxel = 3.0;
constexpr double kMostPixels = 384.0;  // greatest number of pixels along an edge of the image
// Greatest number of the net's cells along an edge. Displacements vary little over some voxels.
constexpr double kMostCells = 64.0;

// Builds the net of a section whose pixels are known.
class NetBuilder {
 public:
  NetBuilder(const DrawnInside& inside, Section& section, int pixels_per_cell)
      : inside_(inside), section_(section), per_cell_(pixels_per_cell) {}

  void build() {
    const int columns = (section_.width + per_cell_ - 1) / per_cell_;
    const int rows = (section_.height + per_cell_ - 1) / per_cell_;
    number_.assign(static_cast<std::size_t>(columns + 1) * static_cast<std::size_t>(rows + 1), kNone);
    for (int j = 0; j < rows; ++j) {
      for (int i = 0; i < columns; ++i) {
        if (!nearest_pixel(i * per_cell_, (i + 1) * per_cell_, j * per_cell_, (j + 1) * per_cell_, {}))
          continue;
        const std::array<std::uint32_t, 4> corners{node(i, j, columns), node(i + 1, j, columns),
                                                   node(i, j + 1, columns), node(i + 1, j + 1, columns)};
        for (const std::size_t c : {0U, 1U, 3U, 0U, 3U, 2U}) section_.indices.push_back(corners[c]);
      }
    }
  }

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  // The pixel of tissue nearest to a place (unit: pixels), among those of a rectangle.
  [[nodiscard]] std::optional<glm::dvec3> nearest_pixel(int left, int right, int low, int high,
                                                        const glm::dvec2& place) const {
    double least = std::numeric_limits<double>::infinity();
    std::optional<glm::dvec3> nearest;
    for (int y = std::max(low, 0); y < std::min(high, section_.height); ++y) {
      for (int x = std::max(left, 0); x < std::min(right, section_.width); ++x) {
        if (section_.materials[static_cast<std::size_t>(y) * static_cast<std::size_t>(section_.width) +
                               static_cast<std::size_t>(x)] == 0)
          continue;
        const glm::dvec2 way = glm::dvec2(x, y) - place;
        if (const double squared = glm::dot(way, way); squared < least) {
          least = squared;
          nearest = section_.pixel_m(x, y);
        }
      }
    }
    return nearest;
  }

  std::uint32_t node(int i, int j, int columns) {
    std::uint32_t& number = number_[static_cast<std::size_t>(j) * static_cast<std::size_t>(columns + 1) +
                                    static_cast<std::size_t>(i)];
    if (number != kNone) return number;
    number = static_cast<std::uint32_t>(section_.nodes_m.size());
    const int x = i * per_cell_, y = j * per_cell_;
    const glm::dvec3 at = section_.corner_m + (x - 0.5) * section_.right_m + (y - 0.5) * section_.up_m;
    section_.nodes_m.push_back(at);
    section_.in_image.emplace_back(static_cast<float>(x) / static_cast<float>(section_.width),
                                   static_cast<float>(y) / static_cast<float>(section_.height));
    // A node beside the tissue moves with the tissue nearest to it in the cells around it.
    const auto near = inside_.material_at(at)
                          ? std::optional(at)
                          : nearest_pixel(x - per_cell_, x + per_cell_, y - per_cell_, y + per_cell_, {x, y});
    section_.in_tissue.push_back(near.value_or(at));
    return number;
  }

  const DrawnInside& inside_;
  Section& section_;
  int per_cell_;
  std::vector<std::uint32_t> number_;  // of each crossing of the net; kNone: not used yet
};

}  // namespace

Section make_section(const DrawnObject& object, const SectionPlane& plane) {
  Section section;
  section.plane = plane;
  const DrawnInside& inside = object.inside;
  if (inside.lattice == nullptr || object.surface.vertices.empty()) return section;
  const glm::dvec3 side =
      std::abs(plane.normal.z) < 0.9 ? glm::dvec3(0.0, 0.0, 1.0) : glm::dvec3(1.0, 0.0, 0.0);
  const glm::dvec3 a = glm::normalize(glm::cross(side, plane.normal));
  const glm::dvec3 b = glm::cross(plane.normal, a);
  glm::dvec2 low(std::numeric_limits<double>::max()), high(-low);
  for (const glm::dvec3& v : object.surface.vertices) {
    const glm::dvec2 at(glm::dot(v - plane.point_m, a), glm::dot(v - plane.point_m, b));
    if (!std::isfinite(at.x + at.y)) continue;
    low = glm::min(low, at);
    high = glm::max(high, at);
  }
  const double extent = std::max(high.x - low.x, high.y - low.y);
  if (!(extent >= 0.0)) return section;
  const double spacing = inside.lattice->min_spacing_m();
  const double step = std::max(spacing / kPixelsPerVoxel, extent / kMostPixels);
  // The border of the tissue may lie half a voxel outside the surface.
  const double margin = spacing;
  section.width = static_cast<int>(std::ceil((high.x - low.x + 2.0 * margin) / step));
  section.height = static_cast<int>(std::ceil((high.y - low.y + 2.0 * margin) / step));
  section.right_m = step * a;
  section.up_m = step * b;
  section.corner_m = plane.point_m + (low.x - margin + 0.5 * step) * a + (low.y - margin + 0.5 * step) * b;
  section.materials.reserve(static_cast<std::size_t>(section.width) *
                            static_cast<std::size_t>(section.height));
  for (int y = 0; y < section.height; ++y) {
    for (int x = 0; x < section.width; ++x) {
      const auto material = inside.material_at(section.pixel_m(x, y));
      section.materials.push_back(material ? static_cast<std::uint8_t>(*material + 1) : std::uint8_t{0});
    }
  }
  const double cell = std::max(spacing, extent / kMostCells);
  NetBuilder(inside, section, std::max(1, static_cast<int>(std::round(cell / step)))).build();
  return section;
}

SectionImage paint_materials(const Section& section, std::span<const glm::vec3> of_material) {
  SectionImage image{.width = section.width, .height = section.height, .pixels = {}};
  std::vector<VertexColour> colours{VertexColour{}};
  for (const glm::vec3& c : of_material) colours.push_back(bytes_of(c));
  image.pixels.reserve(section.materials.size());
  for (const std::uint8_t m : section.materials)
    image.pixels.push_back(colours[std::min<std::size_t>(m, colours.size() - 1)]);
  return image;
}

DrawMesh move_section(const Section& section, std::span<const glm::vec3> moved_m,
                      std::span<const float> values, bool flat, const glm::dvec3& origin_m) {
  DrawMesh mesh{.vertices = {}, .indices = section.indices};
  mesh.vertices.reserve(section.nodes_m.size());
  for (std::size_t n = 0; n < section.nodes_m.size(); ++n) {
    glm::dvec3 by(n < moved_m.size() ? moved_m[n] : glm::vec3(0.0F));
    if (!polygon::is_finite(by)) by = glm::dvec3(0.0);
    if (flat) by -= glm::dot(by, section.plane.normal) * section.plane.normal;
    mesh.vertices.push_back({glm::vec3(section.nodes_m[n] + by - origin_m), glm::vec3(section.plane.normal),
                             n < values.size() ? values[n] : 0.0F});
  }
  return mesh;
}

}  // namespace hybrid
