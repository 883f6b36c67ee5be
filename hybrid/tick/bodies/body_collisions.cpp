// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tick/bodies/body_collisions.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

#include "polygon/surface/signed_distance.h"

namespace hybrid {
namespace {

constexpr double kSkin = 1e-4;        // of the smaller object's diagonal: how far apart surfaces are kept
constexpr double kTouching = 1.5;     // skins: what is no further is a contact from the beginning
constexpr double kNotLess = 0.5;      // skins: what comes nearer than this was not kept apart
constexpr double kOverlaps = 0.75;    // skins: what is nearer goes back …
constexpr double kBack = 1.0;         // … by no more than so many a tick
constexpr double kOffSurface = 1e-6;  // of the way to an object's middle
constexpr double kOverlap = 0.02;     // of the smaller object: deeper than this is a fault
constexpr double kRigid = 1e5;        // times what stops the lighter body within a tick: as good as rigid
constexpr double kSamePlane = 1e-9;   // 1 − cosine between normals
constexpr double kSlides = 0.05;      // of the smaller object: nearer than this, points slide along edges
constexpr double kSlidEnough = 0.01;  // of their reach
constexpr double kStillSeen = 0.01;   // skins
constexpr double kStride = 0.02;      // of the smaller object: steps on the way
constexpr int kMostStrides = 32;
constexpr int kRounds = 6;  // of solving and following ways
constexpr std::size_t kLooks = 20000;
constexpr double kLookFar = 0.5;    // of the smaller object: further than it has to, a look goes so far
constexpr double kLookAgain = 0.1;  // of the smaller object: after so much travel of a pair that is near
constexpr double kBesides = 0.05;   // of the smaller object: within so much a body that gives way is stopped

glm::dvec3 middle_of(const RigidObject& object) noexcept {
  return 0.5 * (object.surface->lower() + object.surface->upper());
}

class Collisions {
 public:
  Collisions(const World& world, WorldState& state, double dt_s)
      : world_(world), state_(state), all_(state.collisions), dt_s_(dt_s) {}

  void step() noexcept {
    begin();
    if (!all_.pairs.empty()) add_touching();
    for (int round = 0;; ++round) {
      take_step();
      if (all_.pairs.empty()) return;
      place_after();
      if (follow_ways(round)) break;
      if (round < kRounds) continue;
      ++all_.round;  // what was seen on those ways is not where bodies are that stand still
      place_after();
      break;
    }
    finish();
  }

  void look_at_all() noexcept {
    place_now();
    for (BodyPair& pair : all_.pairs)
      for_points(pair, [&](Side side, std::size_t i, PointQuery& sight) { look_now(pair, side, i, sight); });
  }

  void add_stops(std::uint32_t b, double stiffness) noexcept {
    place_now();
    for (BodyPair& pair : all_.pairs) {
      if (pair.free != b && pair.other != b) continue;
      const double near_m = kBesides * pair.size_m;
      if (far_apart(pair, near_m)) continue;
      for_points(pair, [&](Side side, std::size_t i, PointQuery& sight) {
        if (sight.gap_m - drift(pair, sight) > near_m) return;
        look_now(pair, side, i, sight);
        if (sight.gap_m > near_m) return;
        BodyContact contact = contact_at(pair, side, i, sight, now_, now_);
        if (contact.body != member_[b]) contact.normal = -contact.normal;
        contact.body = 0;
        contact.other = BodyContact::kNone;
        contact.stiffness_N_per_m = stiffness;
        contact.force_N = -stiffness * std::max(0.0, sight.gap_m - pair.skin_m);
        contact.friction = 0.0;
        add_contact(state_, contact);
      });
    }
  }

 private:
  using Side = std::size_t;  // 0: points of the free one at the other's surface; 1: the other way round

