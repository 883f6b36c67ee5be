// SPDX-License-Identifier: GPL-3.0-or-later
// Passes of a cycle that move rigid blocks.
#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

#include "voxel/multigrid/fas.h"

#include "voxel/multigrid/rigid_block_visits.h"

namespace voxel {
namespace {

constexpr double kRounding = 1.2e-7;   // last bit of a float, relative
constexpr double kNearObstacle = 2.0;  // (unit: spacing) obstacles further away are skipped
constexpr std::uint32_t kAllLanes = ~std::uint32_t{0};
// Distances {down, up} (m) that the block's voxel at a link's end may move on an axis before the link stops
// it.
std::array<double, 2> room_at(const Lattice& lattice, const Displacement& state, const RigidBlocks::Link& l,
                              int axis) {
  const auto& u = state.u[static_cast<std::size_t>(axis)];
  const auto bounds = lattice.bounds(l.up ? l.cell : l.beside, l.d, axis);
  const float difference = l.up ? u[l.beside] - u[l.cell] : u[l.cell] - u[l.beside];
  const auto closer = std::max(0.0, static_cast<double>(difference - bounds[0])),
             apart = std::max(0.0, static_cast<double>(bounds[1] - difference));
  return l.up ? std::array<double, 2>{apart, closer} : std::array<double, 2>{closer, apart};
}
// Additional distance (m) that the block's voxel may move if voxel v at the link's other end comes along as
// far as v's other links allow.
double room_beside(const Lattice& lattice, const Displacement& state, VoxelId v, std::uint16_t block,
                   int axis, bool upwards) {
  if (state.role[v] != Displacement::free || lattice.anchored(v)) return 0.0;
  const auto& u = state.u[static_cast<std::size_t>(axis)];
  float room = std::numeric_limits<float>::max();
  for (int d = 0; d < 3; ++d) {
    for (const bool up : {false, true}) {
      const VoxelId w = up ? lattice.up(v, d) : lattice.down(v, d);
      if (!lattice.filled(w) || lattice.block(w) == block) continue;
      const auto bounds = lattice.bounds(up ? v : w, d, axis);
      const float difference = up ? u[w] - u[v] : u[v] - u[w];
      room = std::min(room, up == upwards ? difference - bounds[0] : bounds[1] - difference);
    }
  }
  return std::max(0.0, static_cast<double>(room));
}
// True if `l` is the first of the links between its outer voxel and the block.
bool first_link(const Lattice& lattice, const RigidBlocks::Link& l, std::uint16_t block) {
  for (int d = 0; d < l.d; ++d) {
    if (lattice.block(lattice.up(l.beside, d)) == block || lattice.block(lattice.down(l.beside, d)) == block)
      return false;
  }
  return !l.up || lattice.block(lattice.up(l.beside, l.d)) != block;
}

}  // namespace

void Multigrid::set_block_contacts(const Displacement& state, std::span<const VoxelId> held) noexcept {
  if (blocks_ == nullptr) return;
  for (BlockState& p : block_state_) p.by_tool.count = 0;
  for (const VoxelId v : held) {
    if (!Displacement::in_block(state.role[v])) continue;
    const std::uint32_t s = lattice_.surface_number(v);
    if (s != Lattice::kNoSurface)
      block_state_[lattice_.block(v) - 1U].by_tool.add(glm::dvec3(state.tool_normal[s]));
  }
  for (BlockState& p : block_state_) p.held = p.by_tool;
}

glm::dvec3 Multigrid::block_force(std::size_t block, const Displacement& state) const noexcept {
  glm::dvec3 force(0.0);
  for (const RigidBlocks::Link& l : blocks_->on(0, block).border) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto& u = state.u[static_cast<std::size_t>(axis)];
      force[axis] += along(l.spring, axis, l.d) * static_cast<double>(u[l.beside] - u[l.cell]);
    }
  }
  for (const VoxelId v : blocks_->loaded(block)) {
    for (int axis = 0; axis < 3; ++axis) {
      const float* of_row = state.load_of(v / kRow, axis);
      if (of_row != nullptr) force[axis] += static_cast<double>(of_row[v % kRow]);
    }
  }
  return force;
}

