// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/rigid_sweep.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "polygon/round_contact.h"

namespace hybrid {
namespace {

constexpr std::uint32_t kMaxSteps = 64;
constexpr std::uint32_t kMaxExchanges = 64;  // planes that join or are made anew in one step
constexpr std::uint32_t kMaxCrossings = 16;  // of nearly flat edges, in one sweep
constexpr int kMaxShrinks = 60;              // of a survey that found too much
constexpr int kCrowded = 5;                  // so many shrinks do not help where a fan has its pole
constexpr std::uint32_t kManySurveys = 12;   // of one sweep: then larger ones
constexpr int kMaxFreePieces = 512;          // of the way through free space looked at in one tick
// A step shorter than this, of the way to the target and of the ball, is the end.
constexpr double kConvergedWay = 1e-9, kConvergedBall = 1e-7;
constexpr double kAhead = 0.6;  // of its margin a survey is made ahead of the proxy
// A survey is good that finds so many elements: fewer are soon left, more are long to read. A ball has more
// under it than a point before it is free to move at all.
constexpr double kGoodCount = 24.0, kGoodUnderBall = 104.0;
constexpr double kCrowdStays = 0.7;  // of the count, when about half of the margin still finds it: a pole
constexpr double kHalfOrSo = 0.6;
constexpr double kShortLook = 0.05, kLongerLook = 32.0, kLeastLook = 1e-9;
constexpr double kLookCells = 8.0;    // how far the map is asked beyond the ball, in cells
constexpr double kFurtherLook = 4.0;  // times as far, when that ends a step
// Round an edge or a corner, of the ball: how far beyond the minimum over its planes a step goes, and over
// which way their turning is measured.
constexpr double kRoundStep = 0.5, kTurnStep = 1e-4;

// Which objects a sweep minds.
struct Scope {
  enum class Kind : std::uint8_t { all, only, all_but };
  Kind kind = Kind::all;
  std::uint32_t object = 0;
};

class Sweeper {
 public:
  Sweeper(const World& world, WorldState& state, const glm::dvec3& target, const glm::dmat3& metric,
          Scope scope = {})
      : world_(world),
        state_(state),
        target_(target),
        metric_(metric),
        factored_(metric),
        held_(state.held),
        scope_(scope),
        isotropic_(metric == glm::dmat3(metric[0][0])),
        radius_(world.contact_radius_m()),
        rounding_(world.rounding_m) {}

  Sweep go(const glm::dvec3& from, double travel) noexcept {
    Sweep sweep;
    sweep.point = from;
    sweep.arrived = false;
    const bool goes_on = from == state_.swept_to_m;
    if (!goes_on) look_afresh(from);
    for (std::uint32_t n = 0; n < state_.active_count && scope_.kind == Scope::Kind::all; ++n) {
      const ActiveElement& active = state_.active[n];
      const HeldElement& last = held_[n];
      // Held as the last sweep left it, unless something else used the list since.
      if (!goes_on || last.object != active.object || last.element != active.element)
        held_[n] = {active.object, active.element, {}, true};
      ++held_count_;
    }
    for (; sweep.steps < kMaxSteps; ++sweep.steps) {
      point_ = sweep.point;
      if (sweep.steps < state_.trail.size()) state_.trail[sweep.steps] = point_;
      if (!look()) break;
      if (!solve()) break;
      const glm::dvec3 move = minimum_.point - point_;
      const double length = glm::length(move);
      const double still =
          kConvergedWay * glm::length(target_ - point_) + kConvergedBall * radius_ + rounding_;
      if (round_.taken && !round_step_paid()) {
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
        if (cross_ridges(sweep.point, travel) == Crossing::moved) continue;
        sweep.arrived = true;
        break;
      }
      double part = fraction_;
      if (part * length > travel) part = travel / length;
      sweep.point = part == 1.0 ? minimum_.point : point_ + part * move;
      travel -= part * length;
      stepped_ = part * length;
      keep_active();
      if (fraction_ == 1.0 && part == 1.0) {
        const Crossing crossing = cross_ridges(sweep.point, travel);
        if (crossing == Crossing::arrived || (crossing == Crossing::none && held_flatly(sweep.point))) {
          sweep.arrived = true;
          break;
        }
      }
      if (travel <= 0.0) break;
    }
    sweep.surveys = surveys_;
    state_.swept_to_m = sweep.point;
    if (scope_.kind == Scope::Kind::all) publish(sweep);
    return sweep;
  }

