// SPDX-License-Identifier: GPL-3.0-or-later
// Bounds of the displacement of each surface voxel, by the chains of links from the anchors.
#pragma once

#include <array>
#include <vector>

#include "voxel/lattice/lattice.h"

namespace voxel {

// Greatest size of a voxel's displacement on each axis (m), with all links of the shortest chain to an anchor
// at their limits. [axis][0: of negative, 1: of positive displacements]; infinite without such a chain.
using ChainExtension = std::array<std::array<float, 2>, 3>;

// By surface number. Allocates.
std::vector<ChainExtension> chains_to_anchors(const Lattice& lattice);

}  // namespace voxel
