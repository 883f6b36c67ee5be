// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/sparse/relaxation.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace voxel::sparse {
namespace {

constexpr int kCoarsestSweeps = 8;
constexpr int kPatience = 40;        // cycles without gain before an object counts as resting
constexpr double kGoesAlong = 2e-3;  // of the spacing
constexpr double kWorse = 1.05;
constexpr float kHarder = 8.0F, kSofter = 0.97F, kHardest = 1e4F;
constexpr double kGain = 0.98;     // of the least residual so far: less is a gain
constexpr int kContactMargin = 4;  // cells round the contact that are smoothed, on each level

}  // namespace

Relaxation::Relaxation(const Lattice& lattice) : lattice_(lattice), multigrid_(lattice) {
  set_tolerance(kRestingResidual * lattice.force_scale_N());
  const auto last = static_cast<std::uint8_t>(multigrid_.levels() - 1);
  // What coarse levels know and finer ones do not is told first: a step between voxels that were told and
  // others that were not would look like a force to the cells above it.
  for (int level = last - 1; level >= 0; --level) {
    steps_.push_back({Stage::telling, static_cast<std::uint8_t>(level + 1), 0});
    steps_.push_back({Stage::prolong, static_cast<std::uint8_t>(level), 0});
  }
  for (std::uint8_t level = 0; level < last; ++level) {
    steps_.push_back({Stage::smooth, level, 0});
    steps_.push_back({Stage::smooth, level, 1});
    steps_.push_back({Stage::values, static_cast<std::uint8_t>(level + 1), 0});
    steps_.push_back({Stage::loads, static_cast<std::uint8_t>(level + 1), 0});
  }
  for (int n = 0; n < kCoarsestSweeps; ++n) {
    steps_.push_back({Stage::smooth, last, 0});
    steps_.push_back({Stage::smooth, last, 1});
  }
  for (int level = last - 1; level >= 0; --level) {
    steps_.push_back({Stage::telling, static_cast<std::uint8_t>(level + 1), 0});
    steps_.push_back({Stage::prolong, static_cast<std::uint8_t>(level), 0});
    steps_.push_back({Stage::smooth, static_cast<std::uint8_t>(level), 1});
    steps_.push_back({Stage::smooth, static_cast<std::uint8_t>(level), 0});
  }
  const RowBox none{1, 0, 1, 0, 1, 0};
  for (auto* boxes : {&smooth_box_, &parent_box_, &told_box_, &teller_box_})
    boxes->assign(static_cast<std::size_t>(multigrid_.levels()), none);
}

void Relaxation::set_tolerance(double tolerance_N) noexcept {
  tolerance_N_ = tolerance_N;
  // A motion below this changes no force by more than the tolerance.
  const double scale = lattice_.force_scale_N();
  multigrid_.set_quiet(
      static_cast<float>(tolerance_N),
      scale > 0.0 ? static_cast<float>(tolerance_N / scale * lattice_.min_spacing_m()) : 0.0F);
}

void Relaxation::copy_from(const Relaxation& other) noexcept {
  multigrid_.copy_from(other.multigrid_);
  set_tolerance(other.tolerance_N_);
  wake();
}

void Relaxation::stir_all() noexcept {
  for (RowId row = 0; row < lattice_.grid().rows(); ++row) {
    if (lattice_.filled_in(row) != 0) multigrid_.stir(0, row);
  }
}

int Relaxation::planes(const Step& step) const {
  const Grid& g = multigrid_.grid(step.level);
  return (g.columns - 2) * g.dims[2];
}

std::uint64_t Relaxation::run(Displacement& state, const ObstacleView& obstacles,
                              std::span<const VoxelId> held, std::uint64_t budget) noexcept {
  std::uint64_t spent = 0;
  while (!asleep_ && spent < budget) {
    if (step_ == 0 && plane_ == 0) begin_cycle(held);
    spent += do_plane(state, obstacles, steps_[step_], plane_) + 1;
    if (++plane_ < planes(steps_[step_])) continue;
    plane_ = 0;
    if (++step_ == steps_.size()) {
      step_ = 0;
      end_cycle();
    }
  }
  return spent;
}

void Relaxation::run_cycle(Displacement& state, const ObstacleView& obstacles,
                           std::span<const VoxelId> held) noexcept {
  const std::uint64_t cycles = cycles_;
  while (!asleep_ && cycles_ == cycles) run(state, obstacles, held, 1);
}

void Relaxation::begin_cycle(std::span<const VoxelId> held) noexcept {
  running_residual_N_ = 0.0;
  multigrid_.set_held(held);
}