 private:
  // The proxy came here by another way than the last sweep's: a plane between it and an element may have it
  // on the wrong side.
  void look_afresh(const glm::dvec3& from) noexcept {
    for (std::uint32_t o = 0; o < world_.rigid.size(); ++o) {
      if (scope_.kind != Scope::Kind::all && (scope_.kind == Scope::Kind::only) != (o == scope_.object))
        continue;
      RigidNear& near = state_.rigid[o];
      near.near.see_from(*world_.rigid[o].surface, near.frame.to_body(from), radius_, rounding_);
    }
  }

  [[nodiscard]] double cost(const glm::dvec3& q) const noexcept {
    return glm::dot(q - target_, metric_ * (q - target_));
  }

  // Held by something round, the proxy goes on to where the minimum will be when the planes have turned. That
  // is a way uphill, and must pay with the next step.
  bool take_round_step(double still, double travel) noexcept {
    if (round_.waits > 0) --round_.waits;
    if (round_.waits > 0 || round_.taken || fraction_ != 1.0 || minimum_.active_count == 0 ||
        glm::length(minimum_.point - point_) > radius_) {
      round_.taken = false;
      return false;
    }
    round_.taken = false;
    std::array<polygon::TurningPlane, 3> planes;
    bool turns = false;
    for (std::uint32_t n = 0; n < minimum_.active_count; ++n) {
      const HeldElement& held = held_[minimum_.active[n]];
      planes[n] = {state_.planes[minimum_.active[n]].normal, minimum_.multiplier[n]};
      if (held.flat) continue;
      const BodyFrame& frame = state_.rigid[held.object].frame;
      const glm::dvec3 view = frame.to_body(point_);
      const glm::dvec3 on_plane =
          view + (held.in_body.offset - glm::dot(held.in_body.normal, view)) * held.in_body.normal;
      planes[n].turning = frame.rotation *
                          polygon::turning_of(*world_.rigid[held.object].surface, held.element, on_plane,
                                              kTurnStep * radius_) *
                          glm::transpose(frame.rotation);
      turns = true;
    }
    if (!turns) return false;
    round_.instead = minimum_.point;
    round_.to = polygon::minimum_on_turning_planes(
        point_, minimum_.point, metric_, {planes.data(), minimum_.active_count}, kRoundStep * radius_);
    const bool clear = glm::length(round_.to - round_.instead) > still &&
                       glm::length(round_.to - point_) < travel && is_clear(round_.to);
    ended_ = 0;
    look_ended_ = false;
    if (!clear) return false;
    stepped_ = glm::length(round_.to - point_);
    round_.taken = true;
    keep_active();
    return true;
  }

  // Is what was reached better than the minimum that was left for it? If not, back to that, and on without
  // for a while.
  bool round_step_paid() noexcept {
    const glm::dvec3 reached = point_ + fraction_ * (minimum_.point - point_);
    constexpr double kSame = 1.0 + 1e-14;
    if (cost(reached) <= kSame * cost(round_.instead)) return true;
    round_.taken = false;
    round_.waits = round_.patience *= 2;
    held_count_ = 0;
    look_afresh(round_.instead);
    return false;
  }

