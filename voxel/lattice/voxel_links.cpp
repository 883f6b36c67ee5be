// SPDX-License-Identifier: GPL-3.0-or-later
// Per-voxel link queries, and the minimum of energy outside an obstacle.
#include "voxel/lattice/voxel_links.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

namespace voxel {
namespace {

// Load on a voxel beyond its springs: of bricks or of plastic offsets. No object has both.
std::array<float, 3> load_beside_springs(const Lattice& lattice, const Displacement& state,
                                         const VoxelSprings& springs, VoxelId v) noexcept {
  return lattice.has_bricks() ? state.bricks.at(v) : plastic_load(lattice, state, springs, v);
}

glm::dvec3 force_of(const VoxelSprings& springs, const Lattice& lattice, const Displacement& state,
                    VoxelId v) noexcept {
  const std::array<float, 3> load = load_beside_springs(lattice, state, springs, v);
  std::array<double, 3> force{load[0], load[1], load[2]};
  for (std::size_t d = 0; d < 3; ++d) {
    const int id = static_cast<int>(d);
    const VoxelId up = lattice.up(v, id), down = lattice.down(v, id);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const LazyArray<float>& u = state.u[axis];
      const int ia = static_cast<int>(axis);
      force[axis] += static_cast<double>(springs.up[d].on(ia, id) * (u[up] - u[v])) +
                     static_cast<double>(springs.down[d].on(ia, id) * (u[down] - u[v]));
    }
  }
  return {force[0], force[1], force[2]};
}

}  // namespace

std::array<float, 2> link_interval(const Lattice& lattice, const Displacement& state, VoxelId v,
                                   int axis) noexcept {
  const LazyArray<float>& u = state.u[static_cast<std::size_t>(axis)];
  float low = -std::numeric_limits<float>::max(), high = std::numeric_limits<float>::max();
  for (int d = 0; d < 3; ++d) {
    const VoxelId up = lattice.up(v, d), down = lattice.down(v, d);
    if (lattice.filled(up)) {  // b0 <= u(up) − u(v) <= b1
      const auto b = lattice.bounds(v, d, axis);
      low = std::max(low, u[up] - b[1]);
      high = std::min(high, u[up] - b[0]);
    }
    if (lattice.filled(down)) {
      const auto b = lattice.bounds(down, d, axis);
      low = std::max(low, u[down] + b[0]);
      high = std::min(high, u[down] + b[1]);
    }
  }
  return {low, high};
}

float clamp_to(const std::array<float, 2>& interval, float wanted, float now) noexcept {
  return interval[0] > interval[1] ? now : std::clamp(wanted, interval[0], interval[1]);
}

glm::dvec3 unconstrained_minimum(LevelStiffness& couplings, const Displacement& state, VoxelId v) noexcept {
  const VoxelSprings springs = couplings.springs_of(v);
  const Grid& grid = couplings.grid();
  std::array<float, 3> sum = load_beside_springs(couplings.lattice(), state, springs, v);
  for (std::size_t d = 0; d < 3; ++d) {
    const int id = static_cast<int>(d);
    const VoxelId up = grid.up(v, id), down = grid.down(v, id);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const LazyArray<float>& u = state.u[axis];
      const int ia = static_cast<int>(axis);
      sum[axis] += springs.up[d].on(ia, id) * u[up] + springs.down[d].on(ia, id) * u[down];
    }
  }
  return {static_cast<double>(sum[0] * springs.inverse[0]), static_cast<double>(sum[1] * springs.inverse[1]),
          static_cast<double>(sum[2] * springs.inverse[2])};
}

glm::dvec3 clamp_to_links(const Lattice& lattice, const Displacement& state, VoxelId v,
                          const glm::dvec3& wanted) noexcept {
  glm::dvec3 result(0.0);
  for (int axis = 0; axis < 3; ++axis) {
    result[axis] =
        static_cast<double>(clamp_to(link_interval(lattice, state, v, axis), static_cast<float>(wanted[axis]),
                                     state.u[static_cast<std::size_t>(axis)][v]));
  }
  return result;
}

