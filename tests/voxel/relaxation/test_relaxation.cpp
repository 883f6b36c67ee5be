// SPDX-License-Identifier: GPL-3.0-or-later
// Relaxation against direct solutions: of the linear problem where no limit is near, of the quadratic program
// where limits hold.
#include "voxel/relaxation/relaxation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <iostream>

#include "tests/voxel/fixtures/direct_solution.h"
#include "tests/voxel/fixtures/lattice_scenes.h"
#include "voxel/chain/chainmail.h"

namespace {

using tests::block;
using tests::elastic;
using tests::Problem;
using tests::problem_of;
using tests::Random;
using tests::voxel_at;
using tests::voxel_of;
using voxel::Displacement;
using voxel::LabelVolume;
using voxel::Lattice;
using voxel::LatticeOptions;
using voxel::LinkMaterial;
using voxel::Relaxation;
using voxel::VoxelId;

// ---- scenes ----

// What of a random volume hangs together with voxel (0,0,0), which is anchored.
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

// BoundarySprings `v` at `u`, and tells the relaxation.
void hold(Displacement& state, std::vector<VoxelId>& held, VoxelId v, const glm::dvec3& u) {
  state.set(v, u);
  state.set_role(v, Displacement::held);
  held.push_back(v);
}

// Cycles until it sleeps; counts them.
int relax(Relaxation& relaxation, Displacement& state, const std::vector<VoxelId>& held, int most = 2000) {
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

double largest(const std::vector<double>& values) {
  double most = 0.0;
  for (const double x : values) most = std::max(most, std::fabs(x));
  return most;
}

// Error of the state against the direct solution, of the largest displacement.
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

// Displacements are floats: where some links are a hundred times stiffer, the rounding of their ends pulls a
// hundred times harder, and neither residual nor error get as small.
struct Pressed {
  const char* name;
  double rounding;  // by how much it is worse than in a homogeneous block
  LabelVolume volume;
  LatticeOptions options;
};

// Blocks with a patch of the top pressed in and sheared: homogeneous, layered, with a stiff inclusion, and
// flat cells.
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

double energy_of(const Lattice& lattice, const LatticeOptions& options, const Displacement& state) {
  double energy = 0.0;
  for (int axis = 0; axis < 3; ++axis) energy += tests::energy_of(problem_of(lattice, options, state, axis));
  return energy;
}

// Relaxes 60 random scenes from torn starts. Links never leave their limits on the way. Returns the largest
// ratio of the energies after and before a cycle, and expects each scene to end with less than it began with.
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
    // Anywhere within the limits: where the chain ends up after being torn about.
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
        // Not only at its end: never.
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

// With links at their limits a correction is clipped, and a cycle is no descent step any more: some of the
// energy may come back on the way. What is relied on is that it ends far below its start.
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
    // It is measured after the first smoothing of a cycle: about what there was before it.
    for (int cycle = 0; cycle < 8; ++cycle) {
      const double before = largest_force();
      relaxation.run_cycle(state, {}, held);
      EXPECT_LE(relaxation.residual_N(), 2.0 * before) << p.name;
    }
    // At rest it is below the tolerance, and so is what is really left.
    relax(relaxation, state, held);
    ASSERT_TRUE(relaxation.asleep());
    const double resting = voxel::kRestingResidual * lattice.force_scale_N() * p.rounding;
    EXPECT_LT(relaxation.residual_N(), resting) << p.name;
    EXPECT_LT(largest_force(), 2 * resting) << p.name;
    EXPECT_EQ(relaxation.run(state, {}, held, 1'000'000), 0U);
  }
}

// A porous ball on a thin stem, pressed at its top: it hangs by little, so that coarse levels have much to
// say, and cells beside a cycle's box that kept theirs to themselves fed energy to it, cycle by cycle.
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

// A ball's print on top of a block that something else relaxes, or nothing else.
struct Print {
  Print(const Lattice& lattice, bool apart) : state(lattice), relaxation(lattice) {
    if (apart) relaxation.leave_to_another();
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

// What one leaves undone, the next begins with.
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
  double depth;  // in spacings
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

    // First order, voxel by voxel: a force is left only where a link at its limit stands against it.
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
    // And as a whole: its energy beside the optimum's.
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

TEST(Relaxation, WorkIsBoundedAndCutsChangeNoBit) {
  const Pressed p = pressed_blocks()[1];
  const Lattice lattice(p.volume, p.options);
  // What a call may spend beyond what was granted so far: a cycle round one tile, which is not cut.
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
