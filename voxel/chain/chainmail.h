// SPDX-License-Identifier: GPL-3.0-or-later
// Exact ChainMail: difference constraints closed by shortest paths.
//
// On each axis the limits are difference constraints lo <= u(b) − u(a) <= hi on linked voxels, and the axes
// are independent. After the sources have moved, the new state is clamp(u, L, U) with L(v) = max over sources
// s of u(s) − dist(v→s) and U(v) = min over sources s of u(s) + dist(s→v). dist is the shortest path in a
// graph with an arc a→b of length hi and an arc b→a of length −lo for each link. The new state violates no
// link if the old one violated none. One wave raises and one lowers (wave.h). Two more waves follow for
// voxels that obstacles stopped, and two for anchors. A first-come queue (Gibson 1997) gives a different
// result. Schill's order of violation (1998) is Dijkstra's algorithm on these paths.
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

  // Looks up the lattice data of waves now. Otherwise they are looked up at the first use.
  void prepare_all() noexcept { wave_.prepare_all(); }

  static constexpr std::uint64_t kUnlimited = ChainWave::kUnlimited;
  // Row updates that a wave may take in any case, so that the surroundings of a contact are always settled. A
  // row is 32 voxels along x. Rows are taken in the order of their distance.
  static constexpr std::uint64_t kNearest = 64;

  // Restores the limits of all links after the voxels `sources` were moved in `state` by `moves` (m). Before
  // these moves no link was violated. Sources yield to anchors and obstacles (indexed by surface number;
  // empty: none), and to one another if their places are infeasible together. Afterwards no link is violated
  // by more than rounding, whatever the moves. Each source is given once. The order of the sources does not
  // change a bit of the result. Rounding does not accumulate over calls: a link is violated by a few
  // roundings of its ends at most. Allocates nothing.
  //
  // Row updates beyond `budget` (one is about 0.1 us) wait, and later calls of settle() or finish() make
  // them. Until then a link is violated only if one of its ends is in a row of waiting_rows(). Between calls
  // voxels may be moved within the limits of their links, where these limits are feasible. When no row waits,
  // no link is violated.
  void settle(Displacement& state, std::span<const VoxelId> sources, std::span<const glm::vec3> moves,
              std::span<const Obstacle> obstacles, std::uint64_t budget = kUnlimited) noexcept;
  // Continues with the waiting rows.
  void finish(Displacement& state, std::span<const Obstacle> obstacles,
              std::uint64_t budget = kUnlimited) noexcept;
  [[nodiscard]] std::span<const RowId> waiting_rows() const { return wave_.waiting_rows(); }

  // Rows that moved in the last call, including those of the sources; each once.
  [[nodiscard]] const RowSet& moved_rows() const { return wave_.moved_rows(); }
  // Voxels in these rows, moved or not.
  [[nodiscard]] std::size_t moved_count() const noexcept;
  // Row updates of the last call.
  [[nodiscard]] std::uint64_t work() const { return wave_.work(); }
  // Did the last call require an anchor to move? Anchors stay.
  [[nodiscard]] bool pulled_anchors() const { return wave_.pulled_any(); }
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  [[nodiscard]] float margin_of(const Displacement& state, int axis, std::span<const VoxelId> voxels,
                                std::span<const glm::vec3> moves) const noexcept;
  void spread_moves(Displacement& state, std::span<const VoxelId> voxels,
                    std::span<const glm::vec3> moves) noexcept;
  void spread_waiting(Displacement& state) noexcept;
  void enforce_obstacles_and_anchors(Displacement& state, std::span<const Obstacle> obstacles) noexcept;
  void spend(std::uint64_t updates) noexcept { budget_left_ -= std::min(budget_left_, updates); }
  enum class Stop : std::uint8_t { at_all, at_standing };  // at_standing: ignores obstacles that move
  bool stop_at(Displacement& state, std::span<const Obstacle> obstacles, Stop stop) noexcept;

  const Lattice& lattice_;
  ChainWave wave_;
  std::uint64_t budget_left_ = 0;
  // [axis] Margin of this settle(), and of earlier calls of it whose rows still wait (m).
  std::array<float, 3> margin_{};
  LazyArray<ChainWave::Source> raised_, lowered_;
  bool stopped_by_moving_ = false;  // a moving obstacle has stopped some voxel in this call
  LazyVector<VoxelId> stopped_;     // voxels that were put back onto their obstacles, and the corrections (m)
  LazyVector<glm::vec3> stops_;
};

// Largest excess of a link of the lattice over its limits (m); for tests.
double worst_violation(const Lattice& lattice, const Displacement& state);

}  // namespace voxel
