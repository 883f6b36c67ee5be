// SPDX-License-Identifier: GPL-3.0-or-later
#include "polygon/reference/finger_proxy.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

namespace polygon {
namespace {

constexpr std::size_t kMostConstraints = 3;  // more than three planes leave a point no freedom
constexpr double kParallel = 1e-6;           // planes within this sine count as one
constexpr double kSlack = 1e-3;              // of the gap: shorter ways and depths are rounding

struct Constraint {
  glm::dvec3 normal;  // unit; the proxy stays where normal · x >= offset
  double offset;
};

// The constraints of one pass, and the nearest place to a goal that they allow.
class Constraints {
 public:
  explicit Constraints(double slack_m) : slack_m_(slack_m) {}
  [[nodiscard]] double slack_m() const { return slack_m_; }
  [[nodiscard]] bool full() const { return count_ == kMostConstraints; }
  void add(const glm::dvec3& normal, const glm::dvec3& through) {
    of_[count_++] = {normal, glm::dot(normal, through)};
  }

  // `at` is a place that all of them allow. A minimum lies on none, one, two or three of the planes, so the
  // nearest of these places is the minimum.
  [[nodiscard]] glm::dvec3 nearest(const glm::dvec3& goal, const glm::dvec3& at) const {
    Choice best{at, glm::dot(at - goal, at - goal)};
    consider(goal, goal, best);
    for (std::size_t i = 0; i < count_; ++i) {
      consider(goal - above(i, goal) * of_[i].normal, goal, best);
      for (std::size_t k = 0; k < i; ++k) consider_line(i, k, goal, best);
    }
    if (count_ == 3) consider_corner(goal, best);
    return best.place;
  }

 private:
  struct Choice {
    glm::dvec3 place;
    double square;  // of the distance to the goal
  };
  [[nodiscard]] double above(std::size_t i, const glm::dvec3& x) const {
    return glm::dot(of_[i].normal, x) - of_[i].offset;
  }
  void consider(const glm::dvec3& place, const glm::dvec3& goal, Choice& best) const {
    const double square = glm::dot(place - goal, place - goal);
    if (!(square < best.square)) return;
    for (std::size_t i = 0; i < count_; ++i) {
      if (above(i, place) < -slack_m_) return;
    }
    best = {place, square};
  }
  void consider_line(std::size_t i, std::size_t k, const glm::dvec3& goal, Choice& best) const {
    const glm::dvec3 &n = of_[i].normal, &m = of_[k].normal;
    const double cosine = glm::dot(n, m), sine2 = 1.0 - cosine * cosine;
    if (sine2 < kParallel * kParallel) return;
    const double a = -above(i, goal), b = -above(k, goal);
    consider(goal + ((a - cosine * b) / sine2) * n + ((b - cosine * a) / sine2) * m, goal, best);
  }
  void consider_corner(const glm::dvec3& goal, Choice& best) const {
    const glm::dvec3 a = glm::cross(of_[1].normal, of_[2].normal),
                     b = glm::cross(of_[2].normal, of_[0].normal),
                     c = glm::cross(of_[0].normal, of_[1].normal);
    const double volume = glm::dot(of_[0].normal, a);
    if (std::fabs(volume) < kParallel) return;
    consider(goal - (above(0, goal) * a + above(1, goal) * b + above(2, goal) * c) / volume, goal, best);
  }

  std::array<Constraint, kMostConstraints> of_{};
  std::size_t count_ = 0;
  double slack_m_;
};

// Moves `at` towards `next` until it is within the gap of a triangle. The search goes beyond `next` by the
// gap. Otherwise a goal on a triangle would put the proxy on the triangle. Returns the contact, if there is
// one.
SweptHit advance(const TriangleTree& tree, double radius, double gap, const glm::dvec3& next,
                 glm::dvec3& at) {
  const glm::dvec3 way = next - at;
  const double reach = 1.0 + gap / std::max(gap, glm::length(way));
  SweptHit hit = tree.first_hit(at, at + reach * way, radius);
  if (hit.hit) {
    const double part = reach * hit.part + gap / glm::dot(hit.normal, way);  // the product is negative
    hit.hit = part < 1.0;
    if (hit.hit) at += std::max(0.0, part) * way;
  }
  if (!hit.hit) at = next;
  return hit;
}

// Does one pass from `at`. True: nothing was in the way to the goal.
bool pass(const TriangleTree& tree, double radius, double gap, const glm::dvec3& goal, glm::dvec3& at,
          std::uint32_t& sweeps) {
  Constraints constraints(kSlack * gap);
  glm::dvec3 next = goal;
  for (;;) {
    const SweptHit hit = advance(tree, radius, gap, next, at);
    ++sweeps;
    if (!hit.hit) return sweeps == 1;
    if (constraints.full()) return false;
    constraints.add(hit.normal, at);
    next = constraints.nearest(goal, at);
    if (glm::length(next - at) <= constraints.slack_m()) return false;
  }
}

}  // namespace

FingerStep finger_step(const TriangleTree& tree, const FingerOptions& options, const glm::dvec3& from,
                       const glm::dvec3& goal) noexcept {
  const double gap = kFingerGap * tree.size_m();
  FingerStep step{.point = from};
  for (std::uint32_t n = 0; n < options.passes && !step.settled; ++n) {
    const glm::dvec3 before = step.point;
    std::uint32_t sweeps = 0;
    const bool free = pass(tree, options.radius_m, gap, goal, step.point, sweeps);
    step.sweeps += sweeps;
    step.settled = free || glm::length(step.point - before) < gap;
  }
  return step;
}

}  // namespace polygon
