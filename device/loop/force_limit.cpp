// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/loop/force_limit.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "device/loop/is_finite.h"

namespace device {
namespace {

// A limit that is NaN or negative counts as 0.
double usable_limit(double limit) noexcept {
  return limit > 0.0 ? limit : 0.0;
}

// Returns `v`, shortened to the length `limit` if it is longer; `cut` says whether it was. The vector is
// divided by its largest component first, so that no square overflows or vanishes. A cut vector is shortened
// by 5 ulp more, so that rounding cannot put its length above the limit.
glm::dvec3 no_longer_than(const glm::dvec3& v, double limit, bool& cut) noexcept {
  const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  cut = false;
  if (largest <= 0.0) return v;
  const glm::dvec3 scaled = v / largest;
  const double scaled_length = glm::length(scaled);
  if (largest * scaled_length <= limit) return v;
  cut = true;
  return scaled * (limit / scaled_length * (1.0 - 1e-15));
}

// Adds the work that the last force did on the tool since the last tick.
void count_work(const ForceLimits& limits, ForceLimitState& state, const glm::dvec3& position_m,
                double dt_s) noexcept {
  if (!is_finite(position_m)) return;
  const double work = state.placed ? glm::dot(state.last_N, position_m - state.last_m) : 0.0;
  state.handed.add(std::max(0.0, work), dt_s, limits.energy_window_s);
  state.last_m = position_m;
  state.placed = true;
}

// Returns zero force, and counts its reason.
glm::dvec3 cut_force(ForceLimitState& state, std::uint64_t& counter) noexcept {
  ++counter;
  state.last_N = glm::dvec3(0.0);
  return state.last_N;
}

}  // namespace

void EnergyWindow::add(double energy_J, double dt_s, double window_s) noexcept {
  const double slot_s = window_s / static_cast<double>(kSlots - 1);
  in_slot_s_ += dt_s;
  for (std::size_t n = 0; in_slot_s_ >= slot_s && n < kSlots; ++n) {
    in_slot_s_ -= slot_s;
    newest_ = (newest_ + 1) % kSlots;
    energy_J_[newest_] = 0.0;
  }
  if (!(in_slot_s_ < slot_s)) in_slot_s_ = 0.0;  // longer than the window: all slots are empty now
  energy_J_[newest_] += energy_J;
}

double EnergyWindow::sum_J() const noexcept {
  double sum = 0.0;
  for (const double energy : energy_J_) sum += energy;
  return sum;
}

glm::dvec3 limit_force(const ForceLimits& limits, ForceLimitState& state, const glm::dvec3& command_N,
                       const DeviceState& tool, double dt_s) noexcept {
  const double dt = std::isfinite(dt_s) && dt_s > 0.0 ? dt_s : 0.0;
  count_work(limits, state, tool.position_m, dt);
  const double fade = limits.soft_start_s > 0.0 ? std::min(1.0, state.elapsed_s / limits.soft_start_s) : 1.0;
  // Bounded, because only values below soft_start_s matter.
  state.elapsed_s = std::min(state.elapsed_s + dt, std::max(0.0, limits.soft_start_s));

  // The finite check comes first, because a value that is not finite must not be stored in last_N. The force
  // is zero at once, and the slew rate starts from zero again.
  if (!is_finite(command_N)) return cut_force(state, state.nonfinite);
  // The comparisons are written so that a limit that is NaN cuts the force.
  std::uint64_t* reason = nullptr;
  if (tool.fault == DeviceFault::late || !(dt <= limits.deadline_s)) {
    reason = &state.late;
  } else if (stops_force(tool.fault)) {
    reason = &state.lost;
  } else if (!(state.handed.sum_J() < limits.max_energy_J)) {
    reason = &state.energy_limited;
  }
  if (reason != nullptr) {
    state.elapsed_s = 0.0;
    return cut_force(state, *reason);
  }

  bool cut = false;
  const glm::dvec3 wanted = command_N * fade;
  const glm::dvec3 step =
      no_longer_than(wanted - state.last_N, usable_limit(limits.max_slew_N_per_s) * dt, cut);
  // Within the slew rate the command itself is used: last + (command − last) would round.
  glm::dvec3 force = cut ? state.last_N + step : wanted;
  if (cut) ++state.slewed;

  force = no_longer_than(force, usable_limit(limits.max_force_N), cut);
  if (cut) ++state.clamped;

  if (!is_finite(force)) force = glm::dvec3(0.0);  // the difference of two finite forces can overflow
  state.last_N = force;
  return force;
}

glm::dvec3 limit_force(const ForceLimits& limits, ForceLimitState& state, const glm::dvec3& command_N,
                       double dt_s) noexcept {
  return limit_force(limits, state, command_N, DeviceState{}, dt_s);  // a tool that does not move
}

}  // namespace device
