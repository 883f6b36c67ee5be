// SPDX-License-Identifier: GPL-3.0-or-later
// Prescribed displacements, and the energy of a state, for the tests of relaxation.
#pragma once

#include <gtest/gtest.h>
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <iostream>
#include "tests/voxel/fixtures/direct_solution.h"
#include "tests/voxel/fixtures/lattice_scenes.h"
#include "voxel/chain/chainmail.h"
#include "voxel/relaxation/relaxation.h"

namespace tests {

// Sets voxel `v` to the displacement `u` and holds it there.
inline void hold(voxel::Displacement& state, std::vector<voxel::VoxelId>& held, voxel::VoxelId v,
                 const glm::dvec3& u) {
  state.set(v, u);
  state.set_role(v, voxel::Displacement::held);
  held.push_back(v);
}

// Runs cycles until the object sleeps. Returns the number of cycles.
inline int relax(voxel::Relaxation& relaxation, voxel::Displacement& state,
                 const std::vector<voxel::VoxelId>& held, int most = 2000) {
  relaxation.mark_all_dirty();
  relaxation.wake();
  int cycles = 0;
  while (!relaxation.asleep() && cycles < most) {
    const auto before = relaxation.cycles();
    while (relaxation.cycles() == before) relaxation.run(state, {}, held, 100'000);
    ++cycles;
  }
  return cycles;
}

inline double largest(const std::vector<double>& values) {
  double most = 0.0;
  for (const double x : values) most = std::max(most, std::fabs(x));
  return most;
}

inline double energy_of(const voxel::Lattice& lattice, const voxel::LatticeOptions& options,
                        const voxel::Displacement& state) {
  double energy = 0.0;
  for (int axis = 0; axis < 3; ++axis) energy += tests::energy_of(problem_of(lattice, options, state, axis));
  return energy;
}

}  // namespace tests
