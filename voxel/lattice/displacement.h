// SPDX-License-Identifier: GPL-3.0-or-later
// The moving half of a soft object: how far each voxel is from rest, and who is responsible for moving it.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "voxel/lattice/lattice.h"
#include "voxel/lattice/lazy_array.h"
#include "voxel/lattice/plastic_offsets.h"

namespace voxel {

// What bricks add to the forces of links, as it was when it was last found (voxel/fem/deferred_correction.h).
struct BrickLoad {
  BrickLoad() = default;
  // Takes no address space where no tissue is of bricks.
  explicit BrickLoad(const Lattice& lattice) {
    if (!lattice.has_bricks()) return;
    for (auto& axis : load) axis = LazyArray<float>(lattice.size());
    row = LazyArray<std::uint8_t>(lattice.grid().rows());
  }

  std::array<LazyArray<float>, 3> load;  // [axis][v] (N)
  LazyArray<std::uint8_t> row;           // [row] 1 where it has any

  [[nodiscard]] bool has(RowId r) const noexcept { return row.size() != 0 && row[r] != 0; }
  [[nodiscard]] std::array<float, 3> at(VoxelId v) const noexcept {
    return has(v / kRow) ? std::array<float, 3>{load[0][v], load[1][v], load[2][v]} : std::array<float, 3>{};
  }
  void populate(const std::vector<bool>& rows) noexcept {
    for (auto& axis : load) axis.populate(kRow, rows);
    row.populate();
  }
  [[nodiscard]] std::size_t memory_bytes() const {
    return load[0].resident_bytes() + load[1].resident_bytes() + load[2].resident_bytes() +
           row.resident_bytes();
  }
};

// Displacement, not position: at coordinate 100 a float position has lost the slack of the chain to rounding,
// a displacement near zero has not.
struct Displacement {
  enum Role : std::uint8_t {
    free = 0,
    held = 1,      // near the tool or another soft object: moved by the contact solver only
    obstacle = 2,  // near a rigid surface: also subject to n·u >= c
    pressed = 3,   // on the tool, and nothing else: slides along it (see tangential_contact.h)
    // In a part without slack (rigid_blocks.h), and moved with that alone, whatever else it is; the second
    // where it is also near a rigid surface. From construction on.
    joined = 5,
    joined_at_obstacle = 7,
  };
  // Those that stand while their rows are relaxed.
  [[nodiscard]] static bool stands(std::uint8_t role) noexcept { return (role & 1U) != 0; }
  [[nodiscard]] static bool in_block(std::uint8_t role) noexcept { return role >= joined; }
  [[nodiscard]] static bool at_obstacle(std::uint8_t role) noexcept {
    return role == obstacle || role == joined_at_obstacle;
  }

  explicit Displacement(const Lattice& lattice)
      : role(lattice.size()),
        row_standing(lattice.grid().rows()),
        row_obstacles(lattice.grid().rows()),
        tool_normal(lattice.surface().size()),
        rest(lattice),
        bricks(lattice) {
    for (auto& axis : u) axis = LazyArray<float>(lattice.size());
    for (VoxelId v = 0; lattice.block_count() > 0 && v < lattice.size(); ++v) {
      if (lattice.part(v) == 0) continue;
      role[v] = joined;
      ++row_standing[v / kRow];
    }
  }

  std::array<LazyArray<float>, 3> u;                    // [axis][v] (unit: meter)
  LazyArray<std::uint8_t> role;                         // [v]
  LazyArray<std::uint8_t> row_standing, row_obstacles;  // [row]: voxels of the row that stand; with obstacles
  LazyArray<glm::vec3> tool_normal;  // [surface number] from the tool, unit; of those pressed
  RestOffsets rest;
  BrickLoad bricks;

  // All memory that these rows will take, now.
  void populate(const std::vector<bool>& rows) noexcept {
    for (auto& axis : u) axis.populate(kRow, rows);
    role.populate(kRow, rows);
    bricks.populate(rows);
  }
  // Loads of a row of voxels beside the pulls of their springs; null: none (N).
  [[nodiscard]] const float* load_of(RowId r, int axis) const noexcept {
    if (bricks.has(r))
      return bricks.load[static_cast<std::size_t>(axis)].data() + static_cast<std::size_t>(r) * kRow;
    return rest.load_of(r, axis);
  }
  [[nodiscard]] glm::dvec3 at(VoxelId v) const { return {u[0][v], u[1][v], u[2][v]}; }
  void set(VoxelId v, const glm::dvec3& value) {
    for (int a = 0; a < 3; ++a) u[static_cast<std::size_t>(a)][v] = static_cast<float>(value[a]);
  }
  void set_role(VoxelId v, Role r) {
    if (in_block(role[v])) {
      if (r == held || r == pressed) return;
      r = r == obstacle ? joined_at_obstacle : joined;
    }
    if (role[v] == r) return;  // untouched tissue stays unwritten
    const RowId row = v / kRow;
    row_standing[row] = static_cast<std::uint8_t>(row_standing[row] + stands(r) - stands(role[v]));
    row_obstacles[row] =
        static_cast<std::uint8_t>(row_obstacles[row] + at_obstacle(r) - at_obstacle(role[v]));
    role[v] = r;
  }
};

// Displacement at any rest point of the body, from the voxels around it (unit: meter); 0 where none is near.
[[nodiscard]] glm::dvec3 displacement_at(const Lattice& lattice, const Displacement& state,
                                         const glm::dvec3& rest_point) noexcept;

// Of the smallest spacing: a voxel that is no deeper in its obstacle than this lies on it.
inline constexpr double kTouching = 1e-6;

// A half-space that one surface voxel may not leave: normal · u >= bound, u its displacement.
struct Obstacle {
  glm::vec3 normal{0.0F};
  float bound = 0.0F;  // (unit: meter), <= 0 where the voxel is clear of it at rest
  // It is a body's that moves: where a voxel cannot be outside of all, it is in that, and not in what stands.
  bool moving = false;
};

}  // namespace voxel
