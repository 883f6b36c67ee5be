// SPDX-License-Identifier: GPL-3.0-or-later
// Relaxation of the six-link energy towards its equilibrium, under chain limits, anchors and obstacles.
//
// Per axis the energy is ½ Σ k (u(b) − u(a))² over the links: an anisotropic Laplace problem. One cycle is a
// multigrid V(1,1) cycle (Briggs, Henson & McCormick, A Multigrid Tutorial, chapters 3 and 10): zebra sweeps
// over rows, residuals summed into cells of 2×2×2, correction interpolated back trilinearly. The cycle is cut
// into planes, so that a tick does as many voxel updates as its budget says and goes on where it stopped:
// counted work, never measured time. Rows that are at rest, in a neighbourhood at rest, are not visited: work
// follows what moves, not the size of the object.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "voxel/displacement.h"
#include "voxel/lattice.h"

namespace voxel {

struct ObstacleView {
  std::span<const Obstacle> obstacles;            // by surface number
  std::span<const std::uint32_t> surface_number;  // [v]
};

// Moves voxels first..last (not included) of one row to the minimum of their energy given all other rows,
// without leaving their limits. Within the row the update is simultaneous where no limit is near (so it
// vectorises, and lowers the energy all the same: 2D − A is diagonally dominant on a row), one by one
// otherwise. Held voxels stay.
void relax_row(const Lattice& lattice, Displacement& state, const ObstacleView& obstacles, std::size_t row,
               int first, int last) noexcept;

// Is a voxel whose role is obstacle within `margin` of it, or in it (unit: meter)?
bool blocked(const ObstacleView& view, const Displacement& state, VoxelId v, double margin) noexcept;

// Where voxel v would go if only its links pulled, and the interval its links allow it, per axis.
glm::dvec3 link_minimum(const Lattice& lattice, const Displacement& state, VoxelId v) noexcept;
glm::dvec3 clamp_to_links(const Lattice& lattice, const Displacement& state, VoxelId v,
                          const glm::dvec3& wanted) noexcept;
// Force of its links on voxel v (unit: newton).
glm::dvec3 link_force(const Lattice& lattice, const Displacement& state, VoxelId v) noexcept;

// May any link of these voxels be at its limit? And is voxel v pulled against one that is, on this axis?
bool near_limits(const Lattice& lattice, const Displacement& state, int axis, std::size_t begin,
                 int count) noexcept;
bool resisted(const Lattice& lattice, const Displacement& state, int axis, VoxelId v, float pull) noexcept;

// Adds a correction to one axis of `count` voxels from `begin`, as far as their links allow it. Held and
// anchored voxels stay.
void correct_row(const Lattice& lattice, Displacement& state, int axis, std::size_t begin, int count,
                 const float* correction) noexcept;
// Brings voxels that a correction pushed into an obstacle back to it, as far as their links allow it.
void clear_obstacles(const Lattice& lattice, Displacement& state, const ObstacleView& obstacles,
                     std::size_t begin, int count) noexcept;

// An object rests when no free voxel feels more than this part of Lattice::force_scale_N(): a hundred times
// the rounding of floats at a displacement of ten spacings, and far below what a hand can feel.
inline constexpr double kRestingResidual = 1e-5;

class Relaxation {
 public:
  explicit Relaxation(const Lattice& lattice);

  // Spends `budget` voxel updates (a little more: planes are not cut), unless the object is at rest. Returns
  // what it spent.
  std::uint64_t run(Displacement& state, const ObstacleView& obstacles, std::span<const VoxelId> held,
                    std::uint64_t budget) noexcept;