  static std::uint32_t whose(const BodyPair& pair, Side side) noexcept {
    return side == 0 ? pair.free : pair.other;
  }
  static std::uint32_t at_whose(const BodyPair& pair, Side side) noexcept {
    return side == 0 ? pair.other : pair.free;
  }
  [[nodiscard]] const SurfacePoint& point(const BodyPair& pair, Side side, std::size_t i) const noexcept {
    return world_.rigid[whose(pair, side)].points[i];
  }
  // Where the point is on its object's surface now, in the object's own frame.
  [[nodiscard]] static glm::dvec3 place(const SurfacePoint& p, const PointQuery& sight) noexcept {
    return p.at_m + sight.slid_m * p.along;
  }
  [[nodiscard]] glm::dvec3 place(const BodyPair& pair, Side side, std::size_t i) const noexcept {
    return place(point(pair, side, i), pair.queries[side][i]);
  }
  template <class Visit>
  void for_points(BodyPair& pair, const Visit& visit) noexcept {
    for (Side side = 0; side < 2; ++side) {
      for (std::size_t i = 0; i < pair.queries[side].size(); ++i) visit(side, i, pair.queries[side][i]);
    }
  }

  // How far both have moved since the session began, as the last tick left them.
  [[nodiscard]] double travel(const BodyPair& pair) const noexcept {
    return all_.travel_m[pair.free] + all_.travel_m[pair.other];
  }
  [[nodiscard]] double drift(const BodyPair& pair, const PointQuery& sight) const noexcept {
    return travel(pair) - sight.seen_m;
  }

  // Both have hardly moved since: what is at rest is not looked at for ever.
  [[nodiscard]] bool is_current(const BodyPair& pair, const PointQuery& sight) const noexcept {
    return drift(pair, sight) <= kStillSeen * pair.skin_m;
  }

  // Where all were before this tick: those on paths have moved already, and what tissue did to free ones
  // since counts as travel.
  void place_now() noexcept {
    for (std::uint32_t o = 0; o < world_.rigid.size(); ++o) {
      const RigidMotion& motion = world_.rigid[o].motion;
      if (motion.kind() != RigidMotion::Kind::path && state_.rigid[o].pose != all_.last[o]) {
        all_.travel_m[o] += motion.displacement_bound(all_.last[o], state_.rigid[o].pose);
        all_.last[o] = state_.rigid[o].pose;
      }
      now_[o] = BodyFrame(all_.last[o]);
    }
  }
  void begin() noexcept {
    if (all_.pairs.empty()) return;
    place_now();
    std::fill(member_.begin(), member_.end(), BodyContact::kNone);
    for (std::uint32_t m = 0; m < state_.scratch.free_bodies.stepped.size(); ++m)
      member_[state_.scratch.free_bodies.object[m]] = m;
    place_after();
  }
  void place_after() noexcept {
    for (std::uint32_t o = 0; o < world_.rigid.size(); ++o) {
      const std::uint32_t m = member_[o];
      next_[o] = m == BodyContact::kNone ? state_.rigid[o].pose
                                         : pose_of(*state_.scratch.free_bodies.stepped[m].body,
                                                   state_.scratch.free_bodies.stepped[m].state);
      after_[o] = BodyFrame(next_[o]);
      moves_[o] =
          next_[o] != all_.last[o] ? world_.rigid[o].motion.displacement_bound(all_.last[o], next_[o]) : 0.0;
    }
  }

  // Nothing of the one is nearer than `range` to the other. (False also where that was not looked for again.)
  bool far_apart(BodyPair& pair, double range) noexcept {
    if (pair.until_m - travel(pair) > range) return true;
    if (travel(pair) - pair.seen_m < kLookAgain * pair.size_m) return false;
    const RigidObject &free = world_.rigid[pair.free], &other = world_.rigid[pair.other];
    const glm::dvec3 middle = now_[pair.other].to_body(now_[pair.free].to_scene(middle_of(free)));
    const double half = 0.5 * glm::length(free.surface->upper() - free.surface->lower());
    const double look = half + range + pair.size_m;
    polygon::NearPoint near;
    const bool inside = other.surface->inside(middle);
    const double apart = inside ? 0.0 : other.surface->nearest(middle, look, near) ? near.distance : look;
    pair.seen_m = travel(pair);
    pair.until_m = pair.seen_m + apart - half;
    return apart - half > range;
  }

