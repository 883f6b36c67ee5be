// SPDX-License-Identifier: GPL-3.0-or-later
// Internal to body_collisions.cpp: poses, distance queries and contacts of pairs of rigid bodies.
//
// The bodies' poses before and after the tick are cached as frames. The query of a contact point is exact
// until its pair moves. Afterwards its distance less the motion of both objects is a lower bound.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "hybrid/world/world_state.h"

namespace hybrid {

class CollisionQueries {
 public:
  using Side = std::size_t;  // 0: points of the free object; 1: points of the other object

  CollisionQueries(const World& world, WorldState& state, double dt_s)
      : world_(world), state_(state), all_(state.collisions), dt_s_(dt_s) {}

 protected:
  static std::uint32_t owner(const BodyPair& pair, Side side) noexcept {
    return side == 0 ? pair.free : pair.other;
  }
  static std::uint32_t opposite(const BodyPair& pair, Side side) noexcept {
    return side == 0 ? pair.other : pair.free;
  }
  [[nodiscard]] const SurfacePoint& point(const BodyPair& pair, Side side, std::size_t i) const noexcept {
    return world_.rigid[owner(pair, side)].points[i];
  }
  // Where the point is on its object's surface now, in the object's frame.
  [[nodiscard]] static glm::dvec3 position(const SurfacePoint& p, const PointQuery& query) noexcept {
    return p.at_m + query.slid_m * p.along;
  }
  [[nodiscard]] glm::dvec3 position(const BodyPair& pair, Side side, std::size_t i) const noexcept {
    return position(point(pair, side, i), pair.queries[side][i]);
  }
  template <class Visit>
  void for_points(BodyPair& pair, const Visit& visit) noexcept {
    for (Side side = 0; side < 2; ++side) {
      for (std::size_t i = 0; i < pair.queries[side].size(); ++i) visit(side, i, pair.queries[side][i]);
    }
  }

  // Sum of both objects' motion since the session began, up to the end of the last tick (m).
  [[nodiscard]] double travel(const BodyPair& pair) const noexcept {
    return all_.travel_m[pair.free] + all_.travel_m[pair.other];
  }
  [[nodiscard]] double drift(const BodyPair& pair, const PointQuery& query) const noexcept {
    return travel(pair) - query.queried_at_m;
  }

  // Have both objects hardly moved since the query? If so, the point needs no new query.
  [[nodiscard]] bool is_current(const BodyPair& pair, const PointQuery& query) const noexcept;

  // Sets now_ to the poses before this tick. Objects on paths have moved already, so their poses at the end
  // of the last tick are used. Motion that tissue gave free bodies since then is added to their travel.
  void place_now() noexcept;
  // Sets after_ to the poses after this tick, for free bodies to those of the present solution.
  void place_after() noexcept;
  [[nodiscard]] bool in_motion(const BodyPair& pair) const noexcept {
    return member_[pair.free] != BodyContact::kNone || member_[pair.other] != BodyContact::kNone;
  }

  // True: nothing of one object is nearer than `range` to the other. False: unknown, or nearer.
  bool far_apart(BodyPair& pair, double range) noexcept;
  [[nodiscard]] bool far_apart_now(const BodyPair& pair) const noexcept {
    return pair.until_m - travel(pair) > 0.0;
  }

  // Queries the surface from place `x` in the other object's frame. `known`: the normal at the point's
  // previous query, or zero. A point went through the surface if three things hold: it moved at most
  // `jump_m`, lies within `jump_m` of the surface, and is now on the side opposite to `known`. Its gap is
  // then negative.
  [[nodiscard]] NearestSurface nearest_surface(const BodyPair& pair, Side side, const glm::dvec3& x,
                                               double radius_m, const glm::dvec3& known,
                                               double jump_m) noexcept;
  // Queries the point again if its query is no longer current. No earlier normal is needed: each way of the
  // point was shorter than its distance to the surface, so it did not change sides.
  void refresh_query(const BodyPair& pair, Side side, std::size_t i, PointQuery& query) noexcept;

  // The contact of a point with the surface that its query returned, without force. `of`: frames in which the
  // point's object is taken; `at`: frames in which the other object is taken.
  [[nodiscard]] BodyContact contact_at(const BodyPair& pair, Side side, std::size_t i,
                                       const NearestSurface& query, const std::vector<BodyFrame>& of,
                                       const std::vector<BodyFrame>& at) const noexcept;

  const World& world_;
  WorldState& state_;
  BodyCollisions& all_;
  double dt_s_;
  std::size_t queries_made_ = 0;
  std::vector<BodyFrame>&now_ = state_.scratch.free_bodies.before, &after_ = state_.scratch.free_bodies.after;
  std::vector<Pose>& next_ = state_.scratch.free_bodies.next;
  std::vector<double>& moves_ = state_.scratch.free_bodies.moves_m;
  std::vector<std::uint32_t>& member_ = state_.scratch.free_bodies.member;
};

}  // namespace hybrid
