// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/multigrid.h"

#include <algorithm>
#include <cmath>

namespace voxel {
namespace {

constexpr int kMaxLevels = 10;
constexpr int kSmallest = 3;       // cells across the coarsest level
constexpr int kWrittenAtOnce = 3;  // from this level on springs are written out on construction
// An anchor counts for so many: where limits act, a cycle gave back 1.4 times the energy that it found when
// it counted for one. From four on none comes back.
constexpr int kAnchored = 12;
constexpr std::size_t kMaxBalanced = 4096;  // rows; the contact of a tool has some hundred
constexpr std::size_t kMaxStopped = 65536;  // cells of all levels stopped at a time; more move a little
// A cycle over a held disc of 2, 4, 8, 16 or 24 spacings' radius leaves 0.5, 0.5, 0.5, 0.4 and 0.6 of what it
// found; with kSide 1.4, all that statics asks for, the layer under a wide one swung (−0.9 at 8 spacings).
constexpr float kDisc = 0.5F, kSide = 28.0F;

// How hard n held voxels hold the cell of size³ they are in, in units of all springs of the cell: few of them
// as a disc on a half-space, 4·κ·a with a = h·sqrt(n/π); a whole side of them as the fine links under it do
// before sweeps have reached the cell's depth.
float hold_of(float n, float size) {
  const float covered = std::sqrt(n) / size;
  return (kDisc + kSide * covered) * covered;
}

}  // namespace

Multigrid::Multigrid(const Lattice& lattice) : lattice_(lattice), tiles_(lattice.grid()), bricks_(lattice) {
  for (AxisLimits& axis : yield_limits_) {
    for (std::size_t d = 0; d < 3; ++d) {
      axis.high[d] = lattice.first_yield_m(static_cast<int>(d));
      axis.low[d] = -axis.high[d];
    }
  }
  levels_.reserve(kMaxLevels);
  while (levels() < kMaxLevels) {
    Level level;
    const Couplings* finer = levels_.empty() ? nullptr : levels_.back().couplings.get();
    level.couplings = std::make_unique<Couplings>(lattice, finer);
    const Grid& g = level.couplings->grid();
    if (finer != nullptr) {
      for (auto* arrays : {&level.value, &level.told, &level.load}) {
        for (auto& array : *arrays) array = LazyArray<float>(g.size());
      }
      for (auto& axis : level.held) axis = LazyArray<std::uint32_t>(g.size());
      for (auto& axis : level.hold) axis = LazyArray<float>(g.size());
      level.row_held = LazyArray<std::uint16_t>(g.rows());
    }
    level.stopped = LazyArray<std::uint8_t>(g.size());
    level.flags = LazyArray<std::uint8_t>(g.rows());
    levels_.push_back(std::move(level));
    // One coarse level at least: it is where residuals are measured.
    if (levels() > 1 && *std::max_element(g.dims.begin(), g.dims.end()) <= kSmallest) break;
  }
  for (int l = kWrittenAtOnce; l < levels(); ++l) prepare_level(l);
  hats_ = Hats(lattice.grid());
  held_.reserve(lattice.surface().size());
  supported_ = LazyArray<HeldParts>(lattice.size());
  row_supported_ = LazyArray<std::uint8_t>(lattice.grid().rows());
  stopped_.reserve(kMaxStopped);
  hold_anchored();
}

void Multigrid::prepare_level(int level) noexcept {
  const Grid& g = grid(level);
  for (int c = 1; c + 1 < g.columns; ++c) {
    for (int k = 0; k < g.dims[2]; ++k) {
      for (int j = 0; j < g.dims[1]; ++j) prepare(level, g.row(c, j, k));
    }
  }
}

void Multigrid::prepare_all() noexcept {
  for (int l = 0; l < levels(); ++l) {
    prepare_level(l);
    Level& level = at(l);
    for (auto* arrays : {&level.value, &level.told, &level.load}) {
      for (auto& array : *arrays) array.populate();
    }
    level.stopped.populate();
    level.flags.populate();
  }
}

// Marks a row and the rows beside it.
void Multigrid::spread(int level, RowId row, std::uint8_t flags) noexcept {
  Level& l = at(level);
  const Grid& g = l.couplings->grid();
  for (const RowId r : {row, row - 1, row + 1, row - g.row_z, row + g.row_z, row - g.row_x, row + g.row_x})
    l.flags[r] |= flags;
  if (level == 0 && (flags & active) != 0) tiles_.stir(g.row_coordinates(row));
}

// A row was moved by as much. What is too little for a sweep is still passed on: a small force on each of
// many voxels is a large one on the cell that holds them, four times as large on each level.
void Multigrid::note_change(int level, RowId row, float change) noexcept {
  if (change <= passed_on_m()) return;
  if (level == 0) bricks_.look_at(row);
  spread(level, row, change > quiet_m_ ? active | dirty : dirty);
  if (level > 0) mark(level, row, changed);
}

// Voxels that do not move hold on to the cells above them as a disc of them holds on to a half-space: a
// spring to the mean of what the cell holds. That goes for what the tool holds, for what lies on an obstacle,
// along its normal, and for anchors. (Cells that stand still as a whole were rejected: round a tool a cycle
// then gained a quarter; a brain that stands on its stem was tied to all of its coarsest cell, and came back
// to rest by a thirtieth a cycle. Cells that know nothing of it swing: a brain pressed onto the skull by 1
// mm, for ever.)
void Multigrid::hold_cells(VoxelId v, const HeldParts& more, const HeldParts& less) noexcept {
  auto c = lattice_.coordinates(v);
  for (int l = 1; l < levels(); ++l) {
    for (int& x : c) x /= 2;
    Level& level = at(l);
    const VoxelId cell = level.couplings->grid().at(c[0], c[1], c[2]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (more[axis] == less[axis]) continue;
      std::uint32_t& held = level.held[axis][cell];
      const bool had = held != 0;
      held += more[axis];
      held -= less[axis];
      if (had != (held != 0)) level.row_held[cell / kRow] += had ? -1 : 1;
      level.hold[axis][cell] =
          hold_of(static_cast<float>(held) / static_cast<float>(kHeld), static_cast<float>(1 << l));
    }
  }
}

void Multigrid::set_held(std::span<const VoxelId> held) noexcept {
  if (std::equal(held.begin(), held.end(), held_.begin(), held_.end())) return;
  constexpr HeldParts all{kHeld, kHeld, kHeld}, none{};
  for (const VoxelId v : held_) hold_cells(v, none, all);
  held_.clear();
  for (const VoxelId v : held) {
    if (held_.size() == held_.capacity()) break;
    held_.push_back(v);
    hold_cells(v, all, none);
  }
}

void Multigrid::hold_anchored() noexcept {
  const Grid& g = lattice_.grid();
  for (RowId row = 0; row < g.rows(); ++row) {
    if (lattice_.filled_in(row) == 0) continue;
    for (VoxelId v = row * kRow; v < (row + 1) * kRow; ++v) {
      if (!lattice_.filled(v) || !lattice_.anchored(v)) continue;
      for (int n = 0; n < kAnchored; ++n) hold_cells(v, {kHeld, kHeld, kHeld}, {});
    }
  }
}

void Multigrid::support(VoxelId v, const HeldParts& parts) noexcept {
  HeldParts& now = supported_[v];
  if (now == parts) return;
  hold_cells(v, parts, now);
  now = parts;
  row_supported_[v / kRow] = 1;
}

void Multigrid::stop_cells(VoxelId v, std::uint8_t bits) noexcept {
  auto c = lattice_.coordinates(v);
  for (int l = 0; l < levels(); ++l) {
    if (l > 0) {
      for (int& x : c) x /= 2;
    }
    Level& level = at(l);
    const VoxelId cell = level.couplings->grid().at(c[0], c[1], c[2]);
    if ((level.stopped[cell] & bits) == bits || stopped_.size() == stopped_.capacity()) return;
    level.stopped[cell] |= bits;
    mark(l, cell / kRow, limited);
    stopped_.push_back({static_cast<std::uint8_t>(l), cell});
  }
}

void Multigrid::release_limited() noexcept {
  for (const StoppedCell& s : stopped_) {
    at(s.level).stopped[s.cell] = 0;
    unmark(s.level, s.cell / kRow, limited);
  }
  stopped_.clear();
}

void Multigrid::copy_from(const Multigrid& other) noexcept {
  tiles_ = other.tiles_;
  bricks_.look_at_all_of(other.bricks_);
  for (int l = 0; l < levels(); ++l) {
    Level& to = at(l);
    const Level& from = other.at(l);
    to.flags.copy_from(from.flags);
    if (l == 0) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      to.value[axis].copy_from(from.value[axis]);
      to.told[axis].copy_from(from.told[axis]);
      to.load[axis].copy_from(from.load[axis]);
    }
  }
}

