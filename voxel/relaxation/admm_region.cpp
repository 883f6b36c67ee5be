// SPDX-License-Identifier: GPL-3.0-or-later
// The region around active limits, its sweeps and multiplier updates, and the clamped result.
#include "voxel/relaxation/admm_region.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace voxel {
namespace {

constexpr std::size_t kMost = 4096;            // largest number of moving voxels
constexpr std::size_t kMostKnown = 8 * kMost;  // largest number of voxels with multipliers
constexpr int kDeep = 3;  // number of layers of neighbours that belong to the region completely
constexpr int kFar = 12;  // number of all layers; layers beyond kDeep follow only links at their limits
constexpr int kSweeps = 30, kTickSweeps = 6;  // sweeps in a round beside moving bodies; in a tick
constexpr int kToolSweeps = 100;              // sweeps in a round under the tool, which no tick waits for
constexpr std::uint64_t kOtherWork = 5;       // cost of all work of relax() except sweeps (unit: sweep)
constexpr double kFurther = 1.6;              // over-relaxation (Boyd et al., 3.4.3)
// Distances of a link from its limit (unit: spacing). Below the first it is at its limit; below the second it
// may reach its limit.
constexpr double kActiveAtFirst = 1e-3;
constexpr double kNearLimit = 0.4;
// Limits are tightened by this while the least energy is searched, so that the result hardly violates them
// (unit: spacing).
constexpr double kTighter = 2e-5;
// Replaces kTighter under the tool. There cycles and the tick continue from the result up to the limits
// themselves.
constexpr double kTighterAtTool = 2e-6;
// A voxel deeper in an obstacle than this counts as squeezed: limits keep it there (unit: spacing).
constexpr double kSqueezed = 5e-3;
constexpr int kRounds = 4;          // rounds that alternate between limits and obstacles
constexpr int kMostPasses = 60;     // largest number of passes to bring one axis within its limits
constexpr double kRounding = 1e-9;  // smaller motions count as rounding (unit: spacing)

}  // namespace

AdmmRegion::AdmmRegion(const Lattice& lattice)
    : lattice_(lattice),
      spacing_m_(lattice.min_spacing_m()),
      number_(lattice.size()),
      asked_(lattice.size()) {
  const std::size_t most = std::min(4 * kMost, lattice.voxel_count());
  on_body_.reserve(kMost);
  members_.reserve(most);
  links_.reserve(3 * most);
  known_.reserve(std::min(kMostKnown, lattice.voxel_count()));
  for (auto& of_axis : beyond_) of_axis = LazyArray<float>(lattice.size());
  for (auto& of_axis : pressed_) of_axis = LazyArray<float>(lattice.size());
}

void AdmmRegion::prepare_lists() {
  const auto fill = [](auto& list) {
    list.resize(list.capacity());
    list.clear();
  };
  fill(on_body_);
  fill(members_);
  fill(links_);
  fill(known_);
}

void AdmmRegion::prepare_all() {
  prepare_lists();
  number_.populate();
  asked_.populate();
  for (auto& of_axis : beyond_) of_axis.populate();
  for (auto& of_axis : pressed_) of_axis.populate();
}

std::uint32_t AdmmRegion::add(VoxelId v) noexcept {
  if (number_[v] != 0) return number_[v] - 1;
  members_.emplace_back().v = v;
  number_[v] = static_cast<std::uint32_t>(members_.size());
  return number_[v] - 1;
}

bool AdmmRegion::at_limit(const Displacement& state, VoxelId v, VoxelId up, int d) const noexcept {
  const auto tight = static_cast<float>(kActiveAtFirst * spacing_m_);
  for (int axis = 0; axis < 3; ++axis) {
    const auto b = lattice_.bounds(v, d, axis);
    const LazyArray<float>& u = state.u[static_cast<std::size_t>(axis)];
    const float difference = u[up] - u[v];
    if (difference < b[0] + tight || difference > b[1] - tight) return true;
  }
  return false;
}

