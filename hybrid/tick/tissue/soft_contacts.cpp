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

constexpr std::uint32_t kPairSlice = 256;  // surface voxels per tick for which a partner is looked up
// A contact is made before the surfaces touch, at a distance below kFindRange (unit: distance at which they
// touch). Each tick searches only a slice of the surface, and no voxel may pass the other surface before its
// slice is searched. A contact is dropped beyond kDropRange (same unit).
constexpr double kFindRange = 1.5;
constexpr double kDropRange = 1.75;
// A contact begins to move its voxels at a gap below kHoldGap, and ends at a gap above kReleaseGap (touching
// distances). The hysteresis prevents oscillation of surfaces that part.
constexpr double kHoldGap = 0.1, kReleaseGap = 0.3;
// A contact that is too far apart to press is queried once in this many ticks.
constexpr std::size_t kFarContactTurns = 4;
constexpr int kPairSweeps = 2;  // sweeps over all contacts in a tick
// kAloneRounds: rounds in which an object that the tool does not press gives way alone. kAloneDepth: the
// deepest overlap for which it does so (touching distances). Slow motion causes no deeper overlap.
constexpr int kAloneRounds = 2;
constexpr double kAloneDepth = 0.1;

// Calls visit(a, b) with both objects of a pair in their poses.
template <class Visit>
auto visit_objects(const World& world, WorldState& state, std::uint32_t soft_pair,
                   const Visit& visit) noexcept {
  const auto [ia, ib] = world.soft_pairs[soft_pair];
  return visit(voxel::PosedObject{*state.soft[ia], world.soft[ia].pose},
               voxel::PosedObject{*state.soft[ib], world.soft[ib].pose});
}

