// SPDX-License-Identifier: GPL-3.0-or-later
// Rigid surfaces rasterised conservatively into constant cells, one bit a cell. The fixed objects of a scene
// share one such set in the scene's frame; every moving body has one in its own frame.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>

#include "hybrid/map/brick_index.h"

namespace hybrid {

class SurfaceCells {
 public:
  SurfaceCells(double cell_m, const glm::dvec3& origin) : index_(cell_m, origin) {}

  // Occupies every cell within `margin_m` of the triangle (along each axis). A margin is for triangles that
  // approximate a curved surface. `object_bit`: the object's bit in the result of objects_in().
  void add_triangle(std::uint64_t object_bit, const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c,
                    double margin_m = 0.0);
  // Frees spare memory, and makes the bitmap for fast queries. Call it after the last triangle.
  void seal();

  // Is there surface in a brick that the box touches?
  [[nodiscard]] bool any_near(const glm::dvec3& low, const glm::dvec3& high) const noexcept;
  // Bits of the objects that have surface in a brick where the box touches an occupied cell.
  [[nodiscard]] std::uint64_t objects_in(const glm::dvec3& low, const glm::dvec3& high,
                                         CellTrail& trail) const noexcept;
  [[nodiscard]] std::uint64_t objects_in(const glm::dvec3& low, const glm::dvec3& high) const noexcept {
    CellTrail trail;
    return objects_in(low, high, trail);
  }

  // Bounds of all triangles; low > high if there are none.
  [[nodiscard]] const glm::dvec3& low() const noexcept { return low_; }
  [[nodiscard]] const glm::dvec3& high() const noexcept { return high_; }
  [[nodiscard]] bool empty() const noexcept { return index_.size() == 0; }
  [[nodiscard]] bool occupied(const CellCoordinates& cell) const noexcept;
  [[nodiscard]] std::size_t occupied_cells() const noexcept;
  [[nodiscard]] double cell_m() const noexcept { return index_.cell_m(); }
  [[nodiscard]] const glm::dvec3& origin() const noexcept { return index_.origin(); }
  [[nodiscard]] std::size_t memory_bytes() const noexcept;

 private:
  struct Brick {
    CellCoordinates at{kNoPlace, 0, 0};
    std::uint64_t objects = 0;
    std::array<std::uint64_t, BrickGrid::kEdge> layer{};  // [z], bit x + 8 y
    void start(const CellCoordinates& brick) noexcept { *this = Brick{brick}; }
  };
  static constexpr std::uint32_t kNone = BrickIndex<Brick>::kNone;
  [[nodiscard]] bool touches_bounds(const glm::dvec3& low, const glm::dvec3& high) const noexcept {
    return !(low.x > high_.x || high.x < low_.x || low.y > high_.y || high.y < low_.y || low.z > high_.z ||
             high.z < low_.z);
  }
  void occupy(std::uint64_t object_bit, const CellCoordinates& first, std::int32_t last_x);
  [[nodiscard]] bool is_occupied(std::uint64_t object_bit, const CellCoordinates& first,
                                 std::int32_t last_x) const noexcept;
  Brick& brick_at(const CellCoordinates& cell);

  BrickIndex<Brick> index_;
  std::uint32_t last_ = kNone;  // brick of the last insertion; mostly also that of the next
  glm::dvec3 low_{1e300}, high_{-1e300};
};

}  // namespace hybrid
