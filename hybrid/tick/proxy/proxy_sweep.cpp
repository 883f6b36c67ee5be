// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tick/proxy/proxy_sweep.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "hybrid/tick/proxy/proxy_surroundings.h"
#include "polygon/proxy/round_contact.h"

namespace hybrid {
namespace {

constexpr std::uint32_t kMaxSteps = 64;      // steps of one sweep
constexpr std::uint32_t kMaxExchanges = 64;  // planes added or renewed in one step
constexpr std::uint32_t kMostStalls = 4;     // steps in a row that do not move the proxy
constexpr std::uint32_t kMaxCrossings = 16;  // crossings of nearly flat edges in one sweep
// A shorter step ends the sweep; relative to the way to the target, and to the ball's radius.
constexpr double kConvergedWay = 1e-9, kConvergedBall = 1e-7;
// When no plane holds the proxy any more, the next obstacle is near. So the first search covers only a part
// of the way, kShortPart of the last step's length. Without an obstacle there, the part is multiplied by
// kPartGrowth. kLeastPart: lower bound (unit: the way).
constexpr double kShortPart = 0.05, kPartGrowth = 32.0, kLeastPart = 1e-9;
// Lengths of a round step (take_round_step()); unit: the ball's radius. kRoundStep: how far the step may go
// beyond the minimum over the present planes. kTurnStep: length over which the turning of the planes is
// measured.
constexpr double kRoundStep = 0.5, kTurnStep = 1e-4;

class Sweeper {
 public:
  Sweeper(const World& world, WorldState& state, const glm::dvec3& target, const glm::dmat3& metric,
          Scope scope = {}) noexcept
      : world_(world),
        state_(state),
        target_(target),
        metric_(metric),
        factored_(metric),
        held_(state.scratch.proxy_planes),
        scope_(scope),
        around_(world, state, scope),
        isotropic_(metric == glm::dmat3(metric[0][0])),
        radius_(world.contact_radius_m()),
        rounding_(world.rounding_m) {}

  Sweep run(const glm::dvec3& from, double travel) noexcept {
    Sweep sweep;
    sweep.point = from;
    sweep.arrived = false;
    state_.trail_count = 0;
    const bool goes_on = from == state_.swept_to_m;
    if (!goes_on) around_.renew_planes(from);
    for (std::uint32_t n = 0; n < state_.active_count && scope_.kind == Scope::Kind::all; ++n) {
      const ActiveElement& active = state_.active[n];
      const ProxyPlane& last = held_[n];
      // The planes are as the last sweep left them, unless something else used the list since.
      if (!goes_on || last.object != active.object || last.element != active.element)
        held_[n] = {active.object, active.element, {}, true};
      ++held_count_;
    }
    for (; sweep.steps < kMaxSteps; ++sweep.steps) {
      point_ = sweep.point;
      leave_trail(point_);
      if (exhausted() || !around_.survey_from(point_)) break;
      if (sweep.steps == 0 && goes_on) {  // the proxy is on the triangle that held it last
        const Crossing crossing = cross_edges(sweep.point, travel);
        if (crossing == Crossing::moved) continue;
        sweep.arrived = crossing == Crossing::arrived;
        if (sweep.arrived) break;
      }
      if (!solve()) break;
      const glm::dvec3 move = minimum_.point - point_;
      const double length = glm::length(move);
      const double still =
          kConvergedWay * glm::length(target_ - point_) + kConvergedBall * radius_ + rounding_;
      if (round_.taken && !round_step_paid()) {
        if (state_.trail_count > 0) --state_.trail_count;  // the proxy never was there
        sweep.point = round_.instead;
        continue;
      }
      if (take_round_step(still, travel)) {
        sweep.point = round_.to;
        travel -= glm::length(round_.to - point_);
        continue;
      }
      if (length <= still && fraction_ == 1.0) {
        if (loosen_false_contacts()) continue;
        sweep.point = minimum_.point;
        keep_active();
        if (cross_edges(sweep.point, travel) == Crossing::moved) continue;
        sweep.arrived = true;
        break;
      }
      double part = fraction_;
      if (part * length > travel) part = travel / length;
      sweep.point = part == 1.0 ? minimum_.point : point_ + part * move;
      travel -= part * length;
      stepped_ = part * length;
      keep_active();
      stalls_ = sweep.point == point_ ? stalls_ + 1 : 0;
      if (stalls_ == kMostStalls) break;
      if (fraction_ == 1.0 && part == 1.0) {
        const Crossing crossing = cross_edges(sweep.point, travel);
        if (crossing == Crossing::arrived ||
            (crossing == Crossing::none && held_by_own_planes(sweep.point))) {
          sweep.arrived = true;
          break;
        }
      }
      if (travel <= 0.0) break;
    }
    sweep.surveys = around_.surveys();
    sweep.work = around_.work();
    state_.swept_to_m = sweep.point;
    if (scope_.kind == Scope::Kind::all) publish(sweep);
    return sweep;
  }

