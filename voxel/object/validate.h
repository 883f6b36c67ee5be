// SPDX-License-Identifier: GPL-3.0-or-later
// Invariants of a whole lattice and of its state; for tests, far too slow for a tick.
#pragma once

#include <string>

#include "voxel/lattice/displacement.h"
#include "voxel/lattice/lattice.h"

namespace voxel {

// Both functions return the first violation in words, or an empty string. This one checks that the border is
// empty, rows and surface are counted right, and only voxels are anchored.
std::string validate(const Lattice& lattice);
// Checks three things. Displacements are finite, and 0 at anchors and where there is no voxel. Roles are
// valid and counted right by row. No link exceeds its limits by more than `roundings` times half the last bit
// of the largest displacement on its axis. The check of links fails while a chain with a budget is
// unfinished.
std::string validate(const Lattice& lattice, const Displacement& state, double roundings);

}  // namespace voxel
