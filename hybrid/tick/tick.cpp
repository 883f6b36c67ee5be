// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tick/tick.h"

#include <time.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>

#include "hybrid/tick/tissue/obstacles_and_pairs.h"
#include "hybrid/tick/bodies/move_bodies.h"
#include "hybrid/tick/bodies/tissue_supports_bodies.h"
#include "hybrid/tick/bodies/bodies_press_tissue.h"
#include "hybrid/tick/proxy/feel_stage.h"
#include "hybrid/tick/tissue/async_relaxation.h"
#include "hybrid/tick/proxy/proxy_step.h"
#include "hybrid/tick/tissue/press_tissue.h"

namespace hybrid {
namespace {

constexpr double kFarthestDevice_m = 1e12;
constexpr double kLongestTick_s = 86'400.0;  // a day: times stay numbers however often it is said
constexpr int kPasses = 3;                   // proxy and tissue answer one another this often at most
constexpr int kSweeps = 1;                   // of the contact's neighbourhood, a pass
constexpr double kSoftStep =
    0.25;                        // of the tool's reach: the proxy moves no further against tissue in one pass
constexpr double kStill = 1e-5;  // of the tool's radius: a pass that moves the proxy less teaches nothing
// Of the tool's radius: after a second pass that moves the proxy less the next tick goes on. (With a third
// whenever there was anything to go, ticks took a quarter longer, and organs felt no more like themselves: 61
// mN rms off in place of 58. Without any, at 1 m/s tissue was left 0.2 of a cell deep in bone.)
constexpr double kFar = 1e-2;
constexpr double kForget = 0.9;         // of the hidden stiffness is kept from pass to pass
constexpr double kOvershoot = 0.25;     // of the pull before, turned round: a step that overshot
constexpr double kMostOvershoot = 3.0;  // believed of one step
constexpr double kProbe = 0.005;  // of the tool's radius: how far into tissue that was blocked a tick looks
constexpr double kMostHidden = 50.0;  // hidden stiffness at most, of the model's
// Of the tool's radius: how far from the proxy rigid planes are looked for when tissue stops it. Seldom is
// the first not enough, and beside a fine mesh the second holds five times as many triangles: a seventh of a
// tick.
constexpr std::array<double, 2> kPlanesWithin{1.25, 2.0};

// Stages by the wall clock, which is cheap; the whole tick by the thread's own processor time, because on a
// shared machine a tick that was put aside for another process is not a slow tick.
class StageClock {
 public:
  explicit StageClock(TickResult& result) : result_(result), start_us_(own_time_us()), last_(Clock::now()) {}
  void done(Stage stage) noexcept {
    const auto now = Clock::now();
    result_.stage_us[static_cast<std::size_t>(stage)] +=
        std::chrono::duration<float, std::micro>(now - last_).count();
    last_ = now;
  }
  // So much of the stage that was just done, and of the tick, is not theirs.
  void leave_out(Stage stage, double us) noexcept {
    float& of_stage = result_.stage_us[static_cast<std::size_t>(stage)];
    of_stage = std::max(0.0F, of_stage - static_cast<float>(us));
    left_out_us_ += us;
  }
  void stop() noexcept { result_.tick_us = own_time_us() - start_us_ - left_out_us_; }

 private:
  using Clock = std::chrono::steady_clock;
  static double own_time_us() noexcept {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) * 1e6 + static_cast<double>(now.tv_nsec) * 1e-3;
  }

