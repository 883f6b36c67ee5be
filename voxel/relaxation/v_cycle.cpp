// SPDX-License-Identifier: GPL-3.0-or-later
// One cycle: its boxes, and its steps in order.
#include <algorithm>

#include "voxel/relaxation/relaxation.h"

namespace voxel {
namespace {

constexpr int kCoarsestSweeps = 8;  // sweeps on the coarsest level of a cycle
constexpr int kContactSweeps = 4;   // replaces kCoarsestSweeps under asynchronous relaxation
// Levels of a contact cycle under asynchronous relaxation. The shadow relaxes tissue further away. If contact
// cycles moved the coarsest cells, too, contact cycles and the shadow's cycles would disturb one another.
constexpr int kContactLevels = 5;
// Cost of a Float8 of cells (unit: the prolongation of a Float8): kSmoothed to smooth it, kPassedOn to
// restrict it. A Float8 of voxels costs kOfVoxels times as much, because voxels have limits and obstacles.
constexpr std::size_t kSmoothed = 2, kPassedOn = 3, kOfVoxels = 2;
// Further cycles on the coarse levels alone before voxels get the correction. Each costs an eighth of a whole
// cycle.
constexpr int kCoarseCycles = 2;
constexpr int kRoundParts = 4;  // margin of voxels around a rigid block in relax_around_blocks()
// Levels that are visited twice in a cycle. If they were visited once, they would leave an error around a
// held patch.
constexpr int kFirstTwice = 2, kLastTwice = 3;
constexpr int kAhead = 4;       // rows along y that are prefetched
constexpr int kTileMargin = 3;  // cells around a tile that are smoothed from level 1 on

}  // namespace

int Relaxation::last_level() const noexcept {
  return std::min(multigrid_.levels(), left_to_shadow_ ? kContactLevels : multigrid_.levels()) - 1;
}

template <class Visit>
void Relaxation::for_rows(int level, const RowBox& box, const Visit& visit) noexcept {
  const Grid& g = multigrid_.grid(level);
  for (int c = box.q0 / kLaneGroups; c <= box.q1 / kLaneGroups && box.q0 <= box.q1; ++c) {
    const LaneSpan span{std::max(box.q0 - c * kLaneGroups, 0),
                        std::min(box.q1 - c * kLaneGroups, kLaneGroups - 1)};
    for (int k = box.k0; k <= box.k1; ++k) {
      for (int j = box.j0; j <= box.j1; ++j) {
        const RowId row = g.row(c + 1, j, k);
        if (multigrid_.prepare(level, row)) visit(row, span, j, k);
      }
    }
  }
}

Relaxation::RowBox Relaxation::clipped(int level, const RowBox& b) const noexcept {
  const Grid& g = multigrid_.grid(level);
  return {std::max(b.q0, 0), std::min(b.q1, (g.columns - 2) * kLaneGroups - 1),
          std::max(b.j0, 0), std::min(b.j1, g.dims[1] - 1),
          std::max(b.k0, 0), std::min(b.k1, g.dims[2] - 1)};
}

// Lays the boxes of a cycle that relaxes voxels low … high. On each level they extend as far as a force in
// the middle is felt: by `contact_margin` and a quarter of the width `wide`, in cells. The boxes of a tile
// (kNoContact) are its own voxels and, on coarse levels, its cells with a few around them.
void Relaxation::lay_boxes(const std::array<int, 3>& low, const std::array<int, 3>& high, int wide,
                           int contact_margin, Visits visits) noexcept {
  visits_ = visits;
  const int last = multigrid_.levels() - 1;
  for (int l = 0; l <= last; ++l) {
    const int margin = wide != kNoContact ? contact_margin + (wide >> l) / 4 : l == 0 ? 0 : kTileMargin;
    std::array<int, 3> from{}, to{};
    for (std::size_t d = 0; d < 3; ++d) {
      from[d] = std::max(0, (low[d] >> l) - margin);
      to[d] = std::min(multigrid_.grid(l).dims[d] - 1, (high[d] >> l) + margin);
    }
    // The box is extended to whole cells of the next level, so that all children of a restricted cell are
    // smoothed. The exception is the x direction on level 0 around a contact. There the outermost cells may
    // have children that are not smoothed: whole cells would double the width and gain nothing.
    const bool narrow = wide != kNoContact && l == 0;
    const int pair = narrow ? 0 : 1;
    RowBox& s = boxes(l).smoothed;
    s = clipped(l, {(from[0] / kLanes) & ~pair, (to[0] / kLanes) | pair, from[1] & ~1, to[1] | 1,
                    from[2] & ~1, to[2] | 1});
    if (l == last) break;
    const RowBox p{s.q0 / 2, s.q1 / 2, s.j0 / 2, s.j1 / 2, s.k0 / 2, s.k1 / 2};
    boxes(l + 1).parents = p;
    // The parents and the cells beside the parents prolong to all of their children, and to one more child on
    // each side.
    boxes(l + 1).source_cells = clipped(l + 1, {p.q0 - 1, p.q1 + 1, p.j0 - 1, p.j1 + 1, p.k0 - 1, p.k1 + 1});
    const RowBox& t = boxes(l + 1).source_cells;
    RowBox& prolonged = boxes(l).prolonged;
    prolonged =
        clipped(l, {2 * p.q0 - 2, 2 * p.q1 + 3, 2 * t.j0 - 1, 2 * t.j1 + 2, 2 * t.k0 - 1, 2 * t.k1 + 2});
    boxes(l + 1).first_source = std::max(p.q0 * kLanes - 1, 0);
    boxes(l + 1).last_source = p.q1 * kLanes + kLanes;
    if (!narrow) continue;
    // Around a contact, corrections along x reach the smoothed Float8 and one more on either side. If a
    // smoothed Float8 got half of a correction, smoothing would make up for the other half, which would then
    // be added again.
    prolonged.q0 = std::max(prolonged.q0, s.q0 - 1);
    prolonged.q1 = std::min(prolonged.q1, s.q1 + 1);
    boxes(l + 1).first_source = std::max(s.q0 * kLanes / 2 - 1, 0);
    boxes(l + 1).last_source = (s.q1 + 1) * kLanes / 2;
  }
}

std::size_t Relaxation::groups(const RowBox& b) {
  return static_cast<std::size_t>(b.q1 - b.q0 + 1) * static_cast<std::size_t>(b.j1 - b.j0 + 1) *
         static_cast<std::size_t>(b.k1 - b.k0 + 1);
}

// Number of Float8 smoothed and prolonged in a cycle. Empty ones count, too.
std::size_t Relaxation::octets_of_cycle() const noexcept {
  std::size_t sum = 0;
  for (const Step& step : steps_now()) {
    const LevelBoxes& b = boxes_[static_cast<std::size_t>(step.level)];
    switch (step.what) {
      case Step::restricts:
        break;
      case Step::smooths:
      case Step::smooths_after:
        sum += groups(b.smoothed);
        break;
      case Step::solves:
        sum += 2 * groups(b.smoothed);
        break;
      case Step::prolongs:
        sum += groups(b.prolonged);
    }
  }
  return sum;
}

void Relaxation::list_steps() {
  for (const Visits visits : {Visits::once, Visits::twice}) {
    std::vector<Step>& steps = steps_[static_cast<std::size_t>(visits)];
    steps.clear();
    add_steps(steps, 0, visits, false);
  }
}

void Relaxation::add_steps(std::vector<Step>& to, int level, Visits visits, bool again) const {
  const int last = last_level();
  if (level == last) {
    to.push_back({level, Step::solves});
    return;
  }
  if (!again) to.push_back({level, Step::smooths});
  to.push_back({level, Step::restricts});
  const int next = level + 1;
  const bool twice = visits == Visits::twice && next >= kFirstTwice && next <= kLastTwice && next < last;
  for (int n = 0; n < (twice ? 2 : 1); ++n) add_steps(to, next, visits, n > 0);
  to.push_back({level, Step::prolongs});
  to.push_back({level, Step::smooths_after});
}

// Work of step n (unit: Float8 prolonged).
std::size_t Relaxation::work_of_step(int n) const noexcept {
  const Step step = step_of(n);
  const LevelBoxes& b = boxes_[static_cast<std::size_t>(step.level)];
  const std::size_t each = step.level == 0 ? kOfVoxels : 1, smoothed = each * kSmoothed * groups(b.smoothed);
  switch (step.what) {
    case Step::smooths:
      return smoothed_ ? 0 : smoothed;
    case Step::restricts:
      return each * kPassedOn * groups(b.smoothed);
    case Step::solves:
      return kContactSweeps * smoothed;
    case Step::smooths_after:
      return smoothed;
    case Step::prolongs:
      break;
  }
  // along x corrections reach one Float8 further
  RowBox prolonged = b.prolonged;
  prolonged.q0 = std::max(prolonged.q0, b.smoothed.q0 - 1);
  prolonged.q1 = std::min(prolonged.q1, b.smoothed.q1 + 1);
  return each * groups(prolonged);
}

// Red-black smoothing by rows. The second colour follows one plane behind the first, while that plane is in
// the cache. The result equals, bit for bit, that of smoothing one colour after the other: a row's neighbours
// along x have the row's own colour and are smoothed in the same order.
void Relaxation::smooth_box(int level, int first_colour, Displacement& state, const ObstacleView& obstacles,
                            Look look, Planes planes) noexcept {
  const RowBox& all = boxes(level).smoothed;
  const int first = all.k0 + planes.first, last = std::min(all.k0 + planes.last, all.k1);
  const RowId next_plane = multigrid_.grid(level).row_z;  // the planes before are in the cache
  const auto smooth = [&](const RowBox& plane, int colour) {
    for_rows(level, plane, [&](RowId row, LaneSpan span, int j, int k) {
      if (((j + k + colour) & 1) != 0) return;
      if (look == Look::active_rows && !multigrid_.has(level, row, Multigrid::active)) return;
      if (colour == first_colour && j + kAhead <= all.j1) {
        multigrid_.fetch(level, row + next_plane + kAhead, state);
        multigrid_.fetch(level, row + next_plane + kAhead + 1, state);
      }
      multigrid_.smooth(level, row, state, obstacles, span);
    });
  };
  for (int c = all.q0 / kLaneGroups; c <= all.q1 / kLaneGroups && all.q0 <= all.q1; ++c) {
    RowBox plane = all;
    plane.q0 = std::max(all.q0, c * kLaneGroups);
    plane.q1 = std::min(all.q1, c * kLaneGroups + kLaneGroups - 1);
    for (int k = first; k <= last; ++k) {
      plane.k0 = plane.k1 = k;
      smooth(plane, first_colour);
      plane.k0 = plane.k1 = k - 1;
      if (k > all.k0) smooth(plane, 1 - first_colour);
    }
    plane.k0 = plane.k1 = all.k1;
    if (last == all.k1) smooth(plane, 1 - first_colour);
  }
}

// Prolongs the pending corrections of the next coarser level within the boxes. Cells beside the box prolong,
// too, because nothing relaxes their children here. Children left behind would act on the box like a force,
// four times as much on each coarser level.
void Relaxation::prolong_box(int level, Displacement& state, const ObstacleView& obstacles,
                             Planes planes) noexcept {
  if (planes.first == 0) any_source_ = mark_source_cells(level, state, obstacles);
  if (!any_source_) return;
  const LevelBoxes& b = boxes(level + 1);
  const RowBox& t = boxes(level).prolonged;
  multigrid_.prolong(level,
                     {t.q0, t.q1, t.j0, t.j1, t.k0, t.k1, b.first_source, b.last_source, t.k0 + planes.first,
                      std::min(t.k0 + planes.last, t.k1)},
                     state, obstacles, is_limited_correction_);
}

bool Relaxation::mark_source_cells(int level, Displacement& state, const ObstacleView& obstacles) noexcept {
  const LevelBoxes& b = boxes(level + 1);
  bool any = false;
  for_rows(level + 1, b.source_cells, [&](RowId row, LaneSpan span, int, int) {
    if (!multigrid_.has(level + 1, row, Multigrid::changed)) return;
    const int origin = (multigrid_.grid(level + 1).row_coordinates(row)[0] - 1) * kRow;
    const float most =
        multigrid_.pending_correction(level + 1, row, span, b.first_source - origin, b.last_source - origin);
    if (most <= multigrid_.restricted_m()) return;
    // Under active limits, coarse cells between obstacles can diverge.
    if (!(most <= farthest_m_) && !is_limited_correction_) {
      multigrid_.forget_pending_correction(level + 1, row, state, obstacles);
      return;
    }
    multigrid_.mark(level + 1, row, Multigrid::source);
    any = true;
  });
  return any;
}

// Has a child of a coarse row changed since its last restriction?
bool Relaxation::restrict_due(int level, RowId row) const noexcept {
  const std::array<RowId, 8> below = multigrid_.rows_below(level, row);
  return std::any_of(below.begin(), below.end(),
                     [&](RowId child) { return multigrid_.has(level - 1, child, Multigrid::dirty); });
}

std::size_t Relaxation::work_of_planes(int n, int first) const noexcept {
  const auto planes = static_cast<std::size_t>(planes_of_step(n));
  return work_of_step(n) * (planes - static_cast<std::size_t>(first)) / planes;
}

int Relaxation::planes_of_step(int n) const noexcept {
  const Step step = step_of(n);
  const LevelBoxes& b = boxes_[static_cast<std::size_t>(step.level)];
  switch (step.what) {
    case Step::smooths:
    case Step::smooths_after:
      return std::max(1, b.smoothed.k1 - b.smoothed.k0 + 1);
    case Step::restricts: {
      const RowBox& parents = boxes_[static_cast<std::size_t>(step.level) + 1].parents;
      return std::max(1, parents.k1 - parents.k0 + 1);
    }
    case Step::prolongs:
      return std::max(1, b.prolonged.k1 - b.prolonged.k0 + 1);
    case Step::solves:
      break;
  }
  return 1;
}

void Relaxation::step(int n, Planes planes, Displacement& state, const ObstacleView& obstacles, Look look,
                      bool smoothed) noexcept {
  const Step step = step_of(n);
  // Pending corrections are prolonged first. Otherwise the jump between corrected voxels and others would
  // look like a force to coarse cells.
  for (int l = last_level() - 1; n == 0 && planes.first == 0 && l >= 0; --l)
    prolong_box(l, state, obstacles, kAllPlanes);
  const RigidBlocks::Box box = cells(boxes(step.level).smoothed);
  const bool ends = planes.last >= planes_of_step(n) - 1;
  switch (step.what) {
    case Step::smooths:
      if (smoothed) break;
      smooth_box(step.level, 0, state, obstacles, look, planes);
      if (ends) multigrid_.smooth_blocks(step.level, box, state, obstacles);
      break;
    case Step::restricts:
      restrict_residual(step.level, state, obstacles, look, planes);
      break;
    case Step::solves: {
      const int sweeps = left_to_shadow_ ? kContactSweeps : kCoarsestSweeps;
      for (int k = 0; k < sweeps; ++k) {
        smooth_box(step.level, 0, state, obstacles, look, kAllPlanes);
        multigrid_.smooth_blocks(step.level, box, state, obstacles);
      }
      break;
    }
    case Step::prolongs:
      prolong_box(step.level, state, obstacles, planes);
      break;
    case Step::smooths_after:
      smooth_box(step.level, 1, state, obstacles, look, planes);
      if (ends) multigrid_.smooth_blocks(step.level, box, state, obstacles);
  }
}

// Prefetches rows of the finer level, kAhead rows beyond the children of `row`. They lie in the last two
// planes that a restriction reads; the planes before are in the cache.
void Relaxation::fetch_ahead_below(int level, RowId row, const Displacement& state) const noexcept {
  const Grid& finer = multigrid_.grid(level - 1);
  const RowId first = multigrid_.rows_below(level, row)[0] + finer.row_z + kAhead;
  for (const RowId beside : {RowId{0}, finer.row_x, finer.row_z, finer.row_x + finer.row_z}) {
    multigrid_.fetch(level - 1, first + beside, state);
    multigrid_.fetch(level - 1, first + beside + 1, state);
  }
}

void Relaxation::restrict_residual(int l, Displacement& state, const ObstacleView& obstacles, Look look,
                                   Planes planes) noexcept {
  const bool begins = planes.first == 0;
  // Plastic offsets are updated before forces are summed, so that the residual is that of plastic links.
  if (l == 0 && lattice_.has_plasticity() && begins) {
    for_rows(0, boxes(0).smoothed, [&](RowId row, LaneSpan, int, int) {
      if (look == Look::all_rows || multigrid_.has(0, row, Multigrid::active | Multigrid::dirty))
        uncommitted_ = multigrid_.update_plasticity(row, state, false) || uncommitted_;
    });
  }
  const RowBox& all = boxes(l + 1).parents;
  RowBox parents = all;
  parents.k0 = all.k0 + planes.first;
  parents.k1 = std::min(all.k0 + planes.last, all.k1);
  const Grid& g = multigrid_.grid(l + 1);
  // All values are restricted before any load, because a row's load depends on its neighbours' values.
  for_rows(l + 1, begins ? all : RowBox{}, [&](RowId row, LaneSpan span, int, int) {
    if (look == Look::active_rows) {
      if (!restrict_due(l + 1, row)) return;
      // A load depends on the values of the neighbours, too.
      for (const RowId r :
           {row, row - 1, row + 1, row - g.row_z, row + g.row_z, row - g.row_x, row + g.row_x})
        multigrid_.mark(l + 1, r, Multigrid::renewed);
    }
    // Under asynchronous relaxation coarse cells hold only the motion since the residual was frozen. They
    // have that value already.
    if (!left_to_shadow_) multigrid_.restrict_values(l + 1, row, state, span);
  });
  if (begins) {
    const float of_blocks = multigrid_.measure_blocks(l, cells(boxes(l).smoothed), state, obstacles);
    if (l == 0) running_residual_N_ = std::max(running_residual_N_, static_cast<double>(of_blocks));
  }
  for_rows(l + 1, parents, [&](RowId row, LaneSpan span, int j, int) {
    if (look == Look::active_rows) {
      if (!multigrid_.has(l + 1, row, Multigrid::renewed)) return;
      multigrid_.unmark(l + 1, row, Multigrid::renewed);
    }
    if (j + kAhead / 2 <= parents.j1) fetch_ahead_below(l + 1, row, state);
    const float worst = multigrid_.restrict_loads(l + 1, row, state, obstacles, span);
    if (l == 0) running_residual_N_ = std::max(running_residual_N_, static_cast<double>(worst));
  });
  if (parents.k1 < all.k1) return;
  multigrid_.load_blocks(l + 1, cells(all));
  if (l == 0) multigrid_.renew_boundary_springs();
}

void Relaxation::lay_whole_boxes(Visits visits) noexcept {
  const auto& dims = lattice_.grid().dims;
  lay_boxes({0, 0, 0}, {dims[0] - 1, dims[1] - 1, dims[2] - 1}, kNoContact, 0, visits);
}

std::size_t Relaxation::run_whole_coarse_first(Displacement& state, const ObstacleView& obstacles,
                                               std::span<const VoxelId> held) noexcept {
  fix_held_voxels(state, held);
  multigrid_.release_active();
  lay_whole_boxes(Visits::twice);
  is_limited_correction_ = true;
  run_coarse_first(state, obstacles);
  is_limited_correction_ = false;
  return octets_of_cycle();
}

void Relaxation::run_coarse_first(Displacement& state, const ObstacleView& obstacles) noexcept {
  multigrid_.restrict_all(true);
  const int first_coarse = 2;         // index of the first step on level 1
  const int of_voxels = steps() - 2;  // index of the step that prolongs to voxels
  run_steps_over(0, of_voxels, state, obstacles, Look::all_rows);
  for (int n = 0; n < kCoarseCycles; ++n)
    run_steps_over(first_coarse, of_voxels, state, obstacles, Look::all_rows);
  run_steps_over(of_voxels, of_voxels + 1, state, obstacles, Look::all_rows);
  multigrid_.restrict_all(false);
}

void Relaxation::relax_around_blocks(Displacement& state, const ObstacleView& obstacles) noexcept {
  if (!multigrid_.has_blocks()) return;
  for (std::size_t p = 0; p < multigrid_.blocks().count(); ++p) {
    if (!multigrid_.tool_presses_block(p)) continue;
    const RigidBlocks::Box& block = multigrid_.blocks().on(0, p).box;
    std::array<int, 3> low{}, high{};
    for (std::size_t d = 0; d < 3; ++d) {
      low[d] = std::max(block.first[d] - kRoundParts, 0);
      high[d] = std::min(block.last[d] + kRoundParts, lattice_.grid().dims[d] - 1);
    }
    lay_boxes(low, high, kNoContact, 0, Visits::twice);
    cycle(state, obstacles, Look::all_rows);
  }
}

void Relaxation::renew_coarse(Displacement& state, const ObstacleView& obstacles) noexcept {
  lay_whole_boxes(Visits::once);
  mark_all_dirty();
  for (int l = 1; l < multigrid_.levels(); ++l) {
    for_rows(l, boxes(l).parents,
             [&](RowId row, LaneSpan span, int, int) { multigrid_.restrict_values(l, row, state, span); });
    multigrid_.measure_blocks(l - 1, cells(boxes(l - 1).smoothed), state, obstacles);
    for_rows(l, boxes(l).parents, [&](RowId row, LaneSpan span, int, int) {
      multigrid_.restrict_loads(l, row, state, obstacles, span);
    });
    multigrid_.load_blocks(l, cells(boxes(l).parents));
  }
}

}  // namespace voxel
