// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/tick/forces_by_object.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace hybrid {
namespace {

// Stiffness of tissue that stopped the tool (unit: the tool's stiffness). It is so large that the tissue
// counts as rigid beside tissue that gives way.
constexpr double kJammedStiffness = 1e3;
// Stiffness added for any object near the tool (unit: the tool's stiffness). It is less than that of a
// pressed voxel. It makes the sum of stiffnesses regular, so that every part of the force belongs to an
// object.
constexpr double kLeastStiffness = 1e-6;

}  // namespace

void split_by_object(const World& world, WorldState& state, const glm::dvec3& soft_N) noexcept {
  const std::size_t rigid = world.rigid.size();
  for (std::size_t o = 0; o < rigid; ++o) state.feel[o].on_hand_N = state.rigid_force_N[o];
  glm::dvec3 left_N = soft_N;
  glm::dmat3 all(0.0);
  auto& stiffness = state.scratch.soft_stiffness;
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    state.feel[rigid + o].on_hand_N = state.reactions[o].force_N;
    left_N -= state.reactions[o].force_N;
    stiffness[o] = state.reactions[o].stiffness_N_per_m;
  }
  for (const polygon::ContactPlane& plane : state.scratch.stops) {
    stiffness[plane.object - rigid] +=
        kJammedStiffness * coupling_N_per_m(world, state) * glm::outerProduct(plane.normal, plane.normal);
  }
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    if (!state.soft[o]->touched().empty())
      stiffness[o] += glm::dmat3(kLeastStiffness * coupling_N_per_m(world, state));
    all += stiffness[o];
  }
  if (all != glm::dmat3(0.0)) {
    const glm::dvec3 way = glm::inverse(all) * left_N;
    for (std::size_t o = 0; o < state.soft.size(); ++o) state.feel[rigid + o].on_hand_N += stiffness[o] * way;
  }
  for (std::size_t o = 0; o < state.feel.size(); ++o) {
    ObjectFeel& feel = state.feel[o];
    feel.force_N = glm::length(feel.on_hand_N);
    feel.contact = o < rigid ? feel.force_N > 0.0 : state.reactions[o - rigid].force_N != glm::dvec3(0.0);
  }
  for (const polygon::ContactPlane& plane : state.scratch.stops) state.feel[plane.object].contact = true;
}

}  // namespace hybrid
