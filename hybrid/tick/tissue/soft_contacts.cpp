// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tick/tissue/soft_contacts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <span>

#include "hybrid/tick/bodies/bodies_press_tissue.h"
#include "hybrid/tick/tissue/press_tissue.h"

namespace hybrid {
namespace {

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

// Both objects of a meeting where they lie.
template <class Visit>
auto with_objects(const World& world, WorldState& state, std::uint32_t soft_pair,
                  const Visit& visit) noexcept {
  const auto [ia, ib] = world.soft_pairs[soft_pair];
  return visit(voxel::PosedObject{*state.soft[ia], world.soft[ia].pose},
               voxel::PosedObject{*state.soft[ib], world.soft[ib].pose});
}

// Of the second object's surface the voxel nearest to a voxel of the first, and the facet there.
voxel::PressedPair partner_of(const World& world, WorldState& state, std::uint32_t soft_pair,
                              voxel::VoxelId v) noexcept {
  const std::uint32_t ib = world.soft_pairs[soft_pair][1];
  return with_objects(world, state, soft_pair, [&](const auto& a, const auto& b) {
    const auto surface = b.object.lattice().surface();
    const glm::dvec3 at = a.pose.origin + a.pose.rotation * a.object.position(v);
    const double look = kLookForPairs * (a.object.voxel_radius() + b.object.voxel_radius());
    const std::size_t found = state.map.soft_in(at - look, at + look, state.scratch.map_hits);
    voxel::PressedPair best;
    double nearest = look;
    std::uint32_t partner = voxel::SoftObject::kNoSurface;
    for (std::size_t n = 0; n < found; ++n) {
      const std::uint32_t number = state.scratch.map_hits[n] - world.soft[ib].first_number;
      if (state.scratch.map_hits[n] < world.soft[ib].first_number || number >= surface.size()) continue;
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

void find_pairs(const World& world, WorldState& state, std::uint32_t soft_pair) noexcept {
  const auto [ia, ib] = world.soft_pairs[soft_pair];
  const voxel::SoftObject &a = *state.soft[ia], &b = *state.soft[ib];
  if (!a.moved_ever() && !b.moved_ever()) return;
  if (a.asleep() && b.asleep() && state.pair_cursor[soft_pair] == 0) return;
  const auto surface = a.lattice().surface();
  const auto count = static_cast<std::uint32_t>(surface.size());
  for (std::uint32_t i = 0; i < std::min(kPairSlice, count); ++i) {
    const std::uint32_t s = state.pair_cursor[soft_pair];
    state.pair_cursor[soft_pair] = s + 1 == count ? 0 : s + 1;
    if (state.paired[soft_pair][s] != 0) continue;
    const voxel::PressedPair pressed = partner_of(world, state, soft_pair, surface[s]);
    if (pressed.side == glm::dvec3(0.0)) continue;
    if (state.facet_contacts.size() == state.facet_contacts.capacity()) {
      state.faults |= fault_pair_overflow;
      return;
    }
    state.facet_contacts.push_back({.soft_pair = soft_pair, .pressed = pressed, .surface_a = s});
    state.paired[soft_pair][s] = 1;
  }
}

// That which it is over last, so that this holds, whatever the others asked for.
template <class Pair, class Visit>
void for_facets(Pair& pair, const Visit& visit) noexcept {
  for (std::size_t i = 0; i < pair.extra_facets; ++i) visit(pair.beside[i]);
  visit(pair.pressed);
}

// Facets that it pressed before, and lies on still, press as they did; what it left gives its force to the
// one that it is over.
void keep_facets(const voxel::PosedObject& a, const voxel::PosedObject& b, const FacetContact& before,
                 FacetContact& now) noexcept {
  now.extra_facets = 0;
  now.pressed.force_N = glm::dvec3(0.0);
  const auto keep = [&](const voxel::PressedPair& was) {
    voxel::PressedPair beside = was;
    if (was.force_N != glm::dvec3(0.0) && now.extra_facets < now.beside.size() &&
        voxel::lies_beside(a, b, now.pressed, beside)) {
      now.beside[now.extra_facets++] = beside;
    } else {
      now.pressed.force_N += was.force_N;
    }
  };
  keep(before.pressed);
  for (std::size_t i = 0; i < before.extra_facets; ++i) keep(before.beside[i]);
}

// Voxels moved over one another: the pair looks for its facets again. Returns the gap, in touching distances.
double renew_pair(const World& world, WorldState& state, FacetContact& pair) noexcept {
  return with_objects(world, state, pair.soft_pair, [&](const auto& a, const auto& b) {
    const voxel::PressedPair pressed = pair.pressed;
    voxel::find_facet(a, b, pair.pressed);
    const double gap = voxel::gap_of_pair(a, b, pair.pressed) / pair.pressed.reach_m;
    const bool held = gap < (pair.held ? kLetGoAt : kHoldAt);
    if (held == pair.held && pair.extra_facets == 0 && (!held || pressed.facet == pair.pressed.facet))
      return gap;
    FacetContact before = pair;
    before.pressed = pressed;
    pair.held = held;
    // Before the old ones are let go of: what is in both stays held.
    if (pair.held) {
      keep_facets(a, b, before, pair);
      for_facets(pair, [&](const voxel::PressedPair& p) { voxel::hold_pair(a, b, p); });
    } else {
      pair.extra_facets = 0;
      pair.pressed.force_N = glm::dvec3(0.0);
    }
    if (before.held) for_facets(before, [&](const voxel::PressedPair& p) { voxel::release_pair(a, b, p); });
    return gap;
  });
}

// By the facet that it was over when last looked for.
bool may_press(const World& world, WorldState& state, const FacetContact& pair) noexcept {
  return pair.held || with_objects(world, state, pair.soft_pair, [&](const auto& a, const auto& b) {
           return voxel::gap_of_pair(a, b, pair.pressed) < kLetGoAt * pair.pressed.reach_m;
         });
}

void renew_pairs(const World& world, WorldState& state) noexcept {
  for (std::size_t i = 0; i < state.facet_contacts.size();) {
    FacetContact& pair = state.facet_contacts[i];
    // Most are only near one another, and a look for a facet costs as much as all else.
    if ((i + state.tick) % kFarTurns != 0 && !may_press(world, state, pair)) {
      ++i;
      continue;
    }
    if (renew_pair(world, state, pair) < kPartAt - 1.0) {
      ++i;
      continue;
    }
    state.paired[pair.soft_pair][pair.surface_a] = 0;
    pair = state.facet_contacts.back();
    state.facet_contacts.pop_back();
  }
}

// What a sweep took over the edge of its facet meets the next one in the next sweep. False: nothing was.
bool follow_over_edges(const World& world, WorldState& state) noexcept {
  bool any = false;
  for (FacetContact& pair : state.facet_contacts) {
    const bool left =
        pair.held && with_objects(world, state, pair.soft_pair, [&](const auto& a, const auto& b) {
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
voxel::GiveWay first_to_give(const World& world, WorldState& state, const FacetContact& pair) noexcept {
  const auto [ia, ib] = world.soft_pairs[pair.soft_pair];
  const bool of_a = state.reactions[ia].pressed > 0, of_b = state.reactions[ib].pressed > 0;
  if (of_a == of_b) return voxel::GiveWay::both;
  const double gap = with_objects(world, state, pair.soft_pair, [&](const auto& a, const auto& b) {
    return voxel::gap_of_pair(a, b, pair.pressed);
  });
  if (gap < -kGivesAlone * pair.pressed.reach_m) return voxel::GiveWay::both;
  return of_a ? voxel::GiveWay::second : voxel::GiveWay::first;
}

// What links alone could not part, the chains follow: of who gives way first, then of both, then, where
// anchors held one, of the other.
void part_pairs(const World& world, WorldState& state) noexcept {
  using voxel::GiveWay;
  for (FacetContact& pair : state.facet_contacts) {
    if (may_press(world, state, pair)) renew_pair(world, state, pair);
  }
  const auto part = [&](const auto& who) {
    bool any = false;
    // Those too far apart to be held as well: the chain takes along more than was dragged.
    for (const FacetContact& pair : state.facet_contacts) {
      any = with_objects(world, state, pair.soft_pair,
                         [&](const auto& a, const auto& b) {
                           return voxel::part_pair(a, b, pair.pressed, who(pair));
                         }) ||
            any;
    }
    for (const auto& object : state.soft) object->settle_dragged();
    return any;
  };
  for (int n = 0; n < kFirstGive; ++n) {
    if (!part([&](const FacetContact& pair) { return first_to_give(world, state, pair); })) return;
  }
  for (const GiveWay who : {GiveWay::both, GiveWay::both, GiveWay::second, GiveWay::first}) {
    if (!part([&](const FacetContact&) { return who; })) return;
  }
}

}  // namespace

void solve_soft_contacts(const World& world, WorldState& state) noexcept {
  renew_pairs(world, state);
  for (std::uint32_t m = 0; m < world.soft_pairs.size(); ++m) find_pairs(world, state, m);
  const auto for_pairs = [&](const auto& visit) {
    for (FacetContact& pair : state.facet_contacts) {
      if (!pair.held) continue;
      with_objects(world, state, pair.soft_pair, [&](const auto& a, const auto& b) {
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