  TickResult& result_;
  double start_us_, left_out_us_ = 0.0;
  Clock::time_point last_;
};

bool finite(const glm::dvec3& v) noexcept {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

// No device is further away than a thousand times the largest scene. What is, is as little a position as NaN.
bool is_place(const glm::dvec3& v) noexcept {
  return finite(v) && std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}) <= kFarthestDevice_m;
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

// A clock that ran backwards, or said nothing, says that no time has passed.
double check_time(double dt_s) noexcept {
  return dt_s > 0.0 && std::isfinite(dt_s) ? std::min(dt_s, kLongestTick_s) : 0.0;
}

// What pulls the proxy, apart from rigid surfaces: coupling and tissue (N).
glm::dvec3 pull_on_proxy(const World& world, const WorldState& state, const glm::dvec3& device) noexcept {
  glm::dvec3 pull = world.tool.stiffness_N_per_m * (device - state.proxy_m);
  for (const voxel::Reaction& reaction : state.reactions) pull += reaction.force_N;
  return pull;
}

// The tissue's model is that of the voxels pressed now. Where a chain tightens as the proxy moves, or new
// voxels are met, it answers stiffer than that, and a step by the model alone would jump to and fro for ever.
// When a step overshot, so that the pull turned round, the stiffness that would have landed right is kept,
// and forgotten over some passes. (Taking the secant of every step was rejected: tissue that relaxes
// meanwhile looks as stiff as one likes on a short step.)
void learn_stiffness(const World& world, WorldState& state, const glm::dvec3& delta, const glm::dvec3& before,
                     const glm::dvec3& after, const glm::dmat3& model, const glm::dmat3& used) noexcept {
  state.hidden_stiffness_N_per_m *= kForget;
  const double square = glm::dot(delta, delta), still = kStill * world.contact_radius_m();
  const double wanted = glm::dot(before, delta);
  if (square < still * still || wanted <= 0.0) return;
  const double overshoot = std::min(-glm::dot(after, delta) / wanted, kMostOvershoot);
  if (overshoot < kOvershoot) return;
  const double along_model = glm::dot(delta, model * delta) / square,
               along_used = glm::dot(delta, used * delta) / square;
  const double hidden = std::min(along_used * (1.0 + overshoot) - along_model, kMostHidden * along_model);
  state.hidden_stiffness_N_per_m = std::max(state.hidden_stiffness_N_per_m, hidden);
}

struct OutsideRigid {
  polygon::PlaneMinimum minimum;
  std::size_t rigid = 0;  // state.planes: so many of them first
  bool sure = false;      // feasible, and no rigid plane that was not looked for can change it
};

// The least of the metric about `target`, outside what is rigid near the proxy and outside the planes that
// add_others() appends to state.planes. A rigid plane that was not found is further from the proxy than was
// looked, so a minimum that is nearer than that is the minimum among them all.
template <class AddOthers>
OutsideRigid minimise_outside_rigid(const World& world, WorldState& state, const glm::dvec3& target,
                                    const polygon::Metric& metric, AddOthers&& add_others) noexcept {
  const double radius = world.contact_radius_m();
  OutsideRigid least;
  for (const double within : kPlanesWithin) {
    const double known = gather_planes(world, state, state.proxy_m, within * radius);
    least.rigid = state.planes.size();
    add_others();
    least.minimum = polygon::minimise_on_planes(target, metric, state.planes, 1e-9 * radius);
    least.sure = least.minimum.feasible && glm::length(least.minimum.point - state.proxy_m) <= known - radius;
    if (!least.minimum.feasible || least.sure || known < within * radius) break;
  }
  return least;
}

// Where tissue cannot leave the tool's way, it is as good as rigid, and the proxy stops there: pressed
// further in every pass, to be taken back at the end of the tick, the tool would be a wedge that drives
// voxels aside, and get back from them what it never gave. Whether they still cannot is asked once a tick, by
// a probe.
glm::dvec3 stop_at_blocked(const World& world, WorldState& state, const glm::dvec3& target,
                           const glm::dmat3& metric, bool probe) noexcept {
  if (state.blocked.empty()) return target;
  if (probe) {
    for (polygon::ContactPlane& plane : state.blocked) plane.offset -= kProbe * world.contact_radius_m();
  }
  const OutsideRigid least = minimise_outside_rigid(world, state, target, polygon::Metric(metric), [&state] {
    for (const polygon::ContactPlane& plane : state.blocked) {
      if (state.planes.size() == state.planes.capacity()) break;
      state.planes.push_back(plane);
    }
  });
  const polygon::PlaneMinimum& stop = least.minimum;
  if (!stop.feasible) return target;
  // Of the two kinds of planes that hold it there, rigid ones are for the sweep to meet.
  glm::dvec3 held_N(0.0);
  for (std::uint32_t i = 0; i < stop.active_count; ++i) {
    if (stop.active[i] >= least.rigid) held_N += stop.multiplier[i] * state.planes[stop.active[i]].normal;
  }
  return target + glm::inverse(metric) * held_N;
}

// One pass: the proxy goes to the minimum of ½K|q − x|² plus the tissue's quadratic model, outside everything
// rigid; then the tissue answers. Returns how far the proxy went.
double move_proxy(const World& world, WorldState& state, const glm::dvec3& device, bool near_soft,
                  double travel, bool first_pass, Sweep& sweep) noexcept {
  const double k = world.tool.stiffness_N_per_m;
  glm::dmat3 model(k);
  for (const voxel::Reaction& reaction : state.reactions) model += reaction.stiffness_N_per_m;
  // What tissue hides, it hides where it is pressed: out of contact the proxy goes to the device, at once.
  const bool pressed = model != glm::dmat3(k);
  const glm::dmat3 metric = pressed ? model + glm::dmat3(state.hidden_stiffness_N_per_m) : model;
  const glm::dvec3 pull = pull_on_proxy(world, state, device);
  // Without tissue the target is the device, to the last bit.
  const glm::dvec3 target =
      near_soft
          ? stop_at_blocked(world, state, state.proxy_m + glm::inverse(metric) * pull, metric, first_pass)
          : device;
  sweep = sweep_with_feel(world, state, target, metric, travel, first_pass);
  const glm::dvec3 delta = sweep.point - state.proxy_m;
  state.proxy_m = sweep.point;
  if (near_soft) {
    press_soft(world, state, state.proxy_m, delta, kSweeps);
    // On a composite grid the model is of the equilibrium, and nothing is hidden from it.
    if (!contact_on_grid(state))
      learn_stiffness(world, state, delta, pull, pull_on_proxy(world, state, device), model, metric);
    if (first_pass) state.blocked.clear();
    soft_bounds(world, state, state.proxy_m, true, state.blocked);
  }
  return glm::length(delta);
}

// How deep a tool at `point` is in what soft objects let it have, at most: the last `count` planes (m).
double deepest(const WorldState& state, std::size_t count, const glm::dvec3& point) noexcept {
  double most = 0.0;
  for (std::size_t i = state.planes.size() - count; i < state.planes.size(); ++i)
    most = std::max(most, state.planes[i].offset - glm::dot(state.planes[i].normal, point));
  return most;
}

// Tissue that anchors, bone or its own chain keep from leaving the tool's way: the tool leaves its way
// instead, if need be back to `before`, where it was at the start of the tick.
void give_way(const World& world, WorldState& state, const glm::dvec3& before, Sweep& sweep) noexcept {
  state.planes.clear();
  std::size_t bounds = soft_bounds(world, state, state.proxy_m, false, state.planes);
  if (bounds == 0) return;
  const auto least =
      minimise_outside_rigid(world, state, state.proxy_m, polygon::Metric(glm::dmat3(1.0)),
                             [&] { bounds = soft_bounds(world, state, state.proxy_m, false, state.planes); });
  // Too deep in tissue to see a way out, the way back is one; but not where it was deeper still, and is being
  // pulled out.
  if (least.sure) {
    state.proxy_m = least.minimum.point;
  } else if (deepest(state, bounds, before) <= deepest(state, bounds, state.proxy_m)) {
    state.proxy_m = before;
  }
  sweep.point = state.proxy_m;
}

// What the map says of the neighbourhood.
struct Surroundings {
  bool free = false;       // the proxy reached the device through empty space: nothing can be felt
  bool near_soft = false;  // some surface voxel is within `range_m` of the tool's reach
  double range_m = std::numeric_limits<double>::max();  // how far the proxy may go in this tick
};

Surroundings look_around(const World& world, WorldState& state, const glm::dvec3& device) noexcept {
  Surroundings around;
  // Against tissue no further in a tick than was looked, part of the tool's reach at a time, so that no voxel
  // is jumped over.
  if (!state.soft.empty()) around.range_m = kPasses * kSoftStep * soft_reach(world, state);
  // What is pressed there is not in the map.
  around.free =
      !contact_on_grid(state) && advance_through_free_space(world, state, device, soft_reach(world, state));
  if (around.free) state.active_count = 0;
  if (!around.free && !state.soft.empty()) {
    around.near_soft = touch_soft(world, state, state.proxy_m, around.range_m);
  } else {
    for (auto& object : state.soft) {
      if (!object->touched().empty()) object->touch({});
    }
  }
  prepare_grids(world, state, state.proxy_m);
  return around;
}

// Does what tissue answered last, in the tick before, hold still? Then the first pass goes by that: to ask
// again is a quarter of a contact tick. (Not where a result was taken since: a brain held still felt one as a
// step of 10.9 mN of 152 in place of 7.5.)
bool answered(WorldState& state) noexcept {
  bool any = false;
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    if (state.soft[o]->touched().empty()) state.reactions[o] = {};
    any = any || state.reactions[o].pressed > 0;
  }
  // A grid solves for its contact as a whole.
  return any && !state.apart.took && !contact_on_grid(state);
}

