// SPDX-License-Identifier: GPL-3.0-or-later
// Levels of the multigrid, flags and logs of their rows, active limits, and the exchange with a shadow.
#include "voxel/multigrid/fas.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "voxel/lattice/voxel_links.h"

namespace voxel {
namespace {

constexpr int kMaxLevels = 10;  // levels of the hierarchy, at most
constexpr int kSmallest = 3;    // greatest number of cells along an axis of the coarsest level
// The springs of this level and of coarser ones are found on construction.
constexpr int kWrittenAtOnce = 5;
// Greatest number of rows with a frozen residual. The contact of a tool has some hundred.
constexpr std::size_t kMaxFrozen = 4096;
// Greatest number of rows that a tick adds in one batch.
constexpr std::size_t kMostInTick = 1024;
constexpr std::uint8_t kAllAxes = 7;  // the bits of all three axes
// Greatest number of active limits, summed over all levels. Voxels and cells beyond that number still move.
constexpr std::size_t kMaxStopped = 65536;

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
    const LevelStiffness* finer = levels_.empty() ? nullptr : levels_.back().couplings.get();
    level.couplings = std::make_unique<LevelStiffness>(lattice, finer);
    const Grid& g = level.couplings->grid();
    if (finer != nullptr) {
      for (auto* arrays : {&level.value, &level.prolonged, &level.load, &level.loaded_at}) {
        for (auto& array : *arrays) array = LazyArray<float>(g.size());
      }
    }
    level.stopped = LazyArray<std::uint8_t>(g.size());
    level.flags = LazyArray<std::uint8_t>(g.rows());
    levels_.push_back(std::move(level));
    // There is at least one coarse level, because residuals are measured when they are restricted to it.
    if (levels() > 1 && *std::max_element(g.dims.begin(), g.dims.end()) <= kSmallest) break;
  }
  for (int l = kWrittenAtOnce; l < levels(); ++l) prepare_level(l);
  prolongation_ = Prolongation(lattice.grid());
  for (auto& axis : limit_load_) axis = LazyArray<float>(lattice.size());
  row_has_limit_load_ = LazyArray<std::uint16_t>(lattice.grid().rows());
  stopped_.reserve(kMaxStopped);
  still_stopped_.reserve(kMaxStopped);
  limited_correction_ = LimitedCorrection(lattice.grid().rows());
  std::vector<LevelStiffness*> couplings;
  for (const Level& level : levels_) couplings.push_back(level.couplings.get());
  boundary_springs_ = std::make_unique<BoundarySprings>(lattice, couplings);
  if (lattice.block_count() == 0) return;
  blocks_ = std::make_unique<RigidBlocks>(lattice, couplings);
  block_state_.resize(blocks_->count());
  for (BlockState& p : block_state_) p.on.resize(levels_.size());
  block_bounds_.reserve(kMaxBlockBounds);
  // Row passes must not move the cells of blocks, because a block moves as one. So these cells are stopped.
  for (int l = 1; l < levels(); ++l) {
    for (std::size_t p = 0; p < blocks_->count(); ++p) {
      for (const RigidBlocks::Run& run : blocks_->on(l, p).rows) {
        for (std::uint32_t lanes = run.lanes; lanes != 0; lanes &= lanes - 1)
          at(l).stopped[run.row * kRow + static_cast<VoxelId>(std::countr_zero(lanes))] = kAllAxes;
        mark(l, run.row, limited);
      }
    }
  }
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
    Level& level = at(l);
    const std::vector<bool> rows = level.couplings->rows_in_use();  // finds all springs
    for (auto* arrays : {&level.value, &level.prolonged, &level.load, &level.loaded_at}) {
      for (auto& array : *arrays) array.populate(kRow, rows);
    }
    level.stopped.populate(kRow, rows);
    level.flags.populate();
  }
  boundary_springs_->prepare_all();
  limited_correction_.populate(grid(0).rows(), kMostInTick);
}

