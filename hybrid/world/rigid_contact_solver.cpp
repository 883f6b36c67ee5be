// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/world/rigid_contact_solver.h"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>

namespace hybrid {
namespace {

constexpr int kMaxSolves = 16;          // Newton steps without friction
constexpr int kMaxFrictionSolves = 16;  // Newton steps with friction
constexpr double kStickSpeed = 1e-5;    // m/s: regularises Coulomb's law; slower sliding counts as sticking
constexpr double kSlipTolerance = 0.01, kForceTolerance = 0.1;  // relative tolerances of slip and pressure
constexpr int kHalvings = 40;                                   // steps of a bisection
constexpr double kFlatEnough = 0.1;  // the line search ends at this fraction of the initial slope

double dot(const Twist& a, const Twist& b) noexcept {
  return glm::dot(a.linear, b.linear) + glm::dot(a.angular, b.angular);
}

// Symmetric positive definite matrix with six rows per body, solved by Cholesky in place. The rows of a body
// begin at the column of the first body that it touches. So bodies that do not touch cost no more than each
// body alone. The factorisation does not depend on the scaling of rows and columns, so different units do no
// harm.
class BlockCholesky {
 public:
  BlockCholesky(std::span<double> matrix, std::span<const std::uint32_t> first) : a_(matrix), first_(first) {
    for (std::size_t r = 0; r < rows(); ++r) {
      for (std::size_t c = begin(r); c <= r; ++c) at(r, c) = 0.0;
    }
  }
  void add_block(std::size_t from, const glm::dmat3& m) noexcept {
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j <= i; ++j)
        at(from + i, from + j) += m[static_cast<int>(j)][static_cast<int>(i)];
    }
  }
  // Adds k times the outer product of a contact's levers on two bodies (`body` >= `other`).
  void add_outer(std::size_t body, const Twist& j, std::size_t other, const Twist& i, double k) noexcept {
    for (std::size_t r = 0; r < 6; ++r) {
      const std::size_t end = body == other ? r + 1 : 6;
      for (std::size_t c = 0; c < end; ++c) at(6 * body + r, 6 * other + c) += k * j[r] * i[c];
    }
  }
  // False if the matrix is not positive definite, or not finite.
  [[nodiscard]] bool solve(std::span<double> x) noexcept {
    for (std::size_t r = 0; r < rows(); ++r) {
      for (std::size_t c = begin(r); c <= r; ++c) {
        double sum = at(r, c);
        for (std::size_t k = std::max(begin(r), begin(c)); k < c; ++k) sum -= at(r, k) * at(c, k);
        if (r != c) {
          at(r, c) = sum / at(c, c);
        } else {
          if (!(sum > 0.0) || !std::isfinite(sum)) return false;
          at(r, r) = std::sqrt(sum);
        }
      }
    }
    for (std::size_t r = 0; r < rows(); ++r) {
      for (std::size_t k = begin(r); k < r; ++k) x[r] -= at(r, k) * x[k];
      x[r] /= at(r, r);
    }
    for (std::size_t r = rows(); r-- > 0;) {
      x[r] /= at(r, r);
      for (std::size_t k = begin(r); k < r; ++k) x[k] -= at(r, k) * x[r];
    }
    return std::all_of(x.begin(), x.end(), [](double v) { return std::isfinite(v); });
  }

 private:
  [[nodiscard]] std::size_t rows() const noexcept { return 6 * first_.size(); }
  [[nodiscard]] std::size_t begin(std::size_t row) const noexcept { return 6 * first_[row / 6]; }
  [[nodiscard]] double& at(std::size_t r, std::size_t c) const noexcept { return a_[r * rows() + c]; }

  std::span<double> a_;
  std::span<const std::uint32_t> first_;
};

// Lever j of a contact on a body: the speed of the contact's point along `way` is j · twist.
Twist lever(const BodyContact& contact, const glm::dvec3& way, const FreeBodyState& state) noexcept {
  return {way, glm::cross(contact.point_m - state.centre_m, way)};
}

// The convex problem of one step. Its unknowns are the bodies' velocities at the end of the step, on which
// the contact forces depend.
class ContactSolver {
 public:
  ContactSolver(std::span<const SteppedBody> bodies, std::span<const BodyContact> contacts,
                const SolveScratch& scratch, double dt)
      : bodies_(bodies),
        contacts_(contacts),
        matrix_(scratch.matrix),
        x_(scratch.twists.first(6 * bodies.size())),
        before_(scratch.twists.subspan(6 * bodies.size(), 6 * bodies.size())),
        friction_basis_(scratch.twists.subspan(12 * bodies.size(), 6 * bodies.size())),
        first_(scratch.first.first(bodies.size())),
        one_sided_(std::min(contacts.size(), kMaxOneSided)),
        dt_(dt),
        lines_(scratch.ways) {
    for (std::size_t b = 0; b < bodies.size(); ++b) first_[b] = static_cast<std::uint32_t>(b);
    for (const BodyContact& c : contacts) {
      if (c.other == BodyContact::kNone) continue;
      const auto [low, high] = std::minmax(c.body, c.other);
      first_[high] = std::min(first_[high], low);
    }
    has_friction_ =
        std::any_of(contacts.begin(), contacts.end(), [](const BodyContact& c) { return c.friction > 0.0; });
  }