  // The proxy is at the minimum on one triangle's plane. When the next one's is nearer to the target, and
  // only a nearly flat edge lies between, there, over that edge; and so on.
  enum class Crossing : std::uint8_t { none, moved, arrived };
  Crossing cross_ridges(glm::dvec3& point, double& travel) noexcept {
    if (held_count_ != 1 || !held_[0].flat || scope_.kind != Scope::Kind::all || !isotropic_)
      return Crossing::none;
    HeldElement& held = held_[0];
    RigidNear& near = state_.rigid[held.object];
    const polygon::RigidSurface& surface = *world_.rigid[held.object].surface;
    const glm::dvec3 target = near.frame.to_body(target_);
    bool moved = false;
    while (crossings_ < kMaxCrossings) {
      if (near.ridges.element != held.element || near.ridges.plane != held.in_body)
        near.ridges = polygon::ridges_of(surface, held.element, held.in_body, radius_, rounding_);
      const polygon::Ridges::Side* side = polygon::nearer_side(near.ridges, target);
      if (side == nullptr) break;
      ++crossings_;
      const polygon::RidgeCrossing crossing = polygon::cross_ridge(near.ridges, *side, target);
      const glm::dvec3 top = near.frame.to_scene(crossing.top), end = near.frame.to_scene(crossing.end);
      const double length = glm::length(top - point) + glm::length(end - top);
      const HeldElement from = held;
      point_ = point;
      bool clear = length < travel && is_clear(top);
      if (clear) {
        point_ = top;
        held = {from.object, side->element, side->plane, true, true, false};
        clear = is_clear(end);
      }
      if (!clear) {
        held = from;
        look_afresh(point);
        // Not far enough looked ahead: that comes first.
        if (ended_ != 0 || look_ended_) return Crossing::moved;
        break;
      }
      moved = true;
      point = end;
      travel -= length;
      stepped_ = length;
    }
    if (!moved) return Crossing::none;
    held.touching = touches(held, point);
    if (!held.touching) return Crossing::moved;
    state_.planes.assign(1, in_scene(held));
    minimum_ = {};
    minimum_.point = point;
    minimum_.active_count = 1;
    minimum_.multiplier[0] = metric_[0][0] * glm::length(point - target_);
    return Crossing::arrived;
  }

  // The whole straight way to q, as far as it was looked at.
  bool is_clear(const glm::dvec3& q) noexcept {
    return clear_part(q) == 1.0 && first_in_the_way(q, 1.0).object == kNobody;
  }

  // Which objects are near, and that what is known of them covers the proxy.
  bool look() noexcept {
    const double room = state_.look_m - radius_ - max_component(glm::abs(point_ - state_.look_at));
    if (scope_.kind == Scope::Kind::only) {
      state_.look_m = -1.0;  // what the map said of the scene is not what is asked
    } else if (state_.look_m < 0.0 || room < 0.0 || look_ended_) {
      if (look_ended_) look_cells_ *= kFurtherLook;  // too short-sighted for this motion
      state_.look_at = point_;
      state_.look_m = radius_ + look_cells_ * state_.map.cell_m();
      state_.look_mask = world_.use_map ? state_.map.rigid_in(point_ - state_.look_m, point_ + state_.look_m)
                                        : ~std::uint64_t{0};
      look_ended_ = false;
      // Unasked, a neighbourhood does not follow the proxy, which may come back on another side.
      for (std::uint32_t o = 0; o < world_.rigid.size(); ++o) {
        if (!asked(o) && !(scope_.kind == Scope::Kind::all_but && o == scope_.object))
          state_.rigid[o].near.forget();
      }
    }
    for (std::uint32_t o = 0; o < world_.rigid.size(); ++o) {
      if (!asked(o)) continue;
      const glm::dvec3 view = state_.rigid[o].frame.to_body(point_);
      const bool ended = ended_ == o + 1;
      if (!ended && state_.rigid[o].near.room(view) > 0.0) continue;
      if (!survey(o, view, ended)) return false;
    }
    ended_ = 0;
    return true;
  }

