// SPDX-License-Identifier: GPL-3.0-or-later
// Asynchronous relaxation of a soft object: a second state of the same object (its shadow), which another
// thread brings nearer to rest while the tick moves the object itself.
//
// Tick and thread take turns with the shadow, and neither waits for the other:
//
// submit()      the tick hands over the rows that changed since the last submission;
// relax()       the thread runs one whole cycle towards equilibrium, with the pressed voxels at their
//               submitted places, and packs the changes (the result);
// apply_near()  later the tick adds the result's rows near the contact: at once, so that no step is felt, or
//               in parts, while the residual of the parts still to come stays frozen;
// apply_far()   adds the other rows, some a tick, while the thread relaxes the next submission.
//
// Without active limits displacements are linear, so a result can be added to the motion that the tick made
// meanwhile. Each residual must then be owned by exactly one of the two solvers. The submitted residual
// belongs to the thread. Around the contact it counts as frozen from then on (Relaxation::assign_residual),
// and the tick relaxes only the residual of its own motion. If the tick leaves X of its own residual and a
// cycle of the thread leaves Y of the thread's residual, X + Y is left in total.
//
// Coarse cells are not exchanged: the object and the shadow have separate ones. Changes too small to matter
// are deferred until all is at rest.
//
// Limits are never violated: the part of a row's motion that its links forbid is dropped, and the next
// submission carries the actual state. After a jump of the tool the first results are of cycles on large
// boxes around the contact (coarse levels first). These move tissue by spacings, so rows that could not
// follow are queued and tried again (RetryQueue).
//
// This is not for tissue with plasticity, whose rest lengths change too.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "voxel/lattice/displacement.h"
#include "voxel/lattice/lazy_array.h"
#include "voxel/object/soft_object.h"
#include "voxel/relaxation/relaxation.h"

namespace voxel {

class ShadowObject {
 public:
  // Starts in the object's state. From now on the object logs its changes, and only the shadow relaxes it:
  // relax_background() is for objects without a shadow. Allocates; throws std::bad_alloc.
  explicit ShadowObject(SoftObject& object);

  // Has anything moved since the last submission, or is the object not at rest? Ask it only when no
  // submission is out.
  [[nodiscard]] static bool wanted(const SoftObject& object) { return !object.relaxation_.idle(); }

  // ---- the tick; none of these allocates, locks or throws ----
  void submit(SoftObject& object) noexcept;
  // Call when relax() is done and the previous result is fully applied. Adds the change of the rows near the
  // contact, whole or the first of `parts` equal parts. The residual of parts still to come stays frozen.
  void apply_near(SoftObject& object, int parts = 1) noexcept;
  [[nodiscard]] bool in_parts() const { return parts_left_ > 0; }
  // Adds the next part, or all that are left (`last`).
  void apply_part(SoftObject& object, bool last) noexcept;
  // Adds the next `rows` rows that are not near the contact.
  void apply_far(SoftObject& object, std::size_t rows) noexcept;
  [[nodiscard]] bool all_applied() const {
    return parts_left_ == 0 && rows_applied_ == results_[applying_].count() && retry_.count() == 0;
  }

  // ---- the other thread, between submit() and apply_near() ----
  void relax() noexcept;
  // The result of relax() until it is applied. When a session is replayed, replay_result() installs a
  // recorded result. From then on relax() must not be called.
  struct Result {
    std::vector<RowId> rows;
    std::vector<float> values;  // [row][array][lane], as in a RowDelta
    std::size_t near_count = 0;
    bool large_motion = false, at_limits = false, at_rest = false;
    double residual_N = 0.0;
    std::vector<glm::dvec3> block_moves;  // as BlockMoves
  };
  [[nodiscard]] Result result() const;
  void replay_result(const Result& result) noexcept;
  [[nodiscard]] std::uint64_t times_relaxed() const { return times_relaxed_; }
  // Cost of the last relax(), as the number of rows (on all levels) that a whole cycle writes in the same
  // time.
  [[nodiscard]] std::size_t work() const { return work_; }

  // Displacement of a rest point in the shadow's state; 0 if no voxel is near. For the thread that relaxes.
  [[nodiscard]] glm::dvec3 displacement_at(const glm::dvec3& rest_point) const noexcept {
    return voxel::displacement_at(lattice_, state_, rest_point);
  }

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  static constexpr std::size_t kAhead = 4;  // rows to prefetch ahead
  static std::size_t at(RowId row) { return static_cast<std::size_t>(row) * kRow; }

