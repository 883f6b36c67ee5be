// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/feel/surface_feel.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>

namespace hybrid {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
// Compliance of a shaded proxy across the normals, relative to its compliance along them.
constexpr double kAside = 1e-4;
// A normal counts only if its part outside the span of the others has at least this share of the compliance.
constexpr double kSameNormal = 1e-6;

double largest(const glm::dvec3& v) noexcept {
  return std::max({std::fabs(v.x), std::fabs(v.y), std::fabs(v.z)});
}

// Bound on the force that rounding of positions can cause. A proxy within this distance of the cone counts as
// on the cone.
double rounding_N(const glm::dvec3& a, const glm::dvec3& b, const glm::dmat3& metric) noexcept {
  return 8.0 * kEpsilon * (largest(a) + largest(b)) * (metric[0][0] + metric[1][1] + metric[2][2]);
}

double energy(const glm::dvec3& from, const glm::dvec3& to, const glm::dmat3& metric) noexcept {
  return 0.5 * glm::dot(to - from, metric * (to - from));
}

}  // namespace

MixedFeel mix_feel(std::span<const FeltSurface> surfaces) noexcept {
  MixedFeel mixed;
  double whole = 0.0;
  for (const FeltSurface& s : surfaces) whole += s.force_N;
  if (!(whole > 0.0)) return mixed;
  for (const FeltSurface& s : surfaces) {
    if (s.feel == nullptr) continue;
    const double share = s.force_N / whole;
    mixed.damping_N_s_per_m += share * s.feel->damping_N_s_per_m;
    mixed.static_friction += share * s.feel->static_friction;
    mixed.dynamic_friction += share * s.feel->dynamic_friction;
  }
  return mixed;
}

FrictionStep friction_target(const glm::dvec3& proxy, const glm::dvec3& target, const glm::dmat3& metric,
                             const glm::dvec3& normal, double static_friction, double dynamic_friction,
                             bool sliding) noexcept {
  FrictionStep step{.target = target};
  const glm::dvec3 pull = metric * (target - proxy);
  step.normal_N = -glm::dot(pull, normal);
  const glm::dvec3 tangential = pull + step.normal_N * normal;
  step.tangential_N = glm::length(tangential);
  // No friction, or the pull leaves the surface.
  if (!(static_friction > 0.0) || !(step.normal_N > 0.0)) return step;

  const double hold = (sliding ? dynamic_friction : static_friction) * step.normal_N;
  if (step.tangential_N <= hold + rounding_N(proxy, target, metric)) {
    step.target = proxy;
    return step;
  }
  // The slide moves the proxy by C (f_t − μN û), where C is the compliance A⁻¹ within the plane. A tangential
  // force f changes the normal force by −a f along the slide, with a = n·A⁻¹û / n·A⁻¹n. Let N be the normal
  // force after the slide and N₀ that before. Then N (1 − μa) = N₀ − a f_t.
  step.sliding = true;
  const glm::dvec3 along = tangential / step.tangential_N;
  const glm::dmat3 compliance = glm::inverse(metric);
  const glm::dvec3 back = compliance * along;
  const double a = glm::dot(normal, back) / glm::dot(normal, compliance * normal);
  const double room = 1.0 - dynamic_friction * a, pressed = step.normal_N - a * step.tangential_N;
  if (!(room > 0.0)) {  // friction jams: a slide would increase the friction by more than it lowers the pull
    step.target = proxy;
  } else if (pressed > 0.0) {  // otherwise the slide lifts the proxy off, and there is no friction
    step.target = target - (dynamic_friction * pressed / room) * back;
  }
  return step;
}

bool friction_dissipates(const glm::dvec3& before, const glm::dvec3& after, const glm::dvec3& target,
                         const glm::dmat3& metric) noexcept {
  const double stored = energy(before, target, metric);
  const double slack = rounding_N(before, target, metric) * glm::length(target - before);
  return energy(after, target, metric) <= stored + slack;
}