// Interval in which all links of the border let the block move. `room(link, axis)` gives {down, up} for one
// link.
template <class Room>
Multigrid::AdmissibleInterval Multigrid::room_on_border(std::size_t block, const Room& room) const noexcept {
  constexpr double kUnlimited = 1e30;  // (m)
  AdmissibleInterval all{{{-kUnlimited, kUnlimited}, {-kUnlimited, kUnlimited}, {-kUnlimited, kUnlimited}}};
  for (const RigidBlocks::Link& l : blocks_->on(0, block).border) {
    for (int axis = 0; axis < 3; ++axis) {
      const std::array<double, 2> at_link = room(l, axis);
      auto& of_axis = all[static_cast<std::size_t>(axis)];
      of_axis[0] = std::max(of_axis[0], -at_link[0]);
      of_axis[1] = std::min(of_axis[1], at_link[1]);
    }
  }
  return all;
}

Multigrid::AdmissibleInterval Multigrid::interval_of_block(std::size_t block,
                                                           const Displacement& state) const noexcept {
  return room_on_border(
      block, [&](const RigidBlocks::Link& l, int axis) { return room_at(lattice_, state, l, axis); });
}

void Multigrid::add_bounds(const AdmissibleInterval& room, std::vector<BlockBound>& bounds) {
  for (int axis = 0; axis < 3; ++axis) {
    glm::dvec3 up(0.0);
    up[axis] = 1.0;
    const auto& of_axis = room[static_cast<std::size_t>(axis)];
    bounds.push_back({up, -of_axis[0], false, 0.0});
    bounds.push_back({-up, of_axis[1], false, 0.0});
  }
}

void Multigrid::shift_block(std::size_t block, const glm::dvec3& way, Displacement& state) noexcept {
  const VoxelId first = blocks_->first(block);
  const auto most = static_cast<float>(std::max({std::fabs(way.x), std::fabs(way.y), std::fabs(way.z)}));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // All voxels get the place of the first, to the last bit.
    const float to =
        static_cast<float>(static_cast<double>(state.u[axis][first]) + way[static_cast<int>(axis)]);
    for (const RigidBlocks::Run& run : blocks_->on(0, block).rows) {
      if (run.lanes == kAllLanes) {
        std::fill_n(state.u[axis].data() + std::size_t{run.row} * kRow, kRow, to);
      } else {
        for_cells(run, [&](VoxelId v, std::uint32_t) { state.u[axis][v] = to; });
      }
    }
  }
  for (const RigidBlocks::Run& run : blocks_->on(0, block).rows) note_change(0, run.row, most);
}

// Sets block_bounds_: bounds by the tool, and by obstacles that the block touches or may reach.
void Multigrid::stop_at_obstacles(std::size_t block, const Displacement& state, const ObstacleView& obstacles,
                                  Tool tool) noexcept {
  block_bounds_.clear();
  const HeldDirections& held = block_state_[block].by_tool;
  for (std::size_t n = 0; n < held.count && tool == Tool::constrains; ++n)
    block_bounds_.push_back({held.of[n], 0.0, true, 0.0});
  if (obstacles.obstacles.empty()) return;
  for (const std::uint32_t s : blocks_->surface(block)) {
    const Obstacle& o = obstacles.obstacles[s];
    if (o.normal == glm::vec3(0.0F)) continue;
    const double depth = depth_in_obstacle(o, state.at(lattice_.surface()[s]));
    if (depth < -kNearObstacle * lattice_.max_spacing_m()) continue;
    if (block_bounds_.size() + 6 >= kMaxBlockBounds) return;
    // Overlap is removed elsewhere.
    block_bounds_.push_back({glm::dvec3(o.normal), std::max(0.0, -depth), false, 0.0});
  }
}

// Interval in which the block can move if voxels beside it come along, as far as their other links allow.
// These voxels extend the interval only in the direction of `way`.
Multigrid::AdmissibleInterval Multigrid::room_with_others(std::size_t block, const glm::dvec3& way,
                                                          const Displacement& state) const noexcept {
  const auto number = static_cast<std::uint16_t>(block + 1);
  return room_on_border(block, [&](const RigidBlocks::Link& l, int axis) {
    std::array<double, 2> room = room_at(lattice_, state, l, axis);
    if (room[0] < -way[axis]) room[0] += room_beside(lattice_, state, l.beside, number, axis, false);
    if (room[1] < way[axis]) room[1] += room_beside(lattice_, state, l.beside, number, axis, true);
    return room;
  });
}