void Relaxation::end_cycle() noexcept {
  multigrid_.release_limited();
  // Scattered voxels hold a cell harder than a patch of them does. A cycle that ends worse than it began says
  // so.
  if (running_residual_N_ > kWorse * residual_N_ && cycles_without_gain_ > 0) {
    hold_ = std::min(hold_ * kHarder, kHardest);
  } else {
    hold_ = std::max(1.0F, hold_ * kSofter);
  }
  multigrid_.set_hold(hold_);
  residual_N_ = running_residual_N_;
  ++cycles_;
  if (cycles_without_gain_ == 0 || residual_N_ < kGain * least_residual_N_) {
    least_residual_N_ = residual_N_;
    cycles_without_gain_ = 0;
  }
  ++cycles_without_gain_;
  if (residual_N_ < tolerance_N_ || cycles_without_gain_ > kPatience) asleep_ = true;
}

// Was anything that a coarse row holds moved since it was passed on?
bool Relaxation::restrict_due(int level, RowId row) const noexcept {
  const Grid &coarse = multigrid_.grid(level), &fine = multigrid_.grid(level - 1);
  const auto c = coarse.row_coordinates(row);
  const int column = 2 * (c[0] - 1) + 1, j = 2 * c[1], k = 2 * c[2];
  for (int child = 0; child < 8; ++child) {
    const int cc = column + (child & 1), cj = j + (child >> 1 & 1), ck = k + (child >> 2);
    if (cc + 1 >= fine.columns || cj >= fine.dims[1] || ck >= fine.dims[2]) continue;
    if (multigrid_.has(level - 1, fine.row(cc, cj, ck), Multigrid::dirty)) return true;
  }
  return false;
}

// Cells of the next finer level that a row of cells holds.
std::uint64_t Relaxation::cells_below(int level, RowId row) const noexcept {
  const Grid &coarse = multigrid_.grid(level), &fine = multigrid_.grid(level - 1);
  const auto c = coarse.row_coordinates(row);
  const auto within = [](int first, int count, int dims) {
    return static_cast<std::uint64_t>(std::clamp(dims - first, 0, count));
  };
  return within(2 * kRow * (c[0] - 1), 2 * kRow, fine.dims[0]) * within(2 * c[1], 2, fine.dims[1]) *
         within(2 * c[2], 2, fine.dims[2]);
}

