// SPDX-License-Identifier: GPL-3.0-or-later
// The proxy's constrained minimum: the feasible point nearest to a target, for a ball that may not enter
// rigid objects. God-object (Zilles & Salisbury 1995) with a finite radius (Ruspini, Kolarov & Khatib 1997).
// Exact, bounded and free of allocation.
#pragma once

#include <array>
#include <cstdint>
#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>
#include <span>

namespace polygon {

// Constraint on the ball's centre q: normal · q >= offset (unit: meter).
struct ContactPlane {
  glm::dvec3 normal{0.0};
  double offset = 0.0;
  std::uint32_t object = 0;   // the object that gives the plane
  std::uint32_t element = 0;  // triangle, 0 for a primitive
};

struct PlaneMinimum {
  glm::dvec3 point{0.0};
  std::uint32_t active_count = 0;         // active planes, at most three
  std::array<std::uint32_t, 3> active{};  // their indices in the input
  std::array<double, 3> multiplier{};     // >= 0, in units of metric · meter
  // False: the half-spaces do not intersect, and `point` violates a plane.
  bool feasible = true;
};

// A symmetric positive definite metric A, factored once for many problems.
class Metric {
 public:
  explicit Metric(const glm::dmat3& a) noexcept;
  // L⁻¹ of A = L Lᵀ, lower triangular ([column][row]).
  [[nodiscard]] const glm::dmat3& inverse_cholesky() const noexcept { return inverse_l_; }

 private:
  glm::dmat3 inverse_l_;
};

// The point nearest to `target` in the metric (q − t)ᵀ A (q − t), with A symmetric positive definite, in the
// intersection of the planes' half-spaces. This is an LP-type problem (Sharir & Welzl 1992), solved exactly
// by exchanges. There are at most three active planes. An exchange finds the plane that the present point
// violates most. It solves for each subset of at most three planes that consists of this plane and of active
// ones. Of the solutions that violate no active plane and have no negative multiplier, it keeps the one of
// least cost; the planes of that subset become active. The distance grows with each exchange, so the loop
// ends. The number of exchanges is bounded, too. A plane counts as violated beyond `tolerance` (unit: meter).
// Allocates nothing.
PlaneMinimum minimise_on_planes(const glm::dvec3& target, const Metric& metric,
                                std::span<const ContactPlane> planes, double tolerance) noexcept;
inline PlaneMinimum minimise_on_planes(const glm::dvec3& target, const glm::dmat3& metric,
                                       std::span<const ContactPlane> planes, double tolerance) noexcept {
  return minimise_on_planes(target, Metric(metric), planes, tolerance);
}

}  // namespace polygon
