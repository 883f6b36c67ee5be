// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tick/settle_contact.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>

#include "hybrid/tick/proxy/feel_stage.h"
#include "hybrid/tick/proxy/rigid_proxy.h"
#include "hybrid/tick/tissue/press_tissue.h"

namespace hybrid {
namespace {

struct ContactSettings {
  int passes = 3;           // maximum number of passes in a tick; in each the proxy moves, then the tissue
  int sweeps = 1;           // relaxations of the contact's neighbourhood in each pass
  double soft_step = 0.25;  // longest step of the proxy against tissue in one pass (unit: the tool's reach)
  double arrived = 1e-2;    // a later pass that moves the proxy less is the last (unit: the tool's radius)
  double still = 1e-5;      // a pass that moves the proxy less gives no secant (unit: the tool's radius)
  // Settings of learn_stiffness(). kept: share of the learnt stiffness that is kept from pass to pass.
  // least_overshoot: a smaller overshoot is ignored (unit: the pull before the step). most_overshoot: a
  // larger one is clamped to it. most_learnt: upper bound of the learnt stiffness (unit: the model's
  // stiffness).
  double kept = 0.9, least_overshoot = 0.25, most_overshoot = 3.0, most_learnt = 50.0;
  double probe = 0.005;  // how far the proxy probes jammed tissue once a tick (unit: the tool's radius)
  // Search radii for rigid planes when tissue stops the proxy (unit: the tool's radius). The second radius is
  // tried only if the first is not enough.
  std::array<double, 2> planes_within{1.25, 2.0};
};
constexpr ContactSettings kSettings;

// Force on the proxy apart from rigid surfaces: coupling and tissue (N).
glm::dvec3 pull_on_proxy(const World& world, const WorldState& state, const glm::dvec3& device) noexcept {
  glm::dvec3 pull = coupling_N_per_m(world, state) * (device - state.proxy_m);
  for (const voxel::Reaction& reaction : state.reactions) pull += reaction.force_N;
  return pull;
}

// The tissue's model is the stiffness of the voxels that are pressed now. The true stiffness is larger when a
// chain tightens as the proxy moves, or when the tool meets further voxels. Steps by the model alone could
// then alternate between two places without end. If a step overshoots (the pull changes sign), the secant
// stiffness is learnt: with it the step would have ended at zero pull. The learnt stiffness decays over the
// next passes. Nothing is learnt from other steps: over a short step, tissue that relaxes meanwhile looks
// arbitrarily stiff.
void learn_stiffness(const World& world, WorldState& state, const glm::dvec3& delta, const glm::dvec3& before,
                     const glm::dvec3& after, const glm::dmat3& model, const glm::dmat3& used) noexcept {
  state.learnt_stiffness_N_per_m *= kSettings.kept;
  const double square = glm::dot(delta, delta), still = kSettings.still * world.contact_radius_m();
  const double wanted = glm::dot(before, delta);
  if (square < still * still || wanted <= 0.0) return;
  const double overshoot = std::min(-glm::dot(after, delta) / wanted, kSettings.most_overshoot);
  if (overshoot < kSettings.least_overshoot) return;
  const double along_model = glm::dot(delta, model * delta) / square,
               along_used = glm::dot(delta, used * delta) / square;
  const double learnt =
      std::min(along_used * (1.0 + overshoot) - along_model, kSettings.most_learnt * along_model);
  state.learnt_stiffness_N_per_m = std::max(state.learnt_stiffness_N_per_m, learnt);
}

struct OutsideRigid {
  polygon::PlaneMinimum minimum;
  std::size_t rigid = 0;  // the number of rigid planes, which come first in scratch.planes
  bool sure = false;      // feasible, and no rigid plane beyond the search radius can change it
};

// The point nearest to `target` in the metric, outside rigid objects near the proxy and outside the planes
// that add_others() appends to scratch.planes. Rigid planes are searched up to a radius around the proxy. If
// the point found is nearer to the proxy than this radius, no plane that was missed can change it.
template <class AddOthers>
OutsideRigid minimise_outside_rigid(const World& world, WorldState& state, const glm::dvec3& target,
                                    const polygon::Metric& metric, AddOthers&& add_others) noexcept {
  const double radius = world.contact_radius_m();
  OutsideRigid least;
  for (const double within : kSettings.planes_within) {
    const double known = gather_planes(world, state, state.proxy_m, within * radius);
    least.rigid = state.scratch.planes.size();
    add_others();
    least.minimum = polygon::minimise_on_planes(target, metric, state.scratch.planes, 1e-9 * radius);
    least.sure = least.minimum.feasible && glm::length(least.minimum.point - state.proxy_m) <= known - radius;
    if (!least.minimum.feasible || least.sure || known < within * radius) break;
  }
  return least;
}

// Remembers a soft object's plane that stops the tool in this tick.
void add_stop(WorldState& state, const polygon::ContactPlane& plane) noexcept {
  if (state.scratch.stops.size() < state.scratch.stops.capacity()) state.scratch.stops.push_back(plane);
}

// Tissue that cannot leave the tool's way is as good as rigid, and the proxy stops there. A tool that is
// pressed further in every pass and taken back at the end of the tick would act as a wedge. It would drive
// voxels aside and gain energy. Once a tick the planes recede by `probe`, to find out whether the voxels
// still cannot leave.
glm::dvec3 stop_at_jammed(const World& world, WorldState& state, const glm::dvec3& target,
                          const glm::dmat3& metric, bool probe) noexcept {
  if (state.jammed.empty()) return target;
  if (probe) {
    for (polygon::ContactPlane& plane : state.jammed)
      plane.offset -= kSettings.probe * world.contact_radius_m();
  }
  const OutsideRigid least = minimise_outside_rigid(world, state, target, polygon::Metric(metric), [&state] {
    for (const polygon::ContactPlane& plane : state.jammed) {
      if (state.scratch.planes.size() == state.scratch.planes.capacity()) break;
      state.scratch.planes.push_back(plane);
    }
  });
  const polygon::PlaneMinimum& stop = least.minimum;
  if (!stop.feasible) return target;
  // The sweep meets the rigid planes itself, so only the multipliers of jammed tissue are added here.
  glm::dvec3 jammed_N(0.0);
  for (std::uint32_t i = 0; i < stop.active_count; ++i) {
    if (stop.active[i] < least.rigid) continue;
    const polygon::ContactPlane& plane = state.scratch.planes[stop.active[i]];
    jammed_N += stop.multiplier[i] * plane.normal;
    add_stop(state, plane);
  }
  return target + glm::inverse(metric) * jammed_N;
}

// One pass: the proxy goes to the minimum of ½K|q − x|² plus the tissue's quadratic model, outside everything
// rigid; then the tissue responds. Returns how far the proxy went (m).
double move_proxy(const World& world, WorldState& state, const glm::dvec3& device, bool near_soft,
                  double travel, bool first_pass, Sweep& sweep) noexcept {
  const double k = coupling_N_per_m(world, state);
  state.scratch.stops.clear();
  glm::dmat3 model(k);
  for (const voxel::Reaction& reaction : state.reactions) model += reaction.stiffness_N_per_m;
  // The learnt stiffness applies only in contact. A free proxy goes to the device at once.
  const bool pressed = model != glm::dmat3(k);
  const glm::dmat3 metric = pressed ? model + glm::dmat3(state.learnt_stiffness_N_per_m) : model;
  const glm::dvec3 pull = pull_on_proxy(world, state, device);
  // Without tissue the target is the device, to the last bit.
  const glm::dvec3 target =
      near_soft
          ? stop_at_jammed(world, state, state.proxy_m + glm::inverse(metric) * pull, metric, first_pass)
          : device;
  sweep = sweep_with_feel(world, state, target, metric, travel, first_pass);
  const glm::dvec3 delta = sweep.point - state.proxy_m;
  state.proxy_m = sweep.point;
  if (near_soft) {
    press_tissue(world, state, state.proxy_m, delta, kSettings.sweeps);
    learn_stiffness(world, state, delta, pull, pull_on_proxy(world, state, device), model, metric);
    if (first_pass) state.jammed.clear();
    tool_bounds(world, state, state.proxy_m, true, kSettings.soft_step, state.jammed);
  }
  return glm::length(delta);
}

// Greatest depth (m) of a tool at `point` in the last `count` planes.
double deepest(const WorldState& state, std::size_t count, const glm::dvec3& point) noexcept {
  double most = 0.0;
  for (std::size_t i = state.scratch.planes.size() - count; i < state.scratch.planes.size(); ++i)
    most = std::max(most, state.scratch.planes[i].offset - glm::dot(state.scratch.planes[i].normal, point));
  return most;
}

// Is last tick's reaction still valid? If so, the first pass uses it, which saves a quarter of a contact
// tick. An asynchronous result that was applied since makes the reaction stale. Patches solve the contact as
// a whole, so their reaction is always computed anew.
bool reaction_is_current(WorldState& state) noexcept {
  bool any = false;
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    if (state.soft[o]->touched().empty()) state.reactions[o] = {};
    any = any || state.reactions[o].pressed > 0;
  }
  return any && !state.async.applied && !contact_on_patches(state);
}

}  // namespace

