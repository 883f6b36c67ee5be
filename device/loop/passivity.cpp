// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/loop/passivity.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "device/loop/is_finite.h"

namespace device {
namespace {

// Energy that may be given beyond worst_tick_J, too small to be measured. Without it the force would stay
// zero once given_J equals worst_tick_J, and no work against it could lower given_J again.
constexpr double kSpare_J = 1e-9;
// Energy that a force may give to a tool at rest before any energy is stored. It is enough for walls of up to
// 2.5 kN/m at 1 kHz to start with their whole force.
constexpr double kSeed_J = 200e-6;
constexpr double kStrideKept_s = 0.5;  // time constant with which stride_m falls

// Longest step that a tool at rest can make until the next tick (m). Never 0, because it is a divisor.
double sudden_m(const PassivityOptions& options, double dt_s) noexcept {
  constexpr double kLeast_m = 1e-9;
  return std::max(kLeast_m, options.max_acceleration_m_per_s2 * dt_s * dt_s + options.resolution_m);
}

// Longest step (m) of a tool that may move as fast as it did recently, in either direction.
double reach_m(const PassivityOptions& options, const PassivityState& state, double dt_s) noexcept {
  return 2.0 * state.stride_m + sudden_m(options, dt_s);
}

// Adds the work of the last force over the tool's step `way` (m).
void observe(const PassivityOptions& options, PassivityState& state, const glm::dvec3& way,
             double dt_s) noexcept {
  const double length = glm::length(way);
  if (length > reach_m(options, state, dt_s)) ++state.jumps;
  state.stride_m = std::max(length, state.stride_m * (1.0 - std::min(1.0, dt_s / kStrideKept_s)));
  const double work = glm::dot(state.last_N, way);
  state.given_J += work;
  state.worst_tick_J = std::max(state.worst_tick_J, std::abs(work));
  // A step longer than reach_m() may exceed the guarantee. The excess is then added to worst_tick_J.
  // Otherwise the force would never recover.
  state.worst_tick_J = std::max(state.worst_tick_J, state.given_J - kSpare_J);
  state.most_given_J = std::max(state.most_given_J, state.given_J);
}

}  // namespace

glm::dvec3 keep_passive(const PassivityOptions& options, PassivityState& state, const glm::dvec3& force_N,
                        const glm::dvec3& position_m, double dt_s) noexcept {
  const double dt = std::isfinite(dt_s) && dt_s > 0.0 ? dt_s : 0.0;
  if (!is_finite(force_N) || !is_finite(position_m)) {
    state.last_N = glm::dvec3(0.0);
    return state.last_N;
  }
  glm::dvec3 way(0.0);
  if (state.started) {
    way = position_m - state.last_m;
    observe(options, state, way, dt);
  } else {
    state.started = true;
    state.stride_m = 0.5 * options.max_speed_m_per_s * dt;
  }
  state.last_m = position_m;

  const double size = glm::length(force_N);
  const double expected_J = glm::dot(force_N, way);
  if (expected_J < 0.0 || !(size > 0.0))
    state.share = std::min(1.0, state.share + (options.release_s > 0.0 ? dt / options.release_s : 1.0));
  if (!(size > 0.0)) {
    if (state.given_J < 0.0) state.given_J *= 1.0 - std::min(1.0, dt / options.forget_s);
    state.depth_m = 0.0;
    state.last_N = force_N;
    return force_N;
  }
  ++state.felt;
  state.depth_m = std::max(0.0, state.depth_m - expected_J / size);
  if (expected_J > 0.0) {
    // A spring whose force grows from zero over `depth_m` stores half of force · depth.
    const double stored_J = std::max(0.0, -state.given_J);
    const double needed_J = std::max(expected_J, 0.5 * size * state.depth_m);
    if (needed_J > stored_J) state.share = std::min(state.share, stored_J / needed_J);
  }
  if (state.given_J <= 0.0) {
    const double most_N = (kSeed_J - state.given_J) / sudden_m(options, dt);
    if (size > most_N) state.share = std::min(state.share, most_N / size);
  } else {
    const double most_N = (state.worst_tick_J + kSpare_J - state.given_J) / reach_m(options, state, dt);
    if (size > most_N) state.share = std::min(state.share, std::max(0.0, most_N) / size);
  }

  state.last_N = state.share < 1.0 ? state.share * force_N : force_N;
  if (state.share < 1.0) {
    ++state.acted;
    const double removed_N = (1.0 - state.share) * size;
    state.most_taken_N = std::max(state.most_taken_N, removed_N);
    state.most_taken_jnd =
        std::max(state.most_taken_jnd, removed_N / std::max(options.jnd_share * size, options.jnd_floor_N));
    state.taken_sum_N2 += removed_N * removed_N;
  }
  return state.last_N;
}

}  // namespace device