std::uint64_t Relaxation::do_plane(Displacement& state, const ObstacleView& obstacles, const Step& step,
                                   int plane) noexcept {
  const int level = step.level;
  const Grid& g = multigrid_.grid(level);
  const int column = 1 + plane / g.dims[2], k = plane % g.dims[2];
  const RowId first = g.row(column, 0, k), plane_id = first / g.row_z;
  const auto rows = static_cast<RowId>(g.dims[1]);
  // Fine planes below this one, or coarse ones around.
  const auto any_below = [&](std::uint8_t flag) {
    const Grid& fine = multigrid_.grid(level - 1);
    bool any = false;
    for (int child = 0; child < 4; ++child) {
      const int cc = 2 * (column - 1) + 1 + (child & 1), ck = 2 * k + (child >> 1);
      if (cc + 1 < fine.columns && ck < fine.dims[2])
        any = any || multigrid_.plane_has(level - 1, fine.row(cc, 0, ck) / fine.row_z, flag);
    }
    return any;
  };
  std::uint64_t spent = 0;
  const auto lanes = static_cast<std::uint64_t>(std::min(kRow, g.dims[0]));
  switch (step.stage) {
    case Stage::smooth: {
      if (!multigrid_.plane_has(level, plane_id, Multigrid::active)) return 0;
      bool any = false;
      for (RowId row = first; row < first + rows; ++row) {
        if (!multigrid_.has(level, row, Multigrid::active)) continue;
        any = true;
        if (((static_cast<int>(row - first) + k + step.colour) & 1) != 0) continue;
        if (!multigrid_.prepare(level, row)) {
          multigrid_.unmark(level, row, Multigrid::active | Multigrid::dirty);
          continue;
        }
        multigrid_.smooth(level, row, state, obstacles);
        spent += lanes;
      }
      if (!any) multigrid_.clear_plane(level, plane_id, Multigrid::active);
      return spent + rows / 8;
    }
    case Stage::values: {
      if (!any_below(Multigrid::dirty)) return 0;
      for (RowId row = first; row < first + rows; ++row) {
        if (!restrict_due(level, row) || !multigrid_.prepare(level, row)) continue;
        multigrid_.restrict_values(level, row, state);
        // The load holds a row where it is beside its neighbours where they are.
        for (const RowId r :
             {row, row - 1, row + 1, row - g.row_z, row + g.row_z, row - g.row_x, row + g.row_x})
          multigrid_.mark(level, r, kRenewed);
        spent += lanes;
      }
      return spent + rows / 8;
    }
    case Stage::loads: {
      if (!multigrid_.plane_has(level, plane_id, kRenewed)) return 0;
      for (RowId row = first; row < first + rows; ++row) {
        if (!multigrid_.has(level, row, kRenewed)) continue;
        multigrid_.unmark(level, row, kRenewed);
        if (!multigrid_.prepare(level, row)) continue;
        const float worst = multigrid_.restrict_loads(level, row, state, obstacles);
        if (level == 1) running_residual_N_ = std::max(running_residual_N_, static_cast<double>(worst));
        spent += cells_below(level, row);
      }
      multigrid_.clear_plane(level, plane_id, kRenewed);
      return spent + rows / 8;
    }
    case Stage::telling: {
      constexpr std::uint8_t told = Multigrid::changed | Multigrid::loud;
      if (!multigrid_.plane_has(level, plane_id, told)) return 0;
      multigrid_.clear_plane(level, plane_id, told);
      for (RowId row = first; row < first + rows; ++row) {
        if (!multigrid_.has(level, row, told)) continue;
        if (multigrid_.has(level, row, Multigrid::changed)) {
          multigrid_.begin_telling(level, row);
          spent += lanes;
        } else {
          multigrid_.unmark(level, row, told);
        }
      }
      return spent + rows / 8;
    }
    case Stage::prolong: {
      const Grid& coarse = multigrid_.grid(level + 1);
      bool any = false;
      const int own_k = k / 2, near_k = (k & 1) != 0 ? own_k + 1 : own_k - 1;
      const int own_column = (column - 1) / 2 + 1,
                near_column = (column & 1) != 0 ? own_column - 1 : own_column + 1;
      for (const int ck : {own_k, near_k}) {
        for (const int cc : {own_column, near_column})
          any = any || multigrid_.plane_has(level + 1, coarse.row(cc, 0, ck) / coarse.row_z, Multigrid::loud);
      }
      if (!any) return 0;
      for (RowId row = first; row < first + rows; ++row) {
        if (!multigrid_.prepare(level, row)) continue;
        multigrid_.prolong(level, row, false, state, obstacles);
        spent += lanes;
      }
      return spent + rows / 8;
    }
  }
  return 0;
}

template <class Visit>
void Relaxation::for_rows(int level, const RowBox& box, const Visit& visit) noexcept {
  const Grid& g = multigrid_.grid(level);
  for (int c = box.c0; c <= box.c1; ++c) {
    for (int k = box.k0; k <= box.k1; ++k) {
      for (int j = box.j0; j <= box.j1; ++j) {
        const RowId row = g.row(c, j, k);
        if (multigrid_.prepare(level, row)) visit(row);
      }
    }
  }
}

Relaxation::RowBox Relaxation::clipped(int level, const RowBox& b) const noexcept {
  const Grid& g = multigrid_.grid(level);
  return {std::max(b.c0, 1), std::min(b.c1, g.columns - 2), std::max(b.j0, 0), std::min(b.j1, g.dims[1] - 1),
          std::max(b.k0, 0), std::min(b.k1, g.dims[2] - 1)};
}

// Rows of one colour: j + k even or odd.
void Relaxation::smooth_box(int level, int colour, Displacement& state,
                            const ObstacleView& obstacles) noexcept {
  const Grid& g = multigrid_.grid(level);
  const RowBox& box = smooth_box_[static_cast<std::size_t>(level)];
  for (int c = box.c0; c <= box.c1; ++c) {
    for (int k = box.k0; k <= box.k1; ++k) {
      for (int j = box.j0 + ((box.j0 + k + colour) & 1); j <= box.j1; j += 2) {
        const RowId row = g.row(c, j, k);
        if (multigrid_.prepare(level, row)) multigrid_.smooth(level, row, state, obstacles);
      }
    }
  }
}