  bool survey(std::uint32_t o, const glm::dvec3& view, bool moving) noexcept {
    RigidNear& near = state_.rigid[o];
    const polygon::RigidSurface& surface = *world_.rigid[o].surface;
    const double smallest = 1e-6 * radius_ + 1e2 * rounding_;
    if (surveys_ > 1) near.margin_m *= 2.0;  // too short-sighted for this motion
    const double longest = glm::length(surface.upper() - surface.lower()) + radius_;
    near.margin_m = std::clamp(near.margin_m, std::min(4.0 * smallest, longest), longest);
    // From afar as far as there is nothing.
    const glm::dvec3 outside =
        glm::max(glm::max(surface.lower() - view, view - surface.upper()), glm::dvec3(0.0));
    const double apart = (glm::length(outside) - radius_) * (1.0 - 1e-9) - 4.0 * rounding_;
    if (apart > 2.0 * near.margin_m) {
      ++surveys_;
      return near.near.survey(surface, view, apart, radius_, view);
    }
    const double margin = near.margin_m;
    for (int n = 0; n < kMaxShrinks; ++n) {
      if (n == kCrowded) near.margin_m = margin;
      if (n >= kCrowded && near.margin_m < smallest) break;
      const glm::dvec3 ahead = glm::transpose(near.frame.rotation) * direction_ * (kAhead * near.margin_m);
      ++surveys_;
      if (near.near.survey(surface, moving ? view + ahead : view, near.margin_m, radius_, view,
                           n >= kCrowded || surveys_ > kManySurveys)) {
        adapt_margin(near);
        return true;
      }
      near.margin_m *= 0.5;
    }
    near.margin_m = radius_ + 1e3 * rounding_;
    state_.faults |= fault_triangle_overflow;
    return false;
  }

  // Of the next survey: so that it finds neither too few elements nor too many, if that is in its power.
  void adapt_margin(RigidNear& near) const noexcept {
    const double count = std::max(1.0, static_cast<double>(near.near.size()));
    const double good = kGoodCount + kGoodUnderBall * radius_ / (radius_ + near.margin_m);
    const bool pole = count > good && count >= kCrowdStays * near.counted &&
                      near.margin_m < kHalfOrSo * near.margin_counted_m;
    near.counted = count;
    near.margin_counted_m = near.margin_m;
    if (pole) {
      near.margin_m *= 2.0;
    } else if (surveys_ < 3 || count < good) {  // else the way of this tick is what needs it
      near.margin_m *= std::clamp(std::sqrt(good / count), 0.5, 1.5);
    }
  }

  // The minimum over the planes in the way, and how much of the way there is known to be clear.
  bool solve() noexcept {
    state_.planes.clear();
    // Of those that held the proxy before, the ones that it still touches, and those found not to.
    std::uint32_t kept = 0;
    for (std::uint32_t i = 0; i < held_count_; ++i) {
      if (!asked(held_[i].object) || (held_[i].own_plane && !held_[i].touching && !touches(held_[i], point_)))
        continue;
      held_[kept] = held_[i];
      if (!held_[kept].flat) make_plane(held_[kept]);
      ++kept;
    }
    held_count_ = kept;
    for (std::uint32_t i = 0; i < held_count_; ++i) state_.planes.push_back(in_scene(held_[i]));
    for (std::uint32_t n = 0; n < kMaxExchanges; ++n) {
      minimum_ = polygon::minimise_on_planes(target_, factored_, state_.planes, rounding_);
      if (!minimum_.feasible) {
        state_.faults |= fault_infeasible;
        return false;  // stay: the place before was outside everything
      }
      fraction_ = clear_part(minimum_.point);
      // Nothing holds the proxy just after it slid off what did: what is next is near, and short looks see
      // few elements.
      HeldElement first{kNobody, 0, {}, true};
      for (double part = held_count_ == 0 ? short_look(minimum_.point) : 1.0;; part *= kLongerLook) {
        const double share = std::min(part, 1.0) * fraction_;
        first = first_in_the_way(minimum_.point, share);
        if (first.object != kNobody || part >= 1.0) break;
      }
      if (first.object == kNobody) return true;
      // Found by the plane across its closest point, which says soonest what is really met; held by its own,
      // which lets the proxy come up to it at once, not by halves.
      make_plane(first);
      if (held_count_ == kMaxHeld || n + 1 == kMaxExchanges) {
        stop_before(first);
        return true;
      }
      held_[held_count_++] = first;
      state_.planes.push_back(in_scene(first));
    }
    return true;
  }

