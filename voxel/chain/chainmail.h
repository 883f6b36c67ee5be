// SPDX-License-Identifier: GPL-3.0-or-later
// Exact ChainMail.
//
// Per axis the limits are difference constraints lo <= u(b) − u(a) <= hi on linked voxels, and the axes are
// independent. After some voxels (the sources) moved, the new state is clamp(u, L, U), where
// L(v) = max over sources of u(s) − dist(v→s), U(v) = min over sources of u(s) + dist(s→v), and dist is the
// shortest path with an arc a→b of length hi and an arc b→a of length −lo for each link. It violates no link
// if the old state violated none. First everything is raised, then everything lowered (see wave.h),
// then what gives way to obstacles and to anchors does: two waves each. (A first-come queue, as in Gibson
// 1997, ends elsewhere; Schill's violation order, 1998, is Dijkstra on these paths.)
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "voxel/chain/wave.h"
#include "voxel/lattice/displacement.h"
#include "voxel/lattice/lattice.h"
#include "voxel/lattice/lazy_array.h"

namespace voxel {

class ChainMail {
 public:
  explicit ChainMail(const Lattice& lattice);

  // Looks up what waves need of the lattice now, not when one first comes there.
  void prepare_all() noexcept { wave_.prepare_all(); }

  static constexpr std::uint64_t kUnlimited = ChainWave::kUnlimited;
  // Row updates that a wave takes in any case, so that what is around a contact is always settled: a row is
  // 32 voxels along x, and rows are taken in the order of their distance.
  static constexpr std::uint64_t kNearest = 64;

  // Restores every link after the voxels in `sources` were moved in `state` by `moves` (unit: meter), which
  // violated no link before they were. Sources give way to anchors and obstacles (indexed by surface number;
  // empty: none), those that cannot all be where they were put to one another: afterwards no link is violated
  // by more than floats round, whatever was asked. Each source is given once; their order changes no bit.
  // Rounding does not add up over calls: a link is violated by a few roundings of its ends at most, however
  // old the state. Allocates nothing.
  //
  // With a budget (unit: row update, about 0.1 us), what is beyond it waits, and is finished by later calls
  // of either function; waiting_rows() says where. Meanwhile a link is violated only if one of its ends is in
  // a row that waits. What may move a voxel within the limits of its links, where these leave it any room,
  // may do so in between. When nothing waits any more, no link is violated.
  void settle(Displacement& state, std::span<const VoxelId> sources, std::span<const glm::vec3> moves,
              std::span<const Obstacle> obstacles, std::uint64_t budget = kUnlimited) noexcept;
  // Goes on with what waits.
  void finish(Displacement& state, std::span<const Obstacle> obstacles,
              std::uint64_t budget = kUnlimited) noexcept;
  [[nodiscard]] std::span<const RowId> waiting_rows() const { return wave_.waiting_rows(); }

  // Rows that moved in the last call, those of the sources included; each once.
  [[nodiscard]] const RowRuns& moved_rows() const { return wave_.moved_rows(); }
  // Voxels in these rows: what moved, and what stands beside it.
  [[nodiscard]] std::size_t moved_count() const noexcept;
  // Row updates of the last call.
  [[nodiscard]] std::uint64_t work() const { return wave_.work(); }
  // The last wave came to anchors, which stay.
  [[nodiscard]] bool pulled_anchors() const { return wave_.pulled_any(); }
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  [[nodiscard]] float margin_of(const Displacement& state, int axis, std::span<const VoxelId> voxels,
                                std::span<const glm::vec3> moves) const noexcept;
  void spread_moves(Displacement& state, std::span<const VoxelId> voxels,
                    std::span<const glm::vec3> moves) noexcept;
  void spread_waiting(Displacement& state) noexcept;
  void give_way(Displacement& state, std::span<const Obstacle> obstacles) noexcept;
  void take(std::uint64_t updates) noexcept { left_ -= std::min(left_, updates); }
  enum class Stop : std::uint8_t { at_all, at_standing };  // obstacles that move are passed over
  bool stop_at(Displacement& state, std::span<const Obstacle> obstacles, Stop stop) noexcept;

  const Lattice& lattice_;
  ChainWave wave_;
  std::uint64_t left_ = 0;  // of the budget
  std::array<float, 3>
      margin_{};  // of this settle(), and those before of which something waits (unit: meter)
  LazyArray<ChainWave::Source> raised_, lowered_;
  bool stopped_by_moving_ = false;  // since settle() began, some voxel was
  LazyVector<VoxelId> stopped_;     // voxels put back onto their obstacles, and by how much
  LazyVector<glm::vec3> stops_;
};

// The most by which any link exceeds its limits (unit: meter), over the whole lattice; for tests.
double worst_violation(const Lattice& lattice, const Displacement& state);

}  // namespace voxel
