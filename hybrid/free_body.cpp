// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/free_body.h"

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace hybrid {
namespace {

constexpr int kMaxSolves = 8;           // contacts let go, and solved again
constexpr int kMaxNewton = 12;          // of the midpoint's turning
constexpr double kLongestStep_s = 1.0;  // a program that stood still for longer does not make it up
constexpr double kMostTurn = 1.0;       // rad a step: beyond it the midpoint rule has more than one solution

bool finite(const glm::dvec3& v) noexcept {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

glm::dmat3 cross_matrix(const glm::dvec3& v) noexcept {
  return {0.0, v.z, -v.y, -v.z, 0.0, v.x, v.y, -v.x, 0.0};  // columns
}

// Velocity and spin, or force and torque, as one.
struct Twist {
  glm::dvec3 linear{0.0}, angular{0.0};
  [[nodiscard]] double operator[](std::size_t i) const noexcept {
    return i < 3 ? linear[static_cast<int>(i)] : angular[static_cast<int>(i) - 3];
  }
  [[nodiscard]] double& operator[](std::size_t i) noexcept {
    return i < 3 ? linear[static_cast<int>(i)] : angular[static_cast<int>(i) - 3];
  }
};

// Symmetric positive definite, by Cholesky. Rows and columns of very different units are no trouble: the
// factorisation is the same for any scaling of them.
class System {
 public:
  void add_block(std::size_t at, const glm::dmat3& m) noexcept {
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) a_[at + i][at + j] += m[static_cast<int>(j)][static_cast<int>(i)];
    }
  }
  void add_outer(const Twist& j, double k) noexcept {
    for (std::size_t r = 0; r < 6; ++r) {
      for (std::size_t c = 0; c < 6; ++c) a_[r][c] += k * j[r] * j[c];
    }
  }
  // False when it is not positive definite, or not finite.
  [[nodiscard]] bool solve(Twist& x) const noexcept {
    std::array<std::array<double, 6>, 6> l{};
    for (std::size_t r = 0; r < 6; ++r) {
      for (std::size_t c = 0; c <= r; ++c) {
        double sum = a_[r][c];
        for (std::size_t k = 0; k < c; ++k) sum -= l[r][k] * l[c][k];
        if (r != c) {
          l[r][c] = sum / l[c][c];
        } else {
          if (!(sum > 0.0) || !std::isfinite(sum)) return false;
          l[r][r] = std::sqrt(sum);
        }
      }
    }
    for (std::size_t r = 0; r < 6; ++r) {
      for (std::size_t k = 0; k < r; ++k) x[r] -= l[r][k] * x[k];
      x[r] /= l[r][r];
    }
    for (std::size_t r = 6; r-- > 0;) {
      for (std::size_t k = r + 1; k < 6; ++k) x[r] -= l[k][r] * x[k];
      x[r] /= l[r][r];
    }
    return finite(x.linear) && finite(x.angular);
  }

 private:
  std::array<std::array<double, 6>, 6> a_{};
};

// How a contact sees the body: its point moves along its normal by j · twist.
Twist lever(const BodyContact& contact, const FreeBodyState& state) noexcept {
  return {contact.normal, glm::cross(contact.point_m - state.centre_m, contact.normal)};
}

double dot(const Twist& a, const Twist& b) noexcept {
  return glm::dot(a.linear, b.linear) + glm::dot(a.angular, b.angular);
}

// The velocity at the end of the step, contacts answering to it.
bool push(const FreeBody& body, const FreeBodyState& state, std::span<const BodyContact> contacts, double dt,
          Twist& after) noexcept {
  const glm::dmat3 rotation = glm::mat3_cast(state.rotation);
  const glm::dmat3 inertia = rotation * body.mass.inertia_kg_m2 * glm::transpose(rotation);
  const std::size_t one_sided = std::min(contacts.size(), kMaxOneSided);
  std::bitset<kMaxOneSided> pressing;
  for (std::size_t c = 0; c < one_sided; ++c) pressing[c] = !(contacts[c].force_N < 0.0);
  for (int solve = 0; solve < kMaxSolves; ++solve) {
    System system;
    system.add_block(0, glm::dmat3(body.mass.mass_kg + dt * body.drag_N_s_per_m));
    system.add_block(3, inertia + glm::dmat3(dt * body.angular_drag_N_m_s));
    after = {body.mass.mass_kg * (state.velocity_m_per_s + dt * body.gravity_m_per_s2),
             inertia * state.spin_rad_per_s};
    for (std::size_t c = 0; c < contacts.size(); ++c) {
      if (c < one_sided && !pressing[c]) continue;
      const Twist j = lever(contacts[c], state);
      system.add_outer(j, dt * dt * contacts[c].stiffness_N_per_m);
      after.linear += dt * contacts[c].force_N * j.linear;
      after.angular += dt * contacts[c].force_N * j.angular;
    }
    if (!system.solve(after)) return false;
    // The energy is convex in the velocity, so the set that confirms itself is the solution (a semi-smooth
    // Newton method). Should it not be found in time, the last velocity is one of contacts that may pull a
    // little.
    const std::bitset<kMaxOneSided> before = pressing;
    for (std::size_t c = 0; c < one_sided; ++c) {
      const double gives = dt * contacts[c].stiffness_N_per_m * dot(lever(contacts[c], state), after);
      pressing[c] = contacts[c].force_N - gives > 0.0;
    }
    if (pressing == before) break;
  }
  return true;
}

// Turns the body by itself: implicit midpoint in its own frame, π' = π × I⁻¹π, solved by Newton, and the
// rotation that goes with it. `spin` in scene frame before and after.
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
    if (!finite(step)) break;
    middle -= step;
    if (glm::length(step) <= 1e-15 * scale) break;
  }
  glm::dvec3 after = 2.0 * middle - before;
  // Both hold but for rounding when Newton has converged; when it has not, nothing is gained.
  const double energy = glm::dot(before, momentum), gained = glm::dot(after, inertia * after);
  if (!finite(after)) {
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

}  // namespace