 private:
  [[nodiscard]] double cost(const glm::dvec3& q) const noexcept {
    return glm::dot(q - target_, metric_ * (q - target_));
  }

  // When a ball rolls over an edge or a corner, the separating plane turns with it. A round step goes to the
  // place where the minimum will be once the planes have turned (polygon/proxy/round_contact.h). The cost
  // there is higher than at the minimum over the present planes. If the next step does not bring the cost
  // down to that of this minimum, the round step is undone (round_step_paid()).
  bool take_round_step(double still, double travel) noexcept {
    if (round_.waits > 0) --round_.waits;
    if (round_.waits > 0 || round_.taken || fraction_ != 1.0 || minimum_.active_count == 0 ||
        glm::length(minimum_.point - point_) > radius_) {
      round_.taken = false;
      return false;
    }
    round_.taken = false;
    std::array<polygon::CurvedConstraint, 3> planes;
    bool turns = false;
    for (std::uint32_t n = 0; n < minimum_.active_count; ++n) {
      const ProxyPlane& held = held_[minimum_.active[n]];
      planes[n] = {state_.scratch.planes[minimum_.active[n]].normal, minimum_.multiplier[n]};
      if (held.flat) continue;
      const BodyFrame& frame = state_.rigid[held.object].frame;
      const glm::dvec3 view = frame.to_body(point_);
      const glm::dvec3 on_plane =
          view + (held.in_body.offset - glm::dot(held.in_body.normal, view)) * held.in_body.normal;
      planes[n].hessian = frame.rotation *
                          polygon::distance_hessian(*world_.rigid[held.object].surface, held.element,
                                                    on_plane, kTurnStep * radius_) *
                          glm::transpose(frame.rotation);
      turns = true;
    }
    if (!turns) return false;
    round_.instead = minimum_.point;
    round_.to = polygon::minimum_on_curved_constraints(
        point_, minimum_.point, metric_, {planes.data(), minimum_.active_count}, kRoundStep * radius_);
    const bool clear = glm::length(round_.to - round_.instead) > still &&
                       glm::length(round_.to - point_) < travel && around_.is_clear(round_.to, held_planes());
    around_.forget_cut();
    if (!clear) return false;
    stepped_ = glm::length(round_.to - point_);
    round_.taken = true;
    keep_active();
    return true;
  }

  // Is the cost at the point reached lower than at the minimum that the round step skipped? If not, returns
  // to that minimum and takes no round step for a while.
  bool round_step_paid() noexcept {
    const glm::dvec3 reached = point_ + fraction_ * (minimum_.point - point_);
    constexpr double kSame = 1.0 + 1e-14;  // allows for rounding of the cost
    if (cost(reached) <= kSame * cost(round_.instead)) return true;
    round_.taken = false;
    round_.waits = round_.patience *= 2;
    held_count_ = 0;
    around_.renew_planes(round_.instead);
    return false;
  }

