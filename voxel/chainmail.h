// SPDX-License-Identifier: GPL-3.0-or-later
// Exact ChainMail.
//
// Per axis the limits are difference constraints lo <= u(b) − u(a) <= hi on linked voxels, and the axes are
// independent. After some voxels (the sources) moved, the new state is clamp(u, L, U), where
// L(v) = max over sources of u(s) − dist(v→s), U(v) = min over sources of u(s) + dist(s→v), and dist is the
// shortest path with an arc a→b of length hi and an arc b→a of length −lo for each link. It violates no link
// if the old state violated none, and is the same whatever the order of visits: what runs here is a
// label-correcting shortest path restricted to the voxels that move. (A first-come queue, as in Gibson 1997,
// ends elsewhere; Schill's violation order, 1998, is Dijkstra on these paths.)
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "voxel/displacement.h"
#include "voxel/lattice.h"

namespace voxel {

class ChainMail {
 public:
  explicit ChainMail(const Lattice& lattice);

  // Restores every link after the voxels in `sources` were moved in `state` by `moves` (unit: meter), which
  // violated no link before they were. Sources give way to anchors and obstacles (indexed by surface number;
  // empty: none): a source that the chain cannot follow is itself pulled back, so that afterwards no link is
  // violated, whatever was asked. Each source is given once. Allocates nothing.
  void settle(Displacement& state, std::span<const VoxelId> sources, std::span<const glm::vec3> moves,
              std::span<const Obstacle> obstacles, std::span<const std::uint32_t> surface_number) noexcept;

  // Voxels that moved in the last settle(), sources included; each once.
  [[nodiscard]] std::span<const VoxelId> moved() const { return moved_; }
  // Link checks of the last settle(): the work done, in candidates.
  [[nodiscard]] std::uint64_t candidates() const { return candidates_; }
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  enum Mark : std::uint8_t {
    untouched = 0,
    raised = 1,
    lowered = 2,
    queued = 4,
    fixed = 8,
    listed = 16,
    pulled = 32
  };

  void enqueue(VoxelId v) noexcept;
  void begin_axis() noexcept;
  void spread(Displacement& state, int axis) noexcept;
  void spread_moves(Displacement& state, std::span<const VoxelId> voxels,
                    std::span<const glm::vec3> moves) noexcept;
  bool stop_at(Displacement& state, std::span<const Obstacle> obstacles,
               std::span<const std::uint32_t> surface_number) noexcept;
  void visit(Displacement& state, int axis, VoxelId from, VoxelId to, float low, float high) noexcept;
  void note_moved(VoxelId v) noexcept;
  void note_pulled(VoxelId anchor) noexcept;

  const Lattice& lattice_;
  std::vector<std::uint8_t> mark_;  // [v] Mark bits
  std::vector<VoxelId> ring_;       // queue; a voxel stands in it at most once
  std::size_t head_ = 0, tail_ = 0;
  std::vector<VoxelId> touched_;  // voxels with a mark to clear
  std::vector<VoxelId> moved_;
  std::vector<VoxelId> pulled_;   // anchors that the wave reached; each once
  std::vector<VoxelId> stopped_;  // voxels put back onto their obstacles, and by how much
  std::vector<glm::vec3> stops_;
  std::uint64_t candidates_ = 0;
};

// The most by which any link exceeds its limits (unit: meter), over the whole lattice; for tests.
double worst_violation(const Lattice& lattice, const Displacement& state);

}  // namespace voxel