double contact_range_m(const World& world, const WorldState& state) noexcept {
  if (state.soft.empty()) return std::numeric_limits<double>::max();
  return kSettings.passes * kSettings.soft_step * soft_reach(world, state);
}

Sweep settle_contact(const World& world, WorldState& state, const glm::dvec3& device,
                     const Neighbourhood& around) noexcept {
  Sweep sweep;
  state.scratch.stops.clear();
  std::fill(state.rigid_force_N.begin(), state.rigid_force_N.end(), glm::dvec3(0.0));
  if (!around.near_soft) {
    std::fill(state.reactions.begin(), state.reactions.end(), voxel::Reaction{});
    state.learnt_stiffness_N_per_m = 0.0;
    state.jammed.clear();
  } else if (!reaction_is_current(state)) {
    press_tissue(world, state, state.proxy_m, glm::dvec3(0.0), 0);
  }
  const double travel = around.near_soft ? around.range_m / kSettings.passes : around.range_m;
  for (int pass = 0; pass < kSettings.passes && !around.free; ++pass) {
    const double moved = move_proxy(world, state, device, around.near_soft, travel, pass == 0, sweep);
    if (!around.near_soft || (pass > 0 && moved < kSettings.arrived * world.contact_radius_m())) break;
  }
  if (!sweep.arrived) ++state.truncated_ticks;
  return sweep;
}

