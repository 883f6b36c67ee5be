// SPDX-License-Identifier: GPL-3.0-or-later
// A soft object's tissue away from the contact, relaxed beside the tick: a second state of the same object,
// which another thread brings nearer to rest while the first is being felt.
//
// They take turns with it, and neither waits for the other:
//   give()   the tick says what changed in the object since the last time;
//   relax()  the other thread goes one whole cycle nearer to equilibrium, the pressed voxels held where they
//            were given, and says what that changed;
//   take()   later, the tick adds that to the object: near the contact at once, or it would see a step go by,
//            or in parts, of which each leaves balanced what is still to come; then, with drain(), the rest,
//            some rows at a time, while the next is relaxed.
// Displacements are linear where no limit is active, so what is found is added to what the tick did
// meanwhile. For that each error has to be the business of one of the two. What was given is the other
// thread's: round the contact it counts as balanced from then on (Relaxation::assign_residual), and the tick
// brings to rest only what it moves itself. With X of that left by the tick, and Y of the other by a cycle,
// what is left is the sum of the two, and never more. (Rejected: both at work on all of it, which leaves X +
// Y - 1. As long as a tool stood still that was never more energy than was given; but it is -1 for all that
// both do well, and a tool held in a brain felt 0 to 0.9 N where 0.14 is right. The replica's rows in place
// of the tick's: there is a step at the seam. Tiles of the object itself for the thread: coarse cells are
// everybody's.)
//
// Coarse cells are not exchanged: each of the two has its own. Nor are changes too small to matter, until all
// is at rest.
//
// Limits hold throughout: what a row cannot follow, by the links to its neighbours as they now are, is left
// out, and what became of it is given the next time.
//
// After a jump of the tool the first results are of wide boxes round the contact, a third of a whole cycle
// each at most: nothing else is nearly as far from rest. They move tissue by spacings, and there a row that
// cannot follow waits until those beside it were added, and then has its turn again. (With one turn each,
// they were lost for the most part. In all results, a brain came 4.8 % of a cell deep into its skull, and
// not 4.5 %.)
//
// Not for tissue that yields, whose rest lengths change too.
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
  // In the object's state. From now on the object notes what is written in it, and has to be relaxed here:
  // relax_background() is for objects without a replica. Allocates; throws std::bad_alloc.
  explicit ShadowObject(SoftObject& object);

  // Has anything moved since it was given, or is not at rest yet? Not while something given is still out.
  [[nodiscard]] static bool wanted(const SoftObject& object) { return !object.relaxation_.idle(); }

  // ---- the tick; none of these allocates, locks or throws ----
  void give(SoftObject& object) noexcept;
  // Once relax() is done and what it found before that is drained: adds what it found near the contact, at
  // once, or the first of so many parts. What of it is still to come stays the other thread's business.
  void take(SoftObject& object, int parts = 1) noexcept;
  [[nodiscard]] bool in_parts() const { return parts_left_ > 0; }
  // The next part; of those that are left, the last.
  void take_part(SoftObject& object, bool last) noexcept;
  // Adds the next `rows` rows of the rest.
  void drain(SoftObject& object, std::size_t rows) noexcept;
  [[nodiscard]] bool drained() const {
    return parts_left_ == 0 && drained_ == found_[taking_].count() && retry_.count() == 0;
  }

  // ---- between the two, the other thread ----
  void relax() noexcept;
  // What relax() found, until it is taken; and, for a session that is played again, the same found at once in
  // place of relax(), which then must not be called any more.
  struct Found {
    std::vector<RowId> rows;
    std::vector<float> values;  // [row][array][lane], as in a parcel
    std::size_t near_count = 0;
    bool far = false, limited = false, at_rest = false;
    double residual_N = 0.0;
    std::vector<glm::dvec3> block_moves;  // as BlockMoves
  };
  [[nodiscard]] Found found() const;
  void replay_result(const Found& found) noexcept;
  [[nodiscard]] std::uint64_t times_relaxed() const { return times_relaxed_; }
  // What the last relax() cost: as many rows, of all levels, as a whole cycle writes in that time.
  [[nodiscard]] std::size_t work() const { return work_; }

  // Displacement of a rest point as it is known here; 0 where none is near. By the thread that relaxes.
  [[nodiscard]] glm::dvec3 displacement_at(const glm::dvec3& rest_point) const noexcept {
    return voxel::displacement_at(lattice_, state_, rest_point);
  }

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  static constexpr std::size_t kAhead = 4;  // rows that are fetched before their turn
  static std::size_t at(RowId row) { return static_cast<std::size_t>(row) * kRow; }

  // Rows of voxels on their way from one thread to the other, one after the other in memory: to fetch what
  // another core wrote costs more than all that is done with it, and least where it stands in a row.
  class RowDelta {
   public:
    // Of each row `arrays` of them, [array][lane].
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
    // Where a row is in it; count() where it is not.
    [[nodiscard]] std::size_t find(RowId row) const { return after_[row] == 0 ? count_ : after_[row] - 1; }
    [[nodiscard]] RowId row(std::size_t n) const { return rows_[n]; }
    [[nodiscard]] const float* values(std::size_t n) const { return values_.data() + floats_ * n; }
    [[nodiscard]] float* values(std::size_t n) { return values_.data() + floats_ * n; }
    // What so many rows take.
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
    LazyArray<std::uint32_t> after_;  // [row] the entries up to its own; 0: it is not in there
    std::size_t count_ = 0;
  };
  // Entries of a parcel that were not added altogether. In turns: in each the last of those before is the
  // first, since what is in the way of one row is most often the one after it.
  class RetryQueue {
   public:
    explicit RetryQueue(std::size_t rows)
        : lists_{LazyArray<std::uint32_t>(rows), LazyArray<std::uint32_t>(rows)}, waits_(rows) {}
    [[nodiscard]] std::size_t count() const { return count_ + next_; }  // that still have a turn
    [[nodiscard]] bool waits(std::size_t n) const { return waits_[n] != 0; }
    void put(std::size_t n) noexcept {
      waits_[n] = 1;
      lists_[of_][count_++] = static_cast<std::uint32_t>(n);
    }
    // One more has its turn; `add(n)` is true where something is left of it for the next, of so many.
    template <class Add>
    void take(int most_turns, const Add& add) noexcept {
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
    [[nodiscard]] int turn() const { return turn_; }  // so many were; 0 where none has one
    void populate() noexcept {
      for (auto& list : lists_) list.populate();
      waits_.populate();
    }
    [[nodiscard]] std::size_t memory_bytes() const {
      return lists_[0].resident_bytes() + lists_[1].resident_bytes() + waits_.resident_bytes();
    }

   private:
    std::array<LazyArray<std::uint32_t>, 2> lists_;
    LazyArray<std::uint8_t> waits_;  // [n]
    std::size_t of_ = 0, count_ = 0, next_ = 0;
    int turn_ = 0;
  };
  struct GivenRole {
    VoxelId v;
    Displacement::Role role;
  };
  struct GivenContact {
    VoxelId v;
    glm::vec3 normal;
  };
  struct GivenObstacle {
    std::uint32_t surface_number;
    Obstacle obstacle;
  };

  // [part without slack] how far it went (m): of these not row by row, in which they could not follow.
  using BlockMoves = std::vector<glm::dvec3>;

  [[nodiscard]] Multigrid& multigrid() { return relaxation_.multigrid(); }
  void note_motion(const SoftObject& object) noexcept;
  void open_given() noexcept;
  void relax_quickly(const ObstacleView& obstacles) noexcept;
  void sort_by_distance() noexcept;
  void pack_changes() noexcept;
  bool pack_row(RowId row, float least_m) noexcept;
  void pack_parts() noexcept;
  void take_parts(SoftObject& object) noexcept;
  void keep_back(RowId row) noexcept;
  void pack_kept_back() noexcept;
  void way_of(SoftObject& object, std::size_t n, float part, RowVector& ways) noexcept;
  bool take_row(SoftObject& object, std::size_t n, float part = 1.0F) noexcept;
  void take_limited_correction(SoftObject& object, std::size_t first, std::size_t last, float part) noexcept;
  void fetch_change_ahead(RowId row) const noexcept;
  void fetch_ahead(SoftObject& object, std::size_t n, bool together) const noexcept;

  const Lattice& lattice_;
  Displacement state_;
  Relaxation relaxation_;
  std::vector<Obstacle> obstacles_;
  std::size_t moving_obstacles_ = 0;
  std::vector<VoxelId> held_;
  std::array<LazyArray<float>, 3> before_;  // [axis][voxel] what is here as the other state knows it
  std::size_t work_ = 0;
  int coarse_first_left_ = 0;      // results to come of wide boxes round the contact
  bool was_coarse_first_ = false;  // the last one was
  int large_motion_left_ = 0;      // results to come that move tissue far
  bool found_far_ = false;         // the last one did
  bool found_limited_ = false;     // in the last one limits held what the tool presses
  bool block_pressed_ = false;     // the tool presses a part without slack
  float least_m_ = 0.0F;           // smaller changes are not passed on
  // Rows whose change waits until all is at rest; some that were passed on since are among them.
  LazyArray<RowId> rows_kept_back_;
  std::size_t kept_back_count_ = 0;
  LazyArray<std::uint8_t> kept_back_;  // [row] 1: it is one of them
  static constexpr int kDistances = 64;
  std::array<std::uint32_t, kDistances + 1> begin_{};  // [distance] of by_distance_
  LazyArray<std::uint8_t> distance_;                   // [n] of the rows in the log
  LazyArray<RowId> by_distance_;                       // these, nearest to the contact first

  // ---- what goes over ----
  RowDelta given_;
  std::array<RowDelta, 2> found_;  // what is drained, and what is found meanwhile: ways, loads of bricks
  std::array<BlockMoves, 2> found_blocks_;  // as found_
  std::vector<GivenRole> given_roles_;
  std::vector<GivenObstacle> given_obstacles_;
  std::vector<VoxelId> given_held_;
  std::vector<GivenContact> given_contacts_;  // of those that slide along the tool
  std::size_t given_pressed_ = 0;             // so many of them, the first, by the tool
  glm::dvec3 given_tool_m_{0.0};              // where that was
  int unsettled_ = 0;                     // results to come in which the contact is brought to rest once more
  bool settle_contact_ = false;           // in this one
  Relaxation::NearRows near_;             // the contact
  std::size_t taking_ = 0, drained_ = 0;  // which of found_, and how many of its rows
  RetryQueue retry_;                      // of these
  bool in_turns_ = false;                 // rows that do not follow have another turn
  bool together_ = false;                 // those near the contact are added together
  std::size_t near_count_ = 0;            // of the other one's: they are near the contact
  int parts_left_ = 0;                    // in which these are still to be added
  bool at_rest_ = true;
  double residual_N_ = 0.0;
  std::uint64_t times_relaxed_ = 0;
};

}  // namespace voxel
