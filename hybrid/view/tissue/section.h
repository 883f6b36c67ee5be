// SPDX-License-Identifier: GPL-3.0-or-later
// Plane sections of a soft object. The plane is at rest, and the section moves with the tissue. Uses no
// graphics library.
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "hybrid/snapshot/snapshot.h"
#include "hybrid/view/gl/unit_shapes.h"

namespace hybrid {

// A plane in the scene's frame, at rest.
struct SectionPlane {
  glm::dvec3 point_m{0.0}, normal{0.0, 0.0, 1.0};  // unit vector
};

// Colours of a section, in rows. Alpha 0: no tissue.
struct SectionImage {
  int width = 0, height = 0;
  std::vector<VertexColour> pixels;
};

// A section at rest: a net of triangles over the tissue in the plane, and the materials in more detail.
struct Section {
  SectionPlane plane;
  std::vector<glm::dvec3> nodes_m;    // scene frame
  std::vector<glm::dvec3> in_tissue;  // for each node, the point of the tissue whose displacement it has
  std::vector<glm::vec2> in_image;    // for each node, its place in the image, from 0 to 1
  std::vector<std::uint32_t> indices;
  int width = 0, height = 0;                          // of the image (pixels)
  glm::dvec3 corner_m{0.0}, right_m{0.0}, up_m{0.0};  // middle of pixel (0, 0), and the ways to the next ones
  std::vector<std::uint8_t> materials;                // of each pixel: 0 none, else 1 + index of the material

  // Middle of a pixel, at rest (scene frame).
  [[nodiscard]] glm::dvec3 pixel_m(int column, int row) const {
    return corner_m + static_cast<double>(column) * right_m + static_cast<double>(row) * up_m;
  }
};
[[nodiscard]] Section make_section(const DrawnObject& object, const SectionPlane& plane);

// The image in the colours of materials (palette::of_inside()).
[[nodiscard]] SectionImage paint_materials(const Section& section, std::span<const glm::vec3> of_material);

// The section's net, moved by `moved_m` (scene frame), with a value for each node. `flat`: nodes stay in the
// plane.
[[nodiscard]] DrawMesh move_section(const Section& section, std::span<const glm::vec3> moved_m,
                                    std::span<const float> values, bool flat, const glm::dvec3& origin_m);

}  // namespace hybrid