  // Looks from place `x` in the other one's frame. A point that came no further than `jump_m`, is nearer than
  // that to the surface, and sees it from the other side than before, went through it.
  [[nodiscard]] NearestSurface look_from(const BodyPair& pair, Side side, const glm::dvec3& x,
                                         double radius_m, const glm::dvec3& known, double jump_m) noexcept {
    const polygon::RigidSurface& surface = *world_.rigid[at_whose(pair, side)].surface;
    const double range = radius_m + kLookFar * pair.size_m;
    polygon::SignedDistance near;
    near.distance = range;
    ++looks_;
    bool found = polygon::signed_distance(surface, x, range, known, near);
    if (!found && near.distance == 0.0) {
      // On the surface itself no way out is to be seen: it is on the side of its own object.
      const RigidObject& own = world_.rigid[whose(pair, side)];
      const glm::dvec3 middle =
          now_[at_whose(pair, side)].to_body(now_[whose(pair, side)].to_scene(middle_of(own)));
      found = polygon::signed_distance(surface, glm::mix(x, middle, kOffSurface), range, known, near);
    }
    if (!found) return {glm::dvec3(0.0), x, range - radius_m};
    const glm::dvec3 at = x - near.distance * near.normal;
    if (near.distance > 0.0 && near.distance <= jump_m && glm::dot(near.normal, known) < 0.0) {
      near.normal = -near.normal;
      near.distance = -near.distance;
    }
    return {near.normal, at, near.distance - radius_m};
  }
  // A point whose last ways were all shorter than its distance is seen afresh, from wherever it is.
  void look_now(const BodyPair& pair, Side side, std::size_t i, PointQuery& sight) noexcept {
    if (is_current(pair, sight)) return;
    const SurfacePoint& p = point(pair, side, i);
    const glm::dvec3 x =
        now_[at_whose(pair, side)].to_body(now_[whose(pair, side)].to_scene(place(p, sight)));
    static_cast<NearestSurface&>(sight) = look_from(pair, side, x, p.radius_m, glm::dvec3(0.0), 0.0);
    sight.seen_m = travel(pair);
  }

  // The contact that a point, where `of` has it, makes with what it saw of the other surface, where `at` has
  // that. Without force.
  [[nodiscard]] BodyContact contact_at(const BodyPair& pair, Side side, std::size_t i,
                                       const NearestSurface& sight, const std::vector<BodyFrame>& of,
                                       const std::vector<BodyFrame>& at) const noexcept {
    const SurfacePoint& p = point(pair, side, i);
    BodyContact contact;
    contact.normal = at[at_whose(pair, side)].rotation * sight.normal;
    contact.point_m = of[whose(pair, side)].to_scene(place(pair, side, i)) - p.radius_m * contact.normal;
    contact.friction = pair.friction;
    std::uint32_t body = member_[whose(pair, side)], beside = member_[at_whose(pair, side)];
    if (body == BodyContact::kNone) {
      std::swap(body, beside);
      contact.normal = -contact.normal;
    }
    contact.body = body;
    contact.other = beside;
    if (beside == BodyContact::kNone) {
      // What does not answer: that which is no member.
      const std::uint32_t o = member_[pair.other] == BodyContact::kNone ? pair.other : pair.free;
      const glm::dvec3 in_body = now_[o].to_body(contact.point_m);
      contact.carried_m_per_s = (after_[o].to_scene(in_body) - contact.point_m) / dt_s_;
    }
    return contact;
  }
  // A contact of which `gap` (m) is left, before either gives way.
  void add(BodyContact contact, double gap) noexcept {
    double mass = mass_of(contact.body);
    if (contact.other != BodyContact::kNone) {
      const double other = mass_of(contact.other);
      mass = mass * other / (mass + other);
    }
    contact.stiffness_N_per_m = kRigid * mass / (dt_s_ * dt_s_);
    contact.force_N = -contact.stiffness_N_per_m * gap;
    add_contact(state_, contact);
  }
  [[nodiscard]] double mass_of(std::uint32_t member) const noexcept {
    return state_.scratch.free_bodies.stepped[member].body->mass.mass_kg;
  }