VoxelLinks links_of(LevelStiffness& couplings, const Displacement& state, VoxelId v) noexcept {
  const Lattice& lattice = couplings.lattice();
  const VoxelSprings springs = couplings.springs_of(v);
  std::array<float, 3> sum = load_beside_springs(lattice, state, springs, v), low, high;
  low.fill(-std::numeric_limits<float>::max());
  high.fill(std::numeric_limits<float>::max());
  for (std::size_t d = 0; d < 3; ++d) {
    const int id = static_cast<int>(d);
    const VoxelId up = lattice.up(v, id), down = lattice.down(v, id);
    const bool filled_up = lattice.filled(up), filled_down = lattice.filled(down),
               same = lattice.uniform_limits();
    const LinkLimit& to_up = same ? lattice.tightest(id) : lattice.limit(v, id);
    const LinkLimit& to_down = same ? lattice.tightest(id) : lattice.limit(down, id);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float above = state.u[axis][up], below = state.u[axis][down];
      const int ia = static_cast<int>(axis);
      sum[axis] += springs.up[d].on(ia, id) * above + springs.down[d].on(ia, id) * below;
      if (filled_up) {  // b0 <= u(up) − u(v) <= b1
        low[axis] = std::max(low[axis], above - (axis == d ? to_up.along_high : to_up.across));
        high[axis] = std::min(high[axis], above - (axis == d ? to_up.along_low : -to_up.across));
      }
      if (filled_down) {
        low[axis] = std::max(low[axis], below + (axis == d ? to_down.along_low : -to_down.across));
        high[axis] = std::min(high[axis], below + (axis == d ? to_down.along_high : to_down.across));
      }
    }
  }
  VoxelLinks out;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int ia = static_cast<int>(axis);
    out.minimum[ia] = static_cast<double>(sum[axis] * springs.inverse[axis]);
    out.compliance[ia] = static_cast<double>(springs.inverse[axis]);
    out.interval[axis] = {low[axis], high[axis]};
  }
  return out;
}

glm::dvec3 clamp_to_links(const VoxelLinks& links, const glm::dvec3& wanted, const glm::dvec3& now) noexcept {
  glm::dvec3 result(0.0);
  for (int axis = 0; axis < 3; ++axis) {
    result[axis] =
        static_cast<double>(clamp_to(links.interval[static_cast<std::size_t>(axis)],
                                     static_cast<float>(wanted[axis]), static_cast<float>(now[axis])));
  }
  return result;
}

glm::dvec3 link_force(LevelStiffness& couplings, const Displacement& state, VoxelId v) noexcept {
  return force_of(couplings.springs_of(v), couplings.lattice(), state, v);
}

double link_force(LevelStiffness& couplings, const Displacement& state, VoxelId v, int axis) noexcept {
  const VoxelSprings springs = couplings.springs_of(v);
  const Lattice& lattice = couplings.lattice();
  const auto ua = static_cast<std::size_t>(axis);
  const LazyArray<float>& u = state.u[ua];
  double force = static_cast<double>(load_beside_springs(lattice, state, springs, v)[ua]);
  for (int d = 0; d < 3; ++d) {
    const auto ud = static_cast<std::size_t>(d);
    force += static_cast<double>(springs.up[ud].on(axis, d) * (u[lattice.up(v, d)] - u[v])) +
             static_cast<double>(springs.down[ud].on(axis, d) * (u[lattice.down(v, d)] - u[v]));
  }
  return force;
}

glm::dvec3 link_force(const Lattice& lattice, const Displacement& state, VoxelId v) noexcept {
  return force_of(lattice.springs_of(v), lattice, state, v);
}

glm::dvec3 link_compliance(LevelStiffness& couplings, VoxelId v) noexcept {
  const std::array<float, 3> inverse = couplings.springs_of(v).inverse;
  return {inverse[0], inverse[1], inverse[2]};
}

double depth_in_obstacle(const Obstacle& o, const glm::dvec3& u) noexcept {
  return static_cast<double>(o.bound) - glm::dot(glm::dvec3(o.normal), u);
}

bool is_jammed(const ObstacleView& view, const Displacement& state, VoxelId v, double margin) noexcept {
  const Obstacle& o = view.of(v);
  return glm::dot(glm::dvec3(o.normal), state.at(v)) < static_cast<double>(o.bound) + margin;
}

