// SPDX-License-Identifier: GPL-3.0-or-later
// One wave on one axis: everything that sources raise, or everything that they lower.
//
// Raising, a voxel goes to the greatest of u(neighbour) − limit over its links, and hands that on: a longest
// path to the sources, whose end does not depend on the order of visits. Three ways there:
// - Where all limits of a direction are equal and the box that a source reaches is full, the distance is the
//   sum of steps times limits, and the source's cone is written row by row (look-ahead in mass).
// - Elsewhere, and beyond such a box, rows stand in a queue; a row that changed asks the rows around it, all
//   voxels of a row at once (a label-correcting shortest path, in vectors).
// - Rows with anchors, voxel by voxel: an anchor is asked and does not move.
//
// A wave that may not visit as many rows as it needs stops, and the rows that were still to ask wait:
// whatever link is violated has the end that must ask in one of them, so that a later wave from these rows,
// raising and lowering, finds and mends them all, whatever else moved meanwhile. Dropped, they would be
// violated for good.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "voxel/chain/limits.h"
#include "voxel/chain/sweep_kernel.h"
#include "voxel/chain/row_kernels.h"
#include "voxel/lattice/lattice.h"
#include "voxel/lattice/lazy_array.h"
#include "voxel/chain/row_set.h"

namespace voxel {

class ChainWave {
 public:
  explicit ChainWave(const Lattice& lattice);

  static constexpr std::uint64_t kUnlimited = ~std::uint64_t{0};

  // Looks all rows up now, not when a wave first comes to them.
  void prepare_all() noexcept;

  // Forgets what moved and which anchors were pulled; rows that wait go on waiting.
  void begin() noexcept;

  struct Source {
    float u;  // (unit: meter)
    VoxelId v;
  };
  // All waves return the row updates they took, `most` at most (and one).
  //
  // Moves all sources to their u, the way they go, and what hangs on them. In `u` (displacements, [v]) they
  // are still where they were, and no link is violated but those of rows that wait. `margin`: see
  // row_kernels.h. Sorts the sources, so that the result does not depend on their order in any bit.
  std::uint64_t spread(float* u, int axis, Way way, std::span<Source> sources, float margin,
                       std::uint64_t most = kUnlimited) noexcept;
  // The rows where anchors were pulled, on this axis and the other way, ask what is around them to give way.
  std::uint64_t spread_from_pulled(float* u, int axis, Way way, float margin,
                                   std::uint64_t most = kUnlimited) noexcept;
  // Deals with the rows that wait: take_waiting(), a wave for each axis and way, and put_back() of what these
  // left.
  void take_waiting() noexcept;
  std::uint64_t spread_from_taken(float* u, int axis, Way way, float margin,
                                  std::uint64_t most = kUnlimited) noexcept;
  void put_back() noexcept;

  void note_moved(RowId row) noexcept { moved_.add(row); }
  // Rows that moved since begin(), each once; no order is promised.
  [[nodiscard]] const RowRuns& moved_rows() const { return moved_; }
  [[nodiscard]] std::span<const RowId> waiting_rows() const { return {waiting_.data(), waiting_count_}; }
  [[nodiscard]] bool pulled_any() const { return pulled_count_ > 0; }
  [[nodiscard]] std::uint64_t work() const { return work_; }  // row updates since begin()
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  static constexpr std::uint64_t kConeRows = 8;  // of a cone take about as long as one update of a row
  // first, last: since the row was last looked at, its first voxel moved, its last one.
  enum Mark : std::uint8_t { first = kFirstMoved, last = kLastMoved, queued = 8 };
  struct Pass {  // one wave
    float* u = nullptr;
    int axis = 0;
    Way way = Way::raise;
    float margin = 0.0F;
    ChainLimits::Pass limits;
    std::array<double, kWays> limit{};  // where all links of a direction have the same
  };
  static constexpr std::uint8_t kListed = 64;  // in waiting_
  [[nodiscard]] static std::uint8_t wave_bit(int axis, Way way) {
    return static_cast<std::uint8_t>(1U << (2 * axis + (way == Way::raise ? 0 : 1)));
  }
  struct Span {  // of whole numbers, both included; empty: low > high
    int low = std::numeric_limits<int>::max(), high = -1;
    void add(int n) noexcept;
    void add(const Span& other) noexcept;
    [[nodiscard]] bool empty() const { return low > high; }
  };
  struct Plane {               // that is being swept
    const float* u = nullptr;  // displacements, of the whole lattice
    int at = 0, z = -1;        // it, and where to (-1 or 1)
    int column = 0, x = 1;     // a column of it, and where to
    int step = 1;              // where to in y
  };
  struct Sweep {
    int column = 0, y = 0;       // from where outwards
    Span sources;                // planes where they stand
    std::array<Span, 2> planes;  // that are asked from below, from above
    Span columns;                // in which any row is
    Plane plane;
    Pull task;        // what is the same for many rows
    Span up, down;    // rows of this plane and column that are asked from below and above (in y)
    Span next, back;  // rows that ask the next plane, and the one before
    Span rest;        // rows among which some are still asked, when it was stopped
    std::uint64_t visits = 0, most = 0;
    bool stopped = false;  // by its budget
  };
  static constexpr std::uint64_t kLeastSwept = 512;  // row updates; with fewer left, the nearest first
  struct Box {                                       // voxels from an apex, each way
    std::array<int, kWays> steps{};
    std::array<bool, kWays> cut{};  // ends at something that is no free voxel
  };

