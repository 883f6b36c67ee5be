// SPDX-License-Identifier: GPL-3.0-or-later
// Applies one correction to many rows of voxels together (limited_correction.h).
#include <algorithm>
#include <array>
#include <glm/geometric.hpp>

#include "voxel/multigrid/fas.h"

namespace voxel {
namespace {

// Largest mean number of visits per row. More visits occur only if rounding drives a row back and forth. Then
// all rows return to their start.
constexpr std::size_t kMostVisits = 64;

}  // namespace

// Moves a row by the motion in `from`. Held and anchored voxels stay. Pressed voxels move along the tool's
// tangent plane. A voxel that an active limit holds does not move, but its target is stored. A limit may cut
// the motion of a sliding voxel on one axis. Then the voxel leaves the tool or enters it by a little, until
// it is projected again.
void Multigrid::set_out(LimitedCorrection::Row& r, Displacement& state) noexcept {
  LevelRow row = row_of(0, r.row, state);
  const std::size_t begin = static_cast<std::size_t>(r.row) * kRow;
  if (has(0, r.row, limited)) row.stopped = at(0).stopped.data() + begin;
  std::array<std::uint8_t, kRow> held{};
  if (row.held != nullptr) {
    for (std::size_t i = 0; i < kRow; ++i) {
      held[i] = row.held[i];
      if (held[i] != Displacement::pressed) continue;
      held[i] = Displacement::free;
      const glm::dvec3 n(state.tool_normal[lattice_.surface_number(static_cast<VoxelId>(begin + i))]);
      glm::dvec3 way(r.from[0][i], r.from[1][i], r.from[2][i]);
      way -= glm::dot(way, n) * n;
      for (int axis = 0; axis < 3; ++axis)
        r.from[static_cast<std::size_t>(axis)][i] = static_cast<float>(way[axis]);
    }
    row.held = held.data();
  }
  RowVector refused;
  r.out = true;
  // a link to another row is checked when the second of the two rows has moved
  unsigned sides = 0, side = 1;
  for (const RowId to : beside(r.row)) {
    if (const LimitedCorrection::Row* other = limited_correction_.find(to); other != nullptr && other->out)
      sides |= side;
    side *= 2;
  }
  const SetOut out = set_out_row(row, couplings().limits(r.row), r.span, sides, r.from, refused);
  r.cut = out.cut;
  r.most_m = out.most_m;
  if (out.beyond) ask_round(r.row);
  if (out.stopped == 0) return;
  keep_aim(r, state);
  RowVector& aim = limited_correction_.aim(r);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (auto i = static_cast<std::size_t>(r.span.first) * kLanes;
         i < static_cast<std::size_t>(r.span.last + 1) * kLanes; ++i)
      aim[axis][i] += refused[axis][i];
  }
}

// Stores the row's present place as its target. Call before anything keeps the row from it.
void Multigrid::keep_aim(LimitedCorrection::Row& r, const Displacement& state) noexcept {
  if (r.aims) return;
  r.aims = true;
  RowVector& aim = limited_correction_.aim(r);
  for (std::size_t axis = 0; axis < 3; ++axis)
    std::copy_n(state.u[axis].data() + static_cast<std::size_t>(r.row) * kRow, kRow, aim[axis].begin());
}

void Multigrid::stay(Displacement& state) noexcept {
  while (limited_correction_.next() != nullptr) {
  }
  for (LimitedCorrection::Row& r : limited_correction_.rows()) {
    keep_aim(r, state);
    for (std::size_t axis = 0; axis < 3; ++axis)
      std::copy_n(r.from[axis].begin(), kRow, state.u[axis].data() + static_cast<std::size_t>(r.row) * kRow);
  }
}

// Rows beside a row, in the order of Side.
std::array<RowId, 6> Multigrid::beside(RowId row) const noexcept {
  const Grid& g = grid(0);
  return {row - 1, row + 1, row - g.row_z, row + g.row_z, row - g.row_x, row + g.row_x};
}

void Multigrid::ask_round(RowId row) noexcept {
  limited_correction_.ask(row);
  for (const RowId to : beside(row)) limited_correction_.ask(to);
}

// Queues a row if its links to rows outside the correction may be beyond their limits.
void Multigrid::look_at_others(const LimitedCorrection::Row& r, Displacement& state) noexcept {
  unsigned sides = 0, side = 1;
  for (const RowId to : beside(r.row)) {
    if (!limited_correction_.has(to) && lattice_.filled_in(to) != 0) sides |= side;
    side *= 2;
  }
  if (sides != 0 && may_be_beyond(row_of(0, r.row, state), couplings().limits(r.row), sides))
    limited_correction_.ask(r.row);
}

void Multigrid::draw_back(LimitedCorrection::Row& r, Displacement& state) noexcept {
  const LevelRow row = row_of(0, r.row, state);
  const RowLimits limits = couplings().limits(r.row);
  const unsigned axes = axes_beyond(row, limits);
  if (axes == 0) return;
  keep_aim(r, state);
  if (draw_back_row(row, limits, axes, r.from)) ask_round(r.row);
}

void Multigrid::apply_limited_correction(Displacement& state) noexcept {
  for (LimitedCorrection::Row& r : limited_correction_.rows()) {
    if (!r.out) set_out(r, state);
  }
  for (const LimitedCorrection::Row& r : limited_correction_.rows()) look_at_others(r, state);
  std::size_t visits = kMostVisits * limited_correction_.rows().size();
  for (LimitedCorrection::Row* r = limited_correction_.next(); r != nullptr; r = limited_correction_.next()) {
    if (visits-- == 0) {
      stay(state);
      break;
    }
    draw_back(*r, state);
  }
  for (const LimitedCorrection::Row& r : limited_correction_.rows()) note_change(0, r.row, r.most_m);
}

// Sets `left` to the part of a row's motion that its movable voxels did not make. Returns the bits of the
// axes that have any.
unsigned Multigrid::left_of(const LimitedCorrection::Row& r, const Displacement& state,
                            RowVector& left) const noexcept {
  left = {};
  if (!r.aims) return 0;
  unsigned axes = 0;
  const RowVector& aim = limited_correction_.aim(r);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float* u = state.u[axis].data() + static_cast<std::size_t>(r.row) * kRow;
    for (std::size_t i = 0; i < kRow; ++i) {
      left[axis][i] = aim[axis][i] - u[i];
      if (left[axis][i] != 0.0F) axes |= 1U << axis;
    }
  }
  return axes;
}

}  // namespace voxel