  // Rows on their way from one thread to the other. They are contiguous in memory, because fetching data that
  // another core wrote costs more than adding the rows.
  class RowDelta {
   public:
    // Stores `arrays` arrays per row: [array][lane].
    explicit RowDelta(std::size_t rows, std::size_t arrays = 3)
        : floats_(arrays * kRow), rows_(rows), values_(rows * floats_), after_(rows) {}
    void clear() noexcept {
      while (count_ > 0) drop_last();
    }
    [[nodiscard]] float* add(RowId row) noexcept {
      rows_[count_] = row;
      after_[row] = static_cast<std::uint32_t>(count_ + 1);
      return values_.data() + floats_ * count_++;
    }
    void drop_last() noexcept { after_[rows_[--count_]] = 0; }
    [[nodiscard]] std::size_t count() const { return count_; }
    // Index of a row; count() if the row is not in this RowDelta.
    [[nodiscard]] std::size_t find(RowId row) const { return after_[row] == 0 ? count_ : after_[row] - 1; }
    [[nodiscard]] RowId row(std::size_t n) const { return rows_[n]; }
    [[nodiscard]] const float* values(std::size_t n) const { return values_.data() + floats_ * n; }
    [[nodiscard]] float* values(std::size_t n) { return values_.data() + floats_ * n; }
    // Populates the memory for this many rows.
    void populate(std::size_t rows) noexcept {
      rows_.populate();
      values_.populate(rows * floats_, {true});
      after_.populate();
    }
    [[nodiscard]] std::size_t memory_bytes() const {
      return rows_.resident_bytes() + values_.resident_bytes() + after_.resident_bytes();
    }

   private:
    std::size_t floats_;
    LazyArray<RowId> rows_;
    LazyArray<float> values_;
    LazyArray<std::uint32_t> after_;  // [row] 1 + index; 0: not in this RowDelta
    std::size_t count_ = 0;
  };
  // Entries of a RowDelta that were only partly added. They are tried again in turns, each turn in reverse
  // order: a row is most often blocked by the row after it.
  class RetryQueue {
   public:
    explicit RetryQueue(std::size_t rows)
        : lists_{LazyArray<std::uint32_t>(rows), LazyArray<std::uint32_t>(rows)}, waits_(rows) {}
    [[nodiscard]] std::size_t count() const { return count_ + next_; }  // entries with a turn left
    [[nodiscard]] bool waits(std::size_t n) const { return waits_[n] != 0; }
    void put(std::size_t n) noexcept {
      waits_[n] = 1;
      lists_[of_][count_++] = static_cast<std::uint32_t>(n);
    }
    // Tries one more entry. `add(n)` returns true if something is left for the next turn. There are at most
    // `most_turns` turns.
    template <class Add>
    void retry(int most_turns, const Add& add) noexcept {
      const std::uint32_t n = lists_[of_][--count_];
      if (add(n)) {
        lists_[1 - of_][next_++] = n;
      } else {
        waits_[n] = 0;
      }
      if (count_ > 0) return;
      of_ = 1 - of_;
      std::swap(count_, next_);
      if (++turn_ == most_turns || count_ == 0) clear();
    }
    void clear() noexcept {
      for (std::size_t i = 0; i < count_; ++i) waits_[lists_[of_][i]] = 0;
      for (std::size_t i = 0; i < next_; ++i) waits_[lists_[1 - of_][i]] = 0;
      count_ = next_ = 0;
      turn_ = 0;
    }
    [[nodiscard]] int turn() const { return turn_; }  // turns begun; 0 if no entry is left
    void populate() noexcept {
      for (auto& list : lists_) list.populate();
      waits_.populate();
    }
    [[nodiscard]] std::size_t memory_bytes() const {
      return lists_[0].resident_bytes() + lists_[1].resident_bytes() + waits_.resident_bytes();
    }

   private:
    std::array<LazyArray<std::uint32_t>, 2> lists_;
    LazyArray<std::uint8_t> waits_;  // [n] 1: entry n is queued
    std::size_t of_ = 0, count_ = 0, next_ = 0;
    int turn_ = 0;
  };
  struct SubmittedRole {
    VoxelId v;
    Displacement::Role role;
  };
  struct SubmittedContact {
    VoxelId v;
    glm::vec3 normal;
  };
  struct SubmittedObstacle {
    std::uint32_t surface_number;
    Obstacle obstacle;
  };

