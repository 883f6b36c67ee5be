// SPDX-License-Identifier: GPL-3.0-or-later
// A soft object's tissue away from the contact, relaxed beside the tick: a second state of the same object,
// which another thread brings nearer to rest while the first is being felt.
//
// They take turns with it, and neither waits for the other:
//   give()   the tick says what changed in the object since the last time;
//   relax()  the other thread goes one whole cycle nearer to equilibrium, the pressed voxels held where they
//            were given, and says what that changed;
//   take()   later, the tick adds that to the object, some rows at a time.
// Everything in it is linear where no limit is active: displacements, what coarse cells hold, what they have
// told. So what is taken is added, row by row, to what the tick did meanwhile round the contact: with X and Y
// the shares of the error that the one and the other leave (0 <= X, Y <= 1 in the energy's metric, and
// symmetric), what is left is X + Y - 1, between -1 and 1, and the sum never has more energy than what was
// given. Rows that the tick left alone become the replica's to the last bit. (Putting the replica's rows in
// place of the tick's was rejected: at the seam between the two there is a step. So was giving the thread
// tiles of the object itself: coarse cells are everybody's.)
//
// Limits hold throughout: what a row cannot follow, by the links to its neighbours as they now are, is
// refused and taken back from the cells above it.
//
// Not for tissue that yields, whose rest lengths change too.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "voxel/displacement.h"
#include "voxel/lazy_array.h"
#include "voxel/relaxation.h"
#include "voxel/soft_object.h"

namespace voxel {

class Replica {
 public:
  // In the object's state. From now on the object notes what is written in it, and has to be relaxed here:
  // relax_background() is for objects without a replica. Allocates; throws std::bad_alloc.
  explicit Replica(SoftObject& object);

  // Has anything moved that is not at rest yet?
  [[nodiscard]] static bool wanted(const SoftObject& object) { return !object.asleep(); }

  // ---- the tick; none of these allocates, locks or throws ----
  void give(SoftObject& object) noexcept;
  // Adds the next `rows` rows of what relax() changed; true when that was all of it.
  bool take(SoftObject& object, std::size_t rows) noexcept;

  // ---- between the two, the other thread ----
  void relax() noexcept;
  // Rows, of all levels, that the last relax() wrote: what it cost, in counted work.
  [[nodiscard]] std::size_t work() const { return work_; }

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  // Rows on their way from one thread to the other, one after the other in memory: to fetch what another core
  // wrote costs more than all that is done with it, and least where it stands in a row.
  class Parcel {
   public:
    explicit Parcel(Multigrid& multigrid);
    void clear() noexcept { count_ = filled_ = 0; }
    // Room for another row: [field][lane] of a coarse one, [axis][lane] of voxels.
    [[nodiscard]] float* add(int level, RowId row) noexcept;
    void drop_last() noexcept { filled_ = entries_[--count_].begin; }

    struct Entry {
      std::uint64_t begin;
      RowId row;
      std::uint32_t level;
    };
    [[nodiscard]] std::size_t count() const { return count_; }
    [[nodiscard]] const Entry& entry(std::size_t n) const { return entries_[n]; }
    [[nodiscard]] const float* values(const Entry& entry) const { return values_.data() + entry.begin; }
    void populate() noexcept {
      entries_.populate();
      values_.populate();
    }
    [[nodiscard]] std::size_t memory_bytes() const {
      return entries_.resident_bytes() + values_.resident_bytes();
    }

   private:
    LazyArray<Entry> entries_;
    LazyArray<float> values_;
    std::size_t count_ = 0, filled_ = 0;
  };
  struct GivenRole {
    VoxelId v;
    Displacement::Role role;
  };
  struct GivenObstacle {
    std::uint32_t surface_number;
    Obstacle obstacle;
  };

  [[nodiscard]] Multigrid& multigrid() { return relaxation_.multigrid(); }
  [[nodiscard]] static std::size_t fields(int level) { return level == 0 ? 3 : Multigrid::kFields; }
  // Where a field of the rows of a level is, in `state` and its multigrid.
  [[nodiscard]] static LazyArray<float>& field(Displacement& state, Multigrid& multigrid, int level,
                                               std::size_t which) {
    return level == 0 ? state.u[which] : multigrid.field(level, which);
  }
  [[nodiscard]] LazyArray<float>& before(int level, std::size_t which) {
    return before_[static_cast<std::size_t>(level)][which];
  }
  void open_given() noexcept;
  void pack_changes() noexcept;
  bool pack_row(int level, RowId row) noexcept;
  void take_cells(Multigrid& to, const Parcel::Entry& entry) noexcept;
  void take_voxels(SoftObject& object, const Parcel::Entry& entry) noexcept;

  const Lattice& lattice_;
  Displacement state_;
  Relaxation relaxation_;
  std::vector<Obstacle> obstacles_;
  std::vector<VoxelId> held_;
  // [level][field][row, lane] what is here as the other state knows it.
  std::vector<std::array<LazyArray<float>, Multigrid::kFields>> before_;
  std::size_t work_ = 0;
  float least_m_ = 0.0F, least_N_ = 0.0F;  // smaller changes are not passed on

  // ---- what goes over ----
  Parcel given_, found_;
  std::vector<GivenRole> given_roles_;
  std::vector<GivenObstacle> given_obstacles_;
  std::vector<VoxelId> given_held_;
  std::size_t taken_ = 0;
  bool at_rest_ = true;
  Relaxation::Progress progress_;
};

}  // namespace voxel
