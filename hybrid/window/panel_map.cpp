// SPDX-License-Identifier: GPL-3.0-or-later
// Draws the edges of the map's cells near the tool and of patches over the scene.
#include <array>
#include <cmath>
#include <set>

#include "hybrid/view/palette.h"
#include "hybrid/window/panels.h"

namespace hybrid {
namespace {

// Colours of MapBox::Kind. They differ in lightness too (after Okabe & Ito 2008).
constexpr std::array<glm::vec3, 3> kColours{
    {{0.84F, 0.37F, 0.00F}, {0.00F, 0.62F, 0.45F}, {0.03F, 0.38F, 0.93F}}};

// Edges of cells that share them are drawn once: equal ends of an edge, in units of a cell, are one edge.
class DrawnEdges {
 public:
  explicit DrawnEdges(const MapBox& cell) : origin_m_(cell.corner_m), length_m_(cell.edges_m[0].x) {}
  bool add(const glm::dvec3& from, const glm::dvec3& to) {
    std::array<long, 6> key{};
    for (std::size_t d = 0; d < 3; ++d) {
      const auto axis = static_cast<glm::length_t>(d);
      key[d] = std::lround((from[axis] - origin_m_[axis]) / length_m_);
      key[3 + d] = std::lround((to[axis] - origin_m_[axis]) / length_m_);
    }
    return known_.insert(key).second;
  }

 private:
  glm::dvec3 origin_m_;
  double length_m_;
  std::set<std::array<long, 6>> known_;
};

}  // namespace

void draw_map_boxes(const Pen& pen, const std::vector<MapBox>& boxes, const Camera& camera,
                    const PixelRect& where) {
  std::array<std::optional<DrawnEdges>, 2> edges;  // [rigid, soft]
  const glm::vec2 corner_px(where.x, where.y);
  for (const MapBox& box : boxes) {
    const auto kind = static_cast<std::size_t>(box.kind);
    const bool cell = box.kind != MapBox::Kind::patch;
    if (cell && !edges[kind]) edges[kind].emplace(box);
    const float thick = cell ? 1.0F : 0.12F * pen.em;
    const Ink ink =
        ink_of(kColours[kind], cell ? 0.55F : 0.9F / (1.0F + 0.5F * static_cast<float>(box.level)));
    for (unsigned n = 0; n < 8; ++n) {
      glm::dvec3 from = box.corner_m;
      for (unsigned d = 0; d < 3; ++d) from += (n >> d & 1U) != 0 ? box.edges_m[d] : glm::dvec3(0.0);
      for (unsigned d = 0; d < 3; ++d) {
        if ((n >> d & 1U) != 0) continue;
        const glm::dvec3 to = from + box.edges_m[d];
        if (cell && !edges[kind]->add(from, to)) continue;
        const auto a = camera.pixel(from, where.width, where.height);
        const auto b = camera.pixel(to, where.width, where.height);
        if (a && b) pen.line(corner_px + glm::vec2(*a), corner_px + glm::vec2(*b), ink, thick);
      }
    }
  }
}

}  // namespace hybrid
