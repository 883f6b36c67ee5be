// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tick/tissue/obstacles_and_pairs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <span>

#include "hybrid/tick/bodies/bodies_press_tissue.h"
#include "hybrid/tick/tissue/press_tissue.h"

namespace hybrid {
namespace {

constexpr std::uint32_t kObstacleSlice = 256;  // surface voxels whose motion is looked at a tick
constexpr std::size_t kObstacleQueries = 24;   // exact queries a tick
// … where a result arrived (1.9 % of a cell of overlap in `head`; with 64, which took 150 us, 2.1 %).
constexpr std::size_t kArrivedQueries = 40;
constexpr double kInside = 0.01;  // of the spacing: deeper in a surface a voxel leaves it
// A voxel looks again when it has moved by so many spacings, and to within so many of where it might meet a
// rigid surface that it has not seen: fewer where it has a half-space, since its ball, half a spacing large,
// meets nothing before. (Looked for within two spacings in any case, a brain 1.5 spacings from its skull had
// 28 looks a tick, 2.5 us each, and ticks with a result took half as much again: p99 612 us in place of 430.
// It overlaps the skull by 2.1 % of a cell in place of 1.6.)
constexpr float kMovedEnough = 0.25F, kSeenAhead = 2.0F, kKnownAhead = 0.6F;
// Of bricks, one that lies on its half-space looks again when it has slid by so much: over a ridge that
// turns. (By a quarter, tissue slid over it was carried 9 degrees off, and the hand felt 6 % of its force
// sideways. Links give way along their axes alone, and are hardly drawn aside: 0.3 %.)
constexpr float kSlid = 0.02F, kLiesOn = 1e-3F;
constexpr std::uint32_t kPairSlice = 256;  // surface voxels looked up for a partner a tick
// Touching distances: pairs are made before they touch, so that none is jumped over before its turn, and part
// when further apart.
constexpr double kLookForPairs = 1.5;
constexpr double kPartAt = 1.75;
// Of it, apart: the pair moves its voxels. (Let go of at 0.1, while the surfaces were still on their way
// apart, they swung, and a loop at 0.25 m/s gave the hand 26 uJ.)
constexpr double kHoldAt = 0.1, kLetGoAt = 0.3;
constexpr std::size_t kFarTurns = 4;  // ticks in which each pair that is too far apart to press is looked at
constexpr int kPairSweeps = 2;
// Rounds in which an object that the tool does not press gives way alone, and to how much of an overlap, in
// touching distances: at rest. (To any, a tool at 1 m/s drove one object half a spacing into the other.)
constexpr int kFirstGive = 2;
constexpr double kGivesAlone = 0.1;

struct NearestRigid {
  glm::dvec3 normal{0.0};  // away from the surface, scene frame, unit
  double distance = 0.0;   // negative: within the solid
  std::uint32_t object = 0;
  bool found = false;
};

NearestRigid nearest_rigid(const World& world, const WorldState& state, const glm::dvec3& point,
                           double range) noexcept {
  NearestRigid best;
  const std::uint64_t mask = state.map.rigid_in(point - range, point + range);
  best.distance = range;
  for (std::uint32_t o = 0; o < world.rigid.size(); ++o) {
    if ((mask & OccupancyMap::rigid_bit(o)) == 0) continue;
    const RigidObject& object = world.rigid[o];
    if (object.presses_tissue) continue;  // is looked at in every tick (bodies_press_tissue.h)
    polygon::NearPoint near;
    if (!object.surface->nearest(object.to_body(point), best.distance, near) || !(near.distance > 0.0))
      continue;
    best = {(point - object.to_scene(near.point)) / near.distance, near.distance, o, true};
  }
  return best;
}

// From within a solid the nearest surface is seen from its wrong side, and would hold a voxel in there for
// ever.
NearestRigid from_outside(const World& world, const glm::dvec3& point, NearestRigid near) noexcept {
  const RigidObject& object = world.rigid[near.object];
  if (!near.found || !object.surface->inside(object.to_body(point))) return near;
  near.normal = -near.normal;
  near.distance = -near.distance;
  return near;
}

voxel::Obstacle obstacle_of(const SoftBody& body, const voxel::SoftObject& object, voxel::VoxelId v,
                            const NearestRigid& near) noexcept {
  // n·(y + Δu − c) >= radius, with n·(y − c) = distance now.
  const glm::dvec3 n = glm::inverse(body.pose.rotation) * near.normal;
  const double bound = glm::dot(n, object.state().at(v)) + object.voxel_radius() - near.distance;
  return {glm::vec3(n), static_cast<float>(bound)};
}

}  // namespace

std::size_t find_obstacles(const World& world, WorldState& state, std::size_t soft) {
  voxel::SoftObject& object = *state.soft[soft];
  const SoftBody& body = world.soft[soft];
  const auto surface = object.lattice().surface();
  const double range = kObstacleRange * object.lattice().max_spacing_m();
  std::size_t count = 0;
  // Also where nothing is near: it may be pressed further than one looks.
  object.reserve_obstacles();
  state.obstacle_seen[soft].assign(surface.size(), {});
  for (std::size_t s = 0; s < surface.size(); ++s) {
    const NearestRigid near = nearest_rigid(world, state, body.to_scene(object.position(surface[s])), range);
    state.obstacle_seen[soft][s].clear_m = static_cast<float>(near.distance);
    if (!near.found) continue;
    ++count;
    voxel::Obstacle obstacle = obstacle_of(body, object, surface[s], near);
    obstacle.bound = std::min(obstacle.bound, 0.0F);  // nothing presses at rest
    set_standing_obstacle(state, soft, s, obstacle);
  }
  return count;
}

namespace {

// Surface voxels of one object that have to look for rigid surfaces again, those first that may meet one
// first.
class LooksDue {
 public:
  LooksDue(const WorldState& state, std::size_t soft)
      : state_(state),
        soft_(soft),
        object_(*state.soft[soft]),
        seen_(state.obstacle_seen[soft]),
        spacing_m_(static_cast<float>(object_.lattice().min_spacing_m())),
        radius_m_(static_cast<float>(object_.voxel_radius())) {}

