// SPDX-License-Identifier: GPL-3.0-or-later
// Search and motion of one cluster.
#include "voxel/relaxation/cluster_steps.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "voxel/lattice/voxel_links.h"

namespace voxel {
namespace {

constexpr std::size_t kMostVoxels = 20'000;      // largest number of voxels in a cluster
constexpr std::uint64_t kMostLookedAt = 40'000;  // largest number of voxels visited since begin()
constexpr std::uint8_t kIn = 1;                  // bit of mark_: the voxel is in the current cluster
// A link nearer to its limit than this blocks motion (unit: spacing).
constexpr float kExactlyAtLimit = 1e-6F;

// Distance (m) that u(from) may move before the link to its neighbour stops it.
float room(const Lattice& lattice, const LazyArray<float>& u, VoxelId from, int d, bool up, int axis,
           bool upwards) noexcept {
  const VoxelId to = up ? lattice.up(from, d) : lattice.down(from, d);
  auto b = lattice.bounds(up ? from : to, d, axis);
  if (!up) b = {-b[1], -b[0]};  // limits of u(to) − u(from), whichever way the link points
  const float difference = u[to] - u[from];
  return upwards ? difference - b[0] : b[1] - difference;
}

}  // namespace

ClusterSteps::ClusterSteps(const Lattice& lattice) : lattice_(lattice), mark_(lattice.size()) {
  cluster_.reserve(kMostVoxels);
  seen_.reserve(kMostLookedAt);
}

void ClusterSteps::begin() noexcept {
  for (const VoxelId v : seen_) mark_[v] = 0;
  seen_.clear();
  looked_at_ = 0;
}

void ClusterSteps::forget(int axis) noexcept {
  for (const VoxelId v : cluster_) {
    const bool fresh = mark_[v] == kIn;
    mark_[v] = static_cast<std::uint8_t>((mark_[v] | (2U << axis)) & ~kIn);
    if (fresh && seen_.size() < seen_.capacity()) {
      seen_.push_back(v);
    } else if (fresh) {
      mark_[v] = 0;
    }
  }
}

bool ClusterSteps::gather(const Multigrid& multigrid, const Displacement& state, VoxelId v, int axis,
                          bool upwards) noexcept {
  const LazyArray<float>& u = state.u[static_cast<std::size_t>(axis)];
  const float tight = kExactlyAtLimit * static_cast<float>(lattice_.min_spacing_m());
  cluster_.clear();
  cluster_.push_back(v);
  mark_[v] |= kIn;
  for (std::size_t head = 0; head < cluster_.size(); ++head) {
    const VoxelId w = cluster_[head];
    if (++looked_at_ > kMostLookedAt || lattice_.anchored(w)) return false;
    const bool in_block = state.role[w] == Displacement::joined;
    if (in_block ? multigrid.tool_presses_block(lattice_.block(w) - 1U) : state.role[w] != Displacement::free)
      return false;
    for (int d = 0; d < 3; ++d) {
      for (const bool up : {false, true}) {
        const VoxelId n = up ? lattice_.up(w, d) : lattice_.down(w, d);
        if (!lattice_.filled(n) || (mark_[n] & kIn) != 0) continue;
        if (room(lattice_, u, w, d, up, axis, upwards) > tight) continue;
        if (cluster_.size() == kMostVoxels) return false;
        mark_[n] |= kIn;
        cluster_.push_back(n);
      }
    }
  }
  return true;
}

double ClusterSteps::move(Multigrid& multigrid, Displacement& state, VoxelId v, int axis,
                          double least_N) noexcept {
  if ((mark_[v] & (2U << axis)) != 0 || looked_at_ > kMostLookedAt) return 0.0;
  LevelStiffness& couplings = multigrid.couplings();
  const std::uint16_t block = lattice_.block(v);
  const double own =
      (block != 0 ? multigrid.block_force(block - 1U, state) : link_force(couplings, state, v))[axis];
  if (std::fabs(own) <= least_N) return 0.0;
  const bool upwards = own > 0.0;
  const bool free = gather(multigrid, state, v, axis, upwards);
  if (!free) {
    forget(axis);
    return 0.0;
  }
  LazyArray<float>& u = state.u[static_cast<std::size_t>(axis)];
  double pull = 0.0, stiffness = 0.0;
  float least_room = std::numeric_limits<float>::max();
  for (const VoxelId w : cluster_) {
    pull += link_force(couplings, state, w)[axis];
    const VoxelSprings springs = couplings.springs_of(w);
    for (std::size_t d = 0; d < 3; ++d) {
      for (const bool up : {false, true}) {
        const int id = static_cast<int>(d);
        const VoxelId n = up ? lattice_.up(w, id) : lattice_.down(w, id);
        if (!lattice_.filled(n) || (mark_[n] & kIn) != 0) continue;
        stiffness += static_cast<double>((up ? springs.up : springs.down)[d].on(axis, id));
        least_room = std::min(least_room, room(lattice_, u, w, id, up, axis, upwards));
      }
    }
  }
  forget(axis);
  const double force = (upwards ? pull : -pull) / static_cast<double>(cluster_.size());
  if (!(force > least_N) || !(stiffness > 0.0)) return 0.0;
  const float way = std::min(static_cast<float>(std::fabs(pull) / stiffness), least_room);
  for (const VoxelId w : cluster_) u[w] += upwards ? way : -way;
  return force;
}

std::size_t ClusterSteps::memory_bytes() const {
  return resident_bytes(cluster_) + resident_bytes(seen_) + mark_.resident_bytes();
}

}  // namespace voxel