// Moves voxels beside a block within the limits of their links to it.
void Multigrid::take_others_along(std::size_t block, Displacement& state) noexcept {
  for (const RigidBlocks::Link& l : blocks_->on(0, block).border) {
    if (state.role[l.beside] != Displacement::free || lattice_.anchored(l.beside)) continue;
    for (int axis = 0; axis < 3; ++axis) {
      auto& u = state.u[static_cast<std::size_t>(axis)];
      const auto bounds = lattice_.bounds(l.up ? l.cell : l.beside, l.d, axis);
      const float low = l.up ? u[l.cell] + bounds[0] : u[l.cell] - bounds[1],
                  high = l.up ? u[l.cell] + bounds[1] : u[l.cell] - bounds[0];
      const float to = std::clamp(u[l.beside], low, high);
      if (to == u[l.beside]) continue;
      const float way = std::fabs(to - u[l.beside]);
      u[l.beside] = to;
      log_.note(0, l.beside / kRow);
      note_change(0, l.beside / kRow, way);
    }
  }
}

// Links at their limits tie some voxels to the block, so that they come along with it. Adds the forces of
// these voxels to `pull`. Returns the bits of the axes on which the block is held nevertheless.
std::uint8_t Multigrid::add_what_comes_along(std::size_t block, const Displacement& state,
                                             glm::dvec3& pull) noexcept {
  const double tight = static_cast<double>(kAtLimit) * lattice_.min_spacing_m();
  const auto number = static_cast<std::uint16_t>(block + 1);
  const glm::dvec3 own = pull;
  std::uint8_t stopped = 0;
  for (const RigidBlocks::Link& l : blocks_->on(0, block).border) {
    for (int axis = 0; axis < 3; ++axis) {
      if (own[axis] == 0.0 || (stopped >> axis & 1U) != 0) continue;
      const bool upwards = own[axis] > 0.0;
      if (room_at(lattice_, state, l, axis)[upwards ? 1 : 0] >= tight) continue;
      if (room_beside(lattice_, state, l.beside, number, axis, upwards) < tight) {
        stopped = static_cast<std::uint8_t>(stopped | 1U << axis);
      } else if (first_link(lattice_, l, number)) {
        pull[axis] += link_force(couplings(), state, l.beside, axis);
      }
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    if ((stopped >> axis & 1U) == 0 && pull[axis] * own[axis] >= 0.0) continue;
    stopped = static_cast<std::uint8_t>(stopped | 1U << axis);
    pull[axis] = 0.0;
  }
  return stopped;
}

glm::dvec3 Multigrid::move_block(std::size_t block, const glm::dvec3& way, Displacement& state,
                                 const ObstacleView& obstacles, Tool tool, Note note) noexcept {
  const glm::dvec3& stiffness = blocks_->on(0, block).stiffness;
  stop_at_obstacles(block, state, obstacles, tool);
  const AdmissibleInterval room = room_with_others(block, way, state);
  add_bounds(room, block_bounds_);
  glm::dvec3 to = move_within(stiffness * way, stiffness, block_bounds_);
  for (int axis = 0; axis < 3; ++axis) {  // removes rounding
    const auto& of_axis = room[static_cast<std::size_t>(axis)];
    to[axis] = std::clamp(to[axis], of_axis[0], of_axis[1]);
  }
  const double most = std::max({std::fabs(to.x), std::fabs(to.y), std::fabs(to.z)});
  if (!(most > static_cast<double>(restricted_m()))) return glm::dvec3(0.0);
  const VoxelId first = blocks_->first(block);
  const glm::dvec3 before = state.at(first);
  shift_block(block, to, state);
  take_others_along(block, state);
  for (const RigidBlocks::Run& run : blocks_->on(0, block).rows) {
    if (note == Note::logged) log_.note(0, run.row);
  }
  return state.at(first) - before;
}

void Multigrid::shift_cells(int level, std::size_t block, const glm::dvec3& way) noexcept {
  Level& l = at(level);
  const auto most = static_cast<float>(std::max({std::fabs(way.x), std::fabs(way.y), std::fabs(way.z)}));
  if (most == 0.0F) return;
  for (const RigidBlocks::Run& run : blocks_->on(level, block).rows) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto by = static_cast<float>(way[static_cast<int>(axis)]);
      for_cells(run, [&](VoxelId cell, std::uint32_t) { l.value[axis][cell] += by; });
    }
    log_.note(level, run.row);
    note_change(level, run.row, most);
  }
}