// The surface voxel of the second object that is nearest to a voxel of the first, and the facet there.
voxel::PressedPair partner_of(const World& world, WorldState& state, std::uint32_t soft_pair,
                              voxel::VoxelId v) noexcept {
  const std::uint32_t ib = world.soft_pairs[soft_pair][1];
  return visit_objects(world, state, soft_pair, [&](const auto& a, const auto& b) {
    const auto surface = b.object.lattice().surface();
    const glm::dvec3 at = a.pose.origin + a.pose.rotation * a.object.position(v);
    const double look = kFindRange * (a.object.voxel_radius() + b.object.voxel_radius());
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
      if (pair.side == glm::dvec3(0.0) || voxel::gap_of_pair(a, b, pair) >= (kFindRange - 1.0) * pair.reach_m)
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

// Visits the contact's main facet last, so that its constraint holds exactly.
template <class Pair, class Visit>
void for_facets(Pair& pair, const Visit& visit) noexcept {
  for (std::size_t i = 0; i < pair.extra_count; ++i) visit(pair.extra_facets[i]);
  visit(pair.pressed);
}

// Facets that the voxel pressed before and still lies on keep their force. The force on facets that it left
// passes to its main facet.
void keep_facets(const voxel::PosedObject& a, const voxel::PosedObject& b, const FacetContact& before,
                 FacetContact& now) noexcept {
  now.extra_count = 0;
  now.pressed.force_N = glm::dvec3(0.0);
  const auto keep = [&](const voxel::PressedPair& was) {
    voxel::PressedPair extra_facets = was;
    if (was.force_N != glm::dvec3(0.0) && now.extra_count < now.extra_facets.size() &&
        voxel::lies_beside(a, b, now.pressed, extra_facets)) {
      now.extra_facets[now.extra_count++] = extra_facets;
    } else {
      now.pressed.force_N += was.force_N;
    }
  };
  keep(before.pressed);
  for (std::size_t i = 0; i < before.extra_count; ++i) keep(before.extra_facets[i]);
}

// Finds the contact's facets again after its voxels moved. Returns the gap (touching distances).
double update_contact(const World& world, WorldState& state, FacetContact& pair) noexcept {
  return visit_objects(world, state, pair.soft_pair, [&](const auto& a, const auto& b) {
    const voxel::PressedPair pressed = pair.pressed;
    voxel::find_facet(a, b, pair.pressed);
    const double gap = voxel::gap_of_pair(a, b, pair.pressed) / pair.pressed.reach_m;
    const bool held = gap < (pair.held ? kReleaseGap : kHoldGap);
    if (held == pair.held && pair.extra_count == 0 && (!held || pressed.facet == pair.pressed.facet))
      return gap;
    FacetContact before = pair;
    before.pressed = pressed;
    pair.held = held;
    // Holds the new facets before it releases the old ones, so that voxels that belong to both stay held.
    if (pair.held) {
      keep_facets(a, b, before, pair);
      for_facets(pair, [&](const voxel::PressedPair& p) { voxel::claim_pair(a, b, p); });
    } else {
      pair.extra_count = 0;
      pair.pressed.force_N = glm::dvec3(0.0);
    }
    if (before.held) for_facets(before, [&](const voxel::PressedPair& p) { voxel::release_pair(a, b, p); });
    return gap;
  });
}

// May the contact press, judged by the facet of its last query?
bool may_press(const World& world, WorldState& state, const FacetContact& pair) noexcept {
  return pair.held || visit_objects(world, state, pair.soft_pair, [&](const auto& a, const auto& b) {
           return voxel::gap_of_pair(a, b, pair.pressed) < kReleaseGap * pair.pressed.reach_m;
         });
}

void update_contacts(const World& world, WorldState& state) noexcept {
  for (std::size_t i = 0; i < state.facet_contacts.size();) {
    FacetContact& pair = state.facet_contacts[i];
    // Most contacts are near but do not press. Searching their facets would cost as much as the rest of the
    // tick.
    if ((i + state.tick) % kFarContactTurns != 0 && !may_press(world, state, pair)) {
      ++i;
      continue;
    }
    if (update_contact(world, state, pair) < kDropRange - 1.0) {
      ++i;
      continue;
    }
    state.paired[pair.soft_pair][pair.surface_a] = 0;
    pair = state.facet_contacts.back();
    state.facet_contacts.pop_back();
  }
}

// Gives a new facet to each voxel that a sweep moved over the edge of its facet. For use before the next
// sweep. False: there were none.
bool follow_over_edges(const World& world, WorldState& state) noexcept {
  bool any = false;
  for (FacetContact& pair : state.facet_contacts) {
    const bool left =
        pair.held && visit_objects(world, state, pair.soft_pair, [&](const auto& a, const auto& b) {
          return voxel::left_facet(a, b, pair.pressed);
        });
    if (!left) continue;
    update_contact(world, state, pair);
    any = true;
  }
  return any;
}

// The object that gives way first. Where the chain is tight, the tool holds the object that it presses, so
// the other object gives way. If both gave way, tissue would be pushed back into the tool in every tick.
voxel::GiveWay first_to_give(const World& world, WorldState& state, const FacetContact& pair) noexcept {
  const auto [ia, ib] = world.soft_pairs[pair.soft_pair];
  const bool of_a = state.reactions[ia].pressed > 0, of_b = state.reactions[ib].pressed > 0;
  if (of_a == of_b) return voxel::GiveWay::both;
  const double gap = visit_objects(world, state, pair.soft_pair, [&](const auto& a, const auto& b) {
    return voxel::gap_of_pair(a, b, pair.pressed);
  });
  if (gap < -kAloneDepth * pair.pressed.reach_m) return voxel::GiveWay::both;
  return of_a ? voxel::GiveWay::second : voxel::GiveWay::first;
}

// Moves whole chains to remove overlaps that relaxation of links could not remove. First the object that
// first_to_give() names gives way, and then both objects. If anchors hold one object, the other one gives way
// at last.
void separate_pairs(const World& world, WorldState& state) noexcept {
  using voxel::GiveWay;
  for (FacetContact& pair : state.facet_contacts) {
    if (may_press(world, state, pair)) update_contact(world, state, pair);
  }
  const auto separate = [&](const auto& who) {
    bool any = false;
    // Contacts whose voxels were too far apart to be moved are examined, too: the chain may have moved
    // further voxels into overlap.
    for (const FacetContact& pair : state.facet_contacts) {
      any = visit_objects(world, state, pair.soft_pair,
                          [&](const auto& a, const auto& b) {
                            return voxel::part_pair(a, b, pair.pressed, who(pair));
                          }) ||
            any;
    }
    for (const auto& object : state.soft) object->settle_dragged();
    return any;
  };
  for (int n = 0; n < kAloneRounds; ++n) {
    if (!separate([&](const FacetContact& pair) { return first_to_give(world, state, pair); })) return;
  }
  for (const GiveWay who : {GiveWay::both, GiveWay::both, GiveWay::second, GiveWay::first}) {
    if (!separate([&](const FacetContact&) { return who; })) return;
  }
}

}  // namespace

void solve_soft_contacts(const World& world, WorldState& state) noexcept {
  update_contacts(world, state);
  for (std::uint32_t m = 0; m < world.soft_pairs.size(); ++m) find_pairs(world, state, m);
  const auto for_pairs = [&](const auto& visit) {
    for (FacetContact& pair : state.facet_contacts) {
      if (!pair.held) continue;
      visit_objects(world, state, pair.soft_pair, [&](const auto& a, const auto& b) {
        for_facets(pair, [&](voxel::PressedPair& p) { visit(a, b, p); });
      });
    }
  };
  const auto load = [&] {
    for_pairs(voxel::clear_pair_load);
    for_pairs(voxel::load_pair);
  };
  load();
  // In an object that the tool presses, pairs get no dependents: these may also depend on voxels under the
  // tool, which carry the dependents' load already.
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    if (state.reactions[o].pressed == 0) {
      state.soft[o]->find_pair_dependents();
    } else {
      state.soft[o]->forget_pair_dependents();
    }
  }
  for (int sweep = 0; sweep < kPairSweeps; ++sweep) {
    if (sweep > 0 && follow_over_edges(world, state)) load();
    for_pairs(voxel::relax_pair);
  }
  separate_pairs(world, state);
  load();  // the facets may have changed
}

}  // namespace hybrid
