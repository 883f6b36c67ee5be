// SPDX-License-Identifier: GPL-3.0-or-later
// Looks at the whole of a soft object for anything that should never be; for tests, far too slow for a tick.
#pragma once

#include <string>

#include "voxel/lattice/displacement.h"
#include "voxel/lattice/lattice.h"

namespace voxel {

// What is wrong, in words, the first thing that is found; empty: nothing.
// That the border is empty, that rows and surface are counted right, that only voxels are anchored.
std::string validate(const Lattice& lattice);
// That displacements are finite, 0 where there is no voxel or an anchored one, that roles are those of voxels
// and counted right by row, and that no link is beyond its limits by more than `roundings` times half the
// last bit of the largest displacement on its axis. What a chain with a budget still owes is beyond.
std::string validate(const Lattice& lattice, const Displacement& state, double roundings);

}  // namespace voxel
