// SPDX-License-Identifier: GPL-3.0-or-later
// The shared occupancy map: which surface voxels and which rigid surfaces lie in which cell of the scene.
//
// The map is sparse. Bricks of 8×8×8 cells are in hash tables, so memory grows with the occupied cells and
// not with the scene's extent. Three layers have one interface. Fixed rigid surfaces are rasterised
// conservatively on load, with a bit per cell; exact queries go to the surfaces themselves. Moving rigid
// bodies have such cells in their own frames, so the cells are never stale. Soft surface voxels are kept one
// by one (an intrusive list per cell) and moved in O(1). hybrid/README.md, "The occupancy map", lists the
// functions that ask the map.
#pragma once

#include <cstdint>
#include <glm/gtc/quaternion.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <span>

#include "hybrid/map/fixed_surface_layer.h"
#include "hybrid/map/moving_surface_layer.h"
#include "hybrid/map/voxel_layer.h"

namespace hybrid {

class OccupancyMap {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  // A caller's cache for queries along a path: each query starts where the last one ended. The contents are
  // hints only: results are the same with any trail and after any motion. Each thread needs its own.
  struct Trail {
    CellTrail fixed;
    VoxelLayer::Trail soft;
  };

  // `cell_m` > 0; `origin`: a point near the scene, so that cells are exact far from the world's origin.
  OccupancyMap(double cell_m, const glm::dvec3& origin);

  // ---- on load; these allocate ----
  // Adds a triangle of fixed rigid object number `object`: occupies every cell within `margin_m` of it.
  void add_triangle(std::uint32_t object, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                    double margin_m = 0.0);
  // Adds moving rigid object number `object`: its sealed surface cells in its own frame, and its pose (body
  // to scene).
  void add_moving(std::uint32_t object, std::shared_ptr<const SurfaceCells> cells, const glm::dvec3& position,
                  const glm::dquat& rotation);
  // Gives `count` soft surface voxels consecutive numbers; returns the first. Call place() for each
  // afterwards.
  std::uint32_t add_soft(std::uint32_t count) { return soft_.add(count); }
  void place(std::uint32_t number, const glm::dvec3& position) { soft_.place(number, position); }
  // Makes room for `more` further bricks with four blocks each, which then need no allocation. Call it once,
  // after everything is placed. A voxel needs at most one brick, and a brick that its last voxel leaves is
  // free again. So only bricks that are occupied at the same time count, however far voxels move.
  void reserve_bricks(std::size_t more);

  // ---- in the tick; these do not allocate ----
  // Moves soft voxel `number` to `position` (scene frame, m).
  void move(std::uint32_t number, const glm::dvec3& position) noexcept { soft_.move(number, position); }
  // Sets the pose of a moving rigid object. O(1); later queries use this pose.
  void move_body(std::uint32_t object, const glm::dvec3& position, const glm::dquat& rotation) noexcept;
  // Does anything lie in a brick that the box touches? The cheapest query: reads no cells.
  [[nodiscard]] bool any_near(const glm::dvec3& low, const glm::dvec3& high) const noexcept;
  // Bits of the rigid objects that have surface in a brick where the box touches an occupied cell (objects
  // beyond 62 share bit 63). This is a superset of the exact answer, which the surfaces themselves give.
  [[nodiscard]] std::uint64_t rigid_in(const glm::dvec3& low, const glm::dvec3& high,
                                       Trail& trail) const noexcept;
  [[nodiscard]] std::uint64_t rigid_in(const glm::dvec3& low, const glm::dvec3& high) const noexcept {
    Trail trail;
    return rigid_in(low, high, trail);
  }
  // Writes the numbers of the soft voxels in the cells that the box touches. Returns how many were written,
  // at most out.size().
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
  // Bricks that contain soft voxels.
  [[nodiscard]] std::size_t soft_bricks() const noexcept { return soft_.bricks(); }
  // Number of moves that found no room for a brick. The voxel then stays listed in its last cell. Raise the
  // reserve if it is not 0.
  [[nodiscard]] std::uint64_t overflows() const { return soft_.overflows(); }
  // Number of districts that moving bodies entered or left since they were added.
  [[nodiscard]] std::uint64_t district_changes() const noexcept { return moving_.district_changes(); }
  // For tests: every soft voxel is in the list of its cell, every moving body in the lists of its districts,
  // and in no others.
  [[nodiscard]] bool validate() const;

  [[nodiscard]] static std::uint64_t rigid_bit(std::uint32_t object) {
    return 1ULL << (object < 63 ? object : 63);
  }

 private:
  SurfaceCells fixed_;
  MovingSurfaceLayer moving_;
  VoxelLayer soft_;
};

}  // namespace hybrid