  // [block] motion of a rigid block (m): its voxels could not follow row by row.
  using BlockMoves = std::vector<glm::dvec3>;

  [[nodiscard]] Multigrid& multigrid() { return relaxation_.multigrid(); }
  void note_motion(const SoftObject& object) noexcept;
  void read_submission() noexcept;
  void relax_coarse_first(const ObstacleView& obstacles) noexcept;
  void sort_by_distance() noexcept;
  void pack_changes() noexcept;
  bool pack_row(RowId row, float least_m) noexcept;
  void pack_block_moves() noexcept;
  void apply_block_moves(SoftObject& object) noexcept;
  void defer_row(RowId row) noexcept;
  void pack_deferred() noexcept;
  void take_delta(SoftObject& object, std::size_t n, float part, RowVector& ways) noexcept;
  bool apply_row(SoftObject& object, std::size_t n, float part = 1.0F) noexcept;
  void apply_together(SoftObject& object, std::size_t first, std::size_t last, float part) noexcept;
  void fetch_change_ahead(RowId row) const noexcept;
  void fetch_ahead(SoftObject& object, std::size_t n, bool together) const noexcept;

  const Lattice& lattice_;
  Displacement state_;
  Relaxation relaxation_;
  std::vector<Obstacle> obstacles_;
  std::size_t moving_obstacles_ = 0;
  std::vector<VoxelId> held_;
  std::array<LazyArray<float>, 3> before_;  // [axis][voxel] submitted displacement plus packed changes
  std::size_t work_ = 0;
  int coarse_first_left_ = 0;      // results still to come with coarse levels first
  bool was_coarse_first_ = false;  // the last result had coarse levels first
  int large_motion_left_ = 0;      // results still to come that move tissue far
  bool large_motion_ = false;      // the last result moves tissue far
  bool at_limits_ = false;         // active limits held pressed voxels in the last cycle
  bool block_pressed_ = false;     // the tool presses a rigid block
  float least_m_ = 0.0F;           // smaller changes are deferred
  // Rows whose change is deferred until all is at rest. Some of them may have been passed on since.
  LazyArray<RowId> deferred_rows_;
  std::size_t deferred_count_ = 0;
  LazyArray<std::uint8_t> deferred_;                   // [row] 1: in deferred_rows_
  static constexpr int kDistances = 64;                // greater distances count as kDistances − 1
  std::array<std::uint32_t, kDistances + 1> begin_{};  // [distance] first of by_distance_
  LazyArray<std::uint8_t> distance_;  // [n] distance of the nth row in the log from the contact, in rows
  LazyArray<RowId> by_distance_;      // rows of the log, nearest to the contact first

  // ---- data of the exchange ----
  RowDelta submitted_;
  std::array<RowDelta, 2> results_;  // result being applied, and the next one; motion and loads of bricks
  std::array<BlockMoves, 2> block_moves_;  // [as results_]
  std::vector<SubmittedRole> submitted_roles_;
  std::vector<SubmittedObstacle> submitted_obstacles_;
  std::vector<VoxelId> submitted_held_;
  std::vector<SubmittedContact> submitted_contacts_;  // contacts that slide on the tool
  std::size_t submitted_pressed_ = 0;  // number of leading voxels of submitted_held_ that the tool presses
  glm::dvec3 submitted_tool_m_{0.0};   // centre of the tool at the submission
  int unsettled_ = 0;                  // results still to come that relax the contact once more
  bool settle_contact_ = false;        // the present result relaxes the contact once more
  Relaxation::NearRows near_;          // rows of the contact
  std::size_t applying_ = 0, rows_applied_ = 0;  // index into results_; rows applied of that result
  RetryQueue retry_;                             // entries of that result to try again
  bool retries_rows_ = false;                    // rows that could not follow are tried again
  bool together_ = false;                        // rows near the contact are applied together
  std::size_t near_count_ = 0;                   // number of rows near the contact in the result packed last
  int parts_left_ = 0;                           // parts of the rows near the contact still to be applied
  bool at_rest_ = true;
  double residual_N_ = 0.0;
  std::uint64_t times_relaxed_ = 0;
};

}  // namespace voxel
