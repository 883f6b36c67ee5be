// SPDX-License-Identifier: GPL-3.0-or-later
// One wave on one axis: everything that the sources raise, or everything that they lower.
//
// In a raising wave a voxel goes to the greatest of u(neighbour) − limit over its links, and its own
// neighbours follow. This is a longest path from the sources, and its result does not depend on the order of
// visits. There are three methods:
// - If all limits of a direction are equal and the box that a source reaches is full, distances are steps
//   times limits, and the source's cone is written row by row in closed form (wave_cone.cpp).
// - Elsewhere rows are swept away from the sources (wave_sweep.cpp). Where no sweep can start, and beyond
//   cones, rows stand in a queue, and each visit relaxes all links of a row (a label-correcting shortest
//   path, in vectors).
// - Links to rows with anchors are relaxed voxel by voxel where needed. An anchor that a link requires to
//   move is "pulled": it stays, and its row is noted.
//
// A wave that reaches its limit of row updates stops, and the rows whose links it has yet to relax wait. If a
// link is violated, the voxel that requires the other one to move is in a waiting row. So later waves that
// raise and lower from the waiting rows repair all violations. This holds whatever else has moved in between.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "voxel/chain/limits.h"
#include "voxel/chain/row_kernels.h"
#include "voxel/chain/row_set.h"
#include "voxel/chain/sweep_kernel.h"
#include "voxel/lattice/lattice.h"
#include "voxel/lattice/lazy_array.h"

namespace voxel {

class ChainWave {
 public:
  explicit ChainWave(const Lattice& lattice);

  static constexpr std::uint64_t kUnlimited = ~std::uint64_t{0};

  // Looks up the RowInfo of all rows now; else a row is looked up at its first use.
  void prepare_all() noexcept;

  // Clears the moved rows and the pulled anchors. Waiting rows go on waiting.
  void begin() noexcept;

  struct Source {
    float u;  // displacement that it moves to (m)
    VoxelId v;
  };
  // Waves return the row updates that they took: at most `most` + 1.
  //
  // Moves all sources to their Source::u, in the direction `way`, and the voxels that must follow. In `u`
  // (displacements by voxel, m) the sources are still where they were, and no link is violated except those
  // of waiting rows. `margin`: see row_kernels.h. Sorts the sources, so that their order does not change a
  // bit of the result.
  std::uint64_t spread(float* u, int axis, Way way, std::span<Source> sources, float margin,
                       std::uint64_t most = kUnlimited) noexcept;
  // Starts at the rows of the anchors that waves on this axis pulled in the other direction. Moves voxels in
  // direction `way`.
  std::uint64_t spread_from_pulled(float* u, int axis, Way way, float margin,
                                   std::uint64_t most = kUnlimited) noexcept;
  // To continue with the waiting rows, call take_waiting(), then one wave for each axis and direction, then
  // put_back(): taken rows that still have links to relax wait again.
  void take_waiting() noexcept;
  std::uint64_t spread_from_taken(float* u, int axis, Way way, float margin,
                                  std::uint64_t most = kUnlimited) noexcept;
  void put_back() noexcept;