void Multigrid::prepare_limit_loads() noexcept {
  for (auto& axis : limit_load_) axis.populate();
  row_has_limit_load_.populate();
}

// Marks a row and the rows beside it.
void Multigrid::spread(int level, RowId row, std::uint8_t flags) noexcept {
  if (all_visited_) return;
  Level& l = at(level);
  const Grid& g = l.couplings->grid();
  for (const RowId r : {row, row - 1, row + 1, row - g.row_z, row + g.row_z, row - g.row_x, row + g.row_x})
    l.flags[r] |= flags;
  if (level == 0 && (flags & active) != 0) tiles_.mark_dirty(g.row_coordinates(row));
}

// Notes that a row moved by `change` (m). Even a change too small to need a sweep is restricted, because
// small forces on many voxels add up to a large force on the cells above: four times as much on each coarser
// level.
void Multigrid::note_change(int level, RowId row, float change) noexcept {
  if (change <= restricted_m()) return;
  if (level == 0) bricks_.look_at(row);
  spread(level, row, change > motion_tolerance_m_ ? active | dirty : dirty);
  if (level > 0) mark(level, row, changed);
}

void Multigrid::stop_cells(VoxelId v, std::uint8_t bits) noexcept {
  auto c = lattice_.coordinates(v);
  for (int l = 0; l < levels(); ++l) {
    if (l > 0) {
      for (int& x : c) x /= 2;
    }
    Level& level = at(l);
    const VoxelId cell = level.couplings->grid().at(c[0], c[1], c[2]);
    if (blocks_ != nullptr && l > 0 && blocks_->of(l, cell) != 0) continue;
    if ((level.stopped[cell] & bits) == bits || stopped_.size() == stopped_.capacity()) return;
    level.stopped[cell] |= bits;
    mark(l, cell / kRow, limited);
    stopped_.push_back({static_cast<std::uint8_t>(l), cell});
  }
}

void Multigrid::set_limit_load(VoxelId v, const glm::vec3& force_N) noexcept {
  const auto tied = [&] {
    return limit_load_[0][v] != 0.0F || limit_load_[1][v] != 0.0F || limit_load_[2][v] != 0.0F;
  };
  const bool was = tied();
  if (!was && force_N == glm::vec3(0.0F)) return;
  for (int axis = 0; axis < 3; ++axis) limit_load_[static_cast<std::size_t>(axis)][v] = force_N[axis];
  const bool is = tied();
  if (was == is) return;
  std::uint16_t& count = row_has_limit_load_[v / kRow];
  count = static_cast<std::uint16_t>(is ? count + 1 : count - 1);
}

void Multigrid::release_active() noexcept {
  for (const StoppedCell& s : stopped_) {
    at(s.level).stopped[s.cell] = 0;
    if (blocks_ == nullptr || s.level == 0 || !blocks_->in_row(s.level, s.cell / kRow))
      unmark(s.level, s.cell / kRow, limited);
  }
  stopped_.clear();
}

void Multigrid::release_inactive(const Displacement& state) noexcept {
  const float tight = kAtLimit * static_cast<float>(lattice_.min_spacing_m());
  const auto pulled_against_limit = [&](VoxelId v, int axis) {
    const float at = state.u[static_cast<std::size_t>(axis)][v];
    const std::array<float, 2> interval = link_interval(lattice_, state, v, axis);
    const bool low = at <= interval[0] + tight, high = at >= interval[1] - tight;
    if (!low && !high) return false;
    const double force = link_force(couplings(), state, v, axis);
    return force > 0.0 ? high : low && force < 0.0;
  };
  still_stopped_.clear();
  for (const StoppedCell& s : stopped_) {
    if (s.level != 0) continue;
    std::uint8_t bits = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const auto bit = static_cast<std::uint8_t>(1U << axis);
      if ((at(0).stopped[s.cell] & bit) != 0 && pulled_against_limit(s.cell, axis)) bits |= bit;
    }
    if (bits == 0) continue;
    // A voxel may be listed more than once. Its first entry takes all its axes.
    at(0).stopped[s.cell] = 0;
    still_stopped_.push_back({s.cell, bits});
  }
  release_active();
  for (const StoppedVoxel& s : still_stopped_) stop_cells(s.v, s.axes);
}