// Rigid contact planes, soft wave and local equilibrium, proxy: in passes, because each answers the others.
Sweep settle_contact(const World& world, WorldState& state, const glm::dvec3& device,
                     const Surroundings& around) noexcept {
  Sweep sweep;
  std::fill(state.rigid_force_N.begin(), state.rigid_force_N.end(), glm::dvec3(0.0));
  if (!around.near_soft) {
    std::fill(state.reactions.begin(), state.reactions.end(), voxel::Reaction{});
    state.hidden_stiffness_N_per_m = 0.0;
    state.blocked.clear();
  } else if (!answered(state)) {
    press_soft(world, state, state.proxy_m, glm::dvec3(0.0), 0);
  }
  const double travel = around.near_soft ? around.range_m / kPasses : around.range_m;
  for (int pass = 0; pass < kPasses && !around.free; ++pass) {
    const double moved = move_proxy(world, state, device, around.near_soft, travel, pass == 0, sweep);
    if (!around.near_soft || (pass > 0 && moved < kFar * world.contact_radius_m())) break;
  }
  if (!sweep.arrived) ++state.truncated_ticks;
  return sweep;
}

// The last operations on the force, in the order that device/README.md gives reasons for.
glm::dvec3 make_safe(const World& world, WorldState& state, const glm::dvec3& force_N,
                     const device::DeviceState& input, double dt_s) noexcept {
  // Where the tool is said to be; what is no place was taken for the last good one.
  const device::DeviceState tool{.position_m = state.device_m, .fault = input.fault};
  const std::uint64_t bad = state.limit.nonfinite;
  const glm::dvec3 limited = device::limit_force(world.limits, state.limit, force_N, tool, dt_s);
  state.nonfinite += state.limit.nonfinite - bad;
  if (!world.passivity) return limited;
  return device::keep_passive(*world.passivity, state.passive, limited, state.device_m, dt_s);
}

