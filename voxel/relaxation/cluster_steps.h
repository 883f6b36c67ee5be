// SPDX-License-Identifier: GPL-3.0-or-later
// Active-set step for voxels that can only move together.
//
// A voxel whose net force pushes against an active limit cannot move alone. For example, a row of voxels
// without slack along itself would never move if its voxels moved one by one. A cluster is the smallest set
// of voxels that has to move with such a voxel. A breadth-first search over links at their limits finds it.
// It moves as one body to the equilibrium of its border's springs, or to the next limit. This is the block
// step of an active-set method for a quadratic function under difference constraints (Nocedal & Wright,
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

  // Moves the cluster of a voxel on one axis. A rigid block belongs to a cluster as a whole. Nothing moves in
  // four cases. (1) A voxel of the cluster is held, anchored, at an obstacle, or in a block that the tool
  // presses. (2) The voxel's force, or the cluster's net force per voxel, is at most `least_N`, or the two
  // point in opposite directions. (3) The voxel was in another cluster on this axis since begin(). (4) Too
  // many voxels were visited since begin(), or are in the cluster. Returns the force per voxel that moved the
  // cluster (N), or 0 if nothing moved.
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
  // [v] Bit 0: it is in the current cluster. Bits 1 to 3: it was in one on axis x, y, z since begin().
  LazyArray<std::uint8_t> mark_;
  std::uint64_t looked_at_ = 0;
};

}  // namespace voxel