void Multigrid::copy_from(const Multigrid& other) noexcept {
  tiles_ = other.tiles_;
  bricks_.look_at_all_of(other.bricks_);
  for (int l = 0; l < levels(); ++l) {
    Level& to = at(l);
    const Level& from = other.at(l);
    to.flags.copy_from(from.flags);
    for (std::size_t p = 0; p < block_state_.size(); ++p)
      block_state_[p].on[static_cast<std::size_t>(l)] = other.block_state_[p].on[static_cast<std::size_t>(l)];
    if (l == 0) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      to.value[axis].copy_from(from.value[axis]);
      to.prolonged[axis].copy_from(from.prolonged[axis]);
      to.loaded_at[axis].copy_from(from.loaded_at[axis]);
      to.load[axis].copy_from(from.load[axis]);
    }
  }
}

void Multigrid::forget_coarse() {
  bricks_.leave_to_shadow();
  all_visited_ = true;
  for (int l = 1; l < levels(); ++l) {
    Level& level = at(l);
    for (auto* arrays : {&level.value, &level.prolonged, &level.load, &level.loaded_at}) {
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

std::size_t Multigrid::rows_to_drop() const noexcept {
  std::size_t rows = 0;
  for (int l = 1; l < levels(); ++l) rows += log_.rows(l).size();
  return rows;
}

void Multigrid::drop_coarse() noexcept {
  for (int l = 1; l < levels(); ++l) {
    Level& level = at(l);
    for (const RowId row : log_.rows(l)) {
      for (auto* arrays : {&level.value, &level.prolonged, &level.load, &level.loaded_at}) {
        for (auto& array : *arrays)
          std::fill_n(array.data() + static_cast<std::size_t>(row) * kRow, kRow, 0.0F);
      }
      unmark(l, row, static_cast<std::uint8_t>(~limited));
    }
    log_.clear(l);
  }
}

void Multigrid::restart() noexcept {
  drop_coarse();
  for (const RowId row : frozen_rows_) frozen_number_[row] = 0;
  frozen_rows_.clear();
  restart_blocks();
}

void Multigrid::keep_log() {
  std::vector<std::size_t> rows;
  rows.reserve(levels_.size());
  for (int l = 0; l < levels(); ++l) rows.push_back(grid(l).rows());
  log_.begin(rows);
  const std::size_t most = std::min(kMaxFrozen, grid(0).rows());
  frozen_rows_.reserve(most);
  frozen_residual_ = LazyArray<float>(most * 3 * kRow);
  frozen_residual_.populate();
  frozen_number_ = LazyArray<std::uint16_t>(grid(0).rows());
}

std::size_t Multigrid::memory_bytes() const {
  std::size_t bytes = tiles_.memory_bytes() + log_.memory_bytes() + bricks_.memory_bytes() +
                      (blocks_ == nullptr ? 0 : blocks_->memory_bytes()) + boundary_springs_->memory_bytes() +
                      prolongation_.memory_bytes() + resident_bytes(stopped_) +
                      resident_bytes(still_stopped_) + row_has_limit_load_.resident_bytes() +
                      frozen_number_.resident_bytes() + frozen_residual_.resident_bytes() +
                      resident_bytes(frozen_rows_) + limited_correction_.memory_bytes();
  for (const auto& axis : limit_load_) bytes += axis.resident_bytes();
  for (const Level& l : levels_) {
    bytes += l.couplings->memory_bytes() + l.flags.resident_bytes() + l.stopped.resident_bytes();
    for (const auto* arrays : {&l.value, &l.prolonged, &l.load, &l.loaded_at}) {
      for (const auto& array : *arrays) bytes += array.resident_bytes();
    }
  }
  return bytes;
}

}  // namespace voxel