  // Returns false if the velocities would not be finite. A semi-smooth Newton method minimises an energy that
  // is convex in the velocities: the sum of a quadratic, the energy of unilateral contacts, and the
  // dissipation by friction. A line search ends each step at the point where the energy no longer falls, so
  // the method cannot cycle. Friction bounds use the normal forces of the previous solution. If the
  // iterations run out, contacts may pull a little.
  bool solve() noexcept {
    std::fill(x_.begin(), x_.end(), 0.0);
    for (std::size_t c = 0; c < one_sided_; ++c) active_[c] = !(contacts_[c].force_N < 0.0);
    bool friction_on = false;
    for (int n = 0; n < (has_friction_ ? kMaxFrictionSolves : kMaxSolves); ++n) {
      std::copy(x_.begin(), x_.end(), before_.begin());
      if (!solve_once(friction_on)) return false;
      const bool confirmed = active_set_confirmed();
      if (confirmed && (!has_friction_ || (friction_on && slips_confirmed()))) break;
      if (friction_on || !confirmed) scale_step(line_search(friction_on));
      update_active_set();
      if (!has_friction_ || !(confirmed || friction_on)) continue;
      std::copy(x_.begin(), x_.end(), friction_basis_.begin());
      // With friction, the iteration starts from the velocities before the step. So resting contacts stick
      // from the beginning, and sliding contacts have the right direction.
      if (!friction_on) {
        for (std::uint32_t b = 0; b < bodies_.size(); ++b) set_twist(x_, b, twist_before(b));
      }
      friction_on = true;
    }
    return true;
  }

