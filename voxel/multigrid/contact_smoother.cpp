// SPDX-License-Identifier: GPL-3.0-or-later
// Passes of a cycle at contacts: pressed voxels slide on the tool, and voxels at rigid surfaces stay outside
// these surfaces. Both give boundary springs to the cells above them.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "voxel/multigrid/fas.h"
#include "voxel/multigrid/tangential_contact.h"

namespace voxel {
namespace {

// Number of times that a row is moved, each time with more voxels kept out of their obstacles.
constexpr int kObstacleRounds = 3;

// Bit i is set if lane i of a row is near a rigid surface. Eight lanes are tested at a time, because few of
// them are near one.
std::uint32_t obstacle_lanes(const Displacement& state, RowId row) {
  // the lowest bit of each byte; the seven lowest bits of each byte
  constexpr std::uint64_t kOnes = 0x0101010101010101U, kLow = 0x7F * kOnes;
  static_assert(std::endian::native == std::endian::little);
  std::uint32_t lanes = 0;
  for (std::size_t n = 0; n < kRow; n += 8) {
    std::uint64_t roles;
    std::memcpy(&roles, state.role.data() + static_cast<std::size_t>(row) * kRow + n, sizeof roles);
    // A byte of `other` is 0 if its lane has the role `obstacle`. Then the byte of `is` is 0x80, else 0. The
    // product gathers these bits in one byte.
    const std::uint64_t other = roles ^ (Displacement::obstacle * kOnes);
    const std::uint64_t is = ~(((other & kLow) + kLow) | other) & ~kLow;
    lanes |= static_cast<std::uint32_t>((is >> 7U) * 0x0102040810204080U >> 56U) << n;
  }
  return lanes;
}

// Calls visit(v, lane) for the lanes whose bits are set, in order.
template <class Visit>
void for_lanes(RowId row, std::uint32_t lanes, const Visit& visit) {
  for (; lanes != 0; lanes &= lanes - 1) {
    const auto lane = static_cast<std::size_t>(std::countr_zero(lanes));
    visit(static_cast<VoxelId>(row * kRow + lane), lane);
  }
}

// Calls visit(v, lane) for the pressed voxels of a row in the Float8 of a span.
template <class Visit>
void for_pressed(const Displacement& state, RowId row, LaneSpan span, const Visit& visit) {
  if (state.row_standing[row] == 0) return;
  const auto first = static_cast<std::size_t>(span.first) * kLanes,
             last = static_cast<std::size_t>(span.last) * kLanes + kLanes;
  for (std::size_t lane = first; lane < last; ++lane) {
    const auto v = static_cast<VoxelId>(row * kRow + lane);
    if (state.role[v] == Displacement::pressed) visit(v, lane);
  }
}

}  // namespace

float Multigrid::slide_pressed(RowId row, Displacement& state, LaneSpan span) noexcept {
  float most = 0.0F;
  for_pressed(state, row, span, [&](VoxelId v, std::size_t) {
    most = std::max(most, slide(couplings(), state, v, frozen_load(v, state)));
  });
  return most;
}

float Multigrid::slide_pressed_by(RowId row, const RowVector& way, Displacement& state,
                                  LaneSpan span) noexcept {
  float most = 0.0F;
  for_pressed(state, row, span, [&](VoxelId v, std::size_t i) {
    most = std::max(most, slide_by(couplings(), state, v, {way[0][i], way[1][i], way[2][i]}));
  });
  return most;
}

// Moves a row. Voxels that would enter their obstacles stay where they are, while the others move. If such a
// voxel were put back afterwards, its neighbours would have followed it into the obstacle as far as links
// allow, and would hold it there.
template <class Move>
std::uint32_t Multigrid::move_outside(LevelRow r, RowId row, Displacement& state,
                                      const ObstacleView& obstacles, const Move& move) noexcept {
  if (obstacles.obstacles.empty() || state.row_obstacles[row] == 0) {
    move(r);
    return 0;
  }
  RowVector before;
  for (std::size_t axis = 0; axis < 3; ++axis) std::copy_n(r.u[axis], kRow, before[axis].begin());
  std::array<std::uint8_t, kRow> stays{};
  if (r.stopped != nullptr) std::copy_n(r.stopped, kRow, stays.begin());
  std::uint32_t jammed_lanes = 0;
  const std::uint32_t near = obstacle_lanes(state, row);
  for (int n = 0; n < kObstacleRounds; ++n) {
    move(r);
    std::uint32_t more = 0;
    for_lanes(row, near & ~jammed_lanes, [&](VoxelId v, std::size_t lane) {
      if (is_jammed(obstacles, state, v, 0.0)) more |= 1U << lane;
    });
    if (more == 0) break;
    jammed_lanes |= more;
    if (n + 1 == kObstacleRounds) break;
    for (std::size_t axis = 0; axis < 3; ++axis) std::copy_n(before[axis].begin(), kRow, r.u[axis]);
    for_lanes(row, jammed_lanes, [&](VoxelId, std::size_t lane) { stays[lane] = 7; });
    r.stopped = stays.data();
  }
  for_lanes(row, jammed_lanes, [&](VoxelId v, std::size_t) {
    relax_obstacle(couplings(), state, obstacles, v, frozen_load(v, state));
  });
  return jammed_lanes;
}

float Multigrid::smooth_voxels(const LevelRow& r, RowId row, Displacement& state,
                               const ObstacleView& obstacles, LaneSpan span) noexcept {
  const RowLimits limits = couplings().limits(row);
  float change = 0.0F;
  move_outside(r, row, state, obstacles,
               [&](const LevelRow& way) { change = std::max(change, smooth_row(way, &limits, span)); });
  return std::max(change, slide_pressed(row, state, span));
}

// Corrects a row of voxels as far as links and obstacles allow. An obstacle may refuse a part of the
// correction. This part, unlike a part refused by links, is not subtracted from the cells above. The voxel
// slides along the obstacle with its neighbours. Cells that lost the part in every cycle would oscillate
// between two states.
RowCorrection Multigrid::correct_voxels(const LevelRow& r, RowId row, const RowVector& correction,
                                        Displacement& state, const ObstacleView& obstacles, LaneSpan span,
                                        RowVector& refused) noexcept {
  const RowLimits limits = couplings().limits(row);
  RowCorrection done;
  const std::uint32_t kept_out = move_outside(r, row, state, obstacles, [&](const LevelRow& way) {
    done = correct_row(way, &limits, span, correction, refused);
  });
  for_lanes(row, kept_out, [&](VoxelId, std::size_t lane) {
    const unsigned stopped = r.stopped == nullptr ? 0U : r.stopped[lane];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if ((stopped >> axis & 1U) == 0) refused[axis][lane] = 0.0F;
    }
  });
  done.most_m = std::max(done.most_m, slide_pressed_by(row, correction, state, span));
  return done;
}

