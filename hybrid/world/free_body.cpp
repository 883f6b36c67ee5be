// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/world/free_body.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "hybrid/world/rigid_contact_solver.h"
#include "polygon/mesh/is_finite.h"

namespace hybrid {
namespace {

constexpr int kMaxNewton = 12;          // Newton steps of the midpoint rule
constexpr double kLongestStep_s = 1.0;  // longer steps are shortened to this
constexpr double kMostTurn = 1.0;       // rad per step; beyond it the midpoint rule is ambiguous

glm::dmat3 cross_matrix(const glm::dvec3& v) noexcept {
  return {0.0, v.z, -v.y, -v.z, 0.0, v.x, v.y, -v.x, 0.0};  // columns
}

// Torque-free rotation: implicit midpoint rule in the body frame, π' = π × I⁻¹π, solved by Newton, with the
// matching Cayley rotation. `spin` is in the scene frame before and after.
void turn(const FreeBody& body, glm::dquat& rotation, glm::dvec3& spin, double dt) noexcept {
  const glm::dmat3& inertia = body.mass.inertia_kg_m2;
  const glm::dvec3 before = glm::inverse(rotation) * spin;
  const glm::dvec3 momentum = inertia * before;
  glm::dvec3 middle = before;
  const double scale = glm::length(before);
  for (int n = 0; n < kMaxNewton && scale > 0.0; ++n) {
    const glm::dvec3 now = inertia * middle;
    const glm::dvec3 residual = now - momentum + 0.5 * dt * glm::cross(middle, now);
    const glm::dmat3 jacobian = inertia + 0.5 * dt * (cross_matrix(middle) * inertia - cross_matrix(now));
    const glm::dvec3 step = glm::inverse(jacobian) * residual;
    if (!polygon::is_finite(step)) break;
    middle -= step;
    if (glm::length(step) <= 1e-15 * scale) break;
  }
  glm::dvec3 after = 2.0 * middle - before;
  // Energy and momentum are exact to rounding if Newton converged; otherwise energy must not grow.
  const double energy = glm::dot(before, momentum), gained = glm::dot(after, inertia * after);
  if (!polygon::is_finite(after)) {
    middle = after = before;
  } else if (gained > energy && gained > 0.0) {
    after *= std::sqrt(energy / gained);
  }
  const glm::dvec3 half = 0.5 * dt * middle;
  rotation = glm::normalize(rotation * glm::dquat(1.0, half.x, half.y, half.z));
  spin = rotation * after;
}

glm::dvec3 at_most(const glm::dvec3& v, double most) noexcept {
  const double length = glm::length(v);
  return length > most ? v * (most / length) : v;
}

// Advances the body by its twist; false if the result would not be finite.
bool advance(const FreeBody& body, FreeBodyState& state, const Twist& after, double dt) noexcept {
  FreeBodyState next = state;
  next.velocity_m_per_s = at_most(after.linear, body.max_speed_m_per_s);
  next.spin_rad_per_s = at_most(after.angular, std::min(body.max_spin_rad_per_s, kMostTurn / dt));
  next.centre_m += dt * next.velocity_m_per_s;
  turn(body, next.rotation, next.spin_rad_per_s, dt);
  const glm::dquat& q = next.rotation;
  const double sum = q.w + q.x + q.y + q.z;
  if (!polygon::is_finite(next.centre_m) || !polygon::is_finite(next.spin_rad_per_s) || !std::isfinite(sum))
    return false;
  state = next;
  return true;
}

bool is_finite(const BodyContact& c) noexcept {
  return polygon::is_finite(c.point_m) && polygon::is_finite(c.normal) &&
         polygon::is_finite(c.carried_m_per_s) && std::isfinite(c.force_N + c.stiffness_N_per_m + c.friction);
}

void stop(SteppedBody& stepped) noexcept {
  stepped.stopped = true;
  stepped.state.velocity_m_per_s = stepped.state.spin_rad_per_s = glm::dvec3(0.0);
}

void step(std::span<SteppedBody> bodies, std::span<const BodyContact> contacts, const SolveScratch& scratch,
          double dt) noexcept {
  for (SteppedBody& stepped : bodies) stepped.stopped = false;
  for (const BodyContact& c : contacts) {
    if (is_finite(c)) continue;
    bodies[c.body].stopped = true;
    if (c.other != BodyContact::kNone) bodies[c.other].stopped = true;
  }
  if (bodies.empty() || !(dt > 0.0)) {
    if (!std::isfinite(dt)) std::for_each(bodies.begin(), bodies.end(), stop);
    return;
  }
  dt = std::min(dt, kLongestStep_s);
  const bool solved = solve_velocities(bodies, contacts, scratch, dt);
  for (std::uint32_t b = 0; b < bodies.size(); ++b) {
    if (bodies[b].stopped || !solved ||
        !advance(*bodies[b].body, bodies[b].state, twist_of(scratch.twists, b), dt))
      stop(bodies[b]);
  }
}

}  // namespace

FreeBody without_external_loads(const FreeBody& body) noexcept {
  FreeBody result = body;
  result.gravity_m_per_s2 = glm::dvec3(0.0);
  result.drag_N_s_per_m = result.angular_drag_N_m_s = 0.0;
  return result;
}

FreeBodyState state_at(const FreeBody& body, const Pose& pose) {
  FreeBodyState state;
  state.rotation = glm::normalize(pose.rotation);
  state.centre_m = pose.position_m + state.rotation * body.mass.centre_m;
  return state;
}

Pose pose_of(const FreeBody& body, const FreeBodyState& state) noexcept {
  return {state.centre_m - state.rotation * body.mass.centre_m, state.rotation};
}

BodySystem::BodySystem(std::size_t most_bodies)
    : matrix_(36 * most_bodies * most_bodies),
      twists_(18 * most_bodies),
      first_(most_bodies),
      lines_(most_bodies == 0 ? 0 : kMaxOneSided) {}

void step_free_bodies(std::span<SteppedBody> bodies, std::span<const BodyContact> contacts,
                      BodySystem& system, double dt_s) noexcept {
  step(bodies.first(std::min(bodies.size(), system.most_bodies())), contacts,
       {system.matrix_, system.twists_, system.first_, system.lines_}, dt_s);
}

bool step_free_body(const FreeBody& body, FreeBodyState& state, std::span<const BodyContact> contacts,
                    double dt_s) noexcept {
  std::array<double, 36> matrix{};
  std::array<double, 18> twists{};
  std::array<std::uint32_t, 1> first{};
  std::array<ContactOnLine, kMaxOneSided> ways;  // NOLINT(*-member-init): 256 KiB that few steps need
  SteppedBody stepped{&body, state};
  step({&stepped, 1}, contacts, {matrix, twists, first, ways}, dt_s);
  state = stepped.state;
  return !stepped.stopped;
}

double kinetic_energy_J(const FreeBody& body, const FreeBodyState& state) noexcept {
  return 0.5 * body.mass.mass_kg * glm::dot(state.velocity_m_per_s, state.velocity_m_per_s) +
         0.5 * glm::dot(state.spin_rad_per_s, angular_momentum(body, state));
}

glm::dvec3 angular_momentum(const FreeBody& body, const FreeBodyState& state) noexcept {
  return state.rotation * (body.mass.inertia_kg_m2 * (glm::inverse(state.rotation) * state.spin_rad_per_s));
}

}  // namespace hybrid
