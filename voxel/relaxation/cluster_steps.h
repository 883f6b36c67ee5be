// SPDX-License-Identifier: GPL-3.0-or-later
// Active-set step for voxels that can only move together.
//
// A voxel whose net force pushes against an active limit does not move alone. A row of voxels without slack
// along itself would never move at all. A cluster is the least set that has to move with such a voxel
// (breadth-first search over links at their limits). It moves as one body to the equilibrium of its border's
// springs, or to the next limit. This is the block step of an active-set method for a quadratic function
// under difference constraints (Nocedal & Wright, Numerical Optimization, chapter 16).
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

  // Moves the cluster of a voxel on one axis. Rigid blocks are parts of clusters as wholes. Nothing moves if
  // a voxel of the cluster is held, anchored or at an obstacle, or in a block that the tool presses; if the
  // cluster's net force points the other way or is at most `least_N` a voxel; if the voxel was in another
  // cluster on this axis since begin(); or if too many voxels were visited since begin(). Returns the force
  // per voxel that moved the cluster (N); 0: nothing moved.
  double move(Multigrid& multigrid, Displacement& state, VoxelId v, int axis, double least_N) noexcept;
  // Voxels of the last cluster.
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
  LazyArray<std::uint8_t> mark_;  // [v] 1: in the cluster; 2, 4, 8: was in one on that axis since begin()
  std::uint64_t looked_at_ = 0;
};

}  // namespace voxel
