// SPDX-License-Identifier: GPL-3.0-or-later
// Voxels that can only move together.
//
// Where a link is at its limit, a voxel that its forces pull on against it stays: moved one by one, a row of
// voxels without slack along itself never moves at all, whatever pulls it as a whole. Here the least set that
// has to come along with such a voxel is found (breadth first over the links at their limits) and moved as
// one body, to where the springs that leave it are in balance or the next limit stops it. It is the block
// step of an active-set method for a quadratic function within difference constraints (Nocedal & Wright,
// Numerical Optimization, chapter 16).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "voxel/lattice/displacement.h"
#include "voxel/lattice/lattice.h"
#include "voxel/lattice/lazy_array.h"
#include "voxel/lattice/level_stiffness.h"
#include "voxel/multigrid/fas.h"

namespace voxel {

class ClusterSteps {
 public:
  explicit ClusterSteps(const Lattice& lattice);

  // The voxel, pulled on this axis against a limit, and all that has to come along: moves them. Does nothing
  // where one of them is held, anchored or at an obstacle, where what they are pulled by together points the
  // other way or is less than `least_N` a voxel, where it was looked at in another's cluster already, or when
  // the voxels looked at since begin() are too many.
  // Returns the force a voxel that moved them (N); 0: they stay.
  // Parts without slack come along as wholes, where the tool does not hold them.
  double move(Multigrid& multigrid, Displacement& state, VoxelId v, int axis, double least_N) noexcept;
  // Voxels that the last move() moved.
  [[nodiscard]] const std::vector<VoxelId>& moved() const { return cluster_; }

  void begin() noexcept;
  [[nodiscard]] std::uint64_t looked_at() const { return looked_at_; }
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  bool gather(const Multigrid& multigrid, const Displacement& state, VoxelId v, int axis,
              bool upwards) noexcept;
  void forget(int axis) noexcept;

  const Lattice& lattice_;
  std::vector<VoxelId> cluster_, seen_;
  LazyArray<std::uint8_t> mark_;  // [v] 1: in the cluster; 2, 4, 8: was in one since begin(), on that axis
  std::uint64_t looked_at_ = 0;
};

}  // namespace voxel
