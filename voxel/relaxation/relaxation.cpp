// SPDX-License-Identifier: GPL-3.0-or-later
// The schedule of relaxation: budget, contact cycles and their parts, and the exchange with a shadow.
#include "voxel/relaxation/relaxation.h"

#include <algorithm>
#include <cmath>

#include "voxel/relaxation/admm_region.h"

namespace voxel {
namespace {

// Share of kRestingResidual at which relaxation stops. It is less than 1 because the residual is measured
// before the correction by coarse levels. Around tissue that is a hundred times stiffer, a larger residual
// can be left after the correction.
constexpr double kMeasured = 0.5;
// A pending correction larger than this is dropped (unit: spacing). Otherwise cells between obstacles could
// diverge.
constexpr float kFarthest = 2.0F;
constexpr std::uint64_t kPatient = 200'000;  // voxel updates per call; a tick has a smaller budget
// Margin, in cells, around a contact that is smoothed on each level: in a contact cycle, and in a cycle on a
// large patch.
constexpr int kContactMargin = 3, kLargePatchMargin = 14;
// Margin, in cells, around a contact that gets corrections after a jump.
constexpr int kProlongedMargin = 24;
constexpr int kNear = 2;                     // rows that a contact cycle reads around those it relaxes
constexpr std::uint64_t kBesideContact = 2;  // the budget is divided by this if a contact cycle ran
// Cost of renewing the bricks of a row (unit: voxel update). The budget divided by kBrickShare is spent on
// bricks.
constexpr std::uint64_t kBrickUpdates = 4 * kRow, kBrickShare = 2;
constexpr int kLooksAtOnce = 256;  // tiles searched at a time for pending corrections above them

}  // namespace

Relaxation::Relaxation(const Lattice& lattice)
    : lattice_(lattice),
      multigrid_(lattice),
      cluster_steps_(lattice),
      region_(std::make_unique<AdmmRegion>(lattice)) {
  set_tolerance(kMeasured * kRestingResidual * lattice.force_scale_N());
  farthest_m_ = kFarthest * static_cast<float>(lattice.max_spacing_m());
  boxes_.resize(static_cast<std::size_t>(multigrid_.levels()));
  list_steps();
  standing_.reserve(lattice.surface().size());
}

Relaxation::~Relaxation() = default;

bool Relaxation::at_limits() const noexcept {
  return region_->at_limits();
}

void Relaxation::relax_region(Displacement& state, const ObstacleView& obstacles) noexcept {
  if (!tool_presses_ || !obstacles.obstacles.empty()) return;
  region_->relax(multigrid_, state, obstacles, {}, true);
  multigrid_.release_inactive(state);
}

void Relaxation::prepare_under_tool() {
  region_->prepare_lists();
}

void Relaxation::prepare_beside_bodies() {
  multigrid_.prepare_limit_loads();
  region_->prepare_all();
}

void Relaxation::set_tolerance(double tolerance_N) noexcept {
  tolerance_N_ = tolerance_N;
  // The motion tolerance: a smaller motion changes no force by more than `tolerance_N`.
  const double scale = lattice_.force_scale_N();
  multigrid_.set_motion_tolerance(
      static_cast<float>(tolerance_N),
      scale > 0.0 ? static_cast<float>(tolerance_N / scale * lattice_.min_spacing_m()) : 0.0F);
}

void Relaxation::copy_from(const Relaxation& other) noexcept {
  multigrid_.copy_from(other.multigrid_);
  set_tolerance(other.tolerance_N_);
  uncommitted_ = other.uncommitted_;
  wake();
}

void Relaxation::leave_to_shadow() {
  left_to_shadow_ = true;
  list_steps();
  multigrid_.forget_coarse();
  multigrid_.keep_log();
}

void Relaxation::assign_residual(Displacement& state, const ObstacleView& obstacles) noexcept {
  asleep_ = shadow_busy_ = true;
  end_contact();
  multigrid_.restart();
  const Grid& g = lattice_.grid();
  for (int c = near_.first[0]; c <= near_.last[0]; ++c) {
    for (int k = near_.first[2]; k <= near_.last[2]; ++k) {
      for (int j = near_.first[1]; j <= near_.last[1]; ++j)
        multigrid_.freeze_residual(g.row(c, j, k), state, obstacles);
    }
  }
  multigrid_.freeze_blocks(state);
}

void Relaxation::mark_all_dirty() noexcept {
  for (RowId row = 0; row < lattice_.grid().rows(); ++row) {
    if (lattice_.filled_in(row) != 0) multigrid_.mark_dirty(0, row);
  }
}

// Fixes held voxels on all axes, and pressed voxels along the tool's normal only: they slide.
void Relaxation::fix_held_voxels(const Displacement& state, std::span<const VoxelId> held) noexcept {
  standing_.clear();
  bool others_hold = false;
  tool_presses_ = false;
  for (const VoxelId v : held) {
    tool_presses_ = tool_presses_ || state.role[v] == Displacement::pressed;
    others_hold = others_hold || state.role[v] == Displacement::held;
    if (state.role[v] == Displacement::held && standing_.size() < standing_.capacity())
      standing_.push_back(v);
  }
  // Brick loads lag by a cycle. With ν near 0.5 this error exceeds the part of the force that springs model,
  // and AdmmRegion would oscillate. So it does not run under the tool on objects with bricks.
  tool_presses_ = tool_presses_ && !others_hold && !lattice_.has_bricks();
  multigrid_.set_held(standing_);
  multigrid_.set_block_contacts(state, held);
}

std::uint64_t Relaxation::run(Displacement& state, const ObstacleView& obstacles,
                              std::span<const VoxelId> held, std::uint64_t budget) noexcept {
  if (asleep_) return 0;
  patient_ = budget >= kPatient;
  fix_held_voxels(state, held);
  TileQueue& tiles = multigrid_.tiles();
  std::uint64_t spent = 0;
  credit_ += static_cast<std::int64_t>(contact_relaxed_ ? budget / kBesideContact : budget);
  contact_relaxed_ = false;
  const auto spend = [&](std::uint64_t updates) {
    credit_ -= static_cast<std::int64_t>(updates);
    spent += updates;
  };
  spend(kBrickUpdates * multigrid_.renew_bricks(state, 1 + budget / (kBrickShare * kBrickUpdates)));
  while (!asleep_ && credit_ > 0) {
    if (committing_) {
      spend(commit_plastic_offsets(state, static_cast<std::uint64_t>(credit_)));
      continue;
    }
    if (round_left_ == 0) round_left_ = tiles.waiting();
    if (tiles.waiting() > 0) {
      looked_at_ = 0;
      spend(relax_tile(state, obstacles, tiles.pop()));
      if (round_left_ > 0 && --round_left_ == 0) end_round(state, obstacles, running_residual_N_);
      continue;
    }
    // No tile is dirty. Tiles are searched for pending corrections of the cells above them.
    for (int n = 0; n < kLooksAtOnce && looked_at_ < tiles.tiles() && tiles.waiting() == 0;
         ++n, ++looked_at_) {
      if (tile_waits_for_coarse(cursor_)) tiles.push(cursor_);
      cursor_ = (cursor_ + 1) % tiles.tiles();
    }
    spend(kLooksAtOnce * 4);
    if (looked_at_ >= tiles.tiles() && tiles.waiting() == 0) {
      looked_at_ = 0;
      running_residual_N_ = 0.0;
      end_round(state, obstacles, std::min(residual_N_, 0.99 * tolerance_N_));
    }
  }
  // unused budget is not carried over to later calls
  credit_ = std::min<std::int64_t>(credit_, 0);
  return spent;
}

void Relaxation::run_cycle(Displacement& state, const ObstacleView& obstacles,
                           std::span<const VoxelId> held) noexcept {
  if (asleep_) return;
  if (committing_) {
    while (committing_) commit_plastic_offsets(state, ~std::uint64_t{0});
    return;
  }
  fix_held_voxels(state, held);
  multigrid_.renew_bricks(state, multigrid_.grid(0).rows());
  multigrid_.tiles().clear();
  round_left_ = 0;
  running_residual_N_ = 0.0;
  lay_whole_boxes(Visits::once);
  cycle(state, obstacles, Look::active_rows);
  patient_ = true;
  end_round(state, obstacles, running_residual_N_);
}

std::size_t Relaxation::relax_contact(Displacement& state, const ObstacleView& obstacles,
                                      std::span<const VoxelId> held, std::span<const VoxelId> pressed,
                                      bool again, std::size_t at_once) noexcept {
  contact_relaxed_ = true;
  fix_held_voxels(state, held);
  lay_contact_boxes(pressed, kContactMargin, Visits::once);
  const RowBox& b = boxes(0).smoothed;
  const Grid& g = lattice_.grid();
  near_.first = {b.q0 / kLaneGroups + 1, std::max(b.j0 - kNear, 0), std::max(b.k0 - kNear, 0)};
  near_.last = {b.q1 / kLaneGroups + 1, std::min(b.j1 + kNear, g.dims[1] - 1),
                std::min(b.k1 + kNear, g.dims[2] - 1)};
  end_contact();
  smoothed_ = left_to_shadow_ && again;
  large_patch_ =
      static_cast<double>(octets_of_cycle()) > small_patch_share_ * static_cast<double>(kSmallPatch);
  return run_steps(state, obstacles, large_patch_ ? at_once : kUnlimited);
}

std::size_t Relaxation::continue_contact(Displacement& state, const ObstacleView& obstacles,
                                         std::span<const VoxelId> held, std::size_t at_once) noexcept {
  fix_held_voxels(state, held);
  return run_steps(state, obstacles, at_once);
}

// Runs one of several equal parts of the remaining steps.
std::size_t Relaxation::run_steps(Displacement& state, const ObstacleView& obstacles,
                                  std::size_t at_once) noexcept {
  std::size_t left = work_of_planes(step_, plane_), done = 0;
  for (int n = step_ + 1; n < steps(); ++n) left += work_of_step(n);
  const std::size_t most = std::max<std::size_t>(at_once, 1);
  const std::size_t parts = left <= most ? 1 : std::max<std::size_t>(2, (left - 1) / most + 1);
  const std::size_t part = parts == 1 ? left : left / parts;
  while (step_ < steps()) {
    const int planes = planes_of_step(step_);
    const std::size_t of_plane = work_of_step(step_) / static_cast<std::size_t>(planes);
    if (done > 0 && done + of_plane / 2 > part) return done;
    int last = planes - 1;
    if (parts > 1 && of_plane > 0) {
      const std::size_t fit =
          std::max<std::size_t>(1, (part - std::min(part, done) + of_plane / 2) / of_plane);
      last = std::min(last, plane_ + static_cast<int>(fit) - 1);
    }
    done += work_of_planes(step_, plane_) - work_of_planes(step_, last + 1);
    step(step_, {plane_, last}, state, obstacles, Look::all_rows, smoothed_);
    plane_ = last + 1 < planes ? last + 1 : 0;
    if (plane_ == 0) ++step_;
  }
  end_contact();
  return done;
}

std::size_t Relaxation::relax_large_patch(Displacement& state, const ObstacleView& obstacles,
                                          std::span<const VoxelId> held, std::span<const VoxelId> pressed,
                                          bool coarse_first) noexcept {
  fix_held_voxels(state, held);
  multigrid_.release_active();
  lay_contact_boxes(pressed, kLargePatchMargin, Visits::twice);
  is_limited_correction_ = true;
  if (coarse_first) {
    run_coarse_first(state, obstacles);
    run_steps_over(steps() - 1, steps(), state, obstacles, Look::all_rows);
  } else {
    cycle(state, obstacles, Look::all_rows);
  }
  is_limited_correction_ = false;
  return octets_of_cycle();
}

std::size_t Relaxation::prolong_large_patch(Displacement& state, const ObstacleView& obstacles,
                                            std::span<const VoxelId> pressed) noexcept {
  lay_contact_boxes(pressed, kProlongedMargin, Visits::once);
  is_limited_correction_ = true;
  std::size_t prolonged = 0;
  for (int l = last_level() - 1; l >= 0; --l) {
    prolong_box(l, state, obstacles, kAllPlanes);
    prolonged += groups(boxes(l).prolonged);
  }
  is_limited_correction_ = false;
  return prolonged;
}

void Relaxation::lay_contact_boxes(std::span<const VoxelId> pressed, int margin, Visits visits) noexcept {
  std::array<int, 3> low = lattice_.coordinates(pressed.front()), high = low;
  for (const VoxelId v : pressed) {
    const auto c = lattice_.coordinates(v);
    for (std::size_t d = 0; d < 3; ++d) {
      low[d] = std::min(low[d], c[d]);
      high[d] = std::max(high[d], c[d]);
    }
  }
  for (std::size_t d = 0; d < 3; ++d) {
    const int beyond = high[d] - low[d] - kMaxNear;
    if (beyond <= 0) continue;
    low[d] += beyond / 2;
    high[d] = low[d] + kMaxNear;
  }
  const int wide = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
  lay_boxes(low, high, wide, margin, visits);
}

std::size_t Relaxation::memory_bytes() const {
  return multigrid_.memory_bytes() + cluster_steps_.memory_bytes() + region_->memory_bytes() +
         boxes_.capacity() * sizeof(LevelBoxes) + resident_bytes(standing_);
}

}  // namespace voxel