  // The proxy is at the minimum on one triangle's plane. While the plane of a neighbouring triangle is nearer
  // to the target, and only a nearly flat edge lies between the two, the proxy crosses to that triangle.
  enum class Crossing : std::uint8_t { none, moved, arrived };
  Crossing cross_edges(glm::dvec3& point, double& travel) noexcept {
    if (held_count_ != 1 || !held_[0].flat || scope_.kind != Scope::Kind::all || !isotropic_)
      return Crossing::none;
    ProxyPlane& held = held_[0];
    RigidState& near = state_.rigid[held.object];
    const polygon::RigidSurface& surface = *world_.rigid[held.object].surface;
    const glm::dvec3 target = near.frame.to_body(target_);
    bool moved = false;
    while (crossings_ < kMaxCrossings && !exhausted()) {
      if (near.crossable_edges.element != held.element || near.crossable_edges.plane != held.in_body)
        near.crossable_edges =
            polygon::crossable_edges_of(surface, held.element, held.in_body, radius_, rounding_);
      const polygon::CrossableEdges::Side* side = polygon::nearer_side(near.crossable_edges, target);
      if (side == nullptr) break;
      ++crossings_;
      const polygon::EdgeCrossing crossing = polygon::cross_edge(near.crossable_edges, *side, target);
      const glm::dvec3 top = near.frame.to_scene(crossing.top), end = near.frame.to_scene(crossing.end);
      const double length = glm::length(top - point) + glm::length(end - top);
      const ProxyPlane from = held;
      set_viewpoint(point);
      bool clear = length < travel && around_.is_clear(top, held_planes());
      if (clear) {
        set_viewpoint(top);
        held = {from.object, side->element, side->plane, true, true, false};
        clear = around_.is_clear(end, held_planes());
      }
      if (!clear) {
        held = from;
        set_viewpoint(point);
        around_.renew_planes(point);
        // The known neighbourhood ends on this way, so it is queried there first.
        if (around_.range_cut_way()) return Crossing::moved;
        break;
      }
      for (const glm::dvec3& corner : {point, top, end}) leave_trail(corner);
      moved = true;
      point = end;
      travel -= length;
      stepped_ = length;
    }
    if (!moved) return Crossing::none;
    held.touching = touches(held, point);
    if (!held.touching) return Crossing::moved;
    state_.scratch.planes.assign(1, in_scene(held));
    minimum_ = {};
    minimum_.point = point;
    minimum_.active_count = 1;
    minimum_.multiplier[0] = metric_[0][0] * glm::length(point - target_);
    return Crossing::arrived;
  }

  // The minimum over the planes in the way, and the fraction of the way there that is known to be clear.
  bool solve() noexcept {
    state_.scratch.planes.clear();
    // Keeps the held planes whose elements the proxy still touches, and planes that were loosened.
    std::uint32_t kept = 0;
    for (std::uint32_t i = 0; i < held_count_; ++i) {
      if (!around_.in_scope(held_[i].object) ||
          (held_[i].own_plane && !held_[i].touching && !touches(held_[i], point_)))
        continue;
      held_[kept] = held_[i];
      if (!held_[kept].flat) make_plane(held_[kept]);
      ++kept;
    }
    held_count_ = kept;
    for (std::uint32_t i = 0; i < held_count_; ++i) state_.scratch.planes.push_back(in_scene(held_[i]));
    for (std::uint32_t n = 0; n < kMaxExchanges; ++n) {
      minimum_ = polygon::minimise_on_planes(target_, factored_, state_.scratch.planes, rounding_);
      if (!minimum_.feasible) {
        state_.faults |= fault_infeasible;
        return false;  // stay: the last point is outside everything
      }
      fraction_ = around_.known_fraction(minimum_.point);
      // The proxy has just slid off its element: the next obstacle is near, and short looks see few elements.
      ProxyPlane first{ProxySurroundings::kNobody, 0, {}, true};
      for (double part = held_count_ == 0 ? short_part(minimum_.point) : 1.0;; part *= kPartGrowth) {
        const double share = std::min(part, 1.0) * fraction_;
        first = around_.first_in_the_way(minimum_.point, share, held_planes());
        if (first.object != ProxySurroundings::kNobody || part >= 1.0) break;
      }
      if (first.object == ProxySurroundings::kNobody) return true;
      if (held_count_ == kMaxProxyPlanes || n + 1 == kMaxExchanges || exhausted()) {
        end_way_before(first);
        return true;
      }
      // An element has two planes. first_in_the_way() used the plane across its closest point, which tells
      // where the way meets the element. The step is bounded by the plane of the element's face, because the
      // proxy comes to rest on that plane in one step.
      const ProxyPlane found = first;
      make_plane(first);
      if (holds(first)) {
        end_way_before(found);
        return true;
      }
      held_[held_count_++] = first;
      state_.scratch.planes.push_back(in_scene(first));
    }
    return true;
  }

