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
#include "hybrid/tick/proxy/rigid_proxy.h"
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

using Clock = std::chrono::steady_clock;

double us_between(Clock::time_point from, Clock::time_point to) noexcept {
  return std::chrono::duration<double, std::micro>(to - from).count();
}

// The last reading of this thread's CPU time, and the wall time that followed it and counts as CPU time.
struct CpuReading {
  double cpu_us = 0.0, short_us = 0.0;
  Clock::time_point last{};  // end of the time that is accounted for
  int ticks_left = 0;        // until the next reading is due
};
constinit thread_local CpuReading cpu_reading;

// Measures the CPU time of each stage, so that pre-emption does not count. A read of the thread's CPU time is
// a system call and takes up to 2 µs; the wall clock takes 0.03 µs. So a stage is timed by the wall clock
// first. If its wall time is long enough to hide a pre-emption, CPU time is read and replaces it. Time
// between two ticks is treated alike, so ticks in close succession share one reading. The tick is the sum of
// its stages.
class StageClock {
 public:
  explicit StageClock(TickResult& result) : result_(result), of_thread_(cpu_reading) {
    const Clock::time_point now = Clock::now();
    const double between_us = us_between(of_thread_.last, now);
    if (of_thread_.ticks_left > 0 && between_us <= kShort_us) {
      --of_thread_.ticks_left;
      of_thread_.short_us += between_us;
      of_thread_.last = now;
    } else {
      of_thread_.ticks_left = kTicksPerReading;
      read();
    }
  }
  void done(Stage stage) noexcept {
    const Clock::time_point now = Clock::now();
    double us = us_between(of_thread_.last, now);
    of_thread_.last = now;
    if (us > kShort_us) {
      const double before_us = of_thread_.cpu_us + of_thread_.short_us;
      read();
      us = std::clamp(of_thread_.cpu_us - before_us, 0.0, us);
    } else {
      of_thread_.short_us += us;
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
  static constexpr double kShort_us = 10.0;  // longest wall time that is taken as CPU time
  // Greatest number of ticks for one reading, so that pre-emptions too short to notice do not add up.
  static constexpr int kTicksPerReading = 256;

  void read() noexcept {
    of_thread_.cpu_us = 1e6 * thread_time_s();
    of_thread_.short_us = 0.0;
    of_thread_.last = Clock::now();
  }

  TickResult& result_;
  CpuReading& of_thread_;
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
  // If an object is pressed on nested patches, the map has it in its rest state. So the map cannot decide
  // whether the way is free.
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

// After the tool: soft objects react to one another, to bodies and to the tool, and the map follows.
void let_tissue_follow(const World& world, WorldState& state, const glm::dvec3& before,
                       const Neighbourhood& around, double dt_s, Sweep& sweep, StageClock& clock) noexcept {
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
}

// The last operations on the force, in the order that device/README.md justifies.
void make_safe(const World& world, WorldState& state, const glm::dvec3& force_N,
               const device::DeviceState& input, double dt_s, TickResult& result) noexcept {
  // limit_force() gets the position in use: an invalid input was replaced by the last valid one.
  const device::DeviceState tool{.position_m = state.device_m, .fault = input.fault};
  const std::uint64_t bad = state.limit.nonfinite;
  device::ForceLimits limits = world.limits;
  limits.max_force_N = max_force_N(world, state);
  const glm::dvec3 limited = device::limit_force(limits, state.limit, force_N, tool, dt_s);
  state.nonfinite += state.limit.nonfinite - bad;
  result.force_N = world.passivity
                       ? device::keep_passive(*world.passivity, state.passive, limited, state.device_m, dt_s)
                       : limited;
  // A force that is not finite has no change by the limits.
  if (polygon::is_finite(force_N)) result.limits_N = limited - force_N;
  result.passivity_N = result.force_N - limited;
}

// The hand feels the coupling, damping and texture alone; the parts and contacts are only recorded.
void publish_force(const World& world, WorldState& state, const Sweep& sweep,
                   const device::DeviceState& input, double dt_s, TickResult& result) noexcept {
  const glm::dvec3 coupling = coupling_force_N(world, state, result.device_m);
  const glm::dvec3 added = added_force(world, state, result.device_m, dt_s);
  result.proxy_m = state.proxy_m;
  result.coupling_N = coupling;
  result.rigid_N = sweep.force_N + added;
  result.soft_N = coupling - sweep.force_N;
  result.friction_N = state.friction_N;
  result.damping_N = added;
  make_safe(world, state, coupling + added, input, dt_s, result);
  split_by_object(world, state, result.soft_N);
  for (std::size_t o = 0; o < state.feel.size(); ++o) {
    if (state.feel[o].contact) result.contacts |= 1U << std::min(o, kLastContactBit);
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

  if (!state.soft.empty()) let_tissue_follow(world, state, before, around, dt_s, sweep, clock);

  mix_stiffness(world, state, result.device_m, dt_s, sweep);
  publish_force(world, state, sweep, input, dt_s, result);
  ++state.tick;
  clock.done(Stage::force);
  clock.stop();
  return result;
}

}  // namespace hybrid