  // Voxels of a row (v / dims[0]) were moved by somebody else: it and the rows beside it are to be looked at
  // again.
  void stir(std::size_t row) noexcept;
  void stir_all() noexcept;
  // Something moved: relax until the residual is below the tolerance again.
  void wake() noexcept {
    asleep_ = false;
    cycles_without_gain_ = 0;
  }
  [[nodiscard]] bool asleep() const { return asleep_; }
  // Largest force that any free voxel still feels, as the last whole cycle found it (unit: newton); below the
  // tolerance it is only known to be that.
  [[nodiscard]] double residual_N() const { return residual_N_; }
  // Cycles stop when the residual falls below this (unit: newton), or has not fallen for a while: what chain
  // limits hold has a residual that no relaxation removes. Default: kRestingResidual of the lattice's force
  // scale.
  void set_tolerance(double tolerance_N) noexcept { tolerance_N_ = tolerance_N; }
  [[nodiscard]] std::uint64_t cycles() const { return cycles_; }
  [[nodiscard]] std::uint64_t cycle_cost() const { return cycle_cost_; }
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Level {  // level 0 stands for the lattice itself and keeps no arrays of its own
    Springs springs;
    std::array<std::vector<float>, 3> correction, residual;  // [axis][cell]
    std::vector<float> filled;                               // [cell] 1 or 0
    std::vector<std::uint8_t> loud;         // [row] 1: its correction is too large to leave out
    std::vector<std::uint64_t> plane_cost;  // [plane] voxels in it
  };
  enum class Stage : std::uint8_t { smooth, restrict_residual, prolong };
  struct Step {
    Stage stage;
    std::uint8_t level;
    std::uint8_t colour;
  };
  struct HeldCell {
    std::uint8_t level;
    VoxelId cell;
    std::array<float, 3> inverse_diagonal;
  };

  void build_level(const Springs& fine, const std::vector<float>& fine_filled,
                   const std::vector<std::uint8_t>& fine_fixed, Level& coarse,
                   std::vector<std::uint8_t>& fixed) const;
  [[nodiscard]] const Springs& springs(std::size_t level) const {
    return level == 0 ? lattice_.springs() : levels_[level].springs;
  }
  std::uint64_t smooth_lattice(Displacement& state, const ObstacleView& obstacles, int colour,
                               int plane) noexcept;
  std::uint64_t do_plane(Displacement& state, const ObstacleView& obstacles, const Step& step,
                         int plane) noexcept;
  void begin_cycle(std::span<const VoxelId> held) noexcept;
  void end_cycle() noexcept;
  void hold_cells(VoxelId v, int axis) noexcept;
  void smooth_coarse(Level& level, int colour, int plane) noexcept;
  std::uint64_t restrict_from_lattice(const Displacement& state, const ObstacleView& obstacles,
                                      int plane) noexcept;
  void restrict_from_level(std::size_t fine, int plane) noexcept;
  std::uint64_t prolong_to_lattice(Displacement& state, const ObstacleView& obstacles, int plane) noexcept;
  void prolong_to_level(std::size_t fine, int plane) noexcept;
  // Interpolates the correction of `coarse` along one fine row into scratch_.
  void interpolate_row(const Level& coarse, int axis, int j, int k, int first, int last) noexcept;
  [[nodiscard]] int planes(const Step& step) const;
  // Is the correction that a fine row would get too small to matter?
  [[nodiscard]] bool negligible(const Level& coarse, int j, int k) const noexcept;

  const Lattice& lattice_;
  std::vector<Level> levels_;
  std::vector<Step> steps_;
  std::vector<HeldCell> held_cells_;
  std::vector<float> scratch_, coarse_value_, coarse_weight_;
  std::vector<std::uint8_t>
      at_limit_;  // [v] bit of each axis on which a link at its limit stands against v's pull
  std::vector<std::uint8_t>
      unseen_;  // [row of the lattice] 1: its residual may have changed since it was last found
  std::vector<float> row_residual_;  // [row] largest force on a free voxel when it was last found (N)
  std::size_t step_ = 0;
  int plane_ = 1;
  bool asleep_ = true;
  double residual_N_ = 0.0, running_residual_N_ = 0.0, tolerance_N_ = 0.0, least_residual_N_ = 0.0;
  int cycles_without_gain_ = 0;
  std::uint64_t cycles_ = 0, cycle_cost_ = 0;
};

}  // namespace voxel