FreeBodyState state_at(const FreeBody& body, const Pose& pose) {
  FreeBodyState state;
  state.rotation = glm::normalize(pose.rotation);
  state.centre_m = pose.position_m + state.rotation * body.mass.centre_m;
  return state;
}

Pose pose_of(const FreeBody& body, const FreeBodyState& state) noexcept {
  return {state.centre_m - state.rotation * body.mass.centre_m, state.rotation};
}

bool step_free_body(const FreeBody& body, FreeBodyState& state, std::span<const BodyContact> contacts,
                    double dt_s) noexcept {
  if (!(dt_s > 0.0)) return std::isfinite(dt_s);
  dt_s = std::min(dt_s, kLongestStep_s);
  FreeBodyState next = state;
  Twist after;
  if (push(body, state, contacts, dt_s, after)) {
    next.velocity_m_per_s = at_most(after.linear, body.max_speed_m_per_s);
    next.spin_rad_per_s = at_most(after.angular, std::min(body.max_spin_rad_per_s, kMostTurn / dt_s));
    next.centre_m += dt_s * next.velocity_m_per_s;
    turn(body, next.rotation, next.spin_rad_per_s, dt_s);
    const glm::dquat& q = next.rotation;
    const double sum = q.w + q.x + q.y + q.z;
    if (finite(next.centre_m) && finite(next.spin_rad_per_s) && std::isfinite(sum)) {
      state = next;
      return true;
    }
  }
  state.velocity_m_per_s = state.spin_rad_per_s = glm::dvec3(0.0);
  return false;
}

double kinetic_energy_J(const FreeBody& body, const FreeBodyState& state) noexcept {
  return 0.5 * body.mass.mass_kg * glm::dot(state.velocity_m_per_s, state.velocity_m_per_s) +
         0.5 * glm::dot(state.spin_rad_per_s, angular_momentum(body, state));
}

glm::dvec3 angular_momentum(const FreeBody& body, const FreeBodyState& state) noexcept {
  return state.rotation * (body.mass.inertia_kg_m2 * (glm::inverse(state.rotation) * state.spin_rad_per_s));
}

}  // namespace hybrid
