// SPDX-License-Identifier: GPL-3.0-or-later
// Anchors that do not fill whole sides of the object, on the coarse levels of a CompositeGrid. An anchored
// region holds the nodes around it even if it is smaller than a coarse cell, or if no line of nodes meets it.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "voxel/composite/grid.h"

namespace voxel {
namespace {

// Least resistance of a face, relative to a link between voxels. A face in its node's plane has this value.
constexpr float kLeastResistance = 0.01F;

}  // namespace

// Finds the two nodes that belong to a quarter of an anchor's face. `held` is the node that the face holds:
// along d, the first node at or beyond the anchored voxel on the tissue's side. `nearest` is the node nearest
// to the anchored voxel along d. Across d, both lie on the line of links whose tissue includes the face's
// cell. If `held` has no link, both are the nearest node that has one. `distance`: from the anchored voxel to
// `held` along d (voxels). Returns false if there is no such node.
bool CompositeGrid::nodes_of_face(const Level& level, const CoarseMaterial::AnchorFace& face,
                                  std::size_t& held, std::size_t& nearest, int& distance) noexcept {
  const std::size_t d = face.d;
  Index3 to{};
  bool inside = true;
  for (std::size_t e = 0; e < 3; ++e) {
    const int way = face.voxel[e] - level.nodes[e].begin;
    const int cell = e == (d + 1) % 3 ? face.cell[0] : face.cell[1];
    to[e] = e == d ? (way + (face.side > 0 ? level.step - 1 : 0)) >> level.log2_step
                   : (2 * way + cell + level.step) >> (level.log2_step + 1);
    inside = inside && to[e] >= 0 && to[e] < level.nodes[e].count;
  }
  Index3 near = to;
  near[d] = (face.voxel[d] - level.nodes[d].begin + level.step / 2) >> level.log2_step;
  if (!inside || !is_linked(level, to)) {
    if (!nearest_node(level, face.voxel, false, near)) return false;
    to = near;
  }
  distance = std::max(face.side * (level.at(d, to[d]) - face.voxel[d]), 0);
  held = level.node(to[0], to[1], to[2]);
  nearest = level.node(near[0], near[1], near[2]);
  return true;
}

// Scattered anchors on a coarse level: each face between an anchored voxel and tissue holds a node. If the
// face lies in a link, the link's weight shrinks by the face's share of the area.
void CompositeGrid::gather_anchors(Level& level) noexcept {
  const int step = level.step;
  Index3 low{}, high{};
  for (std::size_t d = 0; d < 3; ++d) {
    low[d] = level.at(d, 0) - step / 2;
    high[d] = level.at(d, level.nodes[d].count - 1) + step / 2;
    for (AnchorFaces& faces : anchor_faces_[d]) {
      for (Floats* const array :
           {&faces.count, &faces.in_link, &faces.distance, &faces.constriction, &faces.stiffness})
        std::fill(array->begin(), array->end(), 0.0F);
    }
  }
  constexpr float kArea = 0.25F;  // of a face's quarter
  std::fill(faces_of_cell_.begin(), faces_of_cell_.end(), 0.0F);
  std::size_t held = 0, nearest = 0;
  int distance = 0;
  bool any = false;
  material_.for_anchor_faces(low, high, [&](const CoarseMaterial::AnchorFace& face) {
    if (!nodes_of_face(level, face, held, nearest, distance)) return;
    faces_of_cell_[nearest] += kArea;
    any = true;
  });
  material_.for_anchor_faces(low, high, [&](const CoarseMaterial::AnchorFace& face) {
    if (!nodes_of_face(level, face, held, nearest, distance)) return;
    AnchorFaces& faces = anchor_faces_[face.d][face.side > 0 ? 1 : 0];
    faces.count[held] += kArea;
    faces.distance[held] += kArea * static_cast<float>(distance);
    faces.in_link[held] += distance > 0 ? kArea : 0.0F;
    faces.constriction[held] += kArea * constriction_of_face(level, nearest);
    faces.stiffness[held] += kArea * face.stiffness;
  });
  if (!any) return;
  level.has_anchors = true;
  const auto square = static_cast<float>(step * step);
  const std::size_t first = level.first_row(), end = first + level.floats();
  for (std::size_t d = 0; d < 3; ++d) {
    const auto& [from_above, from_below] = anchor_faces_[d];
    for (std::size_t n = first; n < end; ++n) {
      const float weight = weight_of_faces(from_above, n, square) + weight_of_faces(from_below, n, square);
      if (weight > 0.0F) level.anchor_weight[d][n] = weight;
    }
  }
  // If no other face holds a node behind a face, all tissue at the node is anchored. Such a node gets the
  // stiffest spring.
  const auto is_held = [&](std::size_t n) {
    return level.anchor_weight[0][n] + level.anchor_weight[1][n] + level.anchor_weight[2][n] > 0.0F;
  };
  for (std::size_t d = 0; d < 3; ++d) {
    const auto& [from_above, from_below] = anchor_faces_[d];
    const std::size_t by = level.stride_along(d);
    for (std::size_t n = first; n < end; ++n) {
      const float up = from_below.in_link[n + by], down = from_above.in_link[n];
      if (std::max(up, down) == 0.0F || level.node_of(n - first)[d] + 1 >= level.nodes[d].count) continue;
      level.weight[d][n] *= std::max(0.0F, 1.0F - std::max(up, down) / square);
      if (up > 0.0F && !is_held(n)) level.anchor_weight[d][n] = square / kLeastResistance;
      if (down > 0.0F && !is_held(n + by)) level.anchor_weight[d][n + by] = square / kLeastResistance;
    }
  }
}

// Resistance from one face to tissue far away (unit: that of a link between voxels). The faces of a cell, A
// in number, together act like a sphere of area A within tissue. If only a part of the cell is tissue, they
// act like the same part of the surface of a larger sphere.
float CompositeGrid::constriction_of_face(const Level& level, std::size_t cell) const noexcept {
  float links = 0.0F;
  for (std::size_t d = 0; d < 3; ++d)
    links += shape_weights(level)[d][cell] + shape_weights(level)[d][cell - level.stride_along(d)];
  const float part = std::clamp(links / static_cast<float>(6 * level.step), 0.1F, 1.0F);
  return std::sqrt(faces_of_cell_[cell] / (4.0F * std::numbers::pi_v<float> * part));
}

// Weight of the spring by which N of the s² faces of a cell hold a node. Three resistances are in series. The
// first is that of the tissue between the faces and the node. The second is that of the links at the faces,
// of which there are N instead of s². The third is the constriction: the load has to spread from N faces to
// s². It has the factor (1 − ε)^1.5 with ε = √N / s (Cooper, Mikic & Yovanovich 1969). With N = s² only the
// first remains, which is that of the chain of links. All three are of tissue as stiff as the mean of the
// faces' cells: other tissue near the node touches no anchor.
float CompositeGrid::weight_of_faces(const AnchorFaces& faces, std::size_t n, float square) noexcept {
  const float count = faces.count[n];
  if (count == 0.0F) return 0.0F;
  const float share = std::min(count / square, 1.0F);
  const float resistance = faces.distance[n] / (count * square) +
                           std::max(1.0F / count - 1.0F / square, 0.0F) +
                           std::pow(1.0F - std::sqrt(share), 1.5F) * faces.constriction[n] / (count * count);
  const float stiffness = faces.stiffness[n] / count;
  return stiffness / std::max(resistance, kLeastResistance / square);
}

// Stiffness of the tissue round a node, relative to the reference stiffness.
float CompositeGrid::stiffness_at(const Level& level, std::size_t n) const noexcept {
  if (!material_.is_heterogeneous()) return 1.0F;
  float stiff = 0.0F, shape = 0.0F;
  for (std::size_t d = 0; d < 3; ++d) {
    const std::size_t before = n - level.stride_along(d);
    stiff += level.weight[d][n] + level.weight[d][before];
    shape += level.shape_weight[d][n] + level.shape_weight[d][before];
  }
  return shape > 0.0F ? stiff / shape : 1.0F;
}

// Has the node any link?
bool CompositeGrid::is_linked(const Level& level, const Index3& node) noexcept {
  const std::size_t n = level.node(node[0], node[1], node[2]);
  for (std::size_t d = 0; d < 3; ++d) {
    if (level.weight[d][n] != 0.0F || level.weight[d][n - level.stride_along(d)] != 0.0F) return true;
  }
  return false;
}

}  // namespace voxel