double DepthRate::add(double depth_m, double dt_s, double noise_m) noexcept {
  if (!std::isfinite(depth_m) || !(dt_s > 0.0)) {
    count_ = 0;
    return 0.0;
  }
  const std::size_t kept = std::min(count_, kMaxValues - 1);
  for (std::size_t i = kept; i > 0; --i) {
    depth_m_[i] = depth_m_[i - 1];
    age_s_[i] = age_s_[i - 1] + dt_s;
  }
  depth_m_[0] = depth_m;
  age_s_[0] = 0.0;
  count_ = kept + 1;
  double rate = 0.0;
  for (std::size_t end = 1; end < count_; ++end) {
    const double slope = (depth_m - depth_m_[end]) / age_s_[end];
    bool straight = true;
    for (std::size_t i = 1; i < end && straight; ++i)
      straight = std::fabs(depth_m - slope * age_s_[i] - depth_m_[i]) <= noise_m;
    if (!straight) break;
    rate = slope;
    if (noise_m <= 0.0) break;
  }
  return rate;
}

double damping_force(DampingState& state, double normal_N, double depth_m, double damping_N_s_per_m,
                     double dt_s, double noise_m, bool account) noexcept {
  if (state.touching && account) {
    const double work_J = state.wanted_N * (depth_m - state.depth_m);
    if (state.felt) {
      state.balance_J = state.balance_J * std::max(0.0, 1.0 - dt_s / kDampingMemory_s) + work_J;
      if (state.balance_J < 0.0) {
        state.felt = false;
        state.resume_at_J = 2.0 * std::max(state.resume_at_J, -state.balance_J);
        state.earned_J = 0.0;
      }
    } else {
      state.earned_J += work_J;
      if (state.earned_J >= state.resume_at_J) {
        state.felt = true;
        state.balance_J = 0.0;
      }
    }
  }
  const double rate = state.rate.add(depth_m, dt_s, noise_m);
  state.touching = true;
  state.depth_m = depth_m;
  state.wanted_N = std::max(damping_N_s_per_m * rate, -std::max(normal_N, 0.0));
  if (!std::isfinite(state.wanted_N + state.balance_J + state.earned_J)) {
    end_damping(state);
    return 0.0;
  }
  return state.felt ? state.wanted_N : 0.0;
}

glm::dvec3 limit_shaded_normal(const glm::dvec3& shaded, const glm::dvec3& normal,
                               double least_cosine) noexcept {
  const double square = glm::dot(shaded, shaded);
  if (!(square > 0.5 && square < 2.0)) return normal;
  const double cosine = glm::dot(shaded, normal);
  if (cosine >= least_cosine) return shaded / std::sqrt(square);
  const glm::dvec3 aside = shaded - cosine * normal;
  const double length = glm::length(aside);
  if (!(length > 1e-6)) return normal;  // opposite vectors: no direction to turn to
  const double sine = std::sqrt(std::max(0.0, 1.0 - least_cosine * least_cosine));
  return least_cosine * normal + (sine / length) * aside;
}

glm::dmat3 shading_metric(const glm::dmat3& metric, std::span<const glm::dvec3> shaded_normals) noexcept {
  if (shaded_normals.empty()) return metric;
  const glm::dmat3 compliance = glm::inverse(metric);
  const double size = compliance[0][0] + compliance[1][1] + compliance[2][2];
  glm::dmat3 rest = compliance, along(0.0);  // rest: compliance outside the span of the normals so far
  for (const glm::dvec3& normal : shaded_normals) {
    const glm::dvec3 way = rest * normal;
    const double square = glm::dot(way, normal);
    if (!(square > kSameNormal * size)) continue;
    along += glm::outerProduct(way, way) / square;
    rest -= glm::outerProduct(way, way) / square;
  }
  return glm::inverse(along + kAside * compliance);
}

}  // namespace hybrid