  // Too many planes for one step: the way to the minimum over those known ends at the next.
  void stop_before(const HeldElement& next) noexcept {
    const BodyFrame& frame = state_.rigid[next.object].frame;
    const glm::dvec3 end = point_ + fraction_ * (minimum_.point - point_);
    fraction_ *= polygon::Neighbourhood::part_before(next.in_body, frame.to_body(point_), frame.to_body(end));
    ended_ = 0;
    look_ended_ = false;
  }

  // Of the way to q, a part as long as a twentieth of the last step.
  [[nodiscard]] double short_look(const glm::dvec3& q) const noexcept {
    const double way = glm::length(q - point_);
    if (!(stepped_ > 0.0 && way > 0.0)) return 1.0;
    const double part = kShortLook * stepped_ / way;
    return part > kLeastLook ? part : kLeastLook;  // nor nothing, however far q is
  }

  // Of the straight way to q, the part within everything that was looked at.
  double clear_part(const glm::dvec3& q) noexcept {
    double part = 1.0;
    ended_ = 0;
    look_ended_ = false;
    direction_ = q - point_;
    const double length = glm::length(direction_);
    if (length > 0.0) direction_ /= length;
    for (int d = 0; d < 3 && scope_.kind != Scope::Kind::only; ++d) {
      const double to = q[d] - point_[d];
      const double most = state_.look_m - radius_;
      const double ahead =
          to > 0.0 ? state_.look_at[d] + most - point_[d] : point_[d] - state_.look_at[d] + most;
      if (std::abs(to) * part > ahead) {
        part = std::max(0.0, ahead / std::abs(to));
        look_ended_ = true;
      }
    }
    for (std::uint32_t o = 0; o < world_.rigid.size(); ++o) {
      if (!asked(o)) continue;
      const RigidNear& near = state_.rigid[o];
      const glm::dvec3 a = near.frame.to_body(point_) - near.near.centre();
      const glm::dvec3 way = near.frame.to_body(q) - near.near.centre() - a;
      const double margin = near.near.margin();
      // |a + f way| = margin
      const double aa = glm::dot(way, way), ab = glm::dot(a, way), bb = glm::dot(a, a) - margin * margin;
      if (aa * part * part + 2.0 * ab * part + bb <= 0.0) continue;
      const double root = std::sqrt(std::max(0.0, ab * ab - aa * bb));
      const double f = std::max(0.0, (root - ab) / aa) * (1.0 - 1e-9);
      if (f >= part) continue;
      part = f;
      ended_ = o + 1;
      look_ended_ = false;
    }
    return part;
  }

  // The element that the first `part` of the way to q meets first; kNobody when that is clear.
  HeldElement first_in_the_way(const glm::dvec3& q, double part) noexcept {
    HeldElement first{kNobody, 0, {}, true};
    double soonest = 2.0;
    for (std::uint32_t o = 0; o < world_.rigid.size(); ++o) {
      if (asked(o)) first_of(o, q, part, first, soonest);
    }
    return first;
  }

  // Planes seen from elsewhere say too soon rather than too late: so the soonest is seen from here instead,
  // until the soonest is one that was.
  void first_of(std::uint32_t o, const glm::dvec3& q, double part, HeldElement& first,
                double& soonest) noexcept {
    using Broken = polygon::Neighbourhood::Broken;
    RigidNear& near = state_.rigid[o];
    const glm::dvec3 view = near.frame.to_body(point_), goal = near.frame.to_body(q);
    const glm::dvec3 end = part == 1.0 ? goal : view + part * (goal - view);
    const double tolerance = 2.0 * rounding_;
    std::span<Broken> broken = near.near.broken(view, end, tolerance);
    while (!broken.empty()) {
      std::size_t n = 0;
      for (std::size_t i = 1; i < broken.size(); ++i) {
        if (broken[i].part < broken[n].part ||
            (broken[i].part == broken[n].part &&
             near.near.element(broken[i].index) < near.near.element(broken[n].index)))
          n = i;
      }
      if (broken[n].part >= soonest) return;
      HeldElement candidate{o, near.near.element(broken[n].index), {}, true};
      if (broken[n].fresh) {
        soonest = broken[n].part;
        first = candidate;
        return;
      }
      if (!covered(candidate))
        candidate.in_body = polygon::separate(*world_.rigid[o].surface, candidate.element, view, radius_);
      near.near.set_plane(broken[n].index, candidate.in_body);
      // A plane that only the first part of the way breaks, by what rounding did to where the proxy stands,
      // is being left.
      const double depth = candidate.in_body.offset - glm::dot(candidate.in_body.normal, end);
      const double at_goal = candidate.in_body.offset - glm::dot(candidate.in_body.normal, goal);
      if (depth > tolerance && at_goal > tolerance) {
        broken[n].fresh = true;
        broken[n].part = polygon::Neighbourhood::part_before(candidate.in_body, view, end);
      } else {
        broken[n] = broken.back();
        broken = broken.first(broken.size() - 1);
      }
    }
  }