  [[nodiscard]] float* row_at(const Pass& p, RowId row) const noexcept {
    return p.u + static_cast<std::size_t>(row) * kRow;
  }
  // What is known of a row, which is looked up when it is first asked for: written for all rows, it took as
  // much memory as a quarter of the labels. All rows of a line in y are looked up together: what is known of
  // one is known of those.
  [[nodiscard]] const RowInfo& info(RowId row) noexcept {
    if (!rows_[row].known) look_up(row);
    return rows_[row];
  }
  void look_up(RowId row) noexcept;
  [[nodiscard]] bool free(VoxelId v) noexcept { return (info(v / kRow).free >> (v % kRow) & 1U) != 0; }
  // `ends`: first and last, those to be looked at beyond.
  void enqueue(RowId row, std::uint8_t ends = first | last) noexcept;
  void note_pulled(const Pass& p, RowId row) noexcept;
  // Visits at most `most` rows of the queue; the rest waits.
  std::uint64_t run(const Pass& p, std::uint64_t most) noexcept;
  void wait(RowId row, std::uint8_t waves) noexcept;
  void fetch_around(const Pass& p, RowId row) const noexcept;
  [[nodiscard]] bool asks(const Pass& p, VoxelId v) const noexcept;
  void ask_around(const Pass& p, RowId row) noexcept;
  Moved ask_along(const Pass& p, RowId row) noexcept;
  void ask_beside(const Pass& p, RowId row, RowId to, int direction) noexcept;
  Moved move_free(const Pass& p, RowId row, const float* asked) noexcept;
  Moved ask_along_anchors(const Pass& p, RowId row) noexcept;
  Moved ask_along_labels(const Pass& p, RowId row, float* u) noexcept;  // its values, or a copy of them
  void ask_across(const Pass& p, RowId row, RowId to, int direction) noexcept;
  void ask_voxel(const Pass& p, VoxelId from, VoxelId to, int direction) noexcept;
  [[nodiscard]] Span& asked_span(int way, int column, int z) noexcept;
  void ask_row(Sweep& sweep, int way, const std::array<int, 3>& at, std::uint8_t by) noexcept;
  bool begin_sweep(const Pass& p, std::span<const Source> sources, Sweep& sweep) noexcept;
  bool sweep(const Pass& p, std::span<const Source> sources, std::uint64_t most,
             std::uint64_t& visits) noexcept;
  void sweep_plane(const Pass& p, Sweep& sweep, int z, int by) noexcept;
  void sweep_rows(const Pass& p, Sweep& sweep, int column, int x, const Span& span) noexcept;
  void pull_rows(const Pass& p, Sweep& sweep, int step, const Span& span) noexcept;
  bool pull_by_anchor(const Pass& p, Sweep& sweep, Pull task, RowId row, int y) noexcept;
  void note_pulled(Sweep& sweep, RowId row, int y, int count) noexcept;
  void leave_sweep(const Pass& p, Sweep& sweep) noexcept;
  bool cone(const Pass& p, VoxelId apex, std::uint64_t most) noexcept;
  [[nodiscard]] Box reach(const Pass& p, VoxelId apex) noexcept;
  [[nodiscard]] bool full(const std::array<int, 3>& low, const std::array<int, 3>& high) noexcept;
  void write_cone(const Pass& p, VoxelId apex, const Box& box) noexcept;
  void enqueue_cut_faces(VoxelId apex, const Box& box) noexcept;

  const Lattice& lattice_;
  ChainLimits limits_;
  LazyArray<RowInfo> rows_;  // read by info(), but for the marks
  std::array<int, 3> free_low_{}, free_high_{};
  bool free_is_box_ = true;  // the free voxels fill that box
  LazyArray<RowId> ring_;    // queue; a row stands in it at most once
  std::size_t head_ = 0, tail_ = 0;
  RowRuns moved_;
  LazyArray<RowId> pulled_, waiting_, taken_;
  std::size_t pulled_count_ = 0, waiting_count_ = 0, taken_count_ = 0;
  LazyArray<std::uint8_t> pulled_by_;  // [row] bit of each wave that is to ask here for its anchors' sake
  LazyArray<std::uint8_t> asked_;      // [row] Asked bits; 0 between sweeps
  std::vector<Span> asked_spans_;      // [way][column][z + 1] rows among which some are; empty between sweeps
  std::vector<std::array<Span, 2>> in_plane_;  // [column] likewise, of the plane that is being swept
  std::vector<Moved> moves_;                   // [n] of rows that are being swept
  std::vector<float> fall_;                    // [column][lane] of the cone that is being written
  std::uint64_t work_ = 0, cone_rows_ = 0;
};

inline void ChainWave::enqueue(RowId row, std::uint8_t ends) noexcept {
  std::uint8_t& mark = rows_[row].mark;
  const bool waited = (mark & queued) != 0;
  mark |= static_cast<std::uint8_t>(ends | queued);
  if (waited) return;
  ring_[tail_] = row;
  tail_ = tail_ + 1 == ring_.size() ? 0 : tail_ + 1;
}

}  // namespace voxel