// The hand feels the coupling and nothing else; its parts, and who is felt, are for the record.
void publish_force(const World& world, WorldState& state, const Sweep& sweep,
                   const device::DeviceState& input, double dt_s, TickResult& result) noexcept {
  const glm::dvec3 coupling = world.tool.stiffness_N_per_m * (state.proxy_m - result.device_m);
  const glm::dvec3 added = added_force(world, state, result.device_m, dt_s);
  result.proxy_m = state.proxy_m;
  result.rigid_N = sweep.force_N + added;
  result.soft_N = coupling - sweep.force_N;
  result.force_N = make_safe(world, state, coupling + added, input, dt_s);
  for (std::size_t o = 0; o < world.object_count(); ++o) {
    const std::size_t rigid = world.rigid.size();
    const glm::dvec3 force = o < rigid ? state.rigid_force_N[o] : state.reactions[o - rigid].force_N;
    state.feel[o].force_N = glm::length(force);
    state.feel[o].contact = state.feel[o].force_N > 0.0;
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

  move_bodies(world, state, dt_s);
  clock.done(Stage::bodies);

  const Surroundings around = look_around(world, state, result.device_m);
  clock.done(Stage::broad_phase);

  press_by_bodies(world, state, dt_s);
  clock.done(Stage::arbitration);

  const glm::dvec3 before = state.proxy_m;
  Sweep sweep = settle_contact(world, state, result.device_m, around);
  clock.done(Stage::contact);

  refresh_obstacles(world, state);
  const bool may_meet = !world.meeting.empty();
  if (around.near_soft && !may_meet) give_way(world, state, before, sweep);
  clock.done(Stage::arbitration);

  relax_background(world, state);
  clock.done(Stage::background);
  if (state.apart.elsewhere_us > 0.0) clock.leave_out(Stage::background, state.apart.elsewhere_us);
  refresh_arrived(world, state);

  // Last of all that moves tissue: nothing overlaps as a tick ends. And the tool after it, because one object
  // may push the other back into its way.
  if (may_meet) relax_pairs(world, state);
  if (around.near_soft && may_meet) give_way(world, state, before, sweep);
  keep_out_of_tissue(world, state, dt_s);
  judge_bodies(world, state);
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
