// SPDX-License-Identifier: GPL-3.0-or-later
// The moving half of the occupancy map: rigid bodies that change their place in a session.
//
// A body's surface cells are rasterised once, in its own frame, and go with it: what the map knows of a
// moving surface is never stale, at any speed, and no cell of it is ever written again. In the scene only
// *where bodies are* is kept: districts (cells as large as the largest body, so that each body lies in at
// most eight) list the bodies whose bounds touch them, and when a body moves only the districts that it
// leaves or enters change. A question looks up its district, compares bounds, and turns its box into the
// frame of those few bodies.
//
// Rejected: samples of the surface kept one by one in the scene's own cells, as soft voxels are. A body of
// 30,000 surface cells takes 0.6 ms to move once, and a bounded slice of it a tick leaves samples that are
// tens of cells stale at 1 m/s, so that a question would have to look as far as the body is large.
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

class MovingCells {
 public:
  // `object_bit` is one bit of what objects_in() answers. Allocates; on load.
  void add(std::uint32_t object, std::uint64_t object_bit, std::shared_ptr<const SurfaceCells> cells,
           const glm::dvec3& position, const glm::dquat& rotation);

  // Body `object` is there now. O(1), allocates nothing. Unknown objects, and poses that are not finite,
  // change nothing.
  void move(std::uint32_t object, const glm::dvec3& position, const glm::dquat& rotation) noexcept;

  [[nodiscard]] bool empty() const noexcept { return bodies_.empty(); }
  // Is there moving surface in a brick (of its body's own cells) that this box touches?
  [[nodiscard]] bool any_near(const glm::dvec3& low, const glm::dvec3& high) const noexcept;
  // Bits of the moving objects with surface in cells that the box touches: never too few.
  [[nodiscard]] std::uint64_t objects_in(const glm::dvec3& low, const glm::dvec3& high) const noexcept;

  [[nodiscard]] std::size_t occupied_cells() const noexcept;
  [[nodiscard]] std::size_t memory_bytes() const noexcept;
  // Districts entered or left since the bodies were added.
  [[nodiscard]] std::uint64_t district_changes() const noexcept { return changes_; }
  // For tests: every body is listed in the districts that its bounds touch, and nowhere else.
  [[nodiscard]] bool validate() const;

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  static constexpr std::size_t kSlots = 8;  // districts of a body: two along each axis at most
  static constexpr std::size_t kFew = 4;    // bodies that are looked at one by one

  struct Body {
    // Read by every question:
    glm::dvec3 low{0.0}, high{0.0};  // bounds, scene frame
    std::uint64_t bit = 0;
    const SurfaceCells* cells = nullptr;
    glm::dvec3 position{0.0};
    glm::dmat3 to_body{1.0};  // of directions
    double slack_m = 0.0;     // rounding of what is turned into the body's frame
    // Read when it moves:
    std::uint32_t object = 0;
    double radius_m = 0.0;  // of the ball about its middle that holds it
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
  // Lists every body anew, in districts of their present size.
  void list_everything();
  void list(std::uint32_t node, const CellCoordinates& district) noexcept;
  void unlist(std::uint32_t node) noexcept;
  // Lists the body where it now is: only what changed is touched.
  void relist(std::uint32_t body) noexcept;
  [[nodiscard]] CellRange districts_of(const Body& body) const noexcept;
  [[nodiscard]] CellCoordinates district_of(const glm::dvec3& p) const noexcept;
  [[nodiscard]] std::size_t bucket_of(const CellCoordinates& district) const noexcept;
  // The box in the frame of the body; false when it does not touch the body's bounds.
  [[nodiscard]] static bool turned(const Body& body, const glm::dvec3& low, const glm::dvec3& high,
                                   glm::dvec3& low_in_body, glm::dvec3& high_in_body) noexcept;
  // Calls visit(body) for each body that may touch the box, some of them twice, until it returns false.
  template <class Visit>
  void each(const glm::dvec3& low, const glm::dvec3& high, Visit&& visit) const noexcept;

  std::vector<Body> bodies_;
  std::vector<std::uint32_t> body_of_object_;  // [object], kNone: it does not move
  double district_m_ = 0.0;
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> buckets_;  // [hash of a district] first node
  std::uint64_t changes_ = 0;
};

}  // namespace hybrid
