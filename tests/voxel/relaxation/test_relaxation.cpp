// SPDX-License-Identifier: GPL-3.0-or-later
// Relaxation against direct solutions. Without active limits the reference solves a linear problem, with
// active limits a quadratic program.
#include "voxel/relaxation/relaxation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <iostream>

#include "tests/voxel/fixtures/direct_solution.h"
#include "tests/voxel/fixtures/lattice_scenes.h"
#include "tests/voxel/relaxation/relaxation_problems.h"
#include "voxel/chain/chainmail.h"

namespace {

using tests::block;
using tests::elastic;
using tests::energy_of;
using tests::hold;
using tests::largest;
using tests::Problem;
using tests::problem_of;
using tests::Random;
using tests::relax;
using tests::voxel_at;
using tests::voxel_of;
using voxel::Displacement;
using voxel::LabelVolume;
using voxel::Lattice;
using voxel::LatticeOptions;
using voxel::Relaxation;
using voxel::VoxelId;

// ---- scenes ----

// The component of a random volume that contains voxel (0,0,0), which is anchored.
LabelVolume connected_to_origin(LabelVolume volume) {
  std::vector<std::uint8_t> seen(volume.labels.size(), 0);
  std::vector<std::array<int, 3>> front{{0, 0, 0}};
  volume.labels[0] = 1;
  seen[0] = 1;
  while (!front.empty()) {
    const auto c = front.back();
    front.pop_back();
    for (std::size_t d = 0; d < 3; ++d) {
      for (const int step : {-1, 1}) {
        auto n = c;
        n[d] += step;
        if (n[d] < 0 || n[d] >= volume.dims[d]) continue;
        const std::size_t i = volume.index(n[0], n[1], n[2]);
        if (volume.labels[i] == 0 || seen[i] != 0) continue;
        seen[i] = 1;
        front.push_back(n);
      }
    }
  }
  for (std::size_t i = 0; i < seen.size(); ++i)
    volume.labels[i] = seen[i] != 0 ? volume.labels[i] : std::uint8_t{0};
  return volume;
}

// Largest error of the state against the direct solution, relative to the largest displacement.
double error_without_limits(const Lattice& lattice, const LatticeOptions& options,
                            const Displacement& state) {
  double worst = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    Problem p = problem_of(lattice, options, state, axis);
    const std::vector<double> found = p.u;
    tests::solve_without_limits(p);
    for (std::size_t v = 0; v < found.size(); ++v) {
      worst = std::max(worst, std::fabs(found[v] - p.u[v]) / std::max(largest(p.u), 1e-30));
    }
  }
  return worst;
}

TEST(Relaxation, ConvergesToTheDirectSolutionOnIrregularVolumes) {
  Random random(21);
  double worst = 0.0;
  int most_cycles = 0;
  for (int n = 0; n < 60; ++n) {
    auto scene = tests::random_scene(random);
    scene.volume = connected_to_origin(scene.volume);
    scene.options.anchor_voxels = {0};
    for (std::size_t label = 1; label <= 4; ++label) {
      scene.options.materials[label] = elastic(random.between(1e3, 3e4), random.between(0.0, 0.45));
    }
    const Lattice lattice(scene.volume, scene.options);
    Displacement state(lattice);
    std::vector<VoxelId> held;
    for (const std::size_t index : scene.filled) {
      const VoxelId v = voxel_of(lattice, scene.volume, index);
      if (!lattice.filled(v) || lattice.anchored(v) || random.unit() > 0.05) continue;
      const double h = 0.3 * lattice.min_spacing_m();
      hold(state, held, v, {random.between(-h, h), random.between(-h, h), random.between(-h, h)});
    }
    if (held.empty()) continue;
    Relaxation relaxation(lattice);
    relaxation.set_tolerance(1e-8 * lattice.force_scale_N());
    most_cycles = std::max(most_cycles, relax(relaxation, state, held));
    EXPECT_TRUE(relaxation.asleep()) << "scene " << n;
    const double error = error_without_limits(lattice, scene.options, state);
    EXPECT_LE(error, 1e-4) << "scene " << n;
    worst = std::max(worst, error);
  }
  std::cout << "largest error " << worst << " of the largest displacement; at most " << most_cycles
            << " cycles\n";
}