  // Does a plane that holds already keep the proxy from this element as well? On a convex surface one plane
  // covers everything, and the proxy need not stop at each edge.
  bool covered(HeldElement& candidate) const noexcept {
    const polygon::RigidSurface& surface = *world_.rigid[candidate.object].surface;
    for (std::uint32_t h = 0; h < held_count_; ++h) {
      const HeldElement& held = held_[h];
      if (held.object != candidate.object) continue;
      if (held.element != candidate.element && !(surface.support(candidate.element, held.in_body.normal) <=
                                                 held.in_body.offset - radius_ + rounding_))
        continue;
      candidate.in_body = held.in_body;
      return true;
    }
    return false;
  }

  void make_plane(HeldElement& held) noexcept {
    const glm::dvec3 view = state_.rigid[held.object].frame.to_body(point_);
    const polygon::RigidSurface& surface = *world_.rigid[held.object].surface;
    held.flat = held.own_plane &&
                polygon::separate_flatly(surface, held.element, view, radius_, rounding_, held.in_body);
    if (!held.flat) held.in_body = polygon::separate(surface, held.element, view, radius_);
  }

  // An element's own plane reaches beyond the element: a proxy that rests where the element is not rests on
  // nothing. True when there was one, and the step must be done again.
  bool loosen_false_contacts() noexcept {
    bool any = false;
    for (std::uint32_t n = 0; n < minimum_.active_count; ++n) {
      HeldElement& held = held_[minimum_.active[n]];
      if (!held.own_plane || touches(held, point_)) continue;
      held.own_plane = false;
      held.flat = false;
      any = true;
    }
    return any;
  }

  // Held by nothing, or by elements' own planes alone where the elements are: no plane would change if it
  // were seen from `point`, so the minimum is the minimum.
  [[nodiscard]] bool held_flatly(const glm::dvec3& point) noexcept {
    for (std::uint32_t n = 0; n < held_count_; ++n) {
      held_[n].touching = held_[n].flat && touches(held_[n], point);
      if (!held_[n].touching) return false;
    }
    return true;
  }

  [[nodiscard]] bool touches(const HeldElement& held, const glm::dvec3& point) const noexcept {
    const glm::dvec3 view = state_.rigid[held.object].frame.to_body(point);
    const polygon::NearPoint near = world_.rigid[held.object].surface->closest(held.element, view);
    if (!held.flat) return near.distance <= radius_ * (1.0 + kConvergedBall) + 4.0 * rounding_;
    // The foot on the plane must be the closest point: by distance alone, a ball would lie on a triangle
    // whose edge it had passed by a root of the tolerance.
    const glm::dvec3 away = view - near.point;
    const glm::dvec3 aside = away - glm::dot(away, held.in_body.normal) * held.in_body.normal;
    return glm::length(aside) <= 4.0 * rounding_;
  }

  // Only what holds the proxy goes on to the next step.
  void keep_active() noexcept {
    // In place: an active one may stand before or after where it goes.
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
      // After a whole step the held ones are the active ones, in their order; before, they are named by
      // index.
      const polygon::ContactPlane& plane = state_.planes[minimum_.active[n]];
      const glm::dvec3 force = minimum_.multiplier[n] * plane.normal;
      sweep.force_N += force;
      state_.rigid_force_N[plane.object] += force;
      state_.active[n] = {plane.object, plane.element, force};
    }
    state_.active_count = minimum_.active_count;
  }

