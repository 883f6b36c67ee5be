// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/session/forces_between.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <limits>
#include <tuple>
#include <utility>

#include "hybrid/tick/tissue/obstacles.h"
#include "voxel/composite/grid.h"
#include "voxel/lattice/voxel_links.h"
#include "voxel/object/loads_by_partner.h"

namespace hybrid {
namespace {

using Kind = ObjectPair::Kind;

// The load of links at their limits is known only if the forces on the object balance. Their sum may be at
// most kBalanced times the largest force, or kBalanced_N.
constexpr double kBalanced = 0.01, kBalanced_N = 1e-4;
// The surface of a half-space is looked for up to this share of the spacing beyond the voxel's ball.
constexpr double kLookBeyond = 0.5;

// The rigid object that surface voxel s lies on, if any.
std::optional<std::uint32_t> rigid_under(const World& world, const WorldState& state, std::size_t soft,
                                         std::uint32_t s) {
  const voxel::SoftObject& object = *state.soft[soft];
  const voxel::Obstacle& obstacle = object.obstacles()[s];
  const voxel::VoxelId v = object.lattice().surface()[s];
  if (obstacle.normal == glm::vec3(0.0F) || object.lattice().anchored(v)) return {};
  const double spacing_m = object.lattice().min_spacing_m();
  if (-voxel::depth_in_obstacle(obstacle, object.state().at(v)) > static_cast<double>(kLiesOn) * spacing_m)
    return {};
  if (obstacle.moving) {
    const std::uint32_t body = state.body_obstacles[soft].whose[s];
    return body == BodyObstacles::kNobody ? std::nullopt : std::optional(body);
  }
  const NearestRigid near = nearest_rigid(world, state, world.soft[soft].to_scene(object.position(v)),
                                          object.voxel_radius() + kLookBeyond * spacing_m);
  return near.found ? std::optional(near.object) : std::nullopt;
}

// Lists the voxels of one soft object that the hand, anchors and rigid objects hold.
std::vector<voxel::HeldVoxel> held_voxels(const World& world, const WorldState& state, std::size_t soft) {
  const voxel::SoftObject& object = *state.soft[soft];
  std::vector<voxel::HeldVoxel> held;
  if (!object.moved_ever()) return held;
  voxel::list_anchors(object, held);
  for (const voxel::VoxelId v : object.touched()) {
    const std::uint8_t role = object.state().role[v];
    if ((role == voxel::Displacement::pressed || role == voxel::Displacement::held) &&
        !object.lattice().anchored(v))
      held.push_back({v, voxel::kHandPartner});
  }
  for (std::uint32_t s = 0; s < object.obstacles().size(); ++s) {
    if (const auto rigid = rigid_under(world, state, soft, s))
      held.push_back({object.lattice().surface()[s], voxel::kFirstRigidPartner + *rigid});
  }
  return held;
}

bool has_partner(const std::vector<voxel::HeldVoxel>& held, std::uint32_t partner) {
  return std::any_of(held.begin(), held.end(),
                     [partner](const voxel::HeldVoxel& h) { return h.partner == partner; });
}

// Adds the forces of anchors and rigid objects on a soft object whose contact is on patches. Patches know
// only the forces of springs. If links are at their limits, these forces count only if they balance.
void add_supports_of_patches(const World& world, const WorldState& state, std::uint32_t soft,
                             std::vector<PairForce>& out) {
  const voxel::SoftObject& object = *state.soft[soft];
  const voxel::CompositeGrid& patches = *object.patches_in_use();
  const glm::dquat& rotation = world.soft[soft].pose.rotation;
  out.push_back({{Kind::anchors, soft, 0}, rotation * -patches.force_on_anchors_N(), true});
  std::vector<std::optional<glm::dvec3>> by_rigid(world.rigid.size());
  const double look_m = kObstacleRange * object.lattice().max_spacing_m();
  for (const voxel::CompositeGrid::ObstacleForce& force : patches.obstacle_forces()) {
    const voxel::VoxelId v = object.lattice().surface()[force.surface_number];
    const NearestRigid near =
        nearest_rigid(world, state, world.soft[soft].to_scene(object.position(v)), look_m);
    if (!near.found) continue;
    auto& sum_N = by_rigid[near.object];
    sum_N = sum_N.value_or(glm::dvec3(0.0)) + rotation * force.on_object_N;
  }
  for (std::uint32_t r = 0; r < by_rigid.size(); ++r) {
    if (by_rigid[r]) out.push_back({{Kind::rigid, soft, r}, by_rigid[r], true});
  }
}

// Adds the forces of anchors and rigid objects on one soft object.
void add_supports(const World& world, const WorldState& state, std::uint32_t soft, const glm::dvec3& hand_N,
                  std::vector<PairForce>& out) {
  const voxel::SoftObject& object = *state.soft[soft];
  const glm::dquat& rotation = world.soft[soft].pose.rotation;
  if (object.uses_patches()) {
    if (object.patches_in_use() != nullptr) add_supports_of_patches(world, state, soft, out);
    return;
  }
  const auto held = held_voxels(world, state, soft);
  if (held.empty()) return;
  const std::size_t partners = voxel::kFirstRigidPartner + world.rigid.size();
  const bool blocks = object.lattice().block_count() > 0;
  const auto loads = blocks
                         ? std::vector<voxel::PartnerLoad>(partners, {.known = false})
                         : voxel::loads_by_partner(object, held, partners, glm::inverse(rotation) * hand_N);
  for (std::uint32_t p = voxel::kAnchorPartner; p < partners; ++p) {
    if (!has_partner(held, p)) continue;
    PairForce force{p == voxel::kAnchorPartner ? ObjectPair{Kind::anchors, soft, 0}
                                               : ObjectPair{Kind::rigid, soft, p - voxel::kFirstRigidPartner},
                    {},
                    false};
    if (loads[p].known) force.on_soft_N = rotation * loads[p].force_N;
    force.through_limits = loads[p].through_limits;
    out.push_back(force);
  }
}

// Adds the forces between soft objects. Each pair is added once, by its first object.
void add_soft_pairs(const World& world, const WorldState& state, std::vector<PairForce>& out) {
  for (std::uint32_t m = 0; m < world.soft_pairs.size(); ++m) {
    const auto [a, b] = world.soft_pairs[m];
    bool touch = false;
    glm::dvec3 on_second_N(0.0);
    for (const FacetContact& contact : state.facet_contacts) {
      if (contact.soft_pair != m || !contact.held) continue;
      touch = true;
      on_second_N += contact.pressed.force_N;
      for (std::size_t i = 0; i < contact.extra_count; ++i) on_second_N += contact.extra_facets[i].force_N;
    }
    if (!touch) continue;
    PairForce force{{Kind::soft, a, b}, {}, false};
    if (state.soft[a]->lattice().block_count() == 0 && state.soft[b]->lattice().block_count() == 0)
      force.on_soft_N = -on_second_N;
    out.push_back(force);
  }
}

ForceBalance balance_of(std::uint32_t soft, const glm::dvec3& hand_N, const std::vector<PairForce>& pairs) {
  ForceBalance balance{.hand_N = hand_N, .largest_N = glm::length(hand_N), .sum_N = {}};
  glm::dvec3 sum_N = hand_N;
  bool known = true;
  for (const PairForce& force : pairs) {
    const bool second = force.pair.kind == Kind::soft && force.pair.other == soft;
    if (force.pair.soft != soft && !second) continue;
    known = known && force.on_soft_N.has_value();
    const glm::dvec3 on_it_N = (second ? -1.0 : 1.0) * force.on_soft_N.value_or(glm::dvec3(0.0));
    sum_N += on_it_N;
    balance.largest_N = std::max(balance.largest_N, glm::length(on_it_N));
  }
  if (known) balance.sum_N = glm::length(sum_N);
  return balance;
}

// If the forces on an object do not balance, those that links at their limits may carry become unknown.
void take_back_unbalanced(std::uint32_t soft, const ForceBalance& balance, std::vector<PairForce>& pairs) {
  if (balance.sum_N && *balance.sum_N <= std::max(kBalanced * balance.largest_N, kBalanced_N)) return;
  for (PairForce& force : pairs) {
    if (force.pair.soft == soft && force.through_limits) force.on_soft_N.reset();
  }
}

}  // namespace

ForcesBetween forces_between(const World& world, const WorldState& state) {
  ForcesBetween forces;
  const auto hand_N = [&](std::size_t soft) { return -state.feel[world.rigid.size() + soft].on_hand_N; };
  for (std::uint32_t o = 0; o < state.soft.size(); ++o)
    add_supports(world, state, o, hand_N(o), forces.pairs);
  add_soft_pairs(world, state, forces.pairs);
  for (std::uint32_t o = 0; o < state.soft.size(); ++o)
    take_back_unbalanced(o, balance_of(o, hand_N(o), forces.pairs), forces.pairs);
  for (std::uint32_t o = 0; o < state.soft.size(); ++o)
    forces.balance.push_back(balance_of(o, hand_N(o), forces.pairs));
  return forces;
}

// The course of a pair. A pair that touches for the first time gets a new one, in the order of objects.
PairCourse& ForcesCourse::course_of(const ObjectPair& pair) {
  const auto order = [](const ObjectPair& p) { return std::tuple(p.soft, p.kind, p.other); };
  const auto at = std::find_if(pairs.begin(), pairs.end(),
                               [&](const PairCourse& course) { return order(pair) <= order(course.pair); });
  if (at != pairs.end() && at->pair == pair) return *at;
  PairCourse fresh{.pair = pair};
  if (keep_every) fresh.every_N.assign(samples, 0.0);
  return *pairs.insert(at, std::move(fresh));
}

void ForcesCourse::add(const ForcesBetween& now, double t_s) {
  ++samples;
  end_t_s = t_s;
  end_balance = now.balance;
  for (PairCourse& course : pairs) {
    course.end_on_soft_N = glm::dvec3(0.0);
    if (keep_every) course.every_N.push_back(0.0);
  }
  for (const PairForce& force : now.pairs) {
    PairCourse& course = course_of(force.pair);
    ++course.samples;
    course.end_on_soft_N = force.on_soft_N;
    const double size_N =
        force.on_soft_N ? glm::length(*force.on_soft_N) : std::numeric_limits<double>::quiet_NaN();
    if (keep_every) course.every_N.back() = size_N;
    if (!force.on_soft_N) continue;
    ++course.known_samples;
    if (size_N <= course.max_N) continue;
    course.max_N = size_N;
    course.max_t_s = t_s;
  }
}

}  // namespace hybrid