  // Voxel number s of the surface, if it has moved enough.
  void consider(std::uint32_t s) noexcept {
    const SurfaceSeen& seen = seen_[s];
    const glm::vec3 way = glm::vec3(object_.state().at(object_.lattice().surface()[s])) - seen.from;
    const float square = glm::dot(way, way);
    // The surface that it knows holds it; another is further than that one was.
    const bool held = standing_obstacle(state_, soft_, s).normal != glm::vec3(0.0F);
    const float ahead = seen.clear_m / spacing_m_ - (held ? kKnownAhead : kSeenAhead);
    const float enough = std::max(kMovedEnough, ahead) * spacing_m_;
    if (square < enough * enough && !slid_on(s, square)) return;
    const float room = held ? std::max(seen.clear_m, spacing_m_) : seen.clear_m - radius_m_;
    add({room - std::sqrt(square), s});
  }
  // Does it lie on its half-space, elsewhere than that was looked for? What presses it goes across that.
  [[nodiscard]] bool slid_on(std::uint32_t s, float square) const noexcept {
    const float slid = kSlid * spacing_m_;
    if (!object_.lattice().has_bricks() || square < slid * slid) return false;
    const voxel::Obstacle& o = standing_obstacle(state_, soft_, s);
    const glm::vec3 u(object_.state().at(object_.lattice().surface()[s]));
    return o.normal != glm::vec3(0.0F) && glm::dot(o.normal, u) - o.bound < kLiesOn * spacing_m_;
  }
  // All of rows that were moved.
  void consider_moved() noexcept {
    for (const voxel::RowId row : object_.moved_rows()) {
      const auto [first, last] = object_.lattice().surface_in(row);
      for (std::uint32_t s = first; s < last; ++s) consider(s);
    }
  }
  [[nodiscard]] std::size_t count() const { return count_; }
  [[nodiscard]] std::uint32_t operator[](std::size_t n) const { return first_[n].s; }

