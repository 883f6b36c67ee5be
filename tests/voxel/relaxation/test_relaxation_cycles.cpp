// SPDX-License-Identifier: GPL-3.0-or-later
// Relaxation in cycles that are split, ended early or limited. Such cycles must reach the same equilibrium as
// whole cycles, and the optimum within limits.
#include <gtest/gtest.h>
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <iostream>
#include "tests/voxel/fixtures/direct_solution.h"
#include "tests/voxel/fixtures/lattice_scenes.h"
#include "tests/voxel/relaxation/relaxation_problems.h"
#include "voxel/chain/chainmail.h"
#include "voxel/relaxation/relaxation.h"

namespace {

using tests::block;
using tests::elastic;
using tests::energy_of;
using tests::hold;
using tests::largest;
using tests::Problem;
using tests::problem_of;
using tests::relax;
using tests::voxel_at;
using voxel::Displacement;
using voxel::Lattice;
using voxel::LatticeOptions;
using voxel::LinkMaterial;
using voxel::Relaxation;
using voxel::VoxelId;

// The imprint of a ball on top of a block. `apart`: the relaxation is left to a shadow.
struct Print {
  Print(const Lattice& lattice, bool apart) : state(lattice), relaxation(lattice) {
    if (apart) relaxation.leave_to_shadow();
    relaxation.mark_all_dirty();
    relaxation.wake();
    const auto& dims = lattice.grid().dims;
    for (int j = -4; j <= 4; ++j) {
      for (int i = -4; i <= 4; ++i) {
        if (i * i + j * j > 16) continue;
        const VoxelId v = voxel_at(lattice, dims[0] / 2 + i, dims[1] / 2 + j, dims[2] - 1);
        hold(state, held, v, {0.0, 0.0, -4e-4 + 2e-5 * (i * i + j * j)});
      }
    }
  }
  Displacement state;
  Relaxation relaxation;
  std::vector<VoxelId> held;
};

TEST(Relaxation, ACycleInPartsEndsWhereAWholeOneDoes) {
  const LatticeOptions options = tests::made_of(elastic(1e4, 0.3));
  const Lattice lattice(block({45, 43, 40}, glm::dvec3(1e-3)), options);
  for (const bool apart : {false, true}) {
    Print whole(lattice, apart);
    std::size_t work = 0;
    for (int n = 0; n < 3; ++n)
      work = whole.relaxation.relax_contact(whole.state, {}, whole.held, whole.held);
    EXPECT_FALSE(whole.relaxation.under_way());
    for (const std::size_t at_once : {std::size_t{0}, std::size_t{1}, work / 5, work / 2, work - 1, work}) {
      Print parts(lattice, apart);
      for (int n = 0; n < 3; ++n) {
        std::size_t done =
            parts.relaxation.relax_contact(parts.state, {}, parts.held, parts.held, false, at_once);
        EXPECT_EQ(parts.relaxation.under_way(), at_once < work);
        while (parts.relaxation.under_way())
          done += parts.relaxation.continue_contact(parts.state, {}, parts.held, at_once);
        EXPECT_EQ(done, work);
      }
      for (std::size_t axis = 0; axis < 3; ++axis)
        EXPECT_EQ(parts.state.u[axis], whole.state.u[axis]) << at_once << " of " << work << " at once";
    }
  }
}

// A cycle that ends early leaves its remaining part to the next cycle.
TEST(Relaxation, CyclesThatEndHalfWayComeToTheSameRest) {
  const LatticeOptions options = tests::made_of(elastic(1e4, 0.3));
  const Lattice lattice(block({29, 27, 24}, glm::dvec3(1e-3)), options);
  Print expected(lattice, false), halves(lattice, false);
  for (int n = 0; n < 60; ++n) expected.relaxation.run_cycle(expected.state, {}, expected.held);
  for (int n = 0; n < 120; ++n) {
    halves.relaxation.relax_contact(halves.state, {}, halves.held, halves.held, false, 1000);
    EXPECT_TRUE(halves.relaxation.under_way());
    halves.relaxation.end_contact();
    halves.relaxation.run_cycle(halves.state, {}, halves.held);
  }
  const double energy = energy_of(lattice, options, expected.state);
  EXPECT_NEAR(energy_of(lattice, options, halves.state), energy, 1e-6 * energy);
}

// ---- limits ----

struct Tight {
  const char* name;
  LinkMaterial material;
  double depth;  // of the pressed patch, in spacings
};

TEST(Relaxation, WhereLimitsHoldTheStateIsTheOptimumOfTheProgram) {
  const Tight rows[] = {
      {"wide", {.young_Pa = 1e4, .stretch_min = 0.4, .stretch_max = 1.6, .shear = 0.6}, 1.5},
      {"narrow", {.young_Pa = 1e4, .stretch_min = 0.8, .stretch_max = 1.2, .shear = 0.2}, 1.2},
      {"tight", {.young_Pa = 1e4, .stretch_min = 0.9, .stretch_max = 1.1, .shear = 0.1}, 0.8}};
  for (const Tight& row : rows) {
    const Lattice lattice(block({11, 11, 11}, glm::dvec3(1e-3)), tests::made_of(row.material));
    const LatticeOptions options = tests::made_of(row.material);
    Displacement state(lattice);
    voxel::ChainMail chain(lattice);
    std::vector<VoxelId> held;
    std::vector<glm::vec3> moves;
    for (int j = 4; j < 7; ++j) {
      for (int i = 4; i < 7; ++i) {
        hold(state, held, voxel_at(lattice, i, j, 10), {0.0, 0.0, -row.depth * 1e-3});
        moves.emplace_back(0.0F, 0.0F, static_cast<float>(-row.depth * 1e-3));
      }
    }
    chain.settle(state, held, moves, {});
    Relaxation relaxation(lattice);
    relaxation.mark_all_dirty();
    relaxation.wake();
    int cycles = 0;
    for (; cycles < 3000 && !relaxation.asleep(); ++cycles) {
      const auto number = relaxation.cycles();
      while (relaxation.cycles() == number) {
        relaxation.run(state, {}, held, 100'000);
        ASSERT_LE(voxel::worst_violation(lattice, state), 1e-9) << row.name;
      }
    }
    EXPECT_TRUE(relaxation.asleep()) << row.name;

    // First-order conditions for each voxel: a residual may remain only in a direction that a link at its
    // limit blocks.
    double unopposed = 0.0;
    std::size_t at_limit = 0;
    for (std::size_t i = 0; i < lattice.size(); ++i) {
      const auto v = static_cast<VoxelId>(i);
      if (!lattice.filled(v) || lattice.anchored(v) || state.role[v] == Displacement::held) continue;
      const glm::dvec3 force = voxel::link_force(lattice, state, v);
      for (int axis = 0; axis < 3; ++axis) {
        glm::dvec3 wanted = state.at(v);
        wanted[axis] += force[axis] > 0.0 ? 1e-3 : -1e-3;
        const glm::dvec3 allowed = voxel::clamp_to_links(lattice, state, v, wanted);
        if (std::fabs(allowed[axis] - state.at(v)[axis]) > 1e-7) {
          unopposed = std::max(unopposed, std::fabs(force[axis]));
        } else {
          ++at_limit;
        }
      }
    }
    // Compares the energy with that of the optimum.
    Problem p = problem_of(lattice, options, state, 2);
    const double found = tests::energy_of(p);
    tests::solve_with_limits(p, 1e-3);
    const double optimum = tests::energy_of(p);
    std::cout << row.name << ": " << cycles << " cycles, " << at_limit
              << " voxels held by limits, largest force on another " << unopposed / lattice.force_scale_N()
              << " of the force scale, energy " << 100 * (found / optimum - 1) << " % above the optimum\n";
    EXPECT_LE(unopposed, 1e-4 * lattice.force_scale_N()) << row.name;
    EXPECT_GE(found, optimum * (1 - 1e-4));
    EXPECT_LE(found, optimum * 1.01) << row.name;
  }
}

// ---- work ----

TEST(Relaxation, AFreshObjectSleeps) {
  const Lattice lattice(block({4, 4, 4}, glm::dvec3(1e-3)), tests::made_of(LinkMaterial{}));
  Displacement state(lattice);
  Relaxation relaxation(lattice);
  EXPECT_TRUE(relaxation.asleep());
  EXPECT_EQ(relaxation.run(state, {}, {}, 1000), 0U);
  relaxation.mark_all_dirty();
  relaxation.wake();
  EXPECT_LE(relax(relaxation, state, {}), 2);
  EXPECT_TRUE(relaxation.asleep());
  for (const auto& axis : state.u) {
    for (const float u : axis) ASSERT_EQ(u, 0.0F);
  }
}

}  // namespace