void Multigrid::forget_coarse() {
  bricks_.leave_to_another();
  for (int l = 1; l < levels(); ++l) {
    Level& level = at(l);
    for (auto* arrays : {&level.value, &level.told, &level.load}) {
      for (auto& array : *arrays) array = LazyArray<float>(level.couplings->grid().size());
    }
  }
}

std::size_t Multigrid::renew_bricks(Displacement& state, std::size_t most_rows) noexcept {
  return bricks_.renew(state, most_rows, [this](RowId row) {
    log_.note(0, row);
    spread(0, row, active | dirty);
  });
}

void Multigrid::begin_anew() noexcept {
  for (int l = 1; l < levels(); ++l) {
    Level& level = at(l);
    for (const RowId row : log_.rows(l)) {
      for (auto* arrays : {&level.value, &level.told, &level.load}) {
        for (auto& array : *arrays)
          std::fill_n(array.data() + static_cast<std::size_t>(row) * kRow, kRow, 0.0F);
      }
      unmark(l, row, static_cast<std::uint8_t>(~limited));
    }
  }
  for (const RowId row : balanced_) row_balanced_[row] = 0;
  balanced_.clear();
}

void Multigrid::keep_log() {
  std::vector<std::size_t> rows;
  rows.reserve(levels_.size());
  for (int l = 0; l < levels(); ++l) rows.push_back(grid(l).rows());
  log_.begin(rows);
  for (auto& axis : balance_) axis = LazyArray<float>(lattice_.size());
  row_balanced_ = LazyArray<std::uint8_t>(grid(0).rows());
  balanced_.reserve(kMaxBalanced);
}

std::size_t Multigrid::memory_bytes() const {
  std::size_t bytes = log_.memory_bytes() + bricks_.memory_bytes() + held_.capacity() * sizeof(VoxelId) +
                      stopped_.capacity() * sizeof(StoppedCell) + supported_.resident_bytes() +
                      row_supported_.resident_bytes() + row_balanced_.resident_bytes() +
                      balanced_.capacity() * sizeof(RowId);
  for (const auto& axis : balance_) bytes += axis.resident_bytes();
  for (const Level& l : levels_) {
    bytes += l.couplings->memory_bytes() + l.flags.resident_bytes() + l.stopped.resident_bytes() +
             l.row_held.resident_bytes();
    for (std::size_t axis = 0; axis < 3; ++axis)
      bytes += l.held[axis].resident_bytes() + l.hold[axis].resident_bytes();
    for (const auto* arrays : {&l.value, &l.told, &l.load}) {
      for (const auto& array : *arrays) bytes += array.resident_bytes();
    }
  }
  return bytes;
}

}  // namespace voxel