 private:
  struct Due {
    float room_m;  // left until it may meet what it has not seen
    std::uint32_t s;
  };
  void add(const Due& due) noexcept {
    const bool full = count_ == first_.size();
    if (full && due.room_m >= first_[count_ - 1].room_m) return;
    for (std::size_t n = 0; n < count_; ++n) {
      if (first_[n].s == due.s) return;
    }
    std::size_t at = full ? count_ - 1 : count_++;
    for (; at > 0 && first_[at - 1].room_m > due.room_m; --at) first_[at] = first_[at - 1];
    first_[at] = due;
  }

  const WorldState& state_;
  std::size_t soft_;
  const voxel::SoftObject& object_;
  std::span<const SurfaceSeen> seen_;
  float spacing_m_, radius_m_;
  std::array<Due, kArrivedQueries> first_{};
  std::size_t count_ = 0;
};

void renew_obstacle(const World& world, WorldState& state, std::size_t o, std::uint32_t s) noexcept {
  const voxel::SoftObject& object = *state.soft[o];
  const SoftBody& body = world.soft[o];
  const voxel::VoxelId v = object.lattice().surface()[s];
  const glm::vec3 u(object.state().at(v));
  const double range = kObstacleRange * object.lattice().max_spacing_m();
  const glm::dvec3 at = body.to_scene(object.position(v));
  const NearestRigid near = from_outside(world, at, nearest_rigid(world, state, at, range));
  state.obstacle_seen[o][s] = {u, static_cast<float>(std::max(near.distance, 0.0))};
  if (!near.found) {
    set_standing_obstacle(state, o, s, {});
    return;
  }
  const voxel::Obstacle old = standing_obstacle(state, o, s);
  voxel::Obstacle fresh = obstacle_of(body, object, v, near);
  // A thin sheet seen from its other side: the voxel was squeezed through by rounding; its own side stands.
  if (old.normal != glm::vec3(0.0F) && glm::dot(old.normal, fresh.normal) < 0.0F) return;
  // A voxel that overlaps may not be thrown out at once: it comes out by as much as is looked at anew. (The
  // depth it has was left to it once: then a fast tool presses it in deeper tick by tick, and through.)
  const float enough = kMovedEnough * static_cast<float>(object.lattice().min_spacing_m());
  fresh.bound = std::min(fresh.bound, glm::dot(fresh.normal, u) + enough);
  set_standing_obstacle(state, o, s, fresh);
}

}  // namespace

void refresh_obstacles(const World& world, WorldState& state) noexcept {
  std::size_t left = kObstacleQueries;
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    voxel::SoftObject& object = *state.soft[o];
    if (object.obstacles().empty()) continue;
    if (!object.asleep()) {
      const voxel::Lattice& lattice = object.lattice();
      LooksDue due(state, o);
      for (const std::uint32_t number : object.touched_numbers()) due.consider(number);
      due.consider_moved();
      // What moves by itself, a little in each tick, is found in turns.
      const auto count = static_cast<std::uint32_t>(lattice.surface().size());
      for (std::uint32_t i = 0; i < std::min(kObstacleSlice, count); ++i) {
        fetch_surface_ahead(object, state.obstacle_cursor[o]);
        due.consider(state.obstacle_cursor[o]);
        if (++state.obstacle_cursor[o] == count) state.obstacle_cursor[o] = 0;
      }
      const std::size_t looks = std::min(left, due.count());
      for (std::size_t n = 0; n < looks; ++n) renew_obstacle(world, state, o, due[n]);
      left -= looks;
    }
    object.forget_moved_rows();
  }
}