glm::dvec3 no_deeper(const Obstacle& o, const glm::dvec3& before, const glm::dvec3& after) noexcept {
  const double now = depth_in_obstacle(o, before), then = depth_in_obstacle(o, after);
  if (then <= std::max(now, 0.0)) return after;
  const double out = std::max(-now, 0.0);
  return before + (after - before) * (out / (then + out));
}

namespace {

// Place of least energy within the intervals low … high and outside the obstacle (m). `wanted` is the place
// of least energy without obstacle and intervals. `w` is the compliance (m/N). The force of the obstacle is
// raised from 0 until the place is outside. A force of 1 N moves each axis by w·n, as long as the axis lies
// in its interval. To project first and clamp afterwards would be wrong: the other axes would not move
// further for an axis that is stopped at the end of its interval.
glm::dvec3 least_outside(const Obstacle& o, const glm::dvec3& w, const glm::dvec3& wanted,
                         const glm::dvec3& low, const glm::dvec3& high) noexcept {
  const glm::dvec3 n(o.normal), rate = w * n;
  glm::dvec3 place = glm::clamp(wanted, low, high);
  double depth = depth_in_obstacle(o, place), pressed = 0.0;  // multiplier so far (N)
  for (int part = 0; part < 6 && depth > 0.0;
       ++part) {  // pieces of the path: each ends where an axis starts or stops moving
    double until = std::numeric_limits<double>::infinity(), out = 0.0;
    glm::dvec3 moves(0.0);
    for (int axis = 0; axis < 3; ++axis) {
      if (rate[axis] == 0.0) continue;
      const double to_low = (low[axis] - wanted[axis]) / rate[axis],
                   to_high = (high[axis] - wanted[axis]) / rate[axis], begins = std::min(to_low, to_high),
                   ends = std::max(to_low, to_high);
      if (pressed >= ends) continue;
      if (pressed < begins) {
        until = std::min(until, begins);
        continue;
      }
      until = std::min(until, ends);
      moves[axis] = rate[axis];
      out += n[axis] * rate[axis];
    }
    const double more = out > 0.0 ? std::min(until - pressed, depth / out) : until - pressed;
    if (!std::isfinite(more)) break;
    place = glm::clamp(place + more * moves, low, high);
    depth -= more * out;
    if (out > 0.0 && pressed + more < until) break;
    pressed = until;
  }
  return place;
}

}  // namespace

void relax_obstacle(LevelStiffness& couplings, Displacement& state, const ObstacleView& view, VoxelId v,
                    const glm::dvec3& load_N) noexcept {
  const Obstacle& o = view.of(v);
  const glm::dvec3 n(o.normal), before = state.at(v), w = link_compliance(couplings, v);
  const glm::dvec3 wanted = unconstrained_minimum(couplings, state, v) + w * load_N;
  if (!o.moving) {
    // Fixed surface: project in the metric of the springs. This lowers the energy along the surface and
    // suffices, because tissue does not carry a fixed surface.
    const double depth = depth_in_obstacle(o, wanted), denominator = glm::dot(n, w * n);
    const glm::dvec3 projected =
        depth > 0.0 && denominator > 0.0 ? wanted + (depth / denominator) * w * n : wanted;
    const glm::dvec3 within = clamp_to_links(couplings.lattice(), state, v, projected);
    const double now = depth_in_obstacle(o, before);
    // If limits keep a voxel that is inside the obstacle from reaching its projection, the minimum within
    // limits and obstacle is computed below. Otherwise the voxel would never move again.
    if (now <= kTouching * couplings.lattice().min_spacing_m() || depth_in_obstacle(o, within) <= now) {
      state.set(v, no_deeper(o, before, within));
      return;
    }
  }
  glm::dvec3 low, high;
  for (int axis = 0; axis < 3; ++axis) {
    const std::array<float, 2> interval = link_interval(couplings.lattice(), state, v, axis);
    const bool empty = !(interval[0] <= interval[1]);  // by rounding
    low[axis] = empty ? before[axis] : static_cast<double>(interval[0]);
    high[axis] = empty ? before[axis] : static_cast<double>(interval[1]);
  }
  state.set(v, no_deeper(o, before, least_outside(o, w, wanted, low, high)));
}

}  // namespace voxel
