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

constexpr int kMaxSolves = 16;                   // contacts let go, and solved again
constexpr int kMaxRubbed = 16;                   // … where there is friction
constexpr double kSticks = 1e-5;                 // m/s: what slides no faster than this, friction may hold
constexpr double kSlips = 0.01, kPresses = 0.1;  // of themselves: slips and pressures that are near enough
constexpr int kHalvings = 40;
constexpr double kFlatEnough = 0.1;     // of the slope where a way begins
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
};

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

struct Scratch {                     // of n bodies
  std::span<double> matrix, twists;  // 36 n², 18 n
  std::span<std::uint32_t> first;    // n
  std::span<ContactOnWay> ways;      // kMaxOneSided
};

// The bodies of a step, their velocities at its end, and the contacts that answer to these.
class Push {
 public:
  Push(std::span<const SteppedBody> bodies, std::span<const BodyContact> contacts, const Scratch& scratch,
       double dt)
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
  [[nodiscard]] Twist after(std::uint32_t body) const noexcept { return twist_of(x_, body); }

 private:
  using Twists = std::span<const double>;
  [[nodiscard]] static Twist twist_of(Twists all, std::uint32_t body) noexcept {
    const double* v = &all[6 * std::size_t{body}];
    return {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
  }
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
    const std::array<glm::dvec3, 2> ways = along(c);
    const double uu = k * (1.0 - u * u / (s * s)), vv = k * (1.0 - v * v / (s * s)),
                 uv = -k * u * v / (s * s);
    // Along its own axes, of which one is the way it slides.
    const double both = u * u + v * v;
    const glm::dvec3 on = both > 0.0 ? (u * ways[0] + v * ways[1]) / std::sqrt(both) : ways[0],
                     across = both > 0.0 ? (u * ways[1] - v * ways[0]) / std::sqrt(both) : ways[1];
    add(system, c, on, dt_ * k * (kSticks * kSticks) / (s * s));
    add(system, c, across, dt_ * k);
    const double to_u = uu * speed(c, ways[0], before_) + uv * speed(c, ways[1], before_) - k * u,
                 to_v = uv * speed(c, ways[0], before_) + vv * speed(c, ways[1], before_) - k * v;
    push(c, ways[0], dt_ * to_u);
    push(c, ways[1], dt_ * to_v);
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

// Where the body is after the step; false when that would not be finite.
bool advance(const FreeBody& body, FreeBodyState& state, const Twist& after, double dt) noexcept {
  FreeBodyState next = state;
  next.velocity_m_per_s = at_most(after.linear, body.max_speed_m_per_s);
  next.spin_rad_per_s = at_most(after.angular, std::min(body.max_spin_rad_per_s, kMostTurn / dt));
  next.centre_m += dt * next.velocity_m_per_s;
  turn(body, next.rotation, next.spin_rad_per_s, dt);
  const glm::dquat& q = next.rotation;
  const double sum = q.w + q.x + q.y + q.z;
  if (!finite(next.centre_m) || !finite(next.spin_rad_per_s) || !std::isfinite(sum)) return false;
  state = next;
  return true;
}

bool is_finite(const BodyContact& c) noexcept {
  return finite(c.point_m) && finite(c.normal) && finite(c.carried_m_per_s) &&
         std::isfinite(c.force_N + c.stiffness_N_per_m + c.friction);
}

void stop(SteppedBody& stepped) noexcept {
  stepped.stopped = true;
  stepped.state.velocity_m_per_s = stepped.state.spin_rad_per_s = glm::dvec3(0.0);
}

void step(std::span<SteppedBody> bodies, std::span<const BodyContact> contacts, const Scratch& scratch,
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
  Push push(bodies, contacts, scratch, dt);
  const bool solved = push.solve();
  for (std::uint32_t b = 0; b < bodies.size(); ++b) {
    if (bodies[b].stopped || !solved || !advance(*bodies[b].body, bodies[b].state, push.after(b), dt))
      stop(bodies[b]);
  }
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

BodySystem::BodySystem(std::size_t most_bodies)
    : matrix_(36 * most_bodies * most_bodies),
      twists_(18 * most_bodies),
      first_(most_bodies),
      ways_(most_bodies == 0 ? 0 : kMaxOneSided) {}

void step_free_bodies(std::span<SteppedBody> bodies, std::span<const BodyContact> contacts,
                      BodySystem& system, double dt_s) noexcept {
  step(bodies.first(std::min(bodies.size(), system.most_bodies())), contacts,
       {system.matrix_, system.twists_, system.first_, system.ways_}, dt_s);
}

bool step_free_body(const FreeBody& body, FreeBodyState& state, std::span<const BodyContact> contacts,
                    double dt_s) noexcept {
  std::array<double, 36> matrix{};
  std::array<double, 18> twists{};
  std::array<std::uint32_t, 1> first{};
  std::array<ContactOnWay, kMaxOneSided> ways;  // NOLINT(*-member-init): 100 kB that few steps need
  SteppedBody alone{&body, state};
  step({&alone, 1}, contacts, {matrix, twists, first, ways}, dt_s);
  state = alone.state;
  return !alone.stopped;
}

double kinetic_energy_J(const FreeBody& body, const FreeBodyState& state) noexcept {
  return 0.5 * body.mass.mass_kg * glm::dot(state.velocity_m_per_s, state.velocity_m_per_s) +
         0.5 * glm::dot(state.spin_rad_per_s, angular_momentum(body, state));
}

glm::dvec3 angular_momentum(const FreeBody& body, const FreeBodyState& state) noexcept {
  return state.rotation * (body.mass.inertia_kg_m2 * (glm::inverse(state.rotation) * state.spin_rad_per_s));
}

}  // namespace hybrid
