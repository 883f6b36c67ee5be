// SPDX-License-Identifier: GPL-3.0-or-later
// Tissue that keeps its dent: perfect plasticity of a link.
//
// A link's strain, on each axis, is elastic up to the yield strain; what is beyond becomes its new rest
// length. The axes stay apart, as the energy and the limits of the chain do. Rejected: one criterion on the
// length of the three (as von Mises's), which would couple three problems that are solved apart.
//
// Within a step the offset of its beginning stays: the force is k·elastic, the slope of a convex energy
// (`link_energy_J`: a parabola that goes on as straight lines), whose least value is one state and does not
// depend on the way there. The offset is moved once, when that state is reached. Moved on the way instead, it
// would keep the strains of a wave that has not spread yet, and the dent would depend on the number of
// cycles. (The backward Euler step of rate-independent plasticity: Simo & Hughes, Computational Inelasticity,
// 1998, section 1.4.) The energy bends nowhere more than its parabola, so cycles of the elastic problem go
// down in it, never up. And since the offset ends where strain stopped, not where it was looked at, steps
// that only load leave the same offset however many they are.
#pragma once

#include <algorithm>
#include <concepts>

namespace voxel {

template <std::floating_point T>
struct PlasticLink {
  T elastic;  // part of the difference that the spring carries (m)
  T offset;   // rest difference from now on (m)
};

// `difference` = u(b) − u(a) on one axis, `offset` its rest value so far, `yield` >= 0 the yield strain times
// the link's length, infinite where nothing yields (all in m). The new offset lies between the old one and
// the difference: where both keep the chain's limits, which are counted from the first rest length, so does
// the unloaded link. No strain beyond yield: the offset stays to the last bit.
template <std::floating_point T>
[[nodiscard]] constexpr PlasticLink<T> plastic_link(T difference, T offset, T yield) {
  const T strain = difference - offset;
  const T elastic = std::clamp(strain, -yield, yield);
  return {elastic, offset + (strain - elastic)};
}

// What a step minimises, of one link (J): the work that takes it from its offset to `difference`, stored or
// spent.
template <std::floating_point T>
[[nodiscard]] constexpr T link_energy_J(T stiffness_N_per_m, T difference, T offset, T yield) {
  const T elastic = plastic_link(difference, offset, yield).elastic;
  return stiffness_N_per_m * elastic * (difference - offset - elastic / 2);
}

}  // namespace voxel