// A pressed block. Its displacements are floats. If some links are a hundred times stiffer, rounding of their
// ends causes forces a hundred times larger. Then neither the residual nor the error becomes as small.
struct Pressed {
  const char* name;
  double rounding;  // factor of the rounding error, relative to a homogeneous block
  LabelVolume volume;
  LatticeOptions options;
};

// Blocks for a test that presses and shears a patch of the top: homogeneous, layered, with a stiff inclusion,
// or with flat cells.
std::vector<Pressed> pressed_blocks() {
  std::vector<Pressed> blocks;
  const auto add = [&](const char* name, const glm::dvec3& spacing, auto label, double rounding = 1.0) {
    Pressed p{name, rounding, block({21, 19, 16}, spacing), {}};
    for (int k = 0; k < 16; ++k) {
      for (int j = 0; j < 19; ++j) {
        for (int i = 0; i < 21; ++i) p.volume.labels[p.volume.index(i, j, k)] = label(i, j, k);
      }
    }
    p.options.anchor_faces = {"-z"};
    p.options.materials[1] = elastic(1e4, 0.3);
    p.options.materials[2] = elastic(3e4, 0.45);
    p.options.materials[3] = elastic(1e3, 0.0);
    p.options.materials[4] = elastic(1e6, 0.3);
    blocks.push_back(std::move(p));
  };
  const auto one = [](int, int, int) { return std::uint8_t{1}; };
  add("homogeneous", glm::dvec3(1e-3), one);
  add("layers 10, 30 and 1 kPa", glm::dvec3(1e-3), [](int, int, int k) {
    return static_cast<std::uint8_t>(k < 6 ? 1 : k < 11 ? 2 : 3);
  });
  const auto inclusion = [](int i, int j, int k) {
    return static_cast<std::uint8_t>(i > 6 && i < 14 && j > 5 && j < 13 && k > 6 && k < 12 ? 4 : 1);
  };
  add("an inclusion 100 times stiffer", glm::dvec3(1e-3), inclusion, 5.0);
  add("spacing 1 x 1 x 2.5 mm", {1e-3, 1e-3, 2.5e-3}, one);
  add("spacing 0.4 x 1 x 1.6 mm", {0.4e-3, 1e-3, 1.6e-3}, one);
  return blocks;
}

std::vector<VoxelId> press_patch(const Lattice& lattice, Displacement& state, const glm::dvec3& u) {
  std::vector<VoxelId> held;
  for (int j = 7; j < 12; ++j) {
    for (int i = 8; i < 13; ++i) hold(state, held, voxel_at(lattice, i, j, 15), u);
  }
  return held;
}

TEST(Relaxation, ConvergesToTheDirectSolutionUnderAPressedPatch) {
  for (const Pressed& p : pressed_blocks()) {
    const Lattice lattice(p.volume, p.options);
    Displacement state(lattice);
    const auto held = press_patch(lattice, state, glm::dvec3(0.05, 0.0, -0.3) * lattice.min_spacing_m());
    Relaxation relaxation(lattice);
    relaxation.set_tolerance(1e-8 * lattice.force_scale_N());
    const int cycles = relax(relaxation, state, held);
    EXPECT_TRUE(relaxation.asleep());
    const double error = error_without_limits(lattice, p.options, state);
    std::cout << p.name << ": " << cycles << " cycles, error " << error << " of the largest displacement\n";
    EXPECT_LE(error, 1e-4 * p.rounding) << p.name;
  }
}

