// SPDX-License-Identifier: GPL-3.0-or-later
// The shared occupancy map: which surface voxels and which rigid surfaces lie in which cell of the scene.
//
// Sparse: bricks of 8×8×8 cells in hash tables; memory follows occupied cells, not the scene's extent. Three
// layers, one question. Fixed rigid surfaces are rasterised conservatively on load, a bit a cell, and a cell
// says only that some of them pass: the exact question goes to the surface itself. Moving rigid bodies carry
// such cells in their own frame, so that what is known of them is never stale. Soft surface voxels are kept
// one by one (an intrusive list a cell), moved in O(1).
#pragma once

#include <cstdint>
#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <span>

#include "hybrid/map/moving_surface_layer.h"
#include "hybrid/map/voxel_layer.h"
#include "hybrid/map/fixed_surface_layer.h"

namespace hybrid {

class OccupancyMap {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  // What the caller of a path of questions keeps between them, so that each starts where the last one ended.
  // Only hints: with any trail, and whatever moved since, the answers are the same. One a thread.
  struct Trail {
    CellTrail fixed;
    SoftCells::Trail soft;
  };

  // `cell_m` > 0; `origin` near the scene, so that cells are exact far from the world's origin.
  OccupancyMap(double cell_m, const glm::dvec3& origin);

  // ---- on load; these allocate ----
  // A triangle of fixed rigid object number `object`: every cell that comes within `margin_m` of it.
  void add_triangle(std::uint32_t object, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                    double margin_m = 0.0);
  // Rigid object number `object` moves: its surface in its own frame, sealed, and where it is now (body to
  // scene).
  void add_moving(std::uint32_t object, std::shared_ptr<const SurfaceCells> cells, const glm::dvec3& position,
                  const glm::dquat& rotation);
  // `count` soft surface voxels get numbers of their own; returns the first. Then place each.
  std::uint32_t add_soft(std::uint32_t count) { return soft_.add(count); }
  void place(std::uint32_t number, const glm::dvec3& position) { soft_.place(number, position); }
  // Room for motion: bricks may grow by this many without allocating. Call once, after everything is placed.
  // Voxels need no more than one brick each, and a brick that the last one leaves is room again: however long
  // they wander, only how many bricks (and blocks of them, of which there are four for each) they are in at
  // one time counts.
  void reserve_bricks(std::size_t more);

  // ---- in the tick; these do not allocate ----
  // Soft voxel `number` is now at `position` (scene frame, meters).
  void move(std::uint32_t number, const glm::dvec3& position) noexcept { soft_.move(number, position); }
  // The moving rigid object is now there. O(1); every question asked later is answered for this pose.
  void move_body(std::uint32_t object, const glm::dvec3& position, const glm::dquat& rotation) noexcept;
  // Does anything at all lie in a brick that this box touches? The cheapest question: no cell is looked at.
  [[nodiscard]] bool any_near(const glm::dvec3& low, const glm::dvec3& high) const noexcept;
  // Bit per rigid object (objects beyond 62 share bit 63) with surface in a brick of which the box touches an
  // occupied cell: never too few, perhaps too many; the exact question goes to the surface.
  [[nodiscard]] std::uint64_t rigid_in(const glm::dvec3& low, const glm::dvec3& high,
                                       Trail& trail) const noexcept;
  [[nodiscard]] std::uint64_t rigid_in(const glm::dvec3& low, const glm::dvec3& high) const noexcept {
    Trail trail;
    return rigid_in(low, high, trail);
  }
  // Soft voxel numbers in the cells that the box touches; returns how many were written, at most out.size().
  [[nodiscard]] std::size_t soft_in(const glm::dvec3& low, const glm::dvec3& high,
                                    std::span<std::uint32_t> out, Trail& trail) const noexcept {
    return soft_.in(low, high, out, trail.soft);
  }
  [[nodiscard]] std::size_t soft_in(const glm::dvec3& low, const glm::dvec3& high,
                                    std::span<std::uint32_t> out) const noexcept {
    Trail trail;
    return soft_in(low, high, out, trail);
  }

  [[nodiscard]] double cell_m() const { return fixed_.cell_m(); }
  [[nodiscard]] const glm::dvec3& origin() const { return fixed_.origin(); }
  [[nodiscard]] std::size_t occupied_cells() const noexcept;
  [[nodiscard]] std::size_t memory_bytes() const;
  // Bricks in which soft voxels are: never an empty one.
  [[nodiscard]] std::size_t soft_bricks() const noexcept { return soft_.bricks(); }
  // Moves that found no room for a brick: raise the reserve. The voxel stays known at its last cell.
  [[nodiscard]] std::uint64_t overflows() const { return soft_.overflows(); }
  // Of moving bodies: districts entered or left since they were added.
  [[nodiscard]] std::uint64_t district_changes() const noexcept { return moving_.district_changes(); }
  // For tests: every soft voxel stands in the list of the cell it says it is in, every moving body in those
  // of its districts, and nowhere else.
  [[nodiscard]] bool validate() const;

  [[nodiscard]] static std::uint64_t rigid_bit(std::uint32_t object) {
    return 1ULL << (object < 63 ? object : 63);
  }

 private:
  SurfaceCells fixed_;
  MovingCells moving_;
  SoftCells soft_;
};

}  // namespace hybrid