  // Is this plane held already? Then the minimum is on it, and the element is in the way by rounding only.
  [[nodiscard]] bool holds(const ProxyPlane& plane) const noexcept {
    return std::ranges::any_of(held_planes(), [&plane](const ProxyPlane& held) {
      return held.object == plane.object && held.element == plane.element && held.in_body == plane.in_body;
    });
  }

  // For a step with too many planes, or with a plane that is held already: ends the way at the plane `next`,
  // as it was found. The way would reach the plane of the element's face later, but elements that were not
  // examined yet may stand before that plane.
  void end_way_before(const ProxyPlane& next) noexcept {
    const BodyFrame& frame = state_.rigid[next.object].frame;
    const glm::dvec3 end = point_ + fraction_ * (minimum_.point - point_);
    fraction_ *=
        polygon::Neighbourhood::fraction_before(next.in_body, frame.to_body(point_), frame.to_body(end));
    around_.forget_cut();
  }

  // The fraction of the way to q that is a twentieth of the last step long.
  [[nodiscard]] double short_part(const glm::dvec3& q) const noexcept {
    const double way = glm::length(q - point_);
    if (!(stepped_ > 0.0 && way > 0.0)) return 1.0;
    const double part = kShortPart * stepped_ / way;
    return part > kLeastPart ? part : kLeastPart;  // never zero, however far q is
  }

  void make_plane(ProxyPlane& held) noexcept {
    const glm::dvec3 view = state_.rigid[held.object].frame.to_body(point_);
    const polygon::RigidSurface& surface = *world_.rigid[held.object].surface;
    held.flat = held.own_plane &&
                polygon::separating_face_plane(surface, held.element, view, radius_, rounding_, held.in_body);
    if (!held.flat) held.in_body = polygon::separating_plane(surface, held.element, view, radius_);
  }

  // The plane of an element's face extends beyond the element, where nothing supports the proxy. Replaces
  // such planes of active contacts. Returns true if there was any; the step must then be repeated.
  bool loosen_false_contacts() noexcept {
    bool any = false;
    for (std::uint32_t n = 0; n < minimum_.active_count; ++n) {
      ProxyPlane& held = held_[minimum_.active[n]];
      if (!held.own_plane || touches(held, point_)) continue;
      held.own_plane = false;
      held.flat = false;
      any = true;
    }
    return any;
  }

  // True if each held plane is that of an element's face and touches the element at `point`, or if no plane
  // is held. Such planes do not depend on the viewpoint, so this minimum is final.
  [[nodiscard]] bool held_by_own_planes(const glm::dvec3& point) noexcept {
    for (std::uint32_t n = 0; n < held_count_; ++n) {
      held_[n].touching = held_[n].flat && touches(held_[n], point);
      if (!held_[n].touching) return false;
    }
    return true;
  }

  [[nodiscard]] bool touches(const ProxyPlane& held, const glm::dvec3& point) const noexcept {
    const glm::dvec3 view = state_.rigid[held.object].frame.to_body(point);
    const polygon::NearPoint near = world_.rigid[held.object].surface->closest(held.element, view);
    if (!held.flat) return near.distance <= radius_ * (1.0 + kConvergedBall) + 4.0 * rounding_;
    // The ball lies on the face if the closest point of the element is the foot of the perpendicular on the
    // plane. The distance alone is a poor test. Beyond an edge it grows only with the square of the way. So
    // it stays within the tolerance for a way of up to the square root of the tolerance.
    const glm::dvec3 away = view - near.point;
    const glm::dvec3 aside = away - glm::dot(away, held.in_body.normal) * held.in_body.normal;
    return glm::length(aside) <= 4.0 * rounding_;
  }

