// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/session/tick_invariants.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "hybrid/session/session.h"
#include "polygon/mesh/is_finite.h"
#include "voxel/composite/grid.h"

namespace hybrid {
namespace {

constexpr std::uint64_t kStateCheckEvery = 64;  // ticks between two checks of every displacement
constexpr double kRounding = 1e-12;             // share of moved_J()

// Does not overflow for long vectors, whose squares would.
double length(const glm::dvec3& v) {
  return std::hypot(v.x, v.y, v.z);
}

// Slope of the coupling's force over depth.
double slope_N_per_m(const World& world, const WorldState& state) {
  return state.mixed.pressed() ? state.mixed.stiffness_N_per_m : world.tool.stiffness_N_per_m;
}

// Energy and force of the clamped coupling. The energy is ½K d² up to the clamp. Beyond it the work of the
// constant force is added. Energy that a mixed coupling has to spare counts as stored.
struct Spring {
  glm::dvec3 clamped_N{0.0};
  double stored_J = 0.0;
};
Spring spring_of(const World& world, const WorldState& state, const glm::dvec3& force) {
  const double k = slope_N_per_m(world, state), most = world.limits.max_force_N;
  const double pull = length(force), spare_J = std::max(0.0, state.mixed.energy_J - 0.5 * pull * pull / k);
  if (pull <= most) return {force, 0.5 * pull * pull / k + spare_J};
  return {force * (most / pull), most * (pull - 0.5 * most) / k + spare_J};
}

bool finite(const WorldState& state) {
  for (const RigidState& body : state.rigid) {
    const glm::dquat& q = body.pose.rotation;
    const bool good = polygon::is_finite(body.pose.position_m) && std::isfinite(q.w + q.x + q.y + q.z) &&
                      polygon::is_finite(body.free.centre_m) &&
                      polygon::is_finite(body.free.velocity_m_per_s) &&
                      polygon::is_finite(body.free.spin_rad_per_s);
    if (!good) return false;
  }
  for (const auto& object : state.soft) {
    for (const auto& axis : object->state().u) {
      if (!std::all_of(axis.begin(), axis.end(), [](float u) { return std::isfinite(u); })) return false;
    }
    bool good = true;
    if (object->patches_in_use() != nullptr)
      object->patches_in_use()->for_values([&good](float u) { good = good && std::isfinite(u); });
    if (!good) return false;
  }
  return std::isfinite(state.clock.now_s()) && std::isfinite(state.limit.elapsed_s) &&
         polygon::is_finite(state.limit.last_N) && std::isfinite(state.learnt_stiffness_N_per_m) &&
         std::isfinite(state.damping.balance_J);
}

}  // namespace

TickInvariants::TickInvariants(const World& world, const WorldState& state)
    : world_(world), hash_(kHashBegin), force_N_(state.limit.last_N), device_m_(state.device_m) {
  const Spring spring = spring_of(world, state, coupling_force_N(world, state, state.device_m));
  allowed_J_ = stored_J_ = spring.stored_J;  // the hand may get the energy that is already stored
  for (const auto& object : state.soft) {
    if (object->moved_ever()) allowed_J_ += object->energy_J();
  }
  slewed_N_ = length(force_N_ - spring.clamped_N);
}

double TickInvariants::tolerance_J() const {
  return (world_.soft.empty() ? kRounding : kTissueShare) * moved_J_ +
         8.0 * world_.tool.stiffness_N_per_m * world_.rounding_m * world_.rounding_m;
}

void TickInvariants::check_state(const WorldState& state) {
  if (!finite(state)) ++not_finite_;
}

void TickInvariants::account_energy(const WorldState& state, const TickResult& felt) {
  const double k = slope_N_per_m(world_, state), most = world_.limits.max_force_N;
  const Spring spring = spring_of(world_, state, felt.coupling_N);
  const double stored = spring.stored_J;
  const glm::dvec3 delta = felt.device_m - device_m_;
  const double moved = length(delta), work = glm::dot(force_N_, delta);
  given_J_ += work;
  most_given_J_ = std::max(most_given_J_, given_J_);
  worst_tick_J_ = std::max(worst_tick_J_, std::abs(work));
  moved_J_ += std::abs(work);
  if (stored > 0.0 || stored_J_ > 0.0)
    allowed_J_ += std::min(0.5 * k * moved, 2.0 * most) * moved;  // a clamped force changes by 2·most at most
  allowed_J_ += slewed_N_ * moved;
  moved_J_ += stored;
  excess_J_ = std::max(excess_J_, given_J_ + stored - allowed_J_);
  stored_J_ = stored;
  device_m_ = felt.device_m;
  force_N_ = felt.force_N;
  const double difference = length(felt.force_N - spring.clamped_N);
  slewed_N_ = difference > 1e-9 * most ? difference : 0.0;
}

void TickInvariants::check_outside(const WorldState& state, const glm::dvec3& proxy) {
  const double radius = world_.contact_radius_m();
  for (std::size_t o = 0; o < world_.rigid.size(); ++o) {
    const polygon::RigidSurface& surface = *world_.rigid[o].surface;
    const glm::dvec3 in_body = state.rigid[o].frame.to_body(proxy);
    polygon::NearPoint near;
    if (surface.nearest(in_body, radius, near)) inside_m_ = std::max(inside_m_, radius - near.distance);
    if (surface.inside(in_body)) inside_m_ = std::max(inside_m_, radius);
  }
}

void TickInvariants::check_tick(const WorldState& state, const TickResult& felt, double dt_s) {
  const bool good = polygon::is_finite(felt.device_m) && polygon::is_finite(felt.proxy_m) &&
                    polygon::is_finite(felt.force_N) && polygon::is_finite(felt.rigid_N) &&
                    polygon::is_finite(felt.soft_N);
  if (!good) {
    ++not_finite_;
    ++ticks_;
    return;
  }
  const double force = length(felt.force_N), dt = std::isfinite(dt_s) && dt_s > 0.0 ? dt_s : 0.0;
  most_N_ = std::max(most_N_, force);
  over_force_N_ = std::max(over_force_N_, force - world_.limits.max_force_N * (1.0 + 1e-12));
  const double step = length(felt.force_N - force_N_);
  if (force > 0.0)
    over_slew_N_ = std::max(over_slew_N_, step - world_.limits.max_slew_N_per_s * dt * (1.0 + 1e-9) - 1e-12);
  account_energy(state, felt);
  check_outside(state, felt.proxy_m);
  slowest_us_ = std::max(slowest_us_, felt.tick_us);
  hash_ = hash_tick(hash_, felt);
  if (ticks_ % kStateCheckEvery == 0) check_state(state);
  ++ticks_;
}

}  // namespace hybrid