  void note_moved(RowId row) noexcept { moved_.add(row); }
  // Rows that moved since begin(), each once; no order is promised.
  [[nodiscard]] const RowSet& moved_rows() const { return moved_; }
  [[nodiscard]] std::span<const RowId> waiting_rows() const { return {waiting_.data(), waiting_count_}; }
  // Was any anchor pulled since begin()?
  [[nodiscard]] bool pulled_any() const { return pulled_count_ > 0; }
  [[nodiscard]] std::uint64_t work() const { return work_; }  // row updates since begin()
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  static constexpr std::uint64_t kConeRows = 8;  // this many rows of a cone take as long as one row update
  // first, last: the first or the last voxel of the row has moved since the row was last visited.
  enum Mark : std::uint8_t { first = kFirstMoved, last = kLastMoved, queued = 8 };
  struct WaveArgs {
    float* u = nullptr;
    int axis = 0;
    Way way = Way::raise;
    float margin = 0.0F;
    ChainLimits::WaveLimits limits;
    std::array<double, kDirections> limit{};  // limits of all links by direction, if they are equal
  };
  static constexpr std::uint8_t kListed = 64;  // bit of RowInfo::waits: the row is in waiting_
  [[nodiscard]] static std::uint8_t wave_bit(int axis, Way way) {
    return static_cast<std::uint8_t>(1U << (2 * axis + (way == Way::raise ? 0 : 1)));
  }
  struct IntRange {  // low … high, both included; empty: low > high
    int low = std::numeric_limits<int>::max(), high = -1;
    void add(int n) noexcept;
    void add(const IntRange& other) noexcept;
    [[nodiscard]] bool empty() const { return low > high; }
  };
  struct Plane {               // the plane that is being swept
    const float* u = nullptr;  // displacements of the whole lattice
    int at = 0, z = -1;        // its z, and the direction of the sweep in z (−1 or 1)
    int column = 0, x = 1;     // the column that is being swept, and the direction in x
    int step = 1;              // the direction in y
  };
  struct Sweep {
    int column = 0, y = 0;           // the middle of the sources, from which rows are swept outwards
    IntRange sources;                // planes of the sources
    std::array<IntRange, 2> planes;  // planes with pending rows: [0] upwards in z, [1] downwards
    IntRange columns;                // columns with pending rows
    Plane plane;
    SweepTask task;       // the part that is the same for many rows
    IntRange up, down;    // rows of this plane and column pending in a sweep upwards or downwards in y
    IntRange next, back;  // rows with pending links to the next plane; to the plane before
    IntRange rest;        // rows that may be pending when the sweep is stopped
    std::uint64_t visits = 0, most = 0;
    bool stopped = false;  // the budget ended it
  };
  // With fewer row updates left than this, the queue is used, which takes the nearest rows first.
  static constexpr std::uint64_t kMinSweepBudget = 512;
  struct ConeBox {
    std::array<int, kDirections> steps{};  // voxels from the apex in each direction
    std::array<bool, kDirections> cut{};   // the next voxel is not free
  };