bool AdmmRegion::gather(const Multigrid& multigrid, const Displacement& state, bool with_tool) noexcept {
  for (const Member& m : members_) number_[m.v] = 0;
  members_.clear();
  const auto moves = [&](VoxelId v) {
    return members_.size() < kMost && lattice_.filled(v) && !lattice_.anchored(v) &&
           (!Displacement::stands(state.role[v]) || (with_tool && state.role[v] == Displacement::pressed));
  };
  multigrid.for_active([&](VoxelId v, int) {
    if (moves(v)) members_[add(v)].moves = true;
  });
  for (const VoxelId v : on_body_) {
    if (moves(v)) members_[add(v)].moves = true;
  }
  std::size_t first = 0;
  for (int n = 0; n < kFar && first < members_.size(); ++n) {
    for (const std::size_t last = members_.size(); first < last; ++first) {
      const VoxelId v = members_[first].v;
      for (int d = 0; d < 3; ++d) {
        for (const bool up : {false, true}) {
          const VoxelId w = up ? lattice_.up(v, d) : lattice_.down(v, d);
          if (number_[w] != 0 || !moves(w)) continue;
          if (n < kDeep || at_limit(state, up ? v : w, up ? w : v, d)) members_[add(w)].moves = true;
        }
      }
    }
  }
  if (members_.empty()) return false;
  add_neighbours();
  return true;
}

// Adds the neighbours of all moving members as fixed members.
void AdmmRegion::add_neighbours() noexcept {
  const std::size_t moving = members_.size();
  for (std::size_t i = 0; i < moving; ++i) {
    for (int d = 0; d < 3; ++d) {
      const auto ud = static_cast<std::size_t>(d);
      for (const bool up : {false, true}) {
        const VoxelId w = up ? lattice_.up(members_[i].v, d) : lattice_.down(members_[i].v, d);
        if (!lattice_.filled(w)) continue;
        const std::uint32_t j = add(w);
        (up ? members_[i].up : members_[i].down)[ud] = j;
        (up ? members_[j].down : members_[j].up)[ud] = static_cast<std::uint32_t>(i);
      }
    }
  }
}

double AdmmRegion::tighter(const Link& link, std::size_t axis) const noexcept {
  return std::min(tighter_m_, 0.25 * (link.high[axis] - link.low[axis]));
}

void AdmmRegion::prepare_links(LevelStiffness& couplings) noexcept {
  links_.assign(3 * members_.size(), Link{});
  for (std::size_t i = 0; i < members_.size(); ++i) {
    const Member& m = members_[i];
    const VoxelSprings springs = couplings.springs_of(m.v);
    for (std::size_t d = 0; d < 3; ++d) {
      if (m.up[d] == kNone || !(m.moves || members_[m.up[d]].moves)) continue;
      Link& l = links_[3 * i + d];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const int ia = static_cast<int>(axis), id = static_cast<int>(d);
        const auto b = lattice_.bounds(m.v, id, ia);
        l.stiff_N_per_m[axis] = static_cast<double>(springs.up[d].on(ia, id));
        l.low[axis] = static_cast<double>(b[0]);
        l.high[axis] = static_cast<double>(b[1]);
        const double is = members_[m.up[d]].from[axis] - m.from[axis],
                     left = std::min(is - l.low[axis], l.high[axis] - is) / spacing_m_,
                     beyond = static_cast<double>(beyond_[3 * axis + d][m.v]);
        at_limits_ = at_limits_ || left < kActiveAtFirst;
        if (beyond == 0.0 && left >= kNearLimit) continue;
        l.near = static_cast<std::uint8_t>(l.near | 1U << axis);
        l.beyond[axis] = beyond;
        l.within[axis] = std::clamp(is, l.low[axis] + tighter(l, axis), l.high[axis] - tighter(l, axis));
      }
    }
  }
}