// Relaxes 60 random scenes from random starts within limits. No link may leave its limits meanwhile. Returns
// the largest ratio of the energies after and before a cycle. Expects that each scene ends with at most 6 %
// of its initial energy.
double largest_growth(bool limits_act) {
  Random random(22);
  double worst = 0.0;
  for (int n = 0; n < 60; ++n) {
    auto scene = tests::random_scene(random);
    scene.volume = connected_to_origin(scene.volume);
    scene.options.anchor_voxels = {0};
    if (!limits_act) {
      for (auto& m : scene.options.materials) {
        m.stretch_min = 1e-3;
        m.stretch_max = 1e3;
        m.shear = 1e3;
      }
    }
    const Lattice lattice(scene.volume, scene.options);
    // a random state within the limits, which the chain makes
    Displacement state(lattice);
    voxel::ChainMail chain(lattice);
    for (int pull = 0; pull < 6; ++pull) {
      const VoxelId v = voxel_of(
          lattice, scene.volume,
          scene.filled[static_cast<std::size_t>(random.below(static_cast<int>(scene.filled.size())))]);
      if (!lattice.filled(v) || lattice.anchored(v)) continue;
      const double far = limits_act ? 4.0 : 0.2;
      const glm::vec3 move(random.between(-far, far) * lattice.min_spacing_m(),
                           random.between(-far, far) * lattice.min_spacing_m(),
                           random.between(-far, far) * lattice.min_spacing_m());
      state.set(v, state.at(v) + glm::dvec3(move));
      chain.settle(state, {&v, 1}, {&move, 1}, {});
    }
    Relaxation relaxation(lattice);
    relaxation.mark_all_dirty();
    relaxation.wake();
    const double start = energy_of(lattice, scene.options, state);
    double before = start;
    const double rounding = 2e-7 * lattice.max_spacing_m() * 10;
    for (int cycle = 0; cycle < 60 && !relaxation.asleep(); ++cycle) {
      const auto number = relaxation.cycles();
      while (relaxation.cycles() == number) {
        relaxation.run(state, {}, {}, 20'000);
        // limits hold at every moment, not only at the end of a cycle
        EXPECT_LE(voxel::worst_violation(lattice, state), rounding) << "scene " << n << ", cycle " << cycle;
      }
      const double energy = energy_of(lattice, scene.options, state);
      if (before > 1e-6 * start) worst = std::max(worst, energy / before);
      before = energy;
    }
    EXPECT_LE(before, 0.06 * start) << "scene " << n;
  }
  std::cout << "largest ratio of the energies after and before a cycle: " << worst << "\n";
  return worst;
}

TEST(Relaxation, EnergyNeverGrows) {
  EXPECT_LE(largest_growth(false), 1.0 + 1e-6);
}

// If links are at their limits, corrections are clipped and a cycle is no longer a descent step. So the
// energy may rise for a moment, but it must end far below its start.
TEST(Relaxation, WithLimitsInTheWayItEndsFarBelowItsStart) {
  EXPECT_LE(largest_growth(true), 1.25);
}

TEST(Relaxation, ItsResidualIsTheLargestForceLeft) {
  for (const Pressed& p : pressed_blocks()) {
    const Lattice lattice(p.volume, p.options);
    Displacement state(lattice);
    const auto held = press_patch(lattice, state, {0.0, 0.0, -0.3 * lattice.min_spacing_m()});
    Relaxation relaxation(lattice);
    relaxation.mark_all_dirty();
    relaxation.wake();
    const auto largest_force = [&] {
      double most = 0.0;
      for (std::size_t i = 0; i < lattice.size(); ++i) {
        const auto v = static_cast<VoxelId>(i);
        if (!lattice.filled(v) || lattice.anchored(v) || state.role[v] == Displacement::held) continue;
        const glm::dvec3 f = glm::abs(voxel::link_force(lattice, state, v));
        most = std::max({most, f.x, f.y, f.z});
      }
      return most;
    };
    // The residual is measured after the first smoothing of a cycle. It is about the residual before the
    // cycle.
    for (int cycle = 0; cycle < 8; ++cycle) {
      const double before = largest_force();
      relaxation.run_cycle(state, {}, held);
      EXPECT_LE(relaxation.residual_N(), 2.0 * before) << p.name;
    }
    // At rest, the reported residual and the true residual are below the tolerance.
    relax(relaxation, state, held);
    ASSERT_TRUE(relaxation.asleep());
    const double resting = voxel::kRestingResidual * lattice.force_scale_N() * p.rounding;
    EXPECT_LT(relaxation.residual_N(), resting) << p.name;
    EXPECT_LT(largest_force(), 2 * resting) << p.name;
    EXPECT_EQ(relaxation.run(state, {}, held, 1'000'000), 0U);
  }
}

// A porous ball on a thin stem, pressed at its top. It is weakly attached, so coarse corrections are large.
// The coarse cells beside a cycle's box must be prolonged too, or the energy grows from cycle to cycle.
TEST(Relaxation, CyclesRoundAContactBetweenTilesEndWhereWholeOnesDo) {
  constexpr int kSize = 48, kWide = 5;
  LabelVolume volume = block({kSize, kSize, kSize}, glm::dvec3(1e-3));
  for (int k = 0; k < kSize; ++k) {
    for (int j = 0; j < kSize; ++j) {
      for (int i = 0; i < kSize; ++i) {
        const double x = i / 2.0, y = j / 2.0, z = k / 2.0, half = kSize / 2.0;
        const double lumps =
            std::sin(x + 0.4 * y + 1.0) + std::sin(y - 0.5 * z + 2.0) + std::sin(z + 0.3 * x + 3.0);
        const double aside = std::hypot(i - half, j - half);
        const bool ball = std::hypot(aside, k - half) < half - 1.0 && lumps > -0.3;
        const bool stem = k < kSize / 6 && aside < kSize / 10.0;
        volume.labels[volume.index(i, j, k)] = ball || stem ? 1 : 0;
      }
    }
  }
  LatticeOptions options = tests::made_of(
      {.young_Pa = 1e4, .poisson = 0.3, .stretch_min = 1e-3, .stretch_max = 100.0, .shear = 100.0});
  const Lattice lattice(volume, options);
  const auto pressed = [&](Displacement& state, std::vector<VoxelId>& held) {
    for (int j = 0; j < kSize; ++j) {
      for (int i = 0; i < kSize; ++i) {
        if (std::hypot(i - kSize / 2, j - kSize / 2) > kWide) continue;
        int k = kSize - 1;
        while (k > kSize / 2 && !lattice.filled(voxel_at(lattice, i, j, k))) --k;
        if (k == kSize / 2) continue;
        hold(state, held, voxel_at(lattice, i, j, k), {0.0, 0.0, -4e-4});
      }
    }
  };
  const auto relaxed = [&](bool tiles) {
    Displacement state(lattice);
    std::vector<VoxelId> held;
    pressed(state, held);
    Relaxation relaxation(lattice);
    relaxation.mark_all_dirty();
    relaxation.wake();
    for (int n = 0; n < 100 && !tiles; ++n) relaxation.run_cycle(state, {}, held);
    for (int n = 0; n < 4000 && tiles; ++n) {
      relaxation.relax_contact(state, {}, held, held);
      relaxation.run(state, {}, held, 4000);
    }
    return energy_of(lattice, options, state);
  };
  const double expected = relaxed(false), found = relaxed(true);
  std::cout << "energy " << found / expected << " times the converged one\n";
  EXPECT_LE(found, 1.02 * expected);
}

TEST(Relaxation, WorkIsBoundedAndCutsChangeNoBit) {
  const Pressed p = pressed_blocks()[1];
  const Lattice lattice(p.volume, p.options);
  // A call may exceed the total budget by a cycle around one tile, which is not interrupted.
  const std::uint64_t a_cycle = 4 * lattice.size();
  Random random(23);
  std::vector<Displacement> ends;
  std::vector<std::uint64_t> cycles;
  for (const int slicing : {0, 1, 2, 3}) {
    Displacement state(lattice);
    const auto held = press_patch(lattice, state, {0.0, 0.0, -0.3 * lattice.min_spacing_m()});
    Relaxation relaxation(lattice);
    relaxation.mark_all_dirty();
    relaxation.wake();
    std::uint64_t granted = 0, all_spent = 0;
    for (int n = 0; n < 10'000'000 && !relaxation.asleep(); ++n) {
      const auto budget = slicing == 0   ? std::uint64_t{1'000'000'000}
                          : slicing == 1 ? std::uint64_t{100}
                          : slicing == 2 ? std::uint64_t{1000}
                                         : static_cast<std::uint64_t>(random.below(20'000));
      granted += budget;
      all_spent += relaxation.run(state, {}, held, budget);
      ASSERT_LE(all_spent, granted + a_cycle);
    }
    ASSERT_TRUE(relaxation.asleep());
    ends.push_back(state);
    cycles.push_back(relaxation.cycles());
  }
  for (std::size_t i = 1; i < ends.size(); ++i) {
    EXPECT_EQ(ends[i].u, ends[0].u);
    EXPECT_EQ(cycles[i], cycles[0]);
  }
}

}  // namespace