// Force and stiffness of a block on a level: springs of its border, boundary springs of its cells, its load.
// On level 0 the returned force is only the load that freezes the block's residual.
glm::dvec3 Multigrid::block_pull(int level, std::size_t block, glm::dvec3& stiffness) noexcept {
  const RigidBlocks::OnLevel& on = blocks_->on(level, block);
  stiffness = on.stiffness;
  if (level == 0) return block_state_[block].frozen_N;
  Level& l = at(level);
  glm::dvec3 pull = block_state_[block].on[static_cast<std::size_t>(level)].load;
  for (const RigidBlocks::Link& link : on.border) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto& value = l.value[static_cast<std::size_t>(axis)];
      pull[axis] +=
          along(link.spring, axis, link.d) * static_cast<double>(value[link.beside] - value[link.cell]);
    }
  }
  // If the tool or an obstacle holds the block, its cells have boundary springs because of that. These
  // springs would also hold the block along the surface, so they are left out.
  if (block_state_[block].held.count > 0 || blocks_->sprawls(block)) return pull;
  for (const RigidBlocks::Run& run : on.rows) {
    if (!boundary_springs_->any(level, run.row) || !prepare(level, run.row)) continue;
    RowStiffness springs;
    l.couplings->all(run.row, springs);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float* hold = boundary_springs_->hold(level, run.row, axis);
      for_cells(run, [&](VoxelId cell, std::uint32_t lane) {
        const float inverse = springs.inverse[axis * kRow + lane];
        if (!(hold[lane] > 0.0F) || !(inverse > 0.0F)) return;
        const double by = static_cast<double>(boundary_scale_ * hold[lane] / inverse);
        stiffness[static_cast<int>(axis)] += by;
        pull[static_cast<int>(axis)] +=
            by * static_cast<double>(l.loaded_at[axis][cell] - l.value[axis][cell]);
      });
    }
  }
  return pull;
}

void Multigrid::smooth_blocks(int level, const RigidBlocks::Box& box, Displacement& state,
                              const ObstacleView& obstacles) noexcept {
  if (blocks_ == nullptr) return;
  for_blocks(level, box, [&](std::size_t p, const RigidBlocks::OnLevel&, BlockOnLevel& on) {
    glm::dvec3 stiffness;
    glm::dvec3 pull = block_pull(level, p, stiffness);
    if (level == 0) {
      pull += block_force(p, state);
      add_what_comes_along(p, state, pull);
    }
    glm::dvec3 way(0.0);
    for (int axis = 0; axis < 3; ++axis) {
      if (stiffness[axis] > 0.0 && (level == 0 || (block_state_[p].stopped >> axis & 1U) == 0))
        way[axis] = pull[axis] / stiffness[axis];
    }
    if (level == 0) {
      move_block(p, way, state, obstacles);
      return;
    }
    way = block_state_[p].held.free_component(way);
    shift_cells(level, p, way);
    on.pending_correction += way;
  });
}

float Multigrid::measure_blocks(int level, const RigidBlocks::Box& box, Displacement& state,
                                const ObstacleView& obstacles) noexcept {
  if (blocks_ == nullptr) return 0.0F;
  for (BlockState& p : block_state_) {
    p.on[static_cast<std::size_t>(level)].left = glm::dvec3(0.0);
    p.on[static_cast<std::size_t>(level)].active = false;
    p.on[static_cast<std::size_t>(level) + 1].passed = glm::dvec3(0.0);
  }
  float worst = 0.0F;
  for_blocks(level, box, [&](std::size_t p, const RigidBlocks::OnLevel& of, BlockOnLevel& on) {
    BlockState& block = block_state_[p];
    glm::dvec3 stiffness;
    glm::dvec3 pull = block_pull(level, p, stiffness);
    if (level == 0) {
      pull += block_force(p, state);
      // An obstacle balances the force that presses the block on it.
      block.held = block.by_tool;
      stop_at_obstacles(p, state, obstacles, Tool::constrains);
      move_within(pull, stiffness, block_bounds_);
      for (const BlockBound& b : block_bounds_) {
        if (b.force_N > 0.0 && !b.both && b.room_m < kTouching * lattice_.min_spacing_m())
          block.held.add(b.normal);
      }
      // An active limit balances the force against it, too. Coarse levels would push against the limit in
      // vain.
      block.stopped = add_what_comes_along(p, state, pull);
    }
    for (int axis = 0; axis < 3; ++axis) {
      if ((block.stopped >> axis & 1U) != 0) pull[axis] = 0.0;
    }
    on.left = block.held.free_component(pull);
    on.active = true;
    block.on[static_cast<std::size_t>(level) + 1].passed = on.left;
    if (level > 0 || of.border.empty()) return;
    // The force of each border link may be off by the tolerance, so the residual is divided by the square
    // root of their number. The rounding of the displacement is subtracted first.
    const glm::dvec3 bit = kRounding * glm::abs(state.at(of.border.front().cell)) * stiffness;
    const double left = std::max(0.0, glm::length(on.left) - glm::length(bit));
    worst = std::max(worst, static_cast<float>(left / std::sqrt(static_cast<double>(of.border.size()))));
  });
  return worst;
}

}  // namespace voxel
