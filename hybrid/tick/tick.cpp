// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tick/tick.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>

#include "hybrid/base/thread_time.h"
#include "hybrid/tick/bodies/bodies_press_tissue.h"
#include "hybrid/tick/bodies/move_bodies.h"
#include "hybrid/tick/bodies/tissue_supports_bodies.h"
#include "hybrid/tick/forces_by_object.h"
#include "hybrid/tick/proxy/feel_stage.h"
#include "hybrid/tick/proxy/proxy_step.h"
#include "hybrid/tick/settle_contact.h"
#include "hybrid/tick/tissue/async_relaxation.h"
#include "hybrid/tick/tissue/obstacles.h"
#include "hybrid/tick/tissue/press_tissue.h"
#include "hybrid/tick/tissue/soft_contacts.h"
#include "hybrid/tick/tissue/tissue_facets.h"
#include "polygon/mesh/is_finite.h"

namespace hybrid {
namespace {

constexpr double kFarthestDevice_m = 1e12;   // m; a thousand times the largest scene
constexpr double kLongestTick_s = 86'400.0;  // a day: times stay finite however many ticks are added

// Measures the CPU time of each stage, so that pre-emption does not count. A read of the thread's CPU time is
// a system call and takes up to 2 µs; the wall clock takes 0.03 µs. So a stage is timed by the wall clock
// first. If its wall time is long enough to hide a pre-emption, CPU time is read and replaces it. The tick is
// the sum of its stages.
class StageClock {
 public:
  explicit StageClock(TickResult& result)
      : result_(result), cpu_us_(1e6 * thread_time_s()), last_(Clock::now()) {}
  void done(Stage stage) noexcept {
    const auto now = Clock::now();
    double us = std::chrono::duration<double, std::micro>(now - last_).count();
    last_ = now;
    if (us > kShort_us) {
      const double cpu_us = 1e6 * thread_time_s();
      us = std::max(0.0, cpu_us - cpu_us_ - short_us_);
      cpu_us_ = cpu_us;
      short_us_ = 0.0;
      last_ = Clock::now();
    } else {
      short_us_ += us;
    }
    result_.stage_us[static_cast<std::size_t>(stage)] += static_cast<float>(us);
  }
  // Subtracts from a finished stage the time that a separate thread would have spent.
  void leave_out(Stage stage, double us) noexcept {
    float& of_stage = result_.stage_us[static_cast<std::size_t>(stage)];
    of_stage = std::max(0.0F, of_stage - static_cast<float>(us));
  }
  void stop() noexcept {
    for (const float us : result_.stage_us) result_.tick_us += static_cast<double>(us);
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr double kShort_us = 10.0;  // longest wall time that is taken as CPU time

  TickResult& result_;
  double cpu_us_;          // thread's CPU time when it was last read
  double short_us_ = 0.0;  // wall time of the stages since that read
  Clock::time_point last_;
};

// Is the position valid? One beyond kFarthestDevice_m is as invalid as NaN.
bool is_place(const glm::dvec3& v) noexcept {
  return polygon::is_finite(v) &&
         std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}) <= kFarthestDevice_m;
}

glm::dvec3 check_input(WorldState& state, const device::DeviceState& input) noexcept {
  if (is_place(input.position_m)) {
    state.device_m = input.position_m;
  } else {
    ++state.nonfinite;
    state.faults |= fault_nonfinite_input;
  }
  return state.device_m;
}

// A negative or non-finite dt is treated as 0.
double check_time(double dt_s) noexcept {
  return dt_s > 0.0 && std::isfinite(dt_s) ? std::min(dt_s, kLongestTick_s) : 0.0;
}

// Crosses free space at once. Otherwise lists the voxels that the tool may touch in this tick, and prepares
// objects on nested patches for contact.
Neighbourhood broad_phase(const World& world, WorldState& state, const glm::dvec3& device) noexcept {
  Neighbourhood around{.range_m = contact_range_m(world, state)};
  // The map holds an object that is pressed on nested patches in its rest state, so the map cannot decide
  // that the way is free.
  around.free = !contact_on_patches(state) &&
                advance_through_free_space(world, state, device, soft_reach(world, state));
  if (around.free) state.active_count = 0;
  if (!around.free && !state.soft.empty()) {
    around.near_soft = find_touched_voxels(world, state, state.proxy_m, around.range_m);
  } else {
    for (auto& object : state.soft) {
      if (!object->touched().empty()) object->touch({});
    }
  }
  prepare_patches(world, state, state.proxy_m);
  return around;
}

// Tissue away from the contact relaxes; surface voxels that came near rigid surfaces get their obstacles.
void relax_tissue(const World& world, WorldState& state, StageClock& clock) noexcept {
  relax_background(world, state);
  refresh_obstacles_of_arrived_rows(world, state);
  clock.done(Stage::background);
  clock.leave_out(Stage::background, state.async.other_thread_us);
}

// The last operations on the force, in the order that device/README.md justifies.
glm::dvec3 make_safe(const World& world, WorldState& state, const glm::dvec3& force_N,
                     const device::DeviceState& input, double dt_s) noexcept {
  // limit_force() gets the position in use: an invalid input was replaced by the last valid one.
  const device::DeviceState tool{.position_m = state.device_m, .fault = input.fault};
  const std::uint64_t bad = state.limit.nonfinite;
  device::ForceLimits limits = world.limits;
  limits.max_force_N = max_force_N(world, state);
  const glm::dvec3 limited = device::limit_force(limits, state.limit, force_N, tool, dt_s);
  state.nonfinite += state.limit.nonfinite - bad;
  if (!world.passivity) return limited;
  return device::keep_passive(*world.passivity, state.passive, limited, state.device_m, dt_s);
}

// The hand feels the coupling, damping and texture alone; the parts and contacts are only recorded.
void publish_force(const World& world, WorldState& state, const Sweep& sweep,
                   const device::DeviceState& input, double dt_s, TickResult& result) noexcept {
  const glm::dvec3 coupling = coupling_N_per_m(world, state) * (state.proxy_m - result.device_m);
  const glm::dvec3 added = added_force(world, state, result.device_m, dt_s);
  result.proxy_m = state.proxy_m;
  result.rigid_N = sweep.force_N + added;
  result.soft_N = coupling - sweep.force_N;
  result.force_N = make_safe(world, state, coupling + added, input, dt_s);
  split_by_object(world, state, result.soft_N);
  for (std::size_t o = 0; o < state.feel.size(); ++o) {
    if (state.feel[o].contact) result.contacts |= 1U << std::min<std::size_t>(o, 31);
  }
}

}  // namespace

