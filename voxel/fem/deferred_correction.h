// SPDX-License-Identifier: GPL-3.0-or-later
// The accurate energy as a deferred correction of the links. The load on a voxel is the force of its bricks
// (voxel/fem/hex_element.h) minus the force of the links of their cells.
//
// Deferred correction (Stetter 1978; Trottenberg, Oosterlee & Schüller, Multigrid, section 5.4): with the
// loads fixed, the solver relaxes the links with contact, limits and coarse levels. Then the loads are
// computed again at the new displacements: u ← u − ω·K_links⁻¹·K_bricks·u. The fixed point is the equilibrium
// of the bricks and does not depend on the links. `largest_ratio` bounds the stiffness of a cell's bricks
// relative to its links, and so bounds ω. A momentum term carries a part of each step on to the next (Polyak
// 1964). The solver does not relax the bricks themselves: their smoother and coarse levels would need 27
// blocks of 3×3 per voxel in every pass, and a limit per axis would no longer be a limit of one unknown.
//
// The links respond to the tool within the same tick. The correction follows over the next ticks.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "voxel/fem/hex_forces.h"
#include "voxel/lattice/displacement.h"
#include "voxel/lattice/lattice.h"
#include "voxel/lattice/lazy_array.h"
#include "voxel/lattice/level_stiffness.h"

namespace voxel {

class BrickLoads {
 public:
  explicit BrickLoads(const Lattice& lattice);

  // True if there are loads that this object renews. False without bricks and after leave_to_shadow().
  [[nodiscard]] bool any() const { return share_ > 0.0F; }
  void leave_to_shadow() noexcept { share_ = 0.0F; }
  // Loads whose error is at most `least_N` are not renewed.
  void set_least(float least_N) noexcept { least_N_ = least_N; }

  // Call when voxels of this row moved.
  void look_at(RowId row) noexcept {
    if (any() && (mark_[row] & kMoved) == 0) put(moved_, row, kMoved);
  }
  // Calls look_at() for every row that `other` ever listed.
  void look_at_all_of(const BrickLoads& other) noexcept;
  // Renews the loads of at most `most_rows` rows that are due, and calls `changed(row)` for each row whose
  // loads changed. Returns the number of rows examined.
  template <class Changed>
  std::size_t renew(Displacement& state, std::size_t most_rows, const Changed& changed) noexcept {
    if (!any() || (next_ == due_.count && !begin_round())) return 0;
    std::size_t count = 0;
    for (; count < most_rows && next_ < due_.count; ++count) {
      const RowId row = due_.row[next_++];
      mark_[row] &= static_cast<std::uint8_t>(~kDue);
      if (renew_row(row, state)) changed(row);
    }
    if (next_ == due_.count) end_round();
    return count;
  }
  // Have the loads of the row changed since the last call? Clears the flag.
  bool take_changed(RowId row) noexcept {
    const bool changed = any() && (mark_[row] & kChanged) != 0;
    if (changed) mark_[row] &= static_cast<std::uint8_t>(~kChanged);
    return changed;
  }
  // True if every row that was due when the last round began has been examined.
  [[nodiscard]] bool round_ended() const { return next_ == due_.count; }
  // Largest error of a load in the last complete round (N).
  [[nodiscard]] float unbalanced_N() const { return left_N_; }

  // Loads on the voxels of a row at the present displacements (N): force of the bricks minus force of the
  // links of their cells. Returns false, and leaves `out` unset, if the row lies inside a material without
  // bricks.
  bool loads_of(RowId row, const Displacement& state, std::array<Lanes, 3>& out) const noexcept;

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  // Per material: stiffness of its bricks minus that of the links of their cells.
  struct Kind {
    NodeStencil inside;
    BrickFloats brick;
  };
  struct Rows {
    LazyArray<RowId> row;
    std::size_t count = 0;
  };
  // Bits of mark_. kMoved, kDue, kAgain: the row is in moved_, due_, retry_. kEver: it was ever in one of
  // them. kChanged: its loads changed since take_changed(). kStepped: step_ of the row is not 0.
  static constexpr std::uint8_t kMoved = 1, kDue = 2, kAgain = 4, kEver = 8, kChanged = 16, kStepped = 32;
  using Materials = std::array<std::uint8_t, kRow + 2>;  // of a row, with one voxel beyond each end

  void put(Rows& rows, RowId row, std::uint8_t mark) noexcept {
    mark_[row] |= mark | kEver;
    rows.row[rows.count++] = row;
  }
  bool begin_round() noexcept;
  void end_round() noexcept;
  bool renew_row(RowId row, Displacement& state) noexcept;
  [[nodiscard]] std::uint8_t softer(std::uint8_t a, std::uint8_t b) const noexcept {
    return lattice_.materials()[b].young_Pa < lattice_.materials()[a].young_Pa ? b : a;
  }
  void mixed_loads(RowId row, const NodeField& field, std::array<Lanes, 3>& out) const noexcept;

  const Lattice& lattice_;
  std::vector<std::unique_ptr<Kind>> kind_;  // [material]; null for a material of links
  float share_ = 0.0F;                       // ω; 0: no loads to renew
  float carry_on_ = 0.0F;                    // momentum: fraction of the last step
  std::array<LazyArray<float>, 3> step_;     // [axis][v]: the last step (N)
  float least_N_ = 0.0F, left_N_ = 0.0F, worst_N_ = 0.0F;
  float calm_ = 1.0F;             // factor of share_ and carry_on_; falls while rounds make no progress
  float least_left_N_ = 0.0F;     // least left_N_ since the error last grew by kElsewhere
  int without_gain_ = 0;          // number of rounds without progress
  LazyArray<std::uint8_t> mark_;  // [row]
  Rows moved_, due_, retry_;      // retry_: rows that this round changed
  std::size_t next_ = 0;          // index of the next row in due_
};

}  // namespace voxel