// Prepares members and links. False if no link is at its limit, or if a voxel is squeezed.
bool AdmmRegion::prepare(Multigrid& multigrid, const Displacement& state,
                         const ObstacleView& obstacles) noexcept {
  for (Member& m : members_) {
    const glm::dvec3 at = state.at(m.v);
    m.from = m.found = {at.x, at.y, at.z};
  }
  prepare_links(multigrid.couplings());
  if (!at_limits_) return false;
  for (std::size_t i = 0; i < members_.size(); ++i) {
    Member& m = members_[i];
    if (!m.moves) continue;
    const std::array<float, 3> own = lattice_.has_bricks() ? state.bricks.at(m.v) : std::array<float, 3>{};
    const glm::dvec3 balance = multigrid.frozen_load(m.v, state);
    Axes sum{};
    for_links(i, [&](const Link& l, const Member&, bool) {
      for (std::size_t axis = 0; axis < 3; ++axis)
        sum[axis] += l.stiff_N_per_m[axis] * ((l.near >> axis & 1U) != 0 ? 1.0 + kOfLink : 1.0);
    });
    m.outside = state.role[m.v] == Displacement::obstacle;
    if (m.outside) m.plane = obstacles.of(m.v);
    if (state.role[m.v] == Displacement::pressed) {
      m.outside = true;
      m.plane.normal = state.tool_normal[lattice_.surface_number(m.v)];
      m.plane.bound = static_cast<float>(glm::dot(glm::dvec3(m.plane.normal), state.at(m.v)));
    }
    m.hold_N_per_m = m.outside ? (sum[0] + sum[1] + sum[2]) / 3.0 : 0.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      m.load_N[axis] = static_cast<double>(own[axis]) + balance[static_cast<int>(axis)];
      m.inverse[axis] = sum[axis] > 0.0 ? 1.0 / (sum[axis] + m.hold_N_per_m) : 0.0;
      if (!m.outside || !(m.hold_N_per_m > 0.0)) continue;
      m.out[axis] = m.from[axis];
      m.pressed[axis] = static_cast<double>(pressed_[axis][m.v]) / m.hold_N_per_m;
    }
    if (m.outside && depth_in_obstacle(m.plane, state.at(m.v)) > kSqueezed * spacing_m_) return false;
  }
  return true;
}

// One Gauss-Seidel sweep on the augmented Lagrangian.
void AdmmRegion::sweep(bool forwards) noexcept {
  const std::size_t count = members_.size();
  for (std::size_t n = 0; n < count; ++n) {
    const std::size_t i = forwards ? n : count - 1 - n;
    if (!members_[i].moves) continue;
    const Member& m = members_[i];
    Axes sum{};
    for (std::size_t axis = 0; axis < 3; ++axis)
      sum[axis] = m.load_N[axis] + m.hold_N_per_m * (m.out[axis] - m.pressed[axis]);
    for_links(i, [&](const Link& l, const Member& beside, bool up) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double k = l.stiff_N_per_m[axis], to = beside.found[axis];
        sum[axis] += k * to;
        if ((l.near >> axis & 1U) == 0) continue;
        const double within = l.within[axis] - l.beyond[axis];
        sum[axis] += kOfLink * k * (up ? to - within : to + within);
      }
    });
    for (std::size_t axis = 0; axis < 3; ++axis) members_[i].found[axis] = sum[axis] * m.inverse[axis];
  }
}

void AdmmRegion::set_multipliers() noexcept {
  for (std::size_t i = 0; i < members_.size(); ++i) {
    Member& m = members_[i];
    for (std::size_t d = 0; d < 3; ++d) {
      Link& l = links_[3 * i + d];
      for (std::size_t axis = 0; axis < 3 && l.near != 0; ++axis) {
        if ((l.near >> axis & 1U) == 0) continue;
        const double is = kFurther * (members_[m.up[d]].found[axis] - m.found[axis]) +
                          (1.0 - kFurther) * l.within[axis] + l.beyond[axis];
        l.within[axis] = std::clamp(is, l.low[axis] + tighter(l, axis), l.high[axis] - tighter(l, axis));
        l.beyond[axis] = is - l.within[axis];
      }
    }
    if (!m.outside || !m.moves) continue;
    glm::dvec3 is(0.0);
    for (std::size_t axis = 0; axis < 3; ++axis)
      is[static_cast<int>(axis)] =
          kFurther * m.found[axis] + (1.0 - kFurther) * m.out[axis] + m.pressed[axis];
    const double depth = depth_in_obstacle(m.plane, is) + tighter_m_;
    const glm::dvec3 in = std::max(0.0, depth) * glm::dvec3(m.plane.normal);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const int ia = static_cast<int>(axis);
      m.out[axis] = is[ia] + in[ia];
      m.pressed[axis] = -in[ia];
    }
  }
}