  [[nodiscard]] bool asked(std::uint32_t o) const noexcept {
    if (scope_.kind == Scope::Kind::only) return o == scope_.object;
    if (scope_.kind == Scope::Kind::all_but && o == scope_.object) return false;
    return (state_.look_mask & OccupancyMap::rigid_bit(o)) != 0;
  }
  [[nodiscard]] polygon::ContactPlane in_scene(const HeldElement& held) const noexcept {
    const BodyFrame& frame = state_.rigid[held.object].frame;
    const glm::dvec3 normal = frame.rotation * held.in_body.normal;
    return {normal, held.in_body.offset + glm::dot(normal, frame.position_m), held.object, held.element};
  }
  static double max_component(const glm::dvec3& v) noexcept { return std::max({v.x, v.y, v.z}); }

  static constexpr std::uint32_t kNobody = 0xFFFFFFFFU;

  const World& world_;
  WorldState& state_;
  const glm::dvec3 target_;
  const glm::dmat3 metric_;
  const polygon::Metric factored_;
  std::array<HeldElement, kMaxHeld>& held_;
  const Scope scope_;
  const bool isotropic_;
  const double radius_, rounding_;
  glm::dvec3 point_{0.0};      // feasible; where everything is seen from
  glm::dvec3 direction_{0.0};  // of the last way tried, unit
  std::uint32_t held_count_ = 0;
  polygon::PlaneMinimum minimum_;
  struct RoundStep {
    bool taken = false;                     // the last step was one
    std::uint32_t waits = 0, patience = 1;  // steps until the next, since one did not pay
    glm::dvec3 instead{0.0}, to{0.0};
  } round_;
  std::uint32_t crossings_ = 0;
  double stepped_ = 0.0;     // how long the last step was
  double fraction_ = 1.0;    // of the way to the minimum that is known to be clear
  std::uint32_t ended_ = 0;  // 1 + the object whose neighbourhood ended the way
  bool look_ended_ = false;  // the map's look ended it
  double look_cells_ = kLookCells;
  std::uint32_t surveys_ = 0;
};

}  // namespace

Sweep sweep_proxy(const World& world, WorldState& state, const glm::dvec3& from, const glm::dvec3& target,
                  const glm::dmat3& metric, double travel) noexcept {
  return Sweeper(world, state, target, metric).go(from, travel);
}

Sweep sweep_past(const World& world, WorldState& state, std::uint32_t object, bool but,
                 const glm::dvec3& from, const glm::dvec3& target) noexcept {
  const Scope scope{but ? Scope::Kind::all_but : Scope::Kind::only, object};
  return Sweeper(world, state, target, glm::dmat3(1.0), scope).go(from, std::numeric_limits<double>::max());
}

bool gather_planes(const World& world, WorldState& state, const glm::dvec3& point, double radius) noexcept {
  state.planes.clear();
  const std::uint64_t mask = state.map.rigid_in(point - radius, point + radius);
  if (mask == 0) return true;
  bool complete = true;
  for (std::uint32_t o = 0; o < world.rigid.size(); ++o) {
    if ((mask & OccupancyMap::rigid_bit(o)) == 0) continue;
    const BodyFrame& frame = state.rigid[o].frame;
    const polygon::GatherResult found =
        world.rigid[o].surface->gather(frame.to_body(point), radius, state.near);
    complete = complete && found.complete;
    for (std::uint32_t i = 0; i < found.count; ++i) {
      if (state.planes.size() == state.planes.capacity()) return false;
      const polygon::NearPoint& near = state.near[i];
      const glm::dvec3 on_surface = frame.to_scene(near.point);
      const glm::dvec3 away = point - on_surface;
      const double distance = glm::length(away);
      if (!(distance > 0.0))
        continue;  // on the surface itself, where no side is right: its neighbours decide
      const glm::dvec3 normal = away / distance;
      state.planes.push_back(
          {normal, glm::dot(normal, on_surface) + world.contact_radius_m(), o, near.element});
    }
  }
  return complete;
}