  // What is touched as the tick begins.
  void add_touching() noexcept {
    for (BodyPair& pair : all_.pairs) {
      if (!in_motion(pair)) continue;
      const double near_m = kTouching * pair.skin_m, slides_m = kSlides * pair.size_m;
      if (far_apart(pair, slides_m)) continue;
      for_points(pair, [&](Side side, std::size_t i, PointQuery& sight) {
        const double watched_m = point(pair, side, i).has_ends() ? slides_m : near_m;
        if (sight.gap_m - drift(pair, sight) > watched_m || looks_ > kLooks) return;
        look_now(pair, side, i, sight);
        slide(pair, side, i, sight);
        if (sight.gap_m > near_m || is_implied(pair, side, i)) return;
        const BodyContact contact = contact_at(pair, side, i, sight, now_, now_);
        add(contact, std::max(sight.gap_m - pair.skin_m, 0.0) - comes(contact));
      });
    }
  }
  // To where its edge is nearest to the other object: where it crosses an edge, and does not begin to
  // overlap.
  void slide(const BodyPair& pair, Side side, std::size_t i, PointQuery& sight) noexcept {
    const SurfacePoint& p = point(pair, side, i);
    if (!p.has_ends() || !(sight.gap_m > 0.0)) return;
    const glm::dvec3 along =
        (now_[whose(pair, side)].rotation * p.along) * now_[at_whose(pair, side)].rotation;
    const double to_m =
        std::clamp(sight.slid_m - sight.gap_m * glm::dot(sight.normal, along), -p.reach_m, p.reach_m);
    if (std::abs(to_m - sight.slid_m) < kSlidEnough * p.reach_m) return;
    PointQuery there = sight;
    there.slid_m = to_m;
    there.seen_m = -std::numeric_limits<double>::infinity();
    look_now(pair, side, i, there);
    if (there.gap_m > 0.0) sight = there;
  }
  // Those beside it on its edge are contacts with the same plane.
  [[nodiscard]] bool is_implied(const BodyPair& pair, Side side, std::size_t i) const noexcept {
    const std::vector<SurfacePoint>& points = world_.rigid[whose(pair, side)].points;
    const SurfacePoint& p = points[i];
    if (!p.has_ends()) return false;
    const auto touches_too = [&](std::size_t n) {
      const PointQuery &beside = pair.queries[side][n], &own = pair.queries[side][i];
      return is_current(pair, beside) && beside.gap_m <= kTouching * pair.skin_m &&
             glm::dot(beside.normal, own.normal) > 1.0 - kSamePlane;
    };
    const bool follows = points[i - 1].ends == p.ends,
               goes_on = i + 1 < points.size() && points[i + 1].ends == p.ends;
    return touches_too(follows ? i - 1 : p.ends[0]) && touches_too(goes_on ? i + 1 : p.ends[1]);
  }
  [[nodiscard]] bool in_motion(const BodyPair& pair) const noexcept {
    return member_[pair.free] != BodyContact::kNone || member_[pair.other] != BodyContact::kNone;
  }

  void take_step() noexcept {
    for (std::uint32_t m = 0; m < state_.scratch.free_bodies.stepped.size(); ++m)
      state_.scratch.free_bodies.stepped[m].state = state_.rigid[state_.scratch.free_bodies.object[m]].free;
    step_free_bodies(state_.scratch.free_bodies.stepped, state_.scratch.body_contacts,
                     state_.scratch.free_bodies.system, dt_s_);
  }

