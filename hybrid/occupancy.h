// SPDX-License-Identifier: GPL-3.0-or-later
// The shared occupancy map: which surface voxels and which rigid surfaces lie in which cell of the scene.
//
// Sparse: bricks of 8×8×8 cells in a hash table; memory follows occupied cells, not the scene's extent.
// A look-up is one hash probe and one index. Soft surface voxels are kept one by one (an intrusive list a
// cell), moved in O(1); rigid surfaces are rasterised conservatively on load, and a cell says only that some
// of them pass: the exact question goes to the surface itself.
#pragma once

#include <array>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

namespace hybrid {

class OccupancyMap {
 public:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

  // `cell_m` > 0; `origin` near the scene, so that cells are exact far from the world's origin.
  OccupancyMap(double cell_m, const glm::dvec3& origin);

  // ---- on load; these allocate ----
  // A triangle of rigid object number `object`: every cell it touches.
  void add_triangle(std::uint32_t object, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c);
  // `count` soft surface voxels get numbers of their own; returns the first. Then place each.
  std::uint32_t add_soft(std::uint32_t count);
  void place(std::uint32_t number, const glm::dvec3& position);
  // Room for motion: bricks may grow by this many without allocating. Call once, after everything is placed.
  void reserve_bricks(std::size_t more);

  // ---- in the tick; these do not allocate ----
  // Soft voxel `number` is now at `position` (scene frame, meters).
  void move(std::uint32_t number, const glm::dvec3& position) noexcept;
  // Does anything at all lie in a brick that this box touches? The cheapest question: no cell is looked at.
  [[nodiscard]] bool any_near(const glm::dvec3& low, const glm::dvec3& high) const noexcept;
  // Bit per rigid object (objects beyond 62 share bit 63) with surface in a brick of which the box touches an
  // occupied cell: never too few, perhaps too many; the exact question goes to the surface.
  [[nodiscard]] std::uint64_t rigid_in(const glm::dvec3& low, const glm::dvec3& high) const noexcept;
  // Soft voxel numbers in the cells that the box touches; returns how many were written, at most out.size().
  [[nodiscard]] std::size_t soft_in(const glm::dvec3& low, const glm::dvec3& high,
                                    std::span<std::uint32_t> out) const noexcept;

  [[nodiscard]] double cell_m() const { return cell_m_; }
  [[nodiscard]] std::size_t occupied_cells() const noexcept;
  [[nodiscard]] std::size_t memory_bytes() const;
  // Moves that found no room for a brick: raise the reserve. The voxel stays known at its last cell.
  [[nodiscard]] std::uint64_t overflows() const { return overflows_; }
  // For tests: every soft voxel stands in the list of the cell it says it is in, and nowhere else.
  [[nodiscard]] bool validate() const;

  [[nodiscard]] static std::uint64_t rigid_bit(std::uint32_t object) {
    return 1ULL << (object < 63 ? object : 63);
  }

 private:
  static constexpr int kShift = 3, kEdge = 1 << kShift, kCells = kEdge * kEdge * kEdge;
  using Coordinates = std::array<std::int32_t, 3>;
  struct Brick {
    Coordinates at{};  // brick coordinates
    std::uint64_t rigid_mask = 0;
    std::uint32_t soft_count = 0;
    std::array<std::uint32_t, kCells> soft_head;  // first soft voxel of the cell, or kNone
    std::array<std::uint8_t, kCells> rigid;       // 1: some rigid surface passes
  };

  void put(std::uint32_t number, const glm::dvec3& position, bool may_allocate);
  [[nodiscard]] Coordinates cell_of(const glm::dvec3& p) const noexcept;
  [[nodiscard]] std::uint32_t find(const Coordinates& brick) const noexcept;
  std::uint32_t find_or_add(const Coordinates& brick, bool may_allocate);
  void rehash(std::size_t capacity);
  [[nodiscard]] static std::uint32_t hash(const Coordinates& c) noexcept;
  [[nodiscard]] static std::uint32_t index_in_brick(const Coordinates& cell) noexcept;
  // Calls visit(brick, lowest cell, highest cell) for each existing brick that the box touches, until it
  // returns false.
  template <class Visit>
  void each_brick(const glm::dvec3& low, const glm::dvec3& high, Visit&& visit) const noexcept;

  double cell_m_;
  glm::dvec3 origin_;
  std::vector<Brick> bricks_;
  std::vector<std::uint32_t> table_;      // open addressing, linear probing; kNone: empty
  std::vector<std::uint32_t> next_;       // [soft number] next in its cell
  std::vector<std::uint32_t> soft_cell_;  // [soft number] brick · kCells + cell, or kNone
  std::uint64_t overflows_ = 0;
};

}  // namespace hybrid