// A contact balances the force that presses a voxel against its obstacle or the tool. Subtracts this force
// from the residual. The cells above the voxel get a boundary spring.
void Multigrid::balance_contacts(RowId row, Displacement& state, const ObstacleView& obstacles, LaneSpan span,
                                 RowResidual& found, RowVector& out) noexcept {
  const double touching = kTouching * lattice_.min_spacing_m();
  const auto first = static_cast<std::size_t>(span.first) * kLanes,
             last = static_cast<std::size_t>(span.last) * kLanes + kLanes;
  for (std::size_t i = first; i < last; ++i) {
    const auto v = static_cast<VoxelId>(row * kRow + i);
    BoundarySprings::Support by{};
    if (state.role[v] == Displacement::pressed) {
      const auto force = sliding_force(couplings(), state, v, frozen_load(v, state));
      for (int axis = 0; axis < 3 && force; ++axis)
        out[static_cast<std::size_t>(axis)][i] = static_cast<float>((*force)[axis]);
      by = force ? BoundarySprings::along(state.tool_normal[lattice_.surface_number(v)],
                                          BoundarySprings::Support::By::tool)
                 : BoundarySprings::kAll;
    } else if (Displacement::in_block(state.role[v])) {
      by = support_of_block(lattice_.block(v) - 1U);
    } else if (state.role[v] == Displacement::obstacle && is_jammed(obstacles, state, v, touching)) {
      const glm::vec3 n = obstacles.of(v).normal;
      const float into = out[0][i] * n.x + out[1][i] * n.y + out[2][i] * n.z;
      for (int axis = 0; axis < 3; ++axis) {
        const auto ua = static_cast<std::size_t>(axis);
        found.resisted[ua] &= ~(1U << i);
        if (into < 0.0F) out[ua][i] -= into * n[axis];
      }
      if (into < 0.0F) by = BoundarySprings::along(n, BoundarySprings::Support::By::obstacle);
    }
    boundary_springs_->support(v, by);
  }
}

// Adds motion of another solver. The motion takes no voxel deeper into its obstacle, except by rounding.
// Rounding must not count as an overlap: the voxel would be projected out again while its neighbours have not
// moved yet, and the two solvers would differ more with each exchange.
void Multigrid::add_motion(RowId row, const RowVector& way, Displacement& state,
                           const ObstacleView& obstacles) noexcept {
  if (!prepare(0, row)) return;
  RowVector refused, before;
  const LevelRow r = row_of(0, row, state);
  if (obstacles.obstacles.empty() || state.row_obstacles[row] == 0) {
    note_change(0, row, correct_voxels(r, row, way, state, obstacles, {}, refused).most_m);
    return;
  }
  for (std::size_t axis = 0; axis < 3; ++axis) std::copy_n(r.u[axis], kRow, before[axis].begin());
  const RowLimits limits = couplings().limits(row);
  RowCorrection done = correct_row(r, &limits, {}, way, refused);
  done.most_m = std::max(done.most_m, slide_pressed_by(row, way, state, {}));
  const double touching = kTouching * lattice_.min_spacing_m();
  bool deeper = false;
  for_lanes(row, obstacle_lanes(state, row), [&](VoxelId v, std::size_t lane) {
    if (deeper) return;
    const Obstacle& o = obstacles.of(v);
    const double depth = depth_in_obstacle(o, state.at(v));
    if (depth <= touching) return;
    const glm::dvec3 was(before[0][lane], before[1][lane], before[2][lane]);
    deeper = depth > std::max(depth_in_obstacle(o, was), 0.0) + touching;
  });
  if (deeper) {
    for (std::size_t axis = 0; axis < 3; ++axis) std::copy_n(before[axis].begin(), kRow, r.u[axis]);
    done = correct_voxels(r, row, way, state, obstacles, {}, refused);
  }
  note_change(0, row, done.most_m);
}