bool advance_through_free_space(const World& world, WorldState& state, const glm::dvec3& goal,
                                double soft_reach_m) noexcept {
  const double radius = world.contact_radius_m();
  if (world.soft.empty() && state.look_m > 0.0) {
    if (state.active_count > 0) return false;
    // Both ends lie in what the last look saw: nothing, or something that the proxy must be asked about.
    const glm::dvec3 a = glm::abs(state.proxy_m - state.look_at), b = glm::abs(goal - state.look_at);
    const double most = state.look_m - radius;
    if (a.x <= most && a.y <= most && a.z <= most && b.x <= most && b.y <= most && b.z <= most) {
      if (state.look_mask == 0) state.proxy_m = goal;
      return state.look_mask == 0;
    }
  }
  if (!world.use_map) return false;
  const double margin = std::max(radius, soft_reach_m) + state.map.cell_m();
  const double piece = kLookCells * state.map.cell_m();
  for (int n = 0; n < kMaxFreePieces; ++n) {
    const glm::dvec3 way = goal - state.proxy_m;
    const double length = glm::length(way);
    const bool last = length <= piece;
    const glm::dvec3 next = last ? goal : state.proxy_m + way * (piece / length);
    if (state.map.any_near(glm::min(state.proxy_m, next) - margin, glm::max(state.proxy_m, next) + margin))
      return false;
    state.proxy_m = next;
    if (last) {
      if (world.soft.empty()) {  // for the ticks to come
        state.look_at = goal;
        state.look_m = radius + kLookCells * state.map.cell_m();
        state.look_mask = state.map.rigid_in(goal - state.look_m, goal + state.look_m);
      }
      return true;
    }
  }
  return false;
}

bool start_proxy(const World& world, WorldState& state, const glm::dvec3& device_m) noexcept {
  const double radius = world.contact_radius_m();
  state.device_m = device_m;
  state.proxy_m = device_m;
  state.active_count = 0;
  state.stuck = state.sliding = false;
  state.look_m = -1.0;
  state.swept_to_m = glm::dvec3(std::numeric_limits<double>::quiet_NaN());
  for (RigidNear& near : state.rigid) near.near.forget();
  for (int n = 0; n < 64; ++n) {
    glm::dvec3 away(0.0);
    double deepest = 0.0;
    for (std::size_t o = 0; o < world.rigid.size(); ++o) {
      const RigidObject& object = world.rigid[o];
      const glm::dvec3 p = state.rigid[o].frame.to_body(state.proxy_m);
      if (object.surface->inside(p)) return false;
      polygon::NearPoint near;
      if (!object.surface->nearest(p, radius, near)) continue;
      const double depth = radius - near.distance;
      if (depth <= deepest) continue;
      if (!(near.distance > 0.0)) return false;
      deepest = depth;
      away = state.rigid[o].frame.rotation * ((p - near.point) / near.distance);
    }
    if (deepest <= 0.0) return true;
    state.proxy_m += (deepest * (1.0 + 1e-9)) * away;
  }
  return false;
}

RigidStep step_rigid(const World& world, WorldState& state, const glm::dvec3& device_m,
                     double /*dt_s*/) noexcept {
  RigidStep step;
  step.free = advance_through_free_space(world, state, device_m, 0.0);
  if (step.free) {
    state.active_count = 0;
  } else {
    const Sweep sweep =
        sweep_proxy(world, state, state.proxy_m, device_m, glm::dmat3(world.tool.stiffness_N_per_m),
                    std::numeric_limits<double>::max());
    state.proxy_m = sweep.point;
    step.arrived = sweep.arrived;
    step.steps = sweep.steps;
    step.surveys = sweep.surveys;
  }
  step.proxy_m = state.proxy_m;
  step.force_N = world.tool.stiffness_N_per_m * (state.proxy_m - device_m);
  return step;
}

}  // namespace hybrid
