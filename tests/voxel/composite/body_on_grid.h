// SPDX-License-Identifier: GPL-3.0-or-later
// Bodies given voxel by voxel, pressed on a CompositeGrid and compared with its references: a direct
// solution, or a CompositeGrid that has all voxels on level 0.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <iostream>
#include <memory>
#include <utility>

#include "tests/voxel/composite/slack_material.h"
#include "tests/voxel/fixtures/direct_solution.h"
#include "tests/voxel/fixtures/lattice_scenes.h"
#include "voxel/composite/grid.h"

namespace tests {

using voxel::CompositeGrid;
using voxel::Lattice;
using voxel::LinkMaterial;
using voxel::VoxelId;
using Index3 = CompositeGrid::Index3;

// A body that is given voxel by voxel: `filled` and `anchored` decide for each voxel. `tissue` gives its
// Young's modulus in units of 10 kPa; if null, there is one tissue. `adjust` may change the other values of a
// tissue.
struct Body {
  voxel::LatticeOptions options;
  std::shared_ptr<const Lattice> lattice;

  Body(const Index3& dims, double play, const std::function<bool(const Index3&)>& filled,
       const std::function<bool(const Index3&)>& anchored,
       const std::function<int(const Index3&)>& tissue = nullptr,
       const std::function<void(int, LinkMaterial&)>& adjust = nullptr)
      : options(made_of(slack(play), nullptr)) {
    voxel::LabelVolume volume = block(dims, glm::dvec3(kSpacing));
    std::size_t n = 0;
    for (int k = 0; k < dims[2]; ++k) {
      for (int j = 0; j < dims[1]; ++j) {
        for (int i = 0; i < dims[0]; ++i, ++n) {
          volume.labels[n] = filled({i, j, k}) ? 1 : 0;
          if (tissue && volume.labels[n] != 0) {
            volume.labels[n] = static_cast<std::uint8_t>(tissue({i, j, k}));
            LinkMaterial& material = options.materials[volume.labels[n]];
            material.young_Pa = 1e4 * volume.labels[n];
            if (adjust) adjust(volume.labels[n], material);
          }
          if (volume.labels[n] != 0 && anchored({i, j, k})) options.anchor_voxels.push_back(n);
        }
      }
    }
    lattice = std::make_shared<Lattice>(std::move(volume), options);
  }
};

inline bool everywhere(const Index3&) {
  return true;
}
inline bool below(const Index3& p) {
  return p[2] == 0;
}

// A square of voxels of the top, pressed down by `depth` (m).
struct PressedSquare {
  Index3 middle;
  int half;
  double depth;

  template <class Visit>
  void for_voxels(const Visit& visit) const {
    for (int j = -half; j <= half; ++j) {
      for (int i = -half; i <= half; ++i) visit(Index3{middle[0] + i, middle[1] + j, middle[2]});
    }
  }
};

inline void press(CompositeGrid& grid, const PressedSquare& patch, int cycles) {
  for (int n = 0; n < cycles; ++n) {
    grid.clear_pressed();
    patch.for_voxels([&](const Index3& p) {
      grid.press(p, glm::dvec3(0.0, 0.0, -patch.depth), glm::dvec3(0.0, 0.0, -1.0));
    });
    grid.cycle({false, false, true});
  }
}

// Direct solution with the lattice's links and their limits, by sparse Cholesky factorisation and an
// augmented Lagrangian. Here the square sticks to the tool. This makes no difference, because the tissue
// pushes every voxel of the square against the tool.
inline Problem solved_directly(const Body& body, const PressedSquare& patch) {
  voxel::Displacement state(*body.lattice);
  patch.for_voxels([&](const Index3& p) {
    const VoxelId v = body.lattice->at(p[0], p[1], p[2]);
    state.u[2][v] = static_cast<float>(-patch.depth);
    state.set_role(v, voxel::Displacement::held);
  });
  Problem problem = problem_of(*body.lattice, body.options, state, 2);
  solve_with_limits(problem, kSpacing);
  return problem;
}

inline double force_of(const Body& body, const Problem& problem) {
  double force = 0.0;
  for (std::size_t i = 0; i < problem.links.size(); ++i) {
    const Link& l = problem.links[i];
    if (body.lattice->anchored(l.a) == body.lattice->anchored(l.b)) continue;
    const double tension = l.k * (problem.u[l.b] - problem.u[l.a]) + problem.limit_N[i];
    force += body.lattice->anchored(l.a) ? -tension : tension;
  }
  return force;
}

struct Difference {
  double displacement = 0.0, force = 0.0;  // relative to the depth; relative to the force
};
inline Difference compare(const Body& body, const PressedSquare& patch, int half_width) {
  const Problem direct = solved_directly(body, patch);
  CompositeGrid grid(*body.lattice, half_width);
  grid.begin(patch.middle);
  press(grid, patch, 100);
  Difference most;
  for (std::size_t i = 0; i < body.lattice->size(); ++i) {
    const auto v = static_cast<VoxelId>(i);
    if (!body.lattice->filled(v)) continue;
    const double error = std::fabs(grid.at(body.lattice->coordinates(v)).z - direct.u[i]);
    most.displacement = std::max(most.displacement, error / patch.depth);
  }
  const double force = force_of(body, direct);
  most.force = std::fabs(grid.force_on_tool_N().z - force) / force;
  std::cout << "[ measured ] " << force << " N; off by " << most.displacement << " of the depth, "
            << most.force << " of the force; links beyond by " << grid.worst_violation() / kSpacing
            << " spacings\n";
  return most;
}

// Nested patches against all voxels, with a pressed square as large as a tool's contact.
inline double patches_against_all(const Body& body, const PressedSquare& patch, int cycles = 25) {
  CompositeGrid all(*body.lattice, CompositeGrid::kRefineAll), patches(*body.lattice, 10);
  all.begin(patch.middle);
  patches.begin(patch.middle);
  press(all, patch, cycles);
  press(patches, patch, cycles);
  const double share = patches.force_on_tool_N().z / all.force_on_tool_N().z - 1.0;
  std::cout << "[ measured ] " << all.force_on_tool_N().z << " N of all voxels, boxes " << 100.0 * share
            << " %\n";
  return std::fabs(share);
}

}  // namespace tests