void give_way(const World& world, WorldState& state, const glm::dvec3& before, Sweep& sweep) noexcept {
  state.scratch.planes.clear();
  std::size_t bounds =
      tool_bounds(world, state, state.proxy_m, false, kSettings.soft_step, state.scratch.planes);
  if (bounds == 0) return;
  const auto least =
      minimise_outside_rigid(world, state, state.proxy_m, polygon::Metric(glm::dmat3(1.0)), [&] {
        bounds = tool_bounds(world, state, state.proxy_m, false, kSettings.soft_step, state.scratch.planes);
      });
  // Notes the planes that stop the tool. Then moves the tool to the place found. If that place is not surely
  // outside everything rigid, moves the tool back to its place at the start of the tick. The tool stays if it
  // was deeper there.
  for (std::size_t i = least.rigid; i < state.scratch.planes.size(); ++i) {
    if (state.scratch.planes[i].offset > glm::dot(state.scratch.planes[i].normal, state.proxy_m))
      add_stop(state, state.scratch.planes[i]);
  }
  if (least.sure) {
    state.proxy_m = least.minimum.point;
  } else if (deepest(state, bounds, before) <= deepest(state, bounds, state.proxy_m)) {
    state.proxy_m = before;
  }
  sweep.point = state.proxy_m;
}

}  // namespace hybrid
