// SPDX-License-Identifier: GPL-3.0-or-later
// Perfect plasticity of a link: tissue that keeps a dent.
//
// On each axis a link is elastic up to the yield strain. The excess becomes its new rest length. The axes are
// independent, like those of the energy and of the limits. A criterion on all three axes (such as von
// Mises's) would couple three problems that are solved separately.
//
// Within a step the offset stays constant. The force is k·elastic, the derivative of a convex energy
// (`link_energy_J`: a parabola continued by straight lines). The energy has a single minimum, which does not
// depend on the path. The offset moves once, when the minimum is reached. An offset that moved earlier would
// keep the strains of a wave that has not spread yet, and the dent would depend on the number of cycles. This
// is the backward Euler step of rate-independent plasticity (Simo & Hughes, Computational Inelasticity, 1998,
// section 1.4). The energy is nowhere more curved than its parabola, so cycles of the elastic problem never
// raise it. The final offset depends on the final strain only, so any number of steps that only load leaves
// the same offset.
#pragma once

#include <algorithm>
#include <concepts>

namespace voxel {

template <std::floating_point T>
struct PlasticLink {
  T elastic;  // elastic part of the difference, which loads the spring (m)
  T offset;   // rest difference from now on (m)
};

// `difference` is u(b) − u(a) on one axis, and `offset` is its rest value so far (both in m). `yield` >= 0 is
// the yield strain times the link's length (m); infinite if the link never yields. The new offset lies
// between the old offset and the difference. The chain's limits are relative to the initial rest length. So
// if the old offset and the difference keep the limits, the unloaded link does too. Without strain beyond
// yield, the offset does not change in any bit.
template <std::floating_point T>
[[nodiscard]] constexpr PlasticLink<T> plastic_link(T difference, T offset, T yield) {
  const T strain = difference - offset;
  const T elastic = std::clamp(strain, -yield, yield);
  return {elastic, offset + (strain - elastic)};
}

// Energy of one link that a step minimises (J): the work from its offset to `difference`, stored or
// dissipated.
template <std::floating_point T>
[[nodiscard]] constexpr T link_energy_J(T stiffness_N_per_m, T difference, T offset, T yield) {
  const T elastic = plastic_link(difference, offset, yield).elastic;
  return stiffness_N_per_m * elastic * (difference - offset - elastic / 2);
}

}  // namespace voxel