// Brings one axis within its limits. Lowers each member (`downwards`), or raises it, to the bound that the
// shortest path from any other member gives. Solutions of difference constraints are closed under minimum and
// maximum, so lowering and then raising suffices. False if kMostPasses passes did not suffice.
bool AdmmRegion::come_within(std::size_t axis, bool downwards) noexcept {
  const std::size_t count = members_.size();
  for (int n = 0; n < kMostPasses; ++n) {
    bool changed = false;
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t i = n % 2 == 0 ? k : count - 1 - k;
      Member& m = members_[i];
      if (!m.moves) continue;
      double to = m.found[axis];
      for_links(i, [&](const Link& l, const Member& beside, bool up) {
        const double at = beside.found[axis];
        if (downwards) {
          to = std::min(to, up ? at - l.low[axis] : at + l.high[axis]);
        } else {
          to = std::max(to, up ? at - l.high[axis] : at + l.low[axis]);
        }
      });
      changed = changed || std::fabs(to - m.found[axis]) > kRounding * spacing_m_;
      m.found[axis] = to;
    }
    if (!changed) return true;
  }
  return false;
}

// Brings the result within its limits, and out of obstacles as far as the limits allow. False if limits
// remain violated.
bool AdmmRegion::allow() noexcept {
  for (int n = 0; n < kRounds; ++n) {
    bool deep = false;
    for (Member& m : members_) {
      if (!m.outside || !m.moves) continue;
      const double depth = depth_in_obstacle(m.plane, {m.found[0], m.found[1], m.found[2]});
      if (!(depth > 0.0)) continue;
      deep = true;
      for (std::size_t axis = 0; axis < 3; ++axis)
        m.found[axis] += depth * static_cast<double>(m.plane.normal[static_cast<int>(axis)]);
    }
    if (n > 0 && !deep) break;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!come_within(axis, true) || !come_within(axis, false)) return false;
    }
  }
  return true;
}

double AdmmRegion::relax(Multigrid& multigrid, Displacement& state, const ObstacleView& obstacles,
                         std::span<const VoxelId> on_body, bool briefly) noexcept {
  looked_at_ = 0;
  at_limits_ = false;
  tighter_m_ = (obstacles.moving > 0 ? kTighter : kTighterAtTool) * spacing_m_;
  if (!on_body.empty()) {
    const std::span<const VoxelId> first = on_body.first(std::min(on_body.size(), kMost));
    on_body_.assign(first.begin(), first.end());
  }
  if (!gather(multigrid, state, obstacles.moving == 0)) {
    skip(multigrid);
    return 0.0;
  }
  if (!prepare(multigrid, state, obstacles)) {
    forget(multigrid);
    return 0.0;
  }
  const int longest = obstacles.moving > 0 ? kSweeps : kToolSweeps;
  const int sweeps = !on_body.empty() ? kTickSweeps : briefly ? longest / 2 : longest;
  for (int n = 0; n < sweeps; ++n) {
    sweep(n % 2 == 0);
    set_multipliers();
  }
  looked_at_ = members_.size() * (static_cast<std::uint64_t>(sweeps) + kOtherWork);
  keep_multipliers(multigrid);
  const double part = allow() ? share() : 0.0;
  if (!(part > 0.0)) return 0.0;
  double most_N = 0.0;
  for (const Member& m : members_) {
    if (!m.moves) continue;
    glm::dvec3 to(0.0);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double way = part * (m.found[axis] - m.from[axis]);
      to[static_cast<int>(axis)] = m.from[axis] + way;
      if (m.inverse[axis] > 0.0) most_N = std::max(most_N, std::fabs(way) / m.inverse[axis]);
    }
    state.set(m.v, to);
    multigrid.mark_dirty(0, m.v / kRow);
  }
  return most_N;
}

std::size_t AdmmRegion::memory_bytes() const {
  std::size_t bytes = resident_bytes(on_body_) + resident_bytes(members_) + resident_bytes(links_) +
                      resident_bytes(known_) + number_.resident_bytes() + asked_.resident_bytes();
  for (const auto& of_axis : beyond_) bytes += of_axis.resident_bytes();
  for (const auto& of_axis : pressed_) bytes += of_axis.resident_bytes();
  return bytes;
}

}  // namespace voxel
