// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tick/bodies/body_collisions.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

#include "hybrid/tick/bodies/collision_queries.h"

namespace hybrid {
namespace {

constexpr double kSkin = 1e-4;          // gap kept between surfaces (unit: the smaller object's diagonal)
constexpr double kTouching = 1.5;       // skins: points this near are contacts when the tick begins
constexpr double kLeastGap = 0.5;       // skins: a point that comes nearer becomes a contact
constexpr double kTakeBackAt = 0.75;    // skins: bodies with points nearer than this are moved apart
constexpr double kMaxCorrection = 1.0;  // skins: largest such motion in a tick
constexpr double kOverlap = 0.02;       // a deeper overlap is a fault (unit: the smaller object's diagonal)
// Stiffness of contacts: as good as rigid. Unit: reduced mass / dt², which stops the approach within a tick.
constexpr double kContactStiffness = 1e5;
constexpr double kSamePlane = 1e-9;  // 1 − cosine of the angle between normals of the same plane
// Points nearer than this slide along their edges (unit: the smaller object's diagonal).
constexpr double kSlideRange = 0.05;
constexpr double kLeastSlide = 0.01;                 // shorter slides are skipped (unit: the point's reach)
constexpr double kStride = 0.02;                     // step along a way (unit: the smaller object's diagonal)
constexpr int kMostStrides = 32;                     // steps along one way, at most
constexpr int kRounds = 6;                           // maximum repetitions of solving and following ways
constexpr std::size_t kMaxCollisionQueries = 20000;  // exact queries a tick
// Range within which a body that gives way is stopped (unit: the smaller object's diagonal).
constexpr double kStopRange = 0.05;

class Collisions : private CollisionQueries {
 public:
  using CollisionQueries::CollisionQueries;

  void step() noexcept {
    begin();
    if (!all_.pairs.empty()) add_touching();
    for (int round = 0;; ++round) {
      take_step();
      if (all_.pairs.empty()) return;
      place_after();
      if (follow_ways(round)) break;
      if (round < kRounds) continue;
      ++all_.round;  // makes the queries on ways invalid, because a body that stands still did not take its
                     // way
      place_after();
      break;
    }
    finish();
  }

  void query_all() noexcept {
    place_now();
    for (BodyPair& pair : all_.pairs)
      for_points(pair,
                 [&](Side side, std::size_t i, PointQuery& query) { refresh_query(pair, side, i, query); });
  }

  void add_stops(std::uint32_t b, double stiffness) noexcept {
    place_now();
    for (BodyPair& pair : all_.pairs) {
      if (pair.free != b && pair.other != b) continue;
      const double near_m = kStopRange * pair.size_m;
      if (far_apart(pair, near_m)) continue;
      for_points(pair, [&](Side side, std::size_t i, PointQuery& query) {
        if (query.gap_m - drift(pair, query) > near_m) return;
        refresh_query(pair, side, i, query);
        if (query.gap_m > near_m) return;
        BodyContact contact = contact_at(pair, side, i, query, now_, now_);
        if (contact.body != member_[b]) contact.normal = -contact.normal;
        contact.body = 0;
        contact.other = BodyContact::kNone;
        contact.stiffness_N_per_m = stiffness;
        contact.force_N = -stiffness * std::max(0.0, query.gap_m - pair.skin_m);
        contact.friction = 0.0;
        add_contact(state_, contact);
      });
    }
  }

 private:
  void begin() noexcept {
    if (all_.pairs.empty()) return;
    place_now();
    std::fill(member_.begin(), member_.end(), BodyContact::kNone);
    for (std::uint32_t m = 0; m < state_.scratch.free_bodies.stepped.size(); ++m)
      member_[state_.scratch.free_bodies.object[m]] = m;
    place_after();
  }
  // Adds a contact. `gap`: its gap (m) before the free bodies of the contact move.
  void add_with_gap(BodyContact contact, double gap) noexcept {
    double mass = mass_of(contact.body);
    if (contact.other != BodyContact::kNone) {
      const double other = mass_of(contact.other);
      mass = mass * other / (mass + other);
    }
    contact.stiffness_N_per_m = kContactStiffness * mass / (dt_s_ * dt_s_);
    contact.force_N = -contact.stiffness_N_per_m * gap;
    add_contact(state_, contact);
  }
  [[nodiscard]] double mass_of(std::uint32_t member) const noexcept {
    return state_.scratch.free_bodies.stepped[member].body->mass.mass_kg;
  }

