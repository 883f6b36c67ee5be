// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tick/bodies/collision_queries.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <utility>

#include "polygon/surface/signed_distance.h"

namespace hybrid {
namespace {

constexpr double kOffSurface = 1e-6;     // shift off a surface (unit: distance to the object's middle)
constexpr double kCurrentWithin = 0.01;  // skins: after less relative motion a query is still current
// A query looks this much further than necessary (unit: the smaller object's diagonal).
constexpr double kQueryMargin = 0.5;
// A near pair is queried again after this much travel (unit: the smaller object's diagonal).
constexpr double kRequeryTravel = 0.1;

glm::dvec3 middle_of(const RigidObject& object) noexcept {
  return 0.5 * (object.surface->lower() + object.surface->upper());
}

}  // namespace

bool CollisionQueries::is_current(const BodyPair& pair, const PointQuery& query) const noexcept {
  return drift(pair, query) <= kCurrentWithin * pair.skin_m;
}

void CollisionQueries::place_now() noexcept {
  for (std::uint32_t o = 0; o < world_.rigid.size(); ++o) {
    const RigidMotion& motion = world_.rigid[o].motion;
    if (motion.kind() != RigidMotion::Kind::path && state_.rigid[o].pose != all_.last[o]) {
      all_.travel_m[o] += motion.displacement_bound(all_.last[o], state_.rigid[o].pose);
      all_.last[o] = state_.rigid[o].pose;
    }
    now_[o] = BodyFrame(all_.last[o]);
  }
}

void CollisionQueries::place_after() noexcept {
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

bool CollisionQueries::far_apart(BodyPair& pair, double range) noexcept {
  if (pair.until_m - travel(pair) > range) return true;
  if (travel(pair) - pair.queried_at_m < kRequeryTravel * pair.size_m) return false;
  const RigidObject &free = world_.rigid[pair.free], &other = world_.rigid[pair.other];
  const glm::dvec3 middle = now_[pair.other].to_body(now_[pair.free].to_scene(middle_of(free)));
  const double half = 0.5 * glm::length(free.surface->upper() - free.surface->lower());
  const double look = half + range + pair.size_m;
  polygon::NearPoint near;
  const bool inside = other.surface->inside(middle);
  const double apart = inside ? 0.0 : other.surface->nearest(middle, look, near) ? near.distance : look;
  pair.queried_at_m = travel(pair);
  pair.until_m = pair.queried_at_m + apart - half;
  return apart - half > range;
}

NearestSurface CollisionQueries::nearest_surface(const BodyPair& pair, Side side, const glm::dvec3& x,
                                                 double radius_m, const glm::dvec3& known,
                                                 double jump_m) noexcept {
  const polygon::RigidSurface& surface = *world_.rigid[opposite(pair, side)].surface;
  const double range = radius_m + kQueryMargin * pair.size_m;
  polygon::SignedDistance near;
  near.distance = range;
  ++queries_made_;
  bool found = polygon::signed_distance(surface, x, range, known, near);
  if (!found && near.distance == 0.0) {
    // On the surface itself the outward direction is undefined. The point counts as being on the side of its
    // own object, so it is moved slightly towards that object's middle.
    const RigidObject& own = world_.rigid[owner(pair, side)];
    const glm::dvec3 middle =
        now_[opposite(pair, side)].to_body(now_[owner(pair, side)].to_scene(middle_of(own)));
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

void CollisionQueries::refresh_query(const BodyPair& pair, Side side, std::size_t i,
                                     PointQuery& query) noexcept {
  if (is_current(pair, query)) return;
  const SurfacePoint& p = point(pair, side, i);
  const glm::dvec3 x =
      now_[opposite(pair, side)].to_body(now_[owner(pair, side)].to_scene(position(p, query)));
  static_cast<NearestSurface&>(query) = nearest_surface(pair, side, x, p.radius_m, glm::dvec3(0.0), 0.0);
  query.queried_at_m = travel(pair);
}

BodyContact CollisionQueries::contact_at(const BodyPair& pair, Side side, std::size_t i,
                                         const NearestSurface& query, const std::vector<BodyFrame>& of,
                                         const std::vector<BodyFrame>& at) const noexcept {
  const SurfacePoint& p = point(pair, side, i);
  BodyContact contact;
  contact.normal = at[opposite(pair, side)].rotation * query.normal;
  contact.point_m = of[owner(pair, side)].to_scene(position(pair, side, i)) - p.radius_m * contact.normal;
  contact.friction = pair.friction;
  std::uint32_t body = member_[owner(pair, side)], beside = member_[opposite(pair, side)];
  if (body == BodyContact::kNone) {
    std::swap(body, beside);
    contact.normal = -contact.normal;
  }
  contact.body = body;
  contact.other = beside;
  if (beside == BodyContact::kNone) {
    // The object that is not among the stepped bodies moves as prescribed.
    const std::uint32_t o = member_[pair.other] == BodyContact::kNone ? pair.other : pair.free;
    const glm::dvec3 in_body = now_[o].to_body(contact.point_m);
    contact.carried_m_per_s = (after_[o].to_scene(in_body) - contact.point_m) / dt_s_;
  }
  return contact;
}

}  // namespace hybrid