  // Only the active planes go on to the next step.
  void keep_active() noexcept {
    // Sorted in place: an active plane may stand before or after its new position.
    std::array<std::uint32_t, 3> from = minimum_.active;
    held_count_ = std::min<std::uint32_t>(minimum_.active_count, 3);
    for (std::uint32_t n = 0; n < held_count_; ++n) {
      std::swap(held_[n], held_[from[n]]);
      for (std::uint32_t m = n + 1; m < held_count_; ++m) {
        if (from[m] == n) from[m] = from[n];
      }
      held_[n].own_plane = true;
      held_[n].touching = false;
    }
  }

  void publish(Sweep& sweep) noexcept {
    std::fill(state_.rigid_force_N.begin(), state_.rigid_force_N.end(), glm::dvec3(0.0));
    for (std::uint32_t n = 0; n < minimum_.active_count && n < held_count_; ++n) {
      // After a whole step the held planes are the active ones, in order; otherwise active planes are known
      // by index.
      const polygon::ContactPlane& plane = state_.scratch.planes[minimum_.active[n]];
      const glm::dvec3 force = minimum_.multiplier[n] * plane.normal;
      sweep.force_N += force;
      state_.rigid_force_N[plane.object] += force;
      state_.active[n] = {plane.object, plane.element, force};
    }
    state_.active_count = minimum_.active_count;
  }

  [[nodiscard]] bool exhausted() const noexcept { return around_.work() >= kMostSweepWork; }
  [[nodiscard]] std::span<const ProxyPlane> held_planes() const noexcept {
    return {held_.data(), held_count_};
  }
  void leave_trail(const glm::dvec3& corner) noexcept {
    if (state_.trail_count < state_.trail.size()) state_.trail[state_.trail_count++] = corner;
  }
  void set_viewpoint(const glm::dvec3& point) noexcept {
    point_ = point;
    around_.set_viewpoint(point);
  }
  [[nodiscard]] polygon::ContactPlane in_scene(const ProxyPlane& held) const noexcept {
    const BodyFrame& frame = state_.rigid[held.object].frame;
    const glm::dvec3 normal = frame.rotation * held.in_body.normal;
    return {normal, held.in_body.offset + glm::dot(normal, frame.position_m), held.object, held.element};
  }

  const World& world_;
  WorldState& state_;
  const glm::dvec3 target_;
  const glm::dmat3 metric_;
  const polygon::Metric factored_;
  std::array<ProxyPlane, kMaxProxyPlanes>& held_;
  const Scope scope_;
  ProxySurroundings around_;
  const bool isotropic_;
  const double radius_, rounding_;
  glm::dvec3 point_{0.0};  // feasible; the viewpoint of all planes
  std::uint32_t held_count_ = 0;
  polygon::PlaneMinimum minimum_;
  struct RoundStep {
    bool taken = false;  // the last step was a round step
    std::uint32_t waits = 0,
                  patience = 1;  // steps until the next round step; it doubles after each that did not pay
    glm::dvec3 instead{0.0}, to{0.0};
  } round_;
  std::uint32_t crossings_ = 0, stalls_ = 0;
  double stepped_ = 0.0;   // length of the last step
  double fraction_ = 1.0;  // fraction of the way to the minimum that is known to be clear
};

}  // namespace

Sweep sweep_proxy(const World& world, WorldState& state, const glm::dvec3& from, const glm::dvec3& target,
                  const glm::dmat3& metric, double travel) noexcept {
  return Sweeper(world, state, target, metric).run(from, travel);
}

Sweep sweep_past(const World& world, WorldState& state, std::uint32_t object, bool but,
                 const glm::dvec3& from, const glm::dvec3& target) noexcept {
  const Scope scope{but ? Scope::Kind::all_but : Scope::Kind::only, object};
  return Sweeper(world, state, target, glm::dmat3(1.0), scope).run(from, std::numeric_limits<double>::max());
}

}  // namespace hybrid