// Tells the rows of a level what the next coarser one knows, within the contact's boxes.
void Relaxation::tell_box(int level, Displacement& state, const ObstacleView& obstacles) noexcept {
  const auto ul = static_cast<std::size_t>(level);
  const RowBox &tellers = teller_box_[ul + 1], &own = parent_box_[ul + 1];
  const Grid &fine = multigrid_.grid(level), &coarse = multigrid_.grid(level + 1);
  // Beside the box voxels only go along, and nobody brings them to rest there: they are left alone as soon as
  // coarse cells hardly move.
  constexpr std::uint8_t goes_along = 32;
  const auto inside = [&own](int c, int j, int k) {
    return c >= own.c0 && c <= own.c1 && j >= own.j0 && j <= own.j1 && k >= own.k0 && k <= own.k1;
  };
  const auto worth_it = static_cast<float>(kGoesAlong * lattice_.min_spacing_m());
  for_rows(level + 1, tellers, [&](RowId row) {
    const auto c = coarse.row_coordinates(row);
    if (!inside(c[0], c[1], c[2]) && multigrid_.untold(level + 1, row) > worth_it)
      multigrid_.mark(level + 1, row, goes_along);
  });
  for_rows(level, told_box_[ul], [&](RowId row) {
    const auto c = fine.row_coordinates(row);
    const int column = (c[0] - 1) / 2 + 1, j = c[1] / 2, k = c[2] / 2;
    if (inside(column, j, k)) {
      multigrid_.prolong(level, row, true, state, obstacles);
    } else if (multigrid_.has(level + 1, coarse.row(column, j, k), goes_along)) {
      multigrid_.follow_coarse(level, row, state, obstacles);
    }
  });
  for_rows(level + 1, tellers, [&](RowId row) {
    const auto c = coarse.row_coordinates(row);
    if (inside(c[0], c[1], c[2]) || multigrid_.has(level + 1, row, goes_along))
      multigrid_.end_telling(level + 1, row);
    multigrid_.unmark(level + 1, row, goes_along);
  });
}

void Relaxation::relax_contact(Displacement& state, const ObstacleView& obstacles,
                               std::span<const VoxelId> held, const std::array<int, 3>& low,
                               const std::array<int, 3>& high) noexcept {
  const int last = multigrid_.levels() - 1;
  multigrid_.set_held(held);
  const int wide = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
  for (int l = 0; l <= last; ++l) {
    const auto ul = static_cast<std::size_t>(l);
    std::array<int, 3> from{}, to{};
    for (std::size_t d = 0; d < 3; ++d) {
      const int margin = kContactMargin + (wide >> l) / 4;
      from[d] = std::max(0, (low[d] >> l) - margin);
      to[d] = std::min(multigrid_.grid(l).dims[d] - 1, (high[d] >> l) + margin);
    }
    // Whole cells of the next level, so that each of them is passed on once all it holds is smooth.
    smooth_box_[ul] =
        clipped(l, {from[0] / kRow + 1, to[0] / kRow + 1, from[1] & ~1, to[1] | 1, from[2] & ~1, to[2] | 1});
    if (l == last) break;
    const RowBox& s = smooth_box_[ul];
    const RowBox p{(s.c0 - 1) / 2 + 1, (s.c1 - 1) / 2 + 1, s.j0 / 2, s.j1 / 2, s.k0 / 2, s.k1 / 2};
    parent_box_[ul + 1] = p;
    // They and the cells beside them tell all they hold what they know.
    teller_box_[ul + 1] = clipped(l + 1, {p.c0, p.c1, p.j0 - 1, p.j1 + 1, p.k0 - 1, p.k1 + 1});
    const RowBox& t = teller_box_[ul + 1];
    told_box_[ul] = clipped(l, {2 * t.c0 - 1, 2 * t.c1, 2 * t.j0, 2 * t.j1 + 1, 2 * t.k0, 2 * t.k1 + 1});
  }
  for (int l = 0; l < last; ++l) {
    const RowBox& parents = parent_box_[static_cast<std::size_t>(l) + 1];
    for (const int colour : {0, 1}) smooth_box(l, colour, state, obstacles);
    for_rows(l + 1, parents, [&](RowId row) { multigrid_.restrict_values(l + 1, row, state); });
    for_rows(l + 1, parents, [&](RowId row) { multigrid_.restrict_loads(l + 1, row, state, obstacles); });
  }
  for (int n = 0; n < 2 * kCoarsestSweeps; ++n) smooth_box(last, n & 1, state, obstacles);
  for (int l = last - 1; l >= 0; --l) {
    tell_box(l, state, obstacles);
    for (const int colour : {1, 0}) smooth_box(l, colour, state, obstacles);
  }
}

std::size_t Relaxation::memory_bytes() const {
  return multigrid_.memory_bytes() + steps_.size() * sizeof(Step) + 4 * smooth_box_.size() * sizeof(RowBox);
}

}  // namespace voxel::sparse