namespace {

// Product of the off-diagonal stiffness with a displacement.
glm::vec3 across(const std::array<float, 3>& tilt, const glm::vec3& way) {
  return {tilt[0] * way.y + tilt[1] * way.z, tilt[0] * way.x + tilt[2] * way.z,
          tilt[1] * way.x + tilt[2] * way.y};
}

}  // namespace

template <class Visit>
void Multigrid::for_tilted(int level, RowId row, const LevelRow& r, LaneSpan span,
                           const Visit& visit) noexcept {
  const auto first = static_cast<std::size_t>(span.first) * kLanes,
             last = static_cast<std::size_t>(span.last) * kLanes + kLanes;
  for (std::size_t i = first; i < last; ++i) {
    const auto cell = static_cast<VoxelId>(row * kRow + i);
    const std::array<float, 3> tilt = boundary_springs_->tilt(level, cell);
    if (tilt[0] == 0.0F && tilt[1] == 0.0F && tilt[2] == 0.0F) continue;
    // skip cells that an active limit holds, or that do not move on an axis
    bool moves = r.stopped == nullptr || r.stopped[i] == 0;
    std::array<float, 3> hold{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float inverse = r.springs.inverse[axis * kRow + (r.springs.uniform ? 0 : i)];
      moves = moves && inverse > 0.0F;
      hold[axis] = moves ? r.hold_times * r.hold[axis][i] / inverse : 0.0F;
    }
    if (!moves) continue;
    visit(cell, i, tilt, hold);
  }
}

// Smooths cells on inclined surfaces, whose axes are coupled. Each cell moves to its least energy.
float Multigrid::smooth_tilted(int level, RowId row, const LevelRow& r, LaneSpan span) noexcept {
  Level& l = at(level);
  const Grid& g = l.couplings->grid();
  float most = 0.0F;
  for_tilted(
      level, row, r, span,
      [&](VoxelId cell, std::size_t i, const std::array<float, 3>& tilt, const std::array<float, 3>& hold) {
        const VoxelSprings springs = l.couplings->springs_of(cell);
        glm::dmat3 stiffness(0.0);  // double: a float may not hold the determinant
        glm::dvec3 pull(0.0);       // force on the cell at the place where its boundary spring is fixed
        for (int axis = 0; axis < 3; ++axis) {
          const auto ua = static_cast<std::size_t>(axis);
          const float prolonged = r.held_at[ua][i];
          float sum = 0.0F, all = r.load[ua][i];
          for (int d = 0; d < 3; ++d) {
            const auto ud = static_cast<std::size_t>(d);
            const float up = springs.up[ud].on(axis, d), down = springs.down[ud].on(axis, d);
            all += up * (l.value[ua][g.up(cell, d)] - prolonged) +
                   down * (l.value[ua][g.down(cell, d)] - prolonged);
            sum += up + down;
          }
          stiffness[axis][axis] = static_cast<double>(sum + hold[ua]);
          pull[axis] = static_cast<double>(all);
        }
        const glm::dvec3 off = r.hold_times * glm::vec3(tilt[0], tilt[1], tilt[2]);
        stiffness[0][1] = stiffness[1][0] = off[0];
        stiffness[0][2] = stiffness[2][0] = off[1];
        stiffness[1][2] = stiffness[2][1] = off[2];
        const glm::dvec3 way = glm::inverse(stiffness) * pull;
        for (int axis = 0; axis < 3; ++axis) {
          const auto ua = static_cast<std::size_t>(axis);
          const float to = r.held_at[ua][i] + static_cast<float>(way[axis]);
          most = std::max(most, std::fabs(to - r.u[ua][i]));
          r.u[ua][i] = to;
        }
      });
  return most;
}

// Adds the off-diagonal part of boundary springs to the residual of a coarse row.
void Multigrid::add_tilt(int level, RowId row, const LevelRow& r, LaneSpan span, RowVector& out) noexcept {
  for_tilted(level, row, r, span,
             [&](VoxelId, std::size_t i, const std::array<float, 3>& tilt, const std::array<float, 3>&) {
               glm::vec3 back(0.0F);
               for (int axis = 0; axis < 3; ++axis) {
                 const auto ua = static_cast<std::size_t>(axis);
                 back[axis] = r.held_at[ua][i] - r.u[ua][i];
               }
               const glm::vec3 pull = r.hold_times * across(tilt, back);
               for (int axis = 0; axis < 3; ++axis) out[static_cast<std::size_t>(axis)][i] += pull[axis];
             });
}

}  // namespace voxel