  // Is every point's way free? Where one is not, it becomes a contact; in the last round its body stands
  // still.
  bool follow_ways(int round) noexcept {
    bool all_free = true;
    ++all_.round;
    least_ = kNotLess * (1.0 - static_cast<double>(round) / (kRounds + 1));
    for (BodyPair& pair : all_.pairs) {
      if (!in_motion(pair)) continue;
      const double moved = moves_[pair.free] + moves_[pair.other];
      if (moved == 0.0 || far_apart(pair, moved + pair.skin_m)) continue;
      for_points(pair, [&](Side side, std::size_t i, PointQuery& sight) {
        if (sight.gap_m - drift(pair, sight) > moved + pair.skin_m) return;
        if (looks_ > kLooks) {
          state_.faults |= fault_body_crowded;
          return;
        }
        look_now(pair, side, i, sight);
        NearestSurface met = static_cast<const NearestSurface&>(sight);
        bool looked = false;
        if (way_is_free(pair, side, i, met, looked)) {
          if (looked) {
            sight.end = met;
            sight.followed = all_.round;
          }
          return;
        }
        all_free = false;
        if (round == kRounds) {
          stand_still(pair.free);
          stand_still(pair.other);
        } else {
          add_met(pair, side, i, met);
        }
      });
    }
    return all_free;
  }
  // Where a point comes from and goes to, in the other's frame.
  struct Way {
    glm::dvec3 from, to;
  };
  [[nodiscard]] Way way_of(const BodyPair& pair, Side side, std::size_t i) const noexcept {
    const std::uint32_t a = whose(pair, side), b = at_whose(pair, side);
    const glm::dvec3 at = place(pair, side, i);
    return {now_[b].to_body(now_[a].to_scene(at)), after_[b].to_body(after_[a].to_scene(at))};
  }
  // Follows a point in the other's frame; `met`: what it saw as the tick began, then what it came too near
  // to.
  bool way_is_free(const BodyPair& pair, Side side, std::size_t i, NearestSurface& met,
                   bool& looked) noexcept {
    const SurfacePoint& p = point(pair, side, i);
    const auto [from, to] = way_of(pair, side, i);
    const double way = glm::distance(from, to), least = least_ * pair.skin_m;
    double gap = met.gap_m;
    if (way <= std::max(0.0, gap - least)) return true;
    const double stride = std::max(kStride * pair.size_m, way / kMostStrides);
    // What overlaps may stay as deep as it was.
    const double allowed = std::min(least, gap - 0.01 * pair.skin_m);
    double done = 0.0;
    while (done < way) {
      const double ahead = std::min(way - done, std::max(gap - least, stride));
      done += ahead;
      const NearestSurface before = met;
      met = look_from(pair, side, glm::mix(from, to, done / way), p.radius_m, before.normal,
                      before.gap_m < ahead ? ahead : 0.0);
      looked = true;
      if (met.gap_m < allowed) {
        // Of a thin object, or at an edge of it, the way out may be another one than the way in.
        if (in_front(met, from, p) < pair.skin_m) met = before;
        return false;
      }
      gap = met.gap_m;
    }
    return true;
  }
  // The half-space that a point met on its way is kept, as seen from where the last solution took it.
  void add_met(BodyPair& pair, Side side, std::size_t i, const NearestSurface& met) noexcept {
    const SurfacePoint& p = point(pair, side, i);
    const auto [from, to] = way_of(pair, side, i);
    const BodyContact contact = contact_at(pair, side, i, met, now_, after_);
    const double before = in_front(met, to, p) - pair.skin_m -
                          dt_s_ * (speed_of(contact.body, contact) - speed_of(contact.other, contact));
    // Where it began nearer than that, nobody is thrown back.
    add(contact, before + std::max(0.0, pair.skin_m - in_front(met, from, p)));
  }
  [[nodiscard]] static double in_front(const NearestSurface& met, const glm::dvec3& place,
                                       const SurfacePoint& p) noexcept {
    return glm::dot(met.normal, place - met.at_m) - p.radius_m;
  }
  // How much nearer a surface comes by itself in this tick.
  [[nodiscard]] double comes(const BodyContact& contact) const noexcept {
    return dt_s_ * glm::dot(contact.normal, contact.carried_m_per_s);
  }
  [[nodiscard]] double speed_of(std::uint32_t member, const BodyContact& contact) const noexcept {
    if (member == BodyContact::kNone) return 0.0;
    const FreeBodyState& after = state_.scratch.free_bodies.stepped[member].state;
    const glm::dvec3 arm =
        contact.point_m - state_.rigid[state_.scratch.free_bodies.object[member]].free.centre_m;
    return glm::dot(contact.normal, after.velocity_m_per_s + glm::cross(after.spin_rad_per_s, arm));
  }
  void stand_still(std::uint32_t o) noexcept {
    const std::uint32_t m = member_[o];
    if (m == BodyContact::kNone) return;
    FreeBodyState& stepped = state_.scratch.free_bodies.stepped[m].state;
    stepped = state_.rigid[o].free;
    stepped.velocity_m_per_s = stepped.spin_rad_per_s = glm::dvec3(0.0);
  }