  [[nodiscard]] float* row_at(const WaveArgs& p, RowId row) const noexcept {
    return p.u + static_cast<std::size_t>(row) * kRow;
  }
  // A RowInfo is looked up at its first use, to save memory. All rows of a line in y are looked up together,
  // so that the RowInfo of a row's neighbours in y is known if its own is.
  [[nodiscard]] const RowInfo& info(RowId row) noexcept {
    if (!rows_[row].known) look_up(row);
    return rows_[row];
  }
  void look_up(RowId row) noexcept;
  [[nodiscard]] bool free(VoxelId v) noexcept { return (info(v / kRow).free >> (v % kRow) & 1U) != 0; }
  // `ends`: Mark bits `first` and `last`, for the ends of the row whose links to the next row along x must be
  // relaxed.
  void enqueue(RowId row, std::uint8_t ends = first | last) noexcept;
  void note_pulled(const WaveArgs& p, RowId row) noexcept;
  // Visits at most `most` rows of the queue; the others wait.
  std::uint64_t run_queue(const WaveArgs& p, std::uint64_t most) noexcept;
  void postpone(RowId row, std::uint8_t waves) noexcept;
  void prefetch_around(const WaveArgs& p, RowId row) const noexcept;
  [[nodiscard]] bool has_binding_link(const WaveArgs& p, VoxelId v) const noexcept;
  void relax_neighbours(const WaveArgs& p, RowId row) noexcept;
  Moved relax_within(const WaveArgs& p, RowId row) noexcept;
  void relax_beside(const WaveArgs& p, RowId row, RowId to, int direction) noexcept;
  Moved move_free(const WaveArgs& p, RowId row, const float* required) noexcept;
  Moved relax_within_anchored(const WaveArgs& p, RowId row) noexcept;
  // `u`: the row's displacements, or a copy of them.
  Moved relax_within_by_label(const WaveArgs& p, RowId row, float* u) noexcept;
  void relax_across(const WaveArgs& p, RowId row, RowId to, int direction) noexcept;
  void relax_link(const WaveArgs& p, VoxelId from, VoxelId to, int direction) noexcept;
  [[nodiscard]] IntRange& pending_range(int sense, int column, int z) noexcept;
  void mark_pending(Sweep& sweep, int sense, const std::array<int, 3>& at, std::uint8_t by) noexcept;
  bool start_sweep(const WaveArgs& p, std::span<const Source> sources, Sweep& sweep) noexcept;
  bool sweep(const WaveArgs& p, std::span<const Source> sources, std::uint64_t most,
             std::uint64_t& visits) noexcept;
  void sweep_plane(const WaveArgs& p, Sweep& sweep, int z, int by) noexcept;
  void sweep_column(const WaveArgs& p, Sweep& sweep, int column, int x, const IntRange& span) noexcept;
  void sweep_strip(const WaveArgs& p, Sweep& sweep, int step, const IntRange& span) noexcept;
  bool sweep_beside_anchor(const WaveArgs& p, Sweep& sweep, SweepTask task, RowId row, int y) noexcept;
  void note_swept(Sweep& sweep, RowId row, int y, int count) noexcept;
  void stop_sweep(const WaveArgs& p, Sweep& sweep) noexcept;
  bool cone(const WaveArgs& p, VoxelId apex, std::uint64_t most) noexcept;
  [[nodiscard]] ConeBox cone_box(const WaveArgs& p, VoxelId apex) noexcept;
  [[nodiscard]] bool is_full(const std::array<int, 3>& low, const std::array<int, 3>& high) noexcept;
  void write_cone(const WaveArgs& p, VoxelId apex, const ConeBox& box) noexcept;
  void enqueue_cut_faces(VoxelId apex, const ConeBox& box) noexcept;

  const Lattice& lattice_;
  ChainLimits limits_;
  LazyArray<RowInfo> rows_;  // read through info(), except marks
  std::array<int, 3> free_low_{}, free_high_{};
  bool free_is_box_ = true;  // the free voxels fill the box free_low_ … free_high_
  LazyArray<RowId> ring_;    // the queue; it holds a row at most once
  std::size_t head_ = 0, tail_ = 0;
  RowSet moved_;
  LazyArray<RowId> pulled_, waiting_, taken_;
  std::size_t pulled_count_ = 0, waiting_count_ = 0, taken_count_ = 0;
  LazyArray<std::uint8_t> pulled_by_;     // [row] bit of each wave that must start here from a pulled anchor
  LazyArray<std::uint8_t> pending_;       // [row] Pending bits; 0 between sweeps
  std::vector<IntRange> pending_ranges_;  // [sense][column][z + 1] y of pending rows; empty between sweeps
  // [column][sense in x] y of pending rows in the plane that is being swept
  std::vector<std::array<IntRange, 2>> pending_in_plane_;
  std::vector<Moved> moves_;  // [n] of the strip that is being swept
  std::vector<float> fall_;   // [column][lane] of the cone that is being written
  std::uint64_t work_ = 0, cone_rows_ = 0;
};

inline void ChainWave::enqueue(RowId row, std::uint8_t ends) noexcept {
  std::uint8_t& mark = rows_[row].mark;
  const bool was_queued = (mark & queued) != 0;
  mark |= static_cast<std::uint8_t>(ends | queued);
  if (was_queued) return;
  ring_[tail_] = row;
  tail_ = tail_ + 1 == ring_.size() ? 0 : tail_ + 1;
}

}  // namespace voxel
