// SPDX-License-Identifier: GPL-3.0-or-later
// The triangles of a mesh in a tree of axis-parallel boxes, for one query: the first triangle that a ball
// meets when it moves in a straight line. This is the collision detection of the peer in finger_proxy.h. It
// shares no code with the proxy's own queries.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "polygon/mesh/mesh.h"

namespace polygon {

// The first meeting of a moving ball with a triangle.
struct SweptHit {
  bool hit = false;        // false: nothing is in the way, and the other fields have no meaning
  double part = 1.0;       // of the way to the meeting, 0 to 1
  glm::dvec3 normal{0.0};  // unit, from the point of contact to the ball's centre; against the way
};

class TriangleTree {
 public:
  // Throws std::invalid_argument for an empty mesh.
  explicit TriangleTree(const TriangleMesh& mesh);

  // Moves a ball of `radius` (0: a point) from `from` to `to`. Triangles have two sides. A ball that is
  // already nearer to a triangle than its radius meets the triangle at once if its way leads closer.
  [[nodiscard]] SweptHit first_hit(const glm::dvec3& from, const glm::dvec3& to,
                                   double radius) const noexcept;

  [[nodiscard]] double size_m() const { return size_m_; }  // longest edge of the mesh's box
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  // The children of an inner node are `first` and `first` + 1. The triangles of a leaf begin at `first`.
  struct Node {
    std::array<float, 3> low{}, high{};  // box, rounded outwards
    std::uint32_t first = 0;
    std::uint32_t count = 0;  // triangles of a leaf; 0: an inner node
  };
  struct Face {
    std::array<glm::dvec3, 3> corner;
    glm::dvec3 normal;  // unit; zero for a triangle without area
  };
  struct Item {
    std::uint32_t triangle = 0;
    std::array<float, 3> middle{};
  };
  void split(const TriangleMesh& mesh, std::vector<Item>& items, std::uint32_t node, std::uint32_t first,
             std::uint32_t count);

  std::vector<Node> nodes_;
  std::vector<Face> faces_;  // in the order of the leaves
  double size_m_ = 0.0;
};

}  // namespace polygon
