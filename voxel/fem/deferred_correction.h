// SPDX-License-Identifier: GPL-3.0-or-later
// The accurate energy in a lattice whose solver knows links: what its bricks (voxel/fem/hex_element.h) pull
// at a voxel beyond what the links of their cells do, as a load on that voxel.
//
// Deferred correction (Stetter 1978; Trottenberg, Oosterlee & Schüller, Multigrid, section 5.4): with the
// load kept, links come to rest by everything that knows links - contact, limits, coarse levels -, then the
// load is found anew where they are, u ← u − ω·K_links⁻¹·K_bricks·u. It ends where the bricks are at rest,
// whatever the links are. A cell's bricks are at most `largest_ratio` times as stiff as its links, which says
// how large ω may be; a part of each step is carried on to the next (without, a tool held in layers of ν 0.45
// came to rest half as fast). (Rejected: a smoother and coarse levels of bricks: 27 blocks of 3×3 a voxel in
// every pass of the tick, and limits per axis would no longer be limits of one unknown.)
//
// So a tick feels links at once, within some tenths right, and the rest of the way as results come.
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

  // Is there anything to renew here? Not where another does it.
  [[nodiscard]] bool any() const { return share_ > 0.0F; }
  void leave_to_another() noexcept { share_ = 0.0F; }
  // Loads that are less wrong than this are left alone.
  void set_least(float least_N) noexcept { least_N_ = least_N; }

  // Voxels of this row moved.
  void look_at(RowId row) noexcept {
    if (any() && (mark_[row] & kMoved) == 0) put(moved_, row, kMoved);
  }
  // Every row that `other` ever looked at.
  void look_at_all_of(const BrickLoads& other) noexcept;
  // Renews the loads of at most so many rows, of each of which voxels moved once, `changed(row)` for each
  // that changed. Returns how many it looked at.
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
  // Whether its loads changed since this was last asked.
  bool take_changed(RowId row) noexcept {
    const bool changed = any() && (mark_[row] & kChanged) != 0;
    if (changed) mark_[row] &= static_cast<std::uint8_t>(~kChanged);
    return changed;
  }
  // All that was due when the last round began was looked at.
  [[nodiscard]] bool round_ended() const { return next_ == due_.count; }
  // How wrong the worst was when the last whole round looked at it (N).
  [[nodiscard]] float unbalanced_N() const { return left_N_; }

  // What bricks pull the voxels of a row with beyond what the links of their cells do, where those are now
  // (N). False: nothing.
  bool loads_of(RowId row, const Displacement& state, std::array<Lanes, 3>& out) const noexcept;

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  // Of a material: its bricks less the links of their cells.
  struct Kind {
    NodeStencil inside;
    BrickFloats brick;
  };
  struct Rows {
    LazyArray<RowId> row;
    std::size_t count = 0;
  };
  static constexpr std::uint8_t kMoved = 1, kDue = 2, kAgain = 4, kEver = 8, kChanged = 16, kStepped = 32;
  using Materials = std::array<std::uint8_t, kRow + 2>;  // of a row, and the voxels beyond its ends

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
  std::vector<std::unique_ptr<Kind>> kind_;  // [material], null where that is of links
  float share_ = 0.0F;                       // ω; 0: nothing to renew
  float carry_on_ = 0.0F;                    // of the last step
  std::array<LazyArray<float>, 3> step_;     // [axis][v] that (N)
  float least_N_ = 0.0F, left_N_ = 0.0F, worst_N_ = 0.0F;
  float calm_ = 1.0F;             // of the share: less where rounds do not gain
  float least_left_N_ = 0.0F;     // since the contact was last somewhere else
  int without_gain_ = 0;          // rounds
  LazyArray<std::uint8_t> mark_;  // [row]
  Rows moved_, due_, retry_;      // retry_: still wrong when they were looked at in this round
  std::size_t next_ = 0;          // of due_
};

}  // namespace voxel