  // What was seen where the ways ended is what is seen as the next tick begins.
  void finish() noexcept {
    arrive();
    bool overlaps = false;
    for (BodyPair& pair : all_.pairs) {
      if (far_apart_now(pair)) continue;
      for_points(pair, [&](Side /*side*/, std::size_t /*i*/, PointQuery& sight) {
        if (sight.followed == all_.round) {
          static_cast<NearestSurface&>(sight) = sight.end;
          sight.seen_m = travel(pair);
        }
        overlaps = overlaps || sight.gap_m < kOverlaps * pair.skin_m;
        if (sight.gap_m < -kOverlap * pair.size_m) state_.faults |= fault_bodies_overlap;
      });
    }
    if (overlaps) take_back();
  }
  // Overlaps are taken back by moving bodies, and not by their speed: no energy comes of it but weight's.
  void take_back() noexcept {
    const std::size_t own = state_.scratch.body_contacts.size();
    for (BodyPair& pair : all_.pairs) {
      if (!in_motion(pair) || far_apart_now(pair)) continue;
      for_points(pair, [&](Side side, std::size_t i, PointQuery& sight) {
        if (sight.gap_m > kTouching * pair.skin_m) return;
        BodyContact contact = contact_at(pair, side, i, sight, after_, after_);
        contact.carried_m_per_s = glm::dvec3(0.0);
        contact.friction = 0.0;
        add(contact, std::max(sight.gap_m - pair.skin_m, -kBack * pair.skin_m));
      });
    }
    auto& still = state_.scratch.free_bodies.still;
    for (std::size_t m = 0; m < state_.scratch.free_bodies.stepped.size(); ++m) {
      still[m].state = state_.scratch.free_bodies.stepped[m].state;
      still[m].state.velocity_m_per_s = still[m].state.spin_rad_per_s = glm::dvec3(0.0);
    }
    step_free_bodies(still, std::span(state_.scratch.body_contacts).subspan(own),
                     state_.scratch.free_bodies.system, dt_s_);
    for (std::size_t m = 0; m < state_.scratch.free_bodies.stepped.size(); ++m) {
      state_.scratch.free_bodies.stepped[m].state.centre_m = still[m].state.centre_m;
      state_.scratch.free_bodies.stepped[m].state.rotation = still[m].state.rotation;
    }
    state_.scratch.body_contacts.resize(own);
    place_after();
    arrive();
  }
  // All are where the tick leaves them.
  void arrive() noexcept {
    for (std::uint32_t o = 0; o < world_.rigid.size(); ++o) {
      all_.travel_m[o] += moves_[o];
      all_.last[o] = next_[o];
    }
  }
  [[nodiscard]] bool far_apart_now(const BodyPair& pair) const noexcept {
    return pair.until_m - travel(pair) > 0.0;
  }