TickResult haptic_tick(const World& world, WorldState& state, const device::DeviceState& input,
                       double given_dt_s) noexcept {
  TickResult result;
  StageClock clock(result);
  result.device_m = check_input(state, input);
  const double dt_s = check_time(given_dt_s);
  const glm::dvec3 before = state.proxy_m;

  move_bodies(world, state, dt_s);
  clock.done(Stage::bodies);

  const Neighbourhood around = broad_phase(world, state, result.device_m);
  clock.done(Stage::broad_phase);

  press_bodies_into_tissue(world, state, dt_s);
  Sweep sweep = settle_contact(world, state, result.device_m, around);
  refresh_obstacles(world, state);
  clock.done(Stage::contact);

  // Soft objects that meet may push one another back into the tool's way. So the tool gives way after their
  // contacts are solved. If no soft objects can meet, tissue relaxes after the tool gave way.
  const bool may_meet = !world.soft_pairs.empty();
  if (may_meet) {
    relax_tissue(world, state, clock);
    solve_soft_contacts(world, state);
  }
  if (around.near_soft) give_way(world, state, before, sweep);
  flag_lost_tool(world, state);
  clock.done(Stage::arbitration);
  if (!may_meet) relax_tissue(world, state, clock);

  // This is the last step that moves bodies or tissue, so that no body overlaps tissue at the end of the
  // tick.
  push_bodies_out_of_tissue(world, state, dt_s);
  flag_squeezed_bodies(world, state);
  clock.done(Stage::arbitration);

  refresh_map(world, state);
  clock.done(Stage::map);

  publish_force(world, state, sweep, input, dt_s, result);
  ++state.tick;
  clock.done(Stage::force);
  clock.stop();
  return result;
}

}  // namespace hybrid
