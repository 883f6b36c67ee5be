// SPDX-License-Identifier: GPL-3.0-or-later
// Relaxation of the six-link energy towards its equilibrium, under chain limits, anchors and obstacles.
//
// Per axis the energy is ½ Σ k (u(b) − u(a))² over the links: an anisotropic Laplace problem, solved by
// multigrid cycles (see multigrid.h) in two ways. Round the contact, whole cycles at once over boxes of the
// same number of cells on each level: a tick's work, the same for any size of object. And everywhere, a few
// planes at a time, as many voxel updates as the budget says: counted work, never measured time. Rows that
// are at rest, in a neighbourhood at rest, are not visited.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "voxel/sparse/displacement.h"
#include "voxel/sparse/lattice.h"
#include "voxel/sparse/links.h"
#include "voxel/sparse/multigrid.h"

namespace voxel::sparse {

// An object counts as at rest when no free voxel is pulled by more than this share of the force scale.
inline constexpr double kRestingResidual = 1e-5;

class Relaxation {
 public:
  explicit Relaxation(const Lattice& lattice);

  // Spends `budget` voxel updates (a little more: planes are not cut), unless the object is at rest. Returns
  // what it spent.
  std::uint64_t run(Displacement& state, const ObstacleView& obstacles, std::span<const VoxelId> held,
                    std::uint64_t budget) noexcept;
  // One whole cycle everywhere, or what is left of the one begun. For references, not for the tick.
  void run_cycle(Displacement& state, const ObstacleView& obstacles, std::span<const VoxelId> held) noexcept;
  // One cycle round the contact: the box of voxels from `low` to `high`, both included.
  void relax_contact(Displacement& state, const ObstacleView& obstacles, std::span<const VoxelId> held,
                     const std::array<int, 3>& low, const std::array<int, 3>& high) noexcept;

  [[nodiscard]] Couplings& couplings() { return multigrid_.couplings(); }

  // Voxels of a row (v / kRow) were moved by somebody else: it and the rows beside it are to be looked at.
  void stir(RowId row) noexcept { multigrid_.stir(0, row); }
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
  void set_tolerance(double tolerance_N) noexcept;
  [[nodiscard]] std::uint64_t cycles() const { return cycles_; }
  // Starts in the same state as `other`, of the same lattice.
  void copy_from(const Relaxation& other) noexcept;
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  enum class Stage : std::uint8_t { smooth, values, loads, telling, prolong };
  struct Step {
    Stage stage;
    std::uint8_t level;
    std::uint8_t colour;
  };
  // Rows of columns c0 … c1, and so on, all included.
  struct RowBox {
    int c0, c1, j0, j1, k0, k1;
  };
  static constexpr std::uint8_t kRenewed = 16;  // a flag of our own: values are new, loads are not yet

  void begin_cycle(std::span<const VoxelId> held) noexcept;
  void end_cycle() noexcept;
  std::uint64_t do_plane(Displacement& state, const ObstacleView& obstacles, const Step& step,
                         int plane) noexcept;
  [[nodiscard]] int planes(const Step& step) const;
  [[nodiscard]] bool restrict_due(int level, RowId row) const noexcept;
  [[nodiscard]] std::uint64_t cells_below(int level, RowId row) const noexcept;
  template <class Visit>
  void for_rows(int level, const RowBox& box, const Visit& visit) noexcept;
  [[nodiscard]] RowBox clipped(int level, const RowBox& box) const noexcept;
  void smooth_box(int level, int colour, Displacement& state, const ObstacleView& obstacles) noexcept;
  void tell_box(int level, Displacement& state, const ObstacleView& obstacles) noexcept;

  const Lattice& lattice_;
  Multigrid multigrid_;
  std::vector<Step> steps_;
  std::vector<RowBox> smooth_box_, parent_box_, told_box_, teller_box_;  // [level] of the contact
  std::size_t step_ = 0;
  int plane_ = 0;
  bool asleep_ = true;
  double residual_N_ = 0.0, running_residual_N_ = 0.0, tolerance_N_ = 0.0, least_residual_N_ = 0.0;
  float hold_ = 1.0F;
  int cycles_without_gain_ = 0;
  std::uint64_t cycles_ = 0;
};

}  // namespace voxel::sparse