void refresh_arrived(const World& world, WorldState& state) noexcept {
  std::size_t left = kArrivedQueries;
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    voxel::SoftObject& object = *state.soft[o];
    if (object.obstacles().empty() || object.moved_rows().empty()) continue;
    LooksDue due(state, o);
    due.consider_moved();
    const double depth = kInside * object.lattice().min_spacing_m();
    std::array<std::uint32_t, kArrivedQueries> inside{};
    std::size_t count = 0;
    const std::size_t looks = std::min(left, due.count());
    for (std::size_t n = 0; n < looks; ++n) {
      const std::uint32_t s = due[n];
      renew_obstacle(world, state, o, s);
      const voxel::Obstacle& now = object.obstacles()[s];
      const glm::dvec3 u = object.state().at(object.lattice().surface()[s]);
      if (now.normal != glm::vec3(0.0F) &&
          glm::dot(glm::dvec3(now.normal), u) < static_cast<double>(now.bound) - depth)
        inside[count++] = s;
    }
    left -= looks;
    if (count > 0) object.leave_obstacles(std::span(inside).first(count));
    object.forget_moved_rows();
  }
}

namespace {

// Both objects of a meeting where they lie.
template <class Visit>
auto with_objects(const World& world, WorldState& state, std::uint32_t meeting, const Visit& visit) noexcept {
  const auto [ia, ib] = world.meeting[meeting];
  return visit(voxel::PosedObject{*state.soft[ia], world.soft[ia].pose},
               voxel::PosedObject{*state.soft[ib], world.soft[ib].pose});
}

// Of the second object's surface the voxel nearest to a voxel of the first, and the facet there.
voxel::PressedPair partner_of(const World& world, WorldState& state, std::uint32_t meeting,
                              voxel::VoxelId v) noexcept {
  const std::uint32_t ib = world.meeting[meeting][1];
  return with_objects(world, state, meeting, [&](const auto& a, const auto& b) {
    const auto surface = b.object.lattice().surface();
    const glm::dvec3 at = a.pose.origin + a.pose.rotation * a.object.position(v);
    const double look = kLookForPairs * (a.object.voxel_radius() + b.object.voxel_radius());
    const std::size_t found = state.map.soft_in(at - look, at + look, state.found);
    voxel::PressedPair best;
    double nearest = look;
    std::uint32_t partner = voxel::SoftObject::kNoSurface;
    for (std::size_t n = 0; n < found; ++n) {
      const std::uint32_t number = state.found[n] - world.soft[ib].first_number;
      if (state.found[n] < world.soft[ib].first_number || number >= surface.size()) continue;
      const double distance = glm::length(world.soft[ib].to_scene(b.object.position(surface[number])) - at);
      if (distance > nearest || (distance == nearest && number >= partner)) continue;
      const voxel::PressedPair pair = voxel::pair_of(a, v, b, surface[number]);
      if (pair.side == glm::dvec3(0.0) ||
          voxel::gap_of_pair(a, b, pair) >= (kLookForPairs - 1.0) * pair.reach_m)
        continue;
      best = pair;
      nearest = distance;
      partner = number;
    }
    return best;
  });
}

void find_pairs(const World& world, WorldState& state, std::uint32_t meeting) noexcept {
  const auto [ia, ib] = world.meeting[meeting];
  const voxel::SoftObject &a = *state.soft[ia], &b = *state.soft[ib];
  if (!a.moved_ever() && !b.moved_ever()) return;
  if (a.asleep() && b.asleep() && state.pair_cursor[meeting] == 0) return;
  const auto surface = a.lattice().surface();
  const auto count = static_cast<std::uint32_t>(surface.size());
  for (std::uint32_t i = 0; i < std::min(kPairSlice, count); ++i) {
    const std::uint32_t s = state.pair_cursor[meeting];
    state.pair_cursor[meeting] = s + 1 == count ? 0 : s + 1;
    if (state.paired[meeting][s] != 0) continue;
    const voxel::PressedPair pressed = partner_of(world, state, meeting, surface[s]);
    if (pressed.side == glm::dvec3(0.0)) continue;
    if (state.pairs.size() == state.pairs.capacity()) {
      state.faults |= fault_pair_overflow;
      return;
    }
    state.pairs.push_back({.meeting = meeting, .pressed = pressed, .surface_a = s});
    state.paired[meeting][s] = 1;
  }
}

// That which it is over last, so that this holds, whatever the others asked for.
template <class Pair, class Visit>
void for_facets(Pair& pair, const Visit& visit) noexcept {
  for (std::size_t i = 0; i < pair.besides; ++i) visit(pair.beside[i]);
  visit(pair.pressed);
}

// Facets that it pressed before, and lies on still, press as they did; what it left gives its force to the
// one that it is over.
void keep_facets(const voxel::PosedObject& a, const voxel::PosedObject& b, const VoxelPair& before,
                 VoxelPair& now) noexcept {
  now.besides = 0;
  now.pressed.force_N = glm::dvec3(0.0);
  const auto keep = [&](const voxel::PressedPair& was) {
    voxel::PressedPair beside = was;
    if (was.force_N != glm::dvec3(0.0) && now.besides < now.beside.size() &&
        voxel::lies_beside(a, b, now.pressed, beside)) {
      now.beside[now.besides++] = beside;
    } else {
      now.pressed.force_N += was.force_N;
    }
  };
  keep(before.pressed);
  for (std::size_t i = 0; i < before.besides; ++i) keep(before.beside[i]);
}

// Voxels moved over one another: the pair looks for its facets again. Returns the gap, in touching distances.
double renew_pair(const World& world, WorldState& state, VoxelPair& pair) noexcept {
  return with_objects(world, state, pair.meeting, [&](const auto& a, const auto& b) {
    const voxel::PressedPair pressed = pair.pressed;
    voxel::find_facet(a, b, pair.pressed);
    const double gap = voxel::gap_of_pair(a, b, pair.pressed) / pair.pressed.reach_m;
    const bool held = gap < (pair.held ? kLetGoAt : kHoldAt);
    if (held == pair.held && pair.besides == 0 && (!held || pressed.facet == pair.pressed.facet)) return gap;
    VoxelPair before = pair;
    before.pressed = pressed;
    pair.held = held;
    // Before the old ones are let go of: what is in both stays held.
    if (pair.held) {
      keep_facets(a, b, before, pair);
      for_facets(pair, [&](const voxel::PressedPair& p) { voxel::hold_pair(a, b, p); });
    } else {
      pair.besides = 0;
      pair.pressed.force_N = glm::dvec3(0.0);
    }
    if (before.held) for_facets(before, [&](const voxel::PressedPair& p) { voxel::release_pair(a, b, p); });
    return gap;
  });
}

// By the facet that it was over when last looked for.
bool may_press(const World& world, WorldState& state, const VoxelPair& pair) noexcept {
  return pair.held || with_objects(world, state, pair.meeting, [&](const auto& a, const auto& b) {
           return voxel::gap_of_pair(a, b, pair.pressed) < kLetGoAt * pair.pressed.reach_m;
         });
}

void renew_pairs(const World& world, WorldState& state) noexcept {
  for (std::size_t i = 0; i < state.pairs.size();) {
    VoxelPair& pair = state.pairs[i];
    // Most are only near one another, and a look for a facet costs as much as all else.
    if ((i + state.tick) % kFarTurns != 0 && !may_press(world, state, pair)) {
      ++i;
      continue;
    }
    if (renew_pair(world, state, pair) < kPartAt - 1.0) {
      ++i;
      continue;
    }
    state.paired[pair.meeting][pair.surface_a] = 0;
    pair = state.pairs.back();
    state.pairs.pop_back();
  }
}

// What a sweep took over the edge of its facet meets the next one in the next sweep. False: nothing was.
bool follow_over_edges(const World& world, WorldState& state) noexcept {
  bool any = false;
  for (VoxelPair& pair : state.pairs) {
    const bool left =
        pair.held && with_objects(world, state, pair.meeting, [&](const auto& a, const auto& b) {
          return voxel::left_facet(a, b, pair.pressed);
        });
    if (!left) continue;
    renew_pair(world, state, pair);
    any = true;
  }
  return any;
}

// An object that the tool presses is held by it where its chain is tight, so the other one gives way.
// (Shared, what was pushed back came to the tool, which gave way to it in every tick and came again in the
// next: the hand felt up to two thirds more than tissue pressed the tool with, and nothing came to rest.)
voxel::GiveWay first_to_give(const World& world, WorldState& state, const VoxelPair& pair) noexcept {
  const auto [ia, ib] = world.meeting[pair.meeting];
  const bool of_a = state.reactions[ia].pressed > 0, of_b = state.reactions[ib].pressed > 0;
  if (of_a == of_b) return voxel::GiveWay::both;
  const double gap = with_objects(world, state, pair.meeting, [&](const auto& a, const auto& b) {
    return voxel::gap_of_pair(a, b, pair.pressed);
  });
  if (gap < -kGivesAlone * pair.pressed.reach_m) return voxel::GiveWay::both;
  return of_a ? voxel::GiveWay::second : voxel::GiveWay::first;
}

// What links alone could not part, the chains follow: of who gives way first, then of both, then, where
// anchors held one, of the other.
void part_pairs(const World& world, WorldState& state) noexcept {
  using voxel::GiveWay;
  for (VoxelPair& pair : state.pairs) {
    if (may_press(world, state, pair)) renew_pair(world, state, pair);
  }
  const auto part = [&](const auto& who) {
    bool any = false;
    // Those too far apart to be held as well: the chain takes along more than was dragged.
    for (const VoxelPair& pair : state.pairs) {
      any = with_objects(world, state, pair.meeting,
                         [&](const auto& a, const auto& b) {
                           return voxel::part_pair(a, b, pair.pressed, who(pair));
                         }) ||
            any;
    }
    for (const auto& object : state.soft) object->settle_dragged();
    return any;
  };
  for (int n = 0; n < kFirstGive; ++n) {
    if (!part([&](const VoxelPair& pair) { return first_to_give(world, state, pair); })) return;
  }
  for (const GiveWay who : {GiveWay::both, GiveWay::both, GiveWay::second, GiveWay::first}) {
    if (!part([&](const VoxelPair&) { return who; })) return;
  }
}

}  // namespace

void relax_pairs(const World& world, WorldState& state) noexcept {
  renew_pairs(world, state);
  for (std::uint32_t m = 0; m < world.meeting.size(); ++m) find_pairs(world, state, m);
  const auto for_pairs = [&](const auto& visit) {
    for (VoxelPair& pair : state.pairs) {
      if (!pair.held) continue;
      with_objects(world, state, pair.meeting, [&](const auto& a, const auto& b) {
        for_facets(pair, [&](voxel::PressedPair& p) { visit(a, b, p); });
      });
    }
  };
  const auto load = [&] {
    for_pairs(voxel::clear_pair_load);
    for_pairs(voxel::load_pair);
  };
  load();
  // What hangs on voxels of an object that the tool presses may hang on the tool as well, which feels it.
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    if (state.reactions[o].pressed == 0) {
      state.soft[o]->find_hanging_on_pairs();
    } else {
      state.soft[o]->forget_hanging_on_pairs();
    }
  }
  for (int sweep = 0; sweep < kPairSweeps; ++sweep) {
    if (sweep > 0 && follow_over_edges(world, state)) load();
    for_pairs(voxel::relax_pair);
  }
  part_pairs(world, state);
  load();  // by the facets as they now are
}

}  // namespace hybrid
