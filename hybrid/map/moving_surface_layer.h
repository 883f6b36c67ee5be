// SPDX-License-Identifier: GPL-3.0-or-later
// The moving rigid surfaces of the occupancy map.
//
// A body's surface cells are rasterised once, in its own frame, and move with it. So they are never stale, at
// any speed, and never rewritten. The scene keeps only the positions of bodies. Districts are cells as large
// as the largest body, so that each body lies in at most eight of them. A district lists the bodies whose
// bounds touch it. A move changes only the districts that the body leaves or enters. A query looks up its
// districts, compares bounds, and transforms its box into the frames of the few bodies that remain.
#pragma once

#include <array>
#include <cstdint>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <vector>

#include "hybrid/map/fixed_surface_layer.h"

namespace hybrid {

class MovingSurfaceLayer {
 public:
  // `object_bit`: the object's bit in the result of objects_in(). Allocates; for use while a scene is loaded.
  void add(std::uint32_t object, std::uint64_t object_bit, std::shared_ptr<const SurfaceCells> cells,
           const glm::dvec3& position, const glm::dquat& rotation);

  // Sets the pose of body `object`. O(1), allocates nothing. Unknown objects and poses that are not finite
  // change nothing.
  void move(std::uint32_t object, const glm::dvec3& position, const glm::dquat& rotation) noexcept;

  [[nodiscard]] bool empty() const noexcept { return bodies_.empty(); }
  // Does the box touch a brick in which a moving body has surface? The bricks are those of the body's own
  // cells.
  [[nodiscard]] bool any_near(const glm::dvec3& low, const glm::dvec3& high) const noexcept;
  // Bits of the moving objects with surface in cells that the box touches: a superset of the exact answer.
  [[nodiscard]] std::uint64_t objects_in(const glm::dvec3& low, const glm::dvec3& high) const noexcept;

  [[nodiscard]] std::size_t occupied_cells() const noexcept;
  [[nodiscard]] std::size_t memory_bytes() const noexcept;
  // Districts entered or left since the bodies were added.
  [[nodiscard]] std::uint64_t district_changes() const noexcept { return changes_; }
  // For tests: every body is listed in the districts that its bounds touch, and nowhere else.
  [[nodiscard]] bool validate() const;

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  static constexpr std::size_t kSlots = 8;    // districts of a body: at most two along each axis
  static constexpr std::size_t kTestAll = 4;  // up to this many bodies are tested one by one

  struct Body {
    // Read by every query:
    glm::dvec3 low{0.0}, high{0.0};  // bounds, scene frame
    std::uint64_t bit = 0;
    const SurfaceCells* cells = nullptr;
    glm::dvec3 position{0.0};
    glm::dmat3 to_body{1.0};  // rotates directions
    double slack_m = 0.0;     // rounding error of positions in the body's frame
    // Read when the body moves:
    std::uint32_t object = 0;
    double radius_m = 0.0;  // radius of the bounding ball about the body's middle
    glm::dvec3 middle_in_body{0.0};
    CellRange districts;
    std::shared_ptr<const SurfaceCells> owner;
  };
  struct Node {  // [body · kSlots + slot]; the slot is the parity of the district's coordinates
    CellCoordinates district{};
    std::uint32_t next = kNone;
    bool listed = false;
  };

  static void set_pose(Body& body, const glm::dvec3& position, const glm::dquat& rotation) noexcept;
  // Lists every body again, in districts of the present size.
  void list_all();
  void list(std::uint32_t node, const CellCoordinates& district) noexcept;
  void unlist(std::uint32_t node) noexcept;
  // Updates the lists for the body's present position; changes only the nodes that differ.
  void relist(std::uint32_t body) noexcept;
  [[nodiscard]] CellRange districts_of(const Body& body) const noexcept;
  [[nodiscard]] CellCoordinates district_of(const glm::dvec3& p) const noexcept;
  [[nodiscard]] std::size_t bucket_of(const CellCoordinates& district) const noexcept;
  // Transforms the box into the body's frame; false if it does not touch the body's bounds.
  [[nodiscard]] static bool box_in_body(const Body& body, const glm::dvec3& low, const glm::dvec3& high,
                                        glm::dvec3& low_in_body, glm::dvec3& high_in_body) noexcept;
  // Calls visit(body) for each body that may touch the box, possibly twice, until visit returns false.
  template <class Visit>
  void each(const glm::dvec3& low, const glm::dvec3& high, Visit&& visit) const noexcept;

  std::vector<Body> bodies_;
  std::vector<std::uint32_t> body_of_object_;  // [object] index into bodies_; kNone: it does not move
  double district_m_ = 0.0;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> buckets_;  // [hash of a district] first node
  std::uint64_t changes_ = 0;
};

}  // namespace hybrid