  const World& world_;
  WorldState& state_;
  BodyCollisions& all_;
  double dt_s_;
  std::size_t looks_ = 0;
  double least_ = kNotLess;  // skins; less from round to round, because a way is not quite straight
  std::vector<BodyFrame>&now_ = state_.scratch.free_bodies.before, &after_ = state_.scratch.free_bodies.after;
  std::vector<Pose>& next_ = state_.scratch.free_bodies.next;
  std::vector<double>& moves_ = state_.scratch.free_bodies.moves_m;
  std::vector<std::uint32_t>& member_ = state_.scratch.free_bodies.member;
};

}  // namespace

void prepare_collisions(const World& world, WorldState& state) {
  const auto count = static_cast<std::uint32_t>(world.rigid.size());
  std::uint32_t free = 0;
  for (std::uint32_t o = 0; o < count; ++o) free += is_free(world, o) ? 1 : 0;
  if (free == 0) return;
  FreeBodyStep& colliding = state.scratch.free_bodies;
  colliding.stepped.reserve(free);
  colliding.object.reserve(free);
  colliding.own.reserve(free);
  colliding.system = BodySystem(free);
  for (std::uint32_t o = 0; o < count; ++o) {
    if (!is_free(world, o)) continue;
    colliding.alone.push_back(alone(world.rigid[o].motion.free_body()));
  }
  for (const FreeBody& body : colliding.alone) colliding.still.push_back({.body = &body, .state = {}});
  state.scratch.body_contacts.reserve(kMaxOneSided);
  BodyCollisions& all = state.collisions;
  const auto size = [&](std::uint32_t o) {
    return glm::length(world.rigid[o].surface->upper() - world.rigid[o].surface->lower());
  };
  for (std::uint32_t a = 0; a < count; ++a) {
    for (std::uint32_t b = 0; b < count; ++b) {
      if (a == b || !is_free(world, a) || (is_free(world, b) && b < a)) continue;
      BodyPair pair;
      pair.free = a;
      pair.other = b;
      pair.size_m = std::min(size(a), size(b));
      pair.skin_m = std::max(kSkin * pair.size_m, world.skin_m);
      pair.friction = std::sqrt(world.rigid[a].feel.dynamic_friction * world.rigid[b].feel.dynamic_friction);
      pair.queries[0].resize(world.rigid[a].points.size());
      pair.queries[1].resize(world.rigid[b].points.size());
      all.pairs.push_back(std::move(pair));
    }
  }
  if (all.pairs.empty()) return;
  all.travel_m.assign(count, 0.0);
  for (const RigidState& near : state.rigid) all.last.push_back(near.pose);
  colliding.before.resize(count);
  colliding.after.resize(count);
  colliding.next.resize(count);
  colliding.moves_m.resize(count);
  colliding.member.assign(count, BodyContact::kNone);
}

void watch_collisions(const World& world, WorldState& state) {
  if (!state.collisions.pairs.empty()) Collisions(world, state, 1.0).look_at_all();
}

double overlap_m(const BodyPair& pair) noexcept {
  double least = std::numeric_limits<double>::max();
  for (const auto& queries : pair.queries) {
    for (const PointQuery& sight : queries) least = std::min(least, sight.gap_m);
  }
  return -least;
}

void step_past_rigid(const World& world, WorldState& state, double dt_s) noexcept {
  if (dt_s > 0.0) Collisions(world, state, dt_s).step();
}

void add_collision_stops(const World& world, WorldState& state, std::uint32_t b, double stiffness) noexcept {
  if (!state.collisions.pairs.empty()) Collisions(world, state, 1.0).add_stops(b, stiffness);
}

}  // namespace hybrid
