// SPDX-License-Identifier: GPL-3.0-or-later
// The state of a soft object: displacement of each voxel from rest, and the role that says which solver moves
// it.
//
// Arrays take memory page by page where they are written, so untouched tissue costs address space only.
// Counts per row agree with the roles, because roles change through set_role() only.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "voxel/lattice/lattice.h"
#include "voxel/lattice/lazy_array.h"
#include "voxel/lattice/plastic_offsets.h"

namespace voxel {

// Loads of bricks: their forces beyond those of links, from the last renewal
// (voxel/fem/deferred_correction.h).
struct BrickLoad {
  BrickLoad() = default;
  // Takes no address space for a lattice without bricks.
  explicit BrickLoad(const Lattice& lattice) {
    if (!lattice.has_bricks()) return;
    for (auto& axis : load) axis = LazyArray<float>(lattice.size());
    row = LazyArray<std::uint8_t>(lattice.grid().rows());
  }

  std::array<LazyArray<float>, 3> load;  // [axis][v] (N)
  LazyArray<std::uint8_t> row;           // [row] 1 if the row has a load

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

// Displacements of all voxels. A float position far from the origin would lose the slack of the chain to
// rounding. A float displacement keeps the slack, because it is near zero.
struct Displacement {
  enum Role : std::uint8_t {
    free = 0,
    held = 1,      // near the tool or another soft object: moved by the contact solver only
    obstacle = 2,  // near a rigid surface: also subject to n·u >= bound
    pressed = 3,   // on the tool only: slides along the tool's surface (tangential_contact.h)
    // In a block without slack (rigid_blocks.h): moves with its block only, even if something touches it.
    // Voxels keep this role from construction on. The second value marks those near a rigid surface.
    joined = 5,
    joined_at_obstacle = 7,
  };
  // Does row relaxation leave voxels of this role where they are?
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
        plastic(lattice),
        bricks(lattice) {
    for (auto& axis : u) axis = LazyArray<float>(lattice.size());
    for (VoxelId v = 0; lattice.block_count() > 0 && v < lattice.size(); ++v) {
      if (lattice.block(v) == 0) continue;
      role[v] = joined;
      ++row_standing[v / kRow];
    }
  }

  std::array<LazyArray<float>, 3> u;                    // [axis][v] (unit: meter)
  LazyArray<std::uint8_t> role;                         // [v]
  LazyArray<std::uint8_t> row_standing, row_obstacles;  // [row] number of voxels with stands(), at_obstacle()
  LazyArray<glm::vec3> tool_normal;  // [surface number] unit, out of the tool; for pressed voxels
  PlasticOffsets plastic;
  BrickLoad bricks;

  // Touches all pages of these rows, so that a tick does not pay for the page faults.
  void populate(const std::vector<bool>& rows) noexcept {
    for (auto& axis : u) axis.populate(kRow, rows);
    role.populate(kRow, rows);
    bricks.populate(rows);
  }
  // Loads on a row of voxels beyond the forces of its springs (N); null: none.
  [[nodiscard]] const float* load_of(RowId r, int axis) const noexcept {
    if (bricks.has(r))
      return bricks.load[static_cast<std::size_t>(axis)].data() + static_cast<std::size_t>(r) * kRow;
    return plastic.load_of(r, axis);
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

// Displacement (m) at any rest point of the object, interpolated from the eight voxels around it; 0 if none
// exists.
[[nodiscard]] glm::dvec3 displacement_at(const Lattice& lattice, const Displacement& state,
                                         const glm::dvec3& rest_point) noexcept;

// A voxel touches its obstacle if it is no deeper in the obstacle than this share of the smallest spacing.
inline constexpr double kTouching = 1e-6;

// A half-space that one surface voxel may not leave: normal · u >= bound, where u is the voxel's
// displacement.
struct Obstacle {
  glm::vec3 normal{0.0F};
  float bound = 0.0F;  // (m); <= 0 if the voxel at rest is outside the obstacle
  // The obstacle is a moving body. If a voxel cannot be outside all obstacles, it enters the moving body, not
  // a fixed surface.
  bool moving = false;
};

}  // namespace voxel