  // Adds the contacts that exist when the tick begins.
  void add_touching() noexcept {
    for (BodyPair& pair : all_.pairs) {
      if (!in_motion(pair)) continue;
      const double near_m = kTouching * pair.skin_m, slides_m = kSlideRange * pair.size_m;
      if (far_apart(pair, slides_m)) continue;
      for_points(pair, [&](Side side, std::size_t i, PointQuery& query) {
        const double watched_m = point(pair, side, i).has_ends() ? slides_m : near_m;
        if (query.gap_m - drift(pair, query) > watched_m || queries_made_ > kMaxCollisionQueries) return;
        refresh_query(pair, side, i, query);
        slide(pair, side, i, query);
        if (query.gap_m > near_m || is_implied(pair, side, i)) return;
        const BodyContact contact = contact_at(pair, side, i, query, now_, now_);
        add_with_gap(contact, std::max(query.gap_m - pair.skin_m, 0.0) - prescribed_approach(contact));
      });
    }
  }
  // Slides the point along its edge to the place nearest to the other object. If two edges cross, that is the
  // crossing. A point that would overlap there does not slide.
  void slide(const BodyPair& pair, Side side, std::size_t i, PointQuery& query) noexcept {
    const SurfacePoint& p = point(pair, side, i);
    if (!p.has_ends() || !(query.gap_m > 0.0)) return;
    const glm::dvec3 along =
        (now_[owner(pair, side)].rotation * p.along) * now_[opposite(pair, side)].rotation;
    const double to_m =
        std::clamp(query.slid_m - query.gap_m * glm::dot(query.normal, along), -p.reach_m, p.reach_m);
    if (std::abs(to_m - query.slid_m) < kLeastSlide * p.reach_m) return;
    PointQuery there = query;
    there.slid_m = to_m;
    there.queried_at_m = -std::numeric_limits<double>::infinity();
    refresh_query(pair, side, i, there);
    if (there.gap_m > 0.0) query = there;
  }
  // Are both neighbours of the point on its edge in contact with the same plane? Then this contact adds
  // nothing.
  [[nodiscard]] bool is_implied(const BodyPair& pair, Side side, std::size_t i) const noexcept {
    const std::vector<SurfacePoint>& points = world_.rigid[owner(pair, side)].points;
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
  void take_step() noexcept {
    for (std::uint32_t m = 0; m < state_.scratch.free_bodies.stepped.size(); ++m)
      state_.scratch.free_bodies.stepped[m].state = state_.rigid[state_.scratch.free_bodies.object[m]].free;
    step_free_bodies(state_.scratch.free_bodies.stepped, state_.scratch.body_contacts,
                     state_.scratch.free_bodies.system, dt_s_);
  }

  // Is every point's way free? A point whose way is not free becomes a contact. In the last round the bodies
  // of its pair stand still instead.
  bool follow_ways(int round) noexcept {
    bool all_free = true;
    ++all_.round;
    least_gap_ = kLeastGap * (1.0 - static_cast<double>(round) / (kRounds + 1));
    for (BodyPair& pair : all_.pairs) {
      if (!in_motion(pair)) continue;
      const double moved = moves_[pair.free] + moves_[pair.other];
      if (moved == 0.0 || far_apart(pair, moved + pair.skin_m)) continue;
      for_points(pair, [&](Side side, std::size_t i, PointQuery& query) {
        if (query.gap_m - drift(pair, query) > moved + pair.skin_m) return;
        if (queries_made_ > kMaxCollisionQueries) {
          state_.faults |= fault_body_crowded;
          return;
        }
        refresh_query(pair, side, i, query);
        NearestSurface met = static_cast<const NearestSurface&>(query);
        bool queried = false;
        if (way_is_free(pair, side, i, met, queried)) {
          if (queried) {
            query.end = met;
            query.followed = all_.round;
          }
          return;
        }
        all_free = false;
        if (round == kRounds) {
          stand_still(pair.free);
          stand_still(pair.other);
        } else {
          add_contact_on_way(pair, side, i, met);
        }
      });
    }
    return all_free;
  }
  // Start and end of a point's way, in the other object's frame.
  struct Way {
    glm::dvec3 from, to;
  };
  [[nodiscard]] Way way_of(const BodyPair& pair, Side side, std::size_t i) const noexcept {
    const std::uint32_t a = owner(pair, side), b = opposite(pair, side);
    const glm::dvec3 at = position(pair, side, i);
    return {now_[b].to_body(now_[a].to_scene(at)), after_[b].to_body(after_[a].to_scene(at))};
  }
  // Follows a point in the other object's frame. `met`, on entry: the point's query at the start of the tick.
  // On return: the surface that the point came too near to, or else the query at the end of the way.
  // `queried`: true on return if queries were made on the way.
  bool way_is_free(const BodyPair& pair, Side side, std::size_t i, NearestSurface& met,
                   bool& queried) noexcept {
    const SurfacePoint& p = point(pair, side, i);
    const auto [from, to] = way_of(pair, side, i);
    const double way = glm::distance(from, to), least = least_gap_ * pair.skin_m;
    double gap = met.gap_m;
    if (way <= std::max(0.0, gap - least)) return true;
    const double stride = std::max(kStride * pair.size_m, way / kMostStrides);
    // A point that overlaps may stay as deep as it is.
    const double allowed = std::min(least, gap - 0.01 * pair.skin_m);
    double done = 0.0;
    while (done < way) {
      const double ahead = std::min(way - done, std::max(gap - least, stride));
      done += ahead;
      const NearestSurface before = met;
      met = nearest_surface(pair, side, glm::mix(from, to, done / way), p.radius_m, before.normal,
                            before.gap_m < ahead ? ahead : 0.0);
      queried = true;
      if (met.gap_m < allowed) {
        // At a thin object or at an edge, the start of the way may not be in front of the surface found here.
        // The surface of the previous query then counts.
        if (in_front(met, from, p) < pair.skin_m) met = before;
        return false;
      }
      gap = met.gap_m;
    }
    return true;
  }
  // Adds a contact between a point and the half-space that it met on its way. The contact's gap is the
  // distance at the end of the way, without the part that the free bodies' motion in the last solution
  // contributes. The next solution finds this motion anew.
  void add_contact_on_way(BodyPair& pair, Side side, std::size_t i, const NearestSurface& met) noexcept {
    const SurfacePoint& p = point(pair, side, i);
    const auto [from, to] = way_of(pair, side, i);
    const BodyContact contact = contact_at(pair, side, i, met, now_, after_);
    const double before = in_front(met, to, p) - pair.skin_m -
                          dt_s_ * (speed_of(contact.body, contact) - speed_of(contact.other, contact));
    // A point that began nearer than the skin is not thrown back.
    add_with_gap(contact, before + std::max(0.0, pair.skin_m - in_front(met, from, p)));
  }
  [[nodiscard]] static double in_front(const NearestSurface& met, const glm::dvec3& position,
                                       const SurfacePoint& p) noexcept {
    return glm::dot(met.normal, position - met.at_m) - p.radius_m;
  }
  // How much nearer (m) a surface with prescribed motion comes by itself in this tick.
  [[nodiscard]] double prescribed_approach(const BodyContact& contact) const noexcept {
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

  // Keeps the poses and the queries at the ends of the ways for the next tick. Moves overlapping bodies
  // apart.
  void finish() noexcept {
    commit_poses();
    bool overlaps = false;
    for (BodyPair& pair : all_.pairs) {
      if (far_apart_now(pair)) continue;
      for_points(pair, [&](Side /*side*/, std::size_t /*i*/, PointQuery& query) {
        if (query.followed == all_.round) {
          static_cast<NearestSurface&>(query) = query.end;
          query.queried_at_m = travel(pair);
        }
        overlaps = overlaps || query.gap_m < kTakeBackAt * pair.skin_m;
        if (query.gap_m < -kOverlap * pair.size_m) state_.faults |= fault_bodies_overlap;
      });
    }
    if (overlaps) take_overlaps_back();
  }
  // Moves overlapping bodies apart without giving them velocity. The only energy added is the potential
  // energy of weight.
  void take_overlaps_back() noexcept {
    const std::size_t own = state_.scratch.body_contacts.size();
    for (BodyPair& pair : all_.pairs) {
      if (!in_motion(pair) || far_apart_now(pair)) continue;
      for_points(pair, [&](Side side, std::size_t i, PointQuery& query) {
        if (query.gap_m > kTouching * pair.skin_m) return;
        BodyContact contact = contact_at(pair, side, i, query, after_, after_);
        contact.carried_m_per_s = glm::dvec3(0.0);
        contact.friction = 0.0;
        add_with_gap(contact, std::max(query.gap_m - pair.skin_m, -kMaxCorrection * pair.skin_m));
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
    commit_poses();
  }
  // Commits the poses at the end of the tick.
  void commit_poses() noexcept {
    for (std::uint32_t o = 0; o < world_.rigid.size(); ++o) {
      all_.travel_m[o] += moves_[o];
      all_.last[o] = next_[o];
    }
  }

  double least_gap_ = kLeastGap;  // skins; decreases from round to round, because a way is not quite straight
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
    colliding.contacts_only.push_back(without_external_loads(world.rigid[o].motion.free_body()));
  }
  for (const FreeBody& body : colliding.contacts_only)
    colliding.still.push_back({.body = &body, .state = {}});
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

void query_collisions(const World& world, WorldState& state) {
  if (!state.collisions.pairs.empty()) Collisions(world, state, 1.0).query_all();
}

double overlap_m(const BodyPair& pair) noexcept {
  double least = std::numeric_limits<double>::max();
  for (const auto& queries : pair.queries) {
    for (const PointQuery& query : queries) least = std::min(least, query.gap_m);
  }
  return -least;
}

void step_with_collisions(const World& world, WorldState& state, double dt_s) noexcept {
  if (dt_s > 0.0) Collisions(world, state, dt_s).step();
}

void add_collision_stops(const World& world, WorldState& state, std::uint32_t b, double stiffness) noexcept {
  if (!state.collisions.pairs.empty()) Collisions(world, state, 1.0).add_stops(b, stiffness);
}

}  // namespace hybrid