 private:
  using Twists = std::span<const double>;
  [[nodiscard]] Twist twist_before(std::uint32_t body) const noexcept {
    return {bodies_[body].state.velocity_m_per_s, bodies_[body].state.spin_rad_per_s};
  }
  static void set_twist(std::span<double> all, std::uint32_t body, const Twist& twist) noexcept {
    for (std::size_t i = 0; i < 6; ++i) all[6 * std::size_t{body} + i] = twist[i];
  }
  // Speed of the body's point along `way`, relative to the other body.
  [[nodiscard]] double speed(const BodyContact& c, const glm::dvec3& way, Twists all) const noexcept {
    double result = dot(lever(c, way, bodies_[c.body].state), twist_of(all, c.body));
    if (c.other != BodyContact::kNone)
      result -= dot(lever(c, way, bodies_[c.other].state), twist_of(all, c.other));
    return result;
  }
  [[nodiscard]] bool stopped(const BodyContact& c) const noexcept {
    return bodies_[c.body].stopped || (c.other != BodyContact::kNone && bodies_[c.other].stopped);
  }
  [[nodiscard]] double pressed_N(const BodyContact& c, Twists all) const noexcept {
    return c.force_N - dt_ * c.stiffness_N_per_m * speed(c, c.normal, all);
  }
  // Two tangents of the surface.
  [[nodiscard]] static std::array<glm::dvec3, 2> along(const BodyContact& c) noexcept {
    const glm::dvec3 size = glm::abs(c.normal);
    const glm::dvec3 least = size.x <= size.y && size.x <= size.z ? glm::dvec3(1, 0, 0)
                             : size.y <= size.z                   ? glm::dvec3(0, 1, 0)
                                                                  : glm::dvec3(0, 0, 1);
    const glm::dvec3 first = glm::normalize(glm::cross(c.normal, least));
    return {first, glm::cross(c.normal, first)};
  }
  // Sliding velocity of the body's point along the surface.
  [[nodiscard]] std::array<double, 2> slip(const BodyContact& c, Twists all) const noexcept {
    const std::array<glm::dvec3, 2> ways = along(c);
    return {speed(c, ways[0], all) - glm::dot(ways[0], c.carried_m_per_s),
            speed(c, ways[1], all) - glm::dot(ways[1], c.carried_m_per_s)};
  }
  // Bound of the contact's friction (N). The contact dissipates this bound times sqrt(slip² + kStickSpeed²)
  // (W).
  [[nodiscard]] double friction_N(const BodyContact& c) const noexcept {
    return c.friction > 0.0 && !stopped(c) ? c.friction * std::max(0.0, pressed_N(c, friction_basis_)) : 0.0;
  }
  // Adds the slope and curvature of the friction's dissipation at the slip of before_.
  void add_friction(BlockCholesky& system, const BodyContact& c) noexcept {
    const double most_N = friction_N(c);
    if (!(most_N > 0.0)) return;
    const auto [u, v] = slip(c, before_);
    const double s = std::sqrt(u * u + v * v + kStickSpeed * kStickSpeed), k = most_N / s;
    const double q = std::hypot(u, v), flat = k * (kStickSpeed * kStickSpeed) / (s * s);
    // The principal axes of the curvature are the direction of sliding and the direction across it.
    const std::array<glm::dvec3, 2> ways = along(c);
    const glm::dvec3 on = q > 0.0 ? (u * ways[0] + v * ways[1]) / q : ways[0],
                     across = q > 0.0 ? (u * ways[1] - v * ways[0]) / q : ways[1];
    add(system, c, on, dt_ * flat);
    add_impulse(c, on, dt_ * (flat * speed(c, on, before_) - k * q));
    add(system, c, across, dt_ * k);
    add_impulse(c, across, dt_ * k * speed(c, across, before_));
  }
  void add(BlockCholesky& system, const BodyContact& c, const glm::dvec3& way, double k) noexcept {
    const Twist j = lever(c, way, bodies_[c.body].state);
    system.add_outer(c.body, j, c.body, j, k);
    if (c.other == BodyContact::kNone) return;
    const Twist i = lever(c, way, bodies_[c.other].state);
    system.add_outer(c.other, i, c.other, i, k);
    if (c.body > c.other) {
      system.add_outer(c.body, j, c.other, i, -k);
    } else {
      system.add_outer(c.other, i, c.body, j, -k);
    }
  }
  void add_impulse(const BodyContact& c, const glm::dvec3& way, double impulse) noexcept {
    add_impulse(c.body, lever(c, way, bodies_[c.body].state), impulse);
    if (c.other != BodyContact::kNone) add_impulse(c.other, lever(c, way, bodies_[c.other].state), -impulse);
  }
  void add_impulse(std::uint32_t body, const Twist& j, double impulse) noexcept {
    for (std::size_t i = 0; i < 6; ++i) x_[6 * std::size_t{body} + i] += impulse * j[i];
  }
  bool solve_once(bool with_friction) noexcept {
    BlockCholesky system(matrix_, first_);
    for (std::uint32_t b = 0; b < bodies_.size(); ++b) {
      const FreeTerm inert = free_term(b);
      system.add_block(6 * std::size_t{b}, glm::dmat3(inert.mass));
      system.add_block(6 * std::size_t{b} + 3, inert.inertia);
      set_twist(x_, b, inert.momentum);
    }
    for (std::size_t n = 0; n < contacts_.size(); ++n) {
      const BodyContact& c = contacts_[n];
      if ((n < one_sided_ && !active_[n]) || stopped(c)) continue;
      add(system, c, c.normal, dt_ * dt_ * c.stiffness_N_per_m);
      add_impulse(c, c.normal, dt_ * c.force_N);
      if (with_friction) add_friction(system, c);
    }
    return system.solve(x_);
  }
  // The equation of motion of one body without contacts. At the end of the step mass · velocity and
  // inertia · spin equal `momentum`. `mass` and `inertia` include the drag over the step, and `momentum`
  // includes the impulse of gravity.
  struct FreeTerm {
    double mass = 0.0;
    glm::dmat3 inertia{0.0};
    Twist momentum;
  };
  [[nodiscard]] FreeTerm free_term(std::uint32_t b) const noexcept {
    const FreeBody& body = *bodies_[b].body;
    const FreeBodyState& state = bodies_[b].state;
    const glm::dmat3 rotation = glm::mat3_cast(state.rotation);
    const glm::dmat3 inertia = rotation * body.mass.inertia_kg_m2 * glm::transpose(rotation);
    return {body.mass.mass_kg + dt_ * body.drag_N_s_per_m,
            inertia + glm::dmat3(dt_ * body.angular_drag_N_m_s),
            {body.mass.mass_kg * (state.velocity_m_per_s + dt_ * body.gravity_m_per_s2),
             inertia * state.spin_rad_per_s}};
  }
  void scale_step(double share) noexcept {
    for (std::size_t i = 0; i < x_.size(); ++i) x_[i] = before_[i] + share * (x_[i] - before_[i]);
  }
  // Line search: the fraction of the way from `before_` to `x_` up to which the energy falls. The slope grows
  // monotonically, because the energy is convex. The normal forces' part of the slope is piecewise linear.
  [[nodiscard]] double line_search(bool with_friction) noexcept {
    double slope = 0.0, curvature = 0.0;  // without the contacts, at before_
    for (std::uint32_t b = 0; b < bodies_.size(); ++b) {
      const FreeTerm inert = free_term(b);
      const Twist from = twist_of(before_, b), to = twist_of(x_, b);
      const Twist way{to.linear - from.linear, to.angular - from.angular};
      const Twist along{inert.mass * way.linear, inert.inertia * way.angular};
      slope += dot(along, from) - dot(way, inert.momentum);
      curvature += dot(along, way);
    }
    for (std::size_t n = 0; n < contacts_.size(); ++n) {
      const BodyContact& c = contacts_[n];
      const double from_N = pressed_N(c, before_);
      const ContactOnLine on_line{from_N,
                                  pressed_N(c, x_) - from_N,
                                  dt_ * (speed(c, c.normal, x_) - speed(c, c.normal, before_)),
                                  0.0,
                                  {},
                                  {}};
      const bool counts = !stopped(c);
      if (n < one_sided_) {
        lines_[n] = counts ? on_line : ContactOnLine{};
      } else if (counts) {
        slope -= on_line.from_N * on_line.moved_m;
        curvature -= on_line.more_N * on_line.moved_m;
      }
      if (n >= one_sided_) continue;
      lines_[n].friction_N = with_friction ? friction_N(c) : 0.0;
      if (!(lines_[n].friction_N > 0.0)) continue;
      lines_[n].slip = slip(c, before_);
      const std::array<double, 2> after = slip(c, x_);
      lines_[n].more_slip = {after[0] - lines_[n].slip[0], after[1] - lines_[n].slip[1]};
    }
    const auto slope_at = [&](double share) {
      double sum = slope + share * curvature;
      for (std::size_t n = 0; n < one_sided_; ++n) {
        const ContactOnLine& way = lines_[n];
        sum -= std::max(0.0, way.from_N + share * way.more_N) * way.moved_m;
        if (!(way.friction_N > 0.0)) continue;
        const double u = way.slip[0] + share * way.more_slip[0], v = way.slip[1] + share * way.more_slip[1];
        sum += dt_ * way.friction_N * (u * way.more_slip[0] + v * way.more_slip[1]) /
               std::sqrt(u * u + v * v + kStickSpeed * kStickSpeed);
      }
      return sum;
    };
    const double enough = kFlatEnough * std::abs(slope_at(0.0));
    double low = 0.0, high = 1.0;
    if (!(slope_at(high) > enough)) return high;
    double middle = 0.5;
    for (int n = 0; n < kHalvings; ++n) {
      middle = 0.5 * (low + high);
      const double there = slope_at(middle);
      if (std::abs(there) <= enough) break;
      (there > 0.0 ? high : low) = middle;
    }
    return middle;
  }
  void update_active_set() noexcept {
    for (std::size_t c = 0; c < one_sided_; ++c) active_[c] = pressed_N(contacts_[c], x_) > 0.0;
  }
  [[nodiscard]] bool active_set_confirmed() const noexcept {
    for (std::size_t c = 0; c < one_sided_; ++c) {
      if (active_[c] != (pressed_N(contacts_[c], x_) > 0.0)) return false;
    }
    return true;
  }
  // Do all contacts slide and press as assumed in the friction terms?
  [[nodiscard]] bool slips_confirmed() const noexcept {
    return std::all_of(contacts_.begin(), contacts_.end(), [&](const BodyContact& c) {
      const double most_N = friction_N(c);
      if (!(most_N > 0.0)) return true;
      const std::array<double, 2> taken = slip(c, before_), is = slip(c, x_);
      return std::hypot(is[0] - taken[0], is[1] - taken[1]) <=
                 kSlipTolerance * (std::hypot(is[0], is[1]) + kStickSpeed) &&
             std::abs(c.friction * pressed_N(c, x_) - most_N) <= kForceTolerance * most_N;
    });
  }

  std::span<const SteppedBody> bodies_;
  std::span<const BodyContact> contacts_;
  std::span<double> matrix_, x_, before_, friction_basis_;
  std::span<std::uint32_t> first_;
  std::size_t one_sided_;
  double dt_;
  bool has_friction_ = false;
  std::bitset<kMaxOneSided> active_;
  std::span<ContactOnLine> lines_;
};

}  // namespace

bool solve_velocities(std::span<const SteppedBody> bodies, std::span<const BodyContact> contacts,
                      const SolveScratch& scratch, double dt) noexcept {
  return ContactSolver(bodies, contacts, scratch, dt).solve();
}

}  // namespace hybrid
