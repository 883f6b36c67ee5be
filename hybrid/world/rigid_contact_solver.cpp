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

constexpr int kMaxSolves = 16;                   // contacts let go, and solved again
constexpr int kMaxRubbed = 16;                   // … where there is friction
constexpr double kSticks = 1e-5;                 // m/s: what slides no faster than this, friction may hold
constexpr double kSlips = 0.01, kPresses = 0.1;  // of themselves: slips and pressures that are near enough
constexpr int kHalvings = 40;
constexpr double kFlatEnough = 0.1;  // of the slope where a way begins

double dot(const Twist& a, const Twist& b) noexcept {
  return glm::dot(a.linear, b.linear) + glm::dot(a.angular, b.angular);
}

// Symmetric positive definite, six rows a body, by Cholesky in place. Of each body's rows nothing before the
// first body that it has a contact with is looked at: bodies that do not touch cost no more than each by
// itself. Rows and columns of very different units are no trouble: the factorisation is the same for any
// scaling of them.
class System {
 public:
  System(std::span<double> matrix, std::span<const std::uint32_t> first) : a_(matrix), first_(first) {
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
  // k times the product of what two bodies (the first no earlier than the second) see of a contact.
  void add_outer(std::size_t body, const Twist& j, std::size_t other, const Twist& i, double k) noexcept {
    for (std::size_t r = 0; r < 6; ++r) {
      const std::size_t end = body == other ? r + 1 : 6;
      for (std::size_t c = 0; c < end; ++c) at(6 * body + r, 6 * other + c) += k * j[r] * i[c];
    }
  }
  // False when it is not positive definite, or not finite.
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

// How a contact sees a body: its point moves along `way` by j · twist.
Twist lever(const BodyContact& contact, const glm::dvec3& way, const FreeBodyState& state) noexcept {
  return {way, glm::cross(contact.point_m - state.centre_m, way)};
}

// The bodies of a step, their velocities at its end, and the contacts that answer to these.
class Push {
 public:
  Push(std::span<const SteppedBody> bodies, std::span<const BodyContact> contacts,
       const SolveScratch& scratch, double dt)
      : bodies_(bodies),
        contacts_(contacts),
        matrix_(scratch.matrix),
        x_(scratch.twists.first(6 * bodies.size())),
        before_(scratch.twists.subspan(6 * bodies.size(), 6 * bodies.size())),
        pressed_in_(scratch.twists.subspan(12 * bodies.size(), 6 * bodies.size())),
        first_(scratch.first.first(bodies.size())),
        one_sided_(std::min(contacts.size(), kMaxOneSided)),
        dt_(dt),
        ways_(scratch.ways) {
    for (std::size_t b = 0; b < bodies.size(); ++b) first_[b] = static_cast<std::uint32_t>(b);
    for (const BodyContact& c : contacts) {
      if (c.other == BodyContact::kNone) continue;
      const auto [low, high] = std::minmax(c.body, c.other);
      first_[high] = std::min(first_[high], low);
    }
    rubs_ =
        std::any_of(contacts.begin(), contacts.end(), [](const BodyContact& c) { return c.friction > 0.0; });
  }

  // False when they would not be finite. The energy is convex in the velocities: a quadratic, pressing
  // contacts that are let go, and what friction takes of sliding. From each solution the way to the next is
  // followed as far as the energy falls (a semi-smooth Newton method with line search, which cannot go in
  // circles). Should it not be found in time, contacts may pull a little. What friction is a share of is
  // taken from the solution before.
  bool solve() noexcept {
    std::fill(x_.begin(), x_.end(), 0.0);
    for (std::size_t c = 0; c < one_sided_; ++c) pressing_[c] = !(contacts_[c].force_N < 0.0);
    bool rubbing = false;
    for (int n = 0; n < (rubs_ ? kMaxRubbed : kMaxSolves); ++n) {
      std::copy(x_.begin(), x_.end(), before_.begin());
      if (!solve_once(rubbing)) return false;
      const bool confirmed = set_confirmed();
      if (confirmed && (!rubs_ || (rubbing && slips_confirmed()))) break;
      if (rubbing || !confirmed) go_back(best_share(rubbing));
      press_where_pressed();
      if (!rubs_ || !(confirmed || rubbing)) continue;
      std::copy(x_.begin(), x_.end(), pressed_in_.begin());
      // From how it was before: what was at rest is held from the beginning, and what slides is known to.
      if (!rubbing) {
        for (std::uint32_t b = 0; b < bodies_.size(); ++b) put(x_, b, twist_before(b));
      }
      rubbing = true;
    }
    return true;
  }

 private:
  using Twists = std::span<const double>;
  [[nodiscard]] Twist twist_before(std::uint32_t body) const noexcept {
    return {bodies_[body].state.velocity_m_per_s, bodies_[body].state.spin_rad_per_s};
  }
  static void put(std::span<double> all, std::uint32_t body, const Twist& twist) noexcept {
    for (std::size_t i = 0; i < 6; ++i) all[6 * std::size_t{body} + i] = twist[i];
  }
  // Speed of the body's point along `way`, less that of what it is in contact with.
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
  // Two ways along the surface.
  [[nodiscard]] static std::array<glm::dvec3, 2> along(const BodyContact& c) noexcept {
    const glm::dvec3 size = glm::abs(c.normal);
    const glm::dvec3 least = size.x <= size.y && size.x <= size.z ? glm::dvec3(1, 0, 0)
                             : size.y <= size.z                   ? glm::dvec3(0, 1, 0)
                                                                  : glm::dvec3(0, 0, 1);
    const glm::dvec3 first = glm::normalize(glm::cross(c.normal, least));
    return {first, glm::cross(c.normal, first)};
  }
  // How fast the body's point slides along the surface.
  [[nodiscard]] std::array<double, 2> slip(const BodyContact& c, Twists all) const noexcept {
    const std::array<glm::dvec3, 2> ways = along(c);
    return {speed(c, ways[0], all) - glm::dot(ways[0], c.carried_m_per_s),
            speed(c, ways[1], all) - glm::dot(ways[1], c.carried_m_per_s)};
  }
  // What friction takes off a contact that slides at such a speed is this much times the root of its square
  // and that of kSticks (N).
  [[nodiscard]] double friction_N(const BodyContact& c) const noexcept {
    return c.friction > 0.0 && !stopped(c) ? c.friction * std::max(0.0, pressed_N(c, pressed_in_)) : 0.0;
  }
  // Its slope and curvature where it slides as in before_.
  void add_friction(System& system, const BodyContact& c) noexcept {
    const double most_N = friction_N(c);
    if (!(most_N > 0.0)) return;
    const auto [u, v] = slip(c, before_);
    const double s = std::sqrt(u * u + v * v + kSticks * kSticks), k = most_N / s;
    const double q = std::hypot(u, v), flat = k * (kSticks * kSticks) / (s * s);
    // Its axes are the way it slides and that across it.
    const std::array<glm::dvec3, 2> ways = along(c);
    const glm::dvec3 on = q > 0.0 ? (u * ways[0] + v * ways[1]) / q : ways[0],
                     across = q > 0.0 ? (u * ways[1] - v * ways[0]) / q : ways[1];
    add(system, c, on, dt_ * flat);
    push(c, on, dt_ * (flat * speed(c, on, before_) - k * q));
    add(system, c, across, dt_ * k);
    push(c, across, dt_ * k * speed(c, across, before_));
  }
  void add(System& system, const BodyContact& c, const glm::dvec3& way, double k) noexcept {
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
  void push(const BodyContact& c, const glm::dvec3& way, double impulse) noexcept {
    push(c.body, lever(c, way, bodies_[c.body].state), impulse);
    if (c.other != BodyContact::kNone) push(c.other, lever(c, way, bodies_[c.other].state), -impulse);
  }
  void push(std::uint32_t body, const Twist& j, double impulse) noexcept {
    for (std::size_t i = 0; i < 6; ++i) x_[6 * std::size_t{body} + i] += impulse * j[i];
  }
  bool solve_once(bool with_friction) noexcept {
    System system(matrix_, first_);
    for (std::uint32_t b = 0; b < bodies_.size(); ++b) {
      const Inert inert = inert_of(b);
      system.add_block(6 * std::size_t{b}, glm::dmat3(inert.mass));
      system.add_block(6 * std::size_t{b} + 3, inert.inertia);
      put(x_, b, inert.momentum);
    }
    for (std::size_t n = 0; n < contacts_.size(); ++n) {
      const BodyContact& c = contacts_[n];
      if ((n < one_sided_ && !pressing_[n]) || stopped(c)) continue;
      add(system, c, c.normal, dt_ * dt_ * c.stiffness_N_per_m);
      push(c, c.normal, dt_ * c.force_N);
      if (with_friction) add_friction(system, c);
    }
    return system.solve(x_);
  }
  // A body by itself: (mass, inertia) · its twist after the step = momentum; drag counts as mass.
  struct Inert {
    double mass = 0.0;
    glm::dmat3 inertia{0.0};
    Twist momentum;
  };
  [[nodiscard]] Inert inert_of(std::uint32_t b) const noexcept {
    const FreeBody& body = *bodies_[b].body;
    const FreeBodyState& state = bodies_[b].state;
    const glm::dmat3 rotation = glm::mat3_cast(state.rotation);
    const glm::dmat3 inertia = rotation * body.mass.inertia_kg_m2 * glm::transpose(rotation);
    return {body.mass.mass_kg + dt_ * body.drag_N_s_per_m,
            inertia + glm::dmat3(dt_ * body.angular_drag_N_m_s),
            {body.mass.mass_kg * (state.velocity_m_per_s + dt_ * body.gravity_m_per_s2),
             inertia * state.spin_rad_per_s}};
  }
  void go_back(double share) noexcept {
    for (std::size_t i = 0; i < x_.size(); ++i) x_[i] = before_[i] + share * (x_[i] - before_[i]);
  }
  // Of the way from `before_` to `x_`, as far as the energy falls. What pressing and letting go add to its
  // slope is linear between places, and only grows.
  [[nodiscard]] double best_share(bool with_friction) noexcept {
    double slope = 0.0, curvature = 0.0;  // of all but the contacts, at before_
    for (std::uint32_t b = 0; b < bodies_.size(); ++b) {
      const Inert inert = inert_of(b);
      const Twist from = twist_of(before_, b), to = twist_of(x_, b);
      const Twist way{to.linear - from.linear, to.angular - from.angular};
      const Twist along{inert.mass * way.linear, inert.inertia * way.angular};
      slope += dot(along, from) - dot(way, inert.momentum);
      curvature += dot(along, way);
    }
    for (std::size_t n = 0; n < contacts_.size(); ++n) {
      const BodyContact& c = contacts_[n];
      const double from_N = pressed_N(c, before_);
      const ContactOnWay on_way{from_N,
                                pressed_N(c, x_) - from_N,
                                dt_ * (speed(c, c.normal, x_) - speed(c, c.normal, before_)),
                                0.0,
                                {},
                                {}};
      const bool counts = !stopped(c);
      if (n < one_sided_) {
        ways_[n] = counts ? on_way : ContactOnWay{};
      } else if (counts) {
        slope -= on_way.from_N * on_way.way_m;
        curvature -= on_way.more_N * on_way.way_m;
      }
      if (n >= one_sided_) continue;
      ways_[n].friction_N = with_friction ? friction_N(c) : 0.0;
      if (!(ways_[n].friction_N > 0.0)) continue;
      ways_[n].slip = slip(c, before_);
      const std::array<double, 2> after = slip(c, x_);
      ways_[n].more_slip = {after[0] - ways_[n].slip[0], after[1] - ways_[n].slip[1]};
    }
    const auto slope_at = [&](double share) {
      double sum = slope + share * curvature;
      for (std::size_t n = 0; n < one_sided_; ++n) {
        const ContactOnWay& way = ways_[n];
        sum -= std::max(0.0, way.from_N + share * way.more_N) * way.way_m;
        if (!(way.friction_N > 0.0)) continue;
        const double u = way.slip[0] + share * way.more_slip[0], v = way.slip[1] + share * way.more_slip[1];
        sum += dt_ * way.friction_N * (u * way.more_slip[0] + v * way.more_slip[1]) /
               std::sqrt(u * u + v * v + kSticks * kSticks);
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
  void press_where_pressed() noexcept {
    for (std::size_t c = 0; c < one_sided_; ++c) pressing_[c] = pressed_N(contacts_[c], x_) > 0.0;
  }
  [[nodiscard]] bool set_confirmed() const noexcept {
    for (std::size_t c = 0; c < one_sided_; ++c) {
      if (pressing_[c] != (pressed_N(contacts_[c], x_) > 0.0)) return false;
    }
    return true;
  }
  // Does everything slide as it was taken to, and press where it does?
  [[nodiscard]] bool slips_confirmed() const noexcept {
    return std::all_of(contacts_.begin(), contacts_.end(), [&](const BodyContact& c) {
      const double most_N = friction_N(c);
      if (!(most_N > 0.0)) return true;
      const std::array<double, 2> taken = slip(c, before_), is = slip(c, x_);
      return std::hypot(is[0] - taken[0], is[1] - taken[1]) <=
                 kSlips * (std::hypot(is[0], is[1]) + kSticks) &&
             std::abs(c.friction * pressed_N(c, x_) - most_N) <= kPresses * most_N;
    });
  }

  std::span<const SteppedBody> bodies_;
  std::span<const BodyContact> contacts_;
  std::span<double> matrix_, x_, before_, pressed_in_;
  std::span<std::uint32_t> first_;
  std::size_t one_sided_;
  double dt_;
  bool rubs_ = false;
  std::bitset<kMaxOneSided> pressing_;
  std::span<ContactOnWay> ways_;
};

}  // namespace

bool solve_velocities(std::span<const SteppedBody> bodies, std::span<const BodyContact> contacts,
                      const SolveScratch& scratch, double dt) noexcept {
  return Push(bodies, contacts, scratch, dt).solve();
}

}  // namespace hybrid
