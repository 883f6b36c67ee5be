// SPDX-License-Identifier: GPL-3.0-or-later
// CompositeGrid against its reference: the whole lattice at equilibrium within its limits. Small lattices are
// solved directly. For large lattices, nested patches are compared with a CompositeGrid that has all voxels
// on level 0.
#include "voxel/composite/grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <iostream>
#include <memory>

#include "tests/voxel/composite/slack_material.h"
#include "tests/voxel/fixtures/direct_solution.h"
#include "tests/voxel/fixtures/lattice_scenes.h"

namespace {

using tests::block;
using tests::kSpacing;
using tests::made_of;
using tests::slack;
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

bool everywhere(const Index3&) {
  return true;
}
bool below(const Index3& p) {
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

void press(CompositeGrid& grid, const PressedSquare& patch, int cycles) {
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
tests::Problem solved_directly(const Body& body, const PressedSquare& patch) {
  voxel::Displacement state(*body.lattice);
  patch.for_voxels([&](const Index3& p) {
    const VoxelId v = body.lattice->at(p[0], p[1], p[2]);
    state.u[2][v] = static_cast<float>(-patch.depth);
    state.set_role(v, voxel::Displacement::held);
  });
  tests::Problem problem = tests::problem_of(*body.lattice, body.options, state, 2);
  tests::solve_with_limits(problem, kSpacing);
  return problem;
}

double force_of(const Body& body, const tests::Problem& problem) {
  double force = 0.0;
  for (std::size_t i = 0; i < problem.links.size(); ++i) {
    const tests::Link& l = problem.links[i];
    if (body.lattice->anchored(l.a) == body.lattice->anchored(l.b)) continue;
    const double tension = l.k * (problem.u[l.b] - problem.u[l.a]) + problem.limit_N[i];
    force += body.lattice->anchored(l.a) ? -tension : tension;
  }
  return force;
}

struct Difference {
  double displacement = 0.0, force = 0.0;  // relative to the depth; relative to the force
};
Difference compare(const Body& body, const PressedSquare& patch, int half_width) {
  const tests::Problem direct = solved_directly(body, patch);
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

// If level 0 covers the object, the result is the lattice's equilibrium, whatever the object's dimensions.
TEST(CompositeGrid, AllVoxelsAreTheLatticeAtEquilibrium) {
  for (const Index3& dims : {Index3{13, 13, 11}, Index3{12, 15, 10}, Index3{9, 16, 14}}) {
    for (const double depth : {0.3, 1.0}) {
      const Body body(dims, 0.15, everywhere, below);
      const PressedSquare patch{{dims[0] / 2, dims[1] / 2, dims[2] - 1}, 2, depth * kSpacing};
      const Difference d = compare(body, patch, CompositeGrid::kRefineAll);
      EXPECT_LT(d.displacement, 1e-3);
      EXPECT_LT(d.force, 2e-3);
    }
  }
}

TEST(CompositeGrid, AnchorsAreHeldWhereverTheyAre) {
  const Index3 dims{15, 13, 12};
  const PressedSquare patch{{7, 6, 11}, 2, 0.8 * kSpacing};
  const Body sides(dims, 0.2, everywhere,
                   [](const Index3& p) { return p[0] == 0 || p[0] == 14 || p[1] == 0; });
  Difference d = compare(sides, patch, CompositeGrid::kRefineAll);
  EXPECT_LT(d.displacement, 2e-3);
  EXPECT_LT(d.force, 5e-3);
  const Body lump(dims, 0.2, everywhere, [](const Index3& p) { return p[0] < 5 && p[1] > 7 && p[2] < 6; });
  // At the edge of the anchors some links exceed their limits. The grid's bounds do not prevent this.
  d = compare(lump, patch, CompositeGrid::kRefineAll);
  EXPECT_LT(d.displacement, 0.06);
  EXPECT_LT(d.force, 0.03);
}

TEST(CompositeGrid, HolesAndNotchesAreInTheLinks) {
  const Index3 dims{15, 14, 13};
  const PressedSquare patch{{7, 7, 12}, 2, 0.8 * kSpacing};
  const Body hole(
      dims, 0.2, [](const Index3& p) { return std::hypot(p[0] - 7.0, p[2] - 6.0) > 2.5; }, below);
  Difference d = compare(hole, patch, CompositeGrid::kRefineAll);
  EXPECT_LT(d.displacement, 0.01);
  EXPECT_LT(d.force, 0.01);
  const Body notch(
      dims, 0.2, [](const Index3& p) { return p[2] < 8 || p[0] < 11 || p[0] > 11; }, below);
  d = compare(notch, patch, CompositeGrid::kRefineAll);
  EXPECT_LT(d.displacement, 0.02);
  EXPECT_LT(d.force, 0.02);
}

// A plate of single voxels joins two blocks.
TEST(CompositeGrid, SheetsOfSingleVoxelsAreInTheLinks) {
  const auto joined = [](const Index3& p) { return p[2] < 4 || p[2] > 8 || p[0] == 7; };
  const Body body({15, 14, 13}, 0.2, joined, below);
  const Difference d = compare(body, {{7, 7, 12}, 2, 0.8 * kSpacing}, CompositeGrid::kRefineAll);
  EXPECT_LT(d.displacement, 0.02);
  EXPECT_LT(d.force, 0.02);
}

// Layers and lumps of tissues whose stiffnesses differ by factors of 4 to 200. Soft layers between stiff ones
// reach their limits. The depth is a fraction of that at which all links below the square do so.
int stiff_soft_stiff(const Index3& p) {
  return p[2] < 4 || p[2] >= 9 ? 4 : 1;
}
int soft_stiff_soft(const Index3& p) {
  return p[2] < 4 || p[2] >= 9 ? 1 : 10;
}
int stiffer_soft_stiffer(const Index3& p) {
  return p[2] < 4 || p[2] >= 9 ? 10 : 1;
}
int skin_fat_muscle(const Index3& p) {
  return p[2] >= 9 ? 31 : p[2] >= 4 ? 1 : 3;
}
int lumps_of_200(const Index3& p) {
  return ((p[0] + 2) / 5 + (p[1] + 1) / 4 + (p[2] + 2) / 5) % 2 == 0 ? 200 : 1;
}
int lumps(const Index3& p) {
  return 1 + 4 * (((p[0] + 2) / 5 + (p[1] + 1) / 4 + (p[2] + 2) / 5) % 3);
}

TEST(CompositeGrid, SeveralTissuesAreTheLatticeAtEquilibrium) {
  const Index3 dims{13, 13, 13};
  for (const auto& tissue :
       {stiff_soft_stiff, soft_stiff_soft, stiffer_soft_stiffer, lumps, skin_fat_muscle, lumps_of_200}) {
    for (const double depth : {0.3, 0.7, 0.9}) {
      const Body body(dims, 0.15, everywhere, below, tissue);
      const PressedSquare patch{{6, 6, 12}, 2, depth * 0.15 * 12 * kSpacing};
      const Difference d = compare(body, patch, CompositeGrid::kRefineAll);
      EXPECT_LT(d.displacement, 0.01);
      EXPECT_LT(d.force, 0.01);
    }
  }
}

void set_play(LinkMaterial& material, double shorter, double longer, double shear) {
  material.stretch_min = 1.0 - shorter;
  material.stretch_max = 1.0 + longer;
  material.shear = shear;
}

// Tissues whose limits differ, pressed into their limits. The softer tissue has the tighter limits, the
// stiffer one has, or both have the same stiffness.
TEST(CompositeGrid, TissuesWithLimitsOfTheirOwnAreTheLatticeAtEquilibrium) {
  const Index3 dims{13, 13, 13};
  const auto of_soft = [](int label, LinkMaterial& m) { label == 1 ? set_play(m, 0.05, 0.1, 0.08) : void(); };
  const auto of_stiff = [](int label, LinkMaterial& m) {
    label != 1 ? set_play(m, 0.06, 0.03, 0.04) : void();
  };
  const auto of_one_stiffness = [](int label, LinkMaterial& m) {
    m.young_Pa = 1e4;
    if (label != 1) set_play(m, 0.05, 0.05, 0.05);
  };
  for (const auto& tissue : {stiff_soft_stiff, soft_stiff_soft, lumps}) {
    for (const auto& adjust : std::initializer_list<std::function<void(int, LinkMaterial&)>>{
             of_soft, of_stiff, of_one_stiffness}) {
      for (const double depth : {0.3, 0.6}) {
        const Body body(dims, 0.15, everywhere, below, tissue, adjust);
        ASSERT_FALSE(body.lattice->uniform_limits());
        const PressedSquare patch{{6, 6, 12}, 2, depth * 0.08 * 12 * kSpacing};
        const Difference d = compare(body, patch, CompositeGrid::kRefineAll);
        EXPECT_LT(d.displacement, 0.01);
        EXPECT_LT(d.force, 0.01);
      }
    }
  }
}

// Nested patches against all voxels, with a pressed square as large as a tool's contact.
double patches_against_all(const Body& body, const PressedSquare& patch, int cycles = 25) {
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

TEST(CompositeGrid, PatchesAreWithinAFewPartsInAHundredOfAllVoxels) {
  for (const int n : {57, 64, 70}) {
    const PressedSquare patch{{n / 2, n / 2, n - 1}, 4, 2.5 * kSpacing};
    EXPECT_LT(patches_against_all(Body({n, n, n}, 0.1, everywhere, below), patch), 0.03) << n;
  }
}

TEST(CompositeGrid, PatchesInOtherShapes) {
  const int n = 60;
  const PressedSquare patch{{n / 2, n / 2, n - 1}, 4, 2.0 * kSpacing};
  const auto sides = [](const Index3& p) { return p[0] == 0 || p[0] == 59 || p[1] == 0 || p[1] == 59; };
  EXPECT_LT(patches_against_all(Body({n, n, n}, 0.1, everywhere, sides), patch), 0.05);
  const auto notched = [](const Index3& p) { return p[2] < 40 || p[0] < 42 || p[0] > 46; };
  EXPECT_LT(patches_against_all(Body({n, n, n}, 0.1, notched, below), patch), 0.05);
  const auto hollow = [](const Index3& p) { return std::hypot(p[0] - 30.0, p[2] - 22.0) > 9.0; };
  EXPECT_LT(patches_against_all(Body({n, n, n}, 0.1, hollow, below), patch), 0.07);
}

TEST(CompositeGrid, PatchesInSeveralTissues) {
  const int n = 64;
  const PressedSquare patch{{n / 2, n / 2, n - 1}, 4, 2.5 * kSpacing};
  const auto layers = [](const Index3& p) { return p[2] < 32 ? 2 : p[2] < 60 ? 1 : 4; };
  EXPECT_LT(patches_against_all(Body({n, n, n}, 0.1, everywhere, below, layers), patch), 0.04);
  const auto lumps = [](const Index3& p) { return (p[0] / 9 + p[1] / 7 + p[2] / 8) % 2 == 0 ? 1 : 5; };
  EXPECT_LT(patches_against_all(Body({n, n, n}, 0.1, everywhere, below, lumps), patch), 0.05);
  const auto core = [](const Index3& p) {
    return std::hypot(p[0] - 31.5, p[1] - 31.5, p[2] - 40.0) < 12.0 ? 10 : 1;
  };
  EXPECT_LT(patches_against_all(Body({n, n, n}, 0.1, everywhere, below, core), patch), 0.04);
}

// The lattice's limits are those of its voxels, a coarse level's are means over the tissue round its nodes.
TEST(CompositeGrid, PatchesInTissuesWithLimitsOfTheirOwn) {
  const int n = 64;
  const PressedSquare patch{{n / 2, n / 2, n - 1}, 4, 2.5 * kSpacing};
  const auto tight = [](int label, LinkMaterial& m) {
    if (label > 1) set_play(m, 0.05, 0.03, 0.04);
  };
  const auto layers = [](const Index3& p) { return p[2] < 32 ? 2 : p[2] < 60 ? 1 : 4; };
  EXPECT_LT(patches_against_all(Body({n, n, n}, 0.1, everywhere, below, layers, tight), patch), 0.04);
  const auto lumps = [](const Index3& p) { return (p[0] / 9 + p[1] / 7 + p[2] / 8) % 2 == 0 ? 1 : 5; };
  EXPECT_LT(patches_against_all(Body({n, n, n}, 0.1, everywhere, below, lumps, tight), patch), 0.07);
  const auto core = [](const Index3& p) {
    return std::hypot(p[0] - 31.5, p[1] - 31.5, p[2] - 40.0) < 12.0 ? 10 : 1;
  };
  EXPECT_LT(patches_against_all(Body({n, n, n}, 0.1, everywhere, below, core, tight), patch), 0.04);
}

// Skin on fat on muscle, and larger contrasts.
TEST(CompositeGrid, PatchesInTissuesThatDifferMuch) {
  const int n = 64;
  const PressedSquare patch{{n / 2, n / 2, n - 1}, 4, 2.5 * kSpacing};
  // Skin, fat, muscle.
  for (const auto& stiff : {std::array{31, 1, 3}, {100, 1, 10}, {1, 100, 10}, {3, 200, 11}}) {
    const auto layers = [&](const Index3& p) {
      return p[2] < 32 ? stiff[2] : p[2] < 60 ? stiff[1] : stiff[0];
    };
    EXPECT_LT(patches_against_all(Body({n, n, n}, 0.1, everywhere, below, layers), patch), 0.05)
        << stiff[0] << ":" << stiff[1] << ":" << stiff[2];
  }
}

// Stiffness of cubes of 1 to 32 cells per edge: layers act in series across them, and in parallel along them.
TEST(CompositeGrid, CubesAreAsStiffAsTheirLayers) {
  const int n = 33;
  const auto layers = [](const Index3& p) { return p[2] <= 16 ? 1 : 4; };
  const Body body({n, n, n}, 0.1, everywhere, below, layers);
  voxel::CoarseMaterial cells(*body.lattice);
  cells.reserve_planes(n + 1);
  for (const int m : {0, 1, 2, 3, 4, 5}) {
    const int edge = 1 << m, count = 32 / edge;
    const auto area = static_cast<std::size_t>(count) * static_cast<std::size_t>(count);
    std::array<std::vector<float>, 3> stiff;
    for (auto& axis : stiff) axis.resize(area);
    for (int z = 0; z < count; ++z) {
      cells.cube_stiffness(m, z, 0, count, 0, count, {stiff[0].data(), stiff[1].data(), stiff[2].data()});
      // A cell between two layers is as stiff as the softer layer.
      double across = 0.0, yields = 0.0;
      for (int k = z * edge; k < (z + 1) * edge; ++k) {
        across += k <= 16 ? 1.0 : 4.0;
        yields += k <= 16 ? 1.0 : 0.25;
      }
      for (std::size_t c = 0; c < area; ++c) {
        EXPECT_NEAR(stiff[0][c], edge * edge * across, 1e-5 * edge * edge * across);
        EXPECT_NEAR(stiff[1][c], edge * edge * across, 1e-5 * edge * edge * across);
        EXPECT_NEAR(stiff[2][c], std::pow(edge, 4) / yields, 1e-5 * std::pow(edge, 4) / yields) << m;
      }
    }
  }
}

// The result does not depend on where the patches were before, or on the path of the tool.
TEST(CompositeGrid, ThePathThereIsForgotten) {
  const int n = 64;
  const Body body({n, n, n}, 0.1, everywhere, below);
  const auto at = [&](int x, double depth) { return PressedSquare{{x, n / 2, n - 1}, 3, depth * kSpacing}; };
  CompositeGrid direct(*body.lattice, 10), round(*body.lattice, 10);
  direct.begin({n / 2, n / 2, n - 1});
  press(direct, at(n / 2, 2.0), 30);
  round.begin({n / 2, n / 2, n - 1});
  press(round, at(n / 2, 3.0), 5);
  for (int x = n / 2; x < n / 2 + 10; x += 2) {
    round.centre_on({x, n / 2, n - 1});
    press(round, at(x, 3.0), 2);
  }
  for (int x = n / 2 + 10; x >= n / 2; x -= 2) {
    round.centre_on({x, n / 2, n - 1});
    press(round, at(x, 2.0), 2);
  }
  press(round, at(n / 2, 2.0), 30);
  EXPECT_NEAR(round.force_on_tool_N().z, direct.force_on_tool_N().z, 2e-3 * direct.force_on_tool_N().z);
  for (int n_cycles = 0; n_cycles < 40; ++n_cycles) {
    round.clear_pressed();
    round.cycle();
  }
  EXPECT_LT(glm::length(round.force_on_tool_N()), 1e-3 * direct.force_on_tool_N().z);
}

// Some or all levels are built before the contact. They are bit for bit the levels that begin() would build.
TEST(CompositeGrid, LevelsBuiltAheadAreThoseBuiltInTime) {
  const int n = 100;
  const Body body({n, n, n}, 0.1, everywhere, below);
  const PressedSquare patch{{80, 31, n - 1}, 3, 2.0 * kSpacing};
  const auto force = [&](int ahead) {
    CompositeGrid grid(*body.lattice, 10);
    for (int tick = 0; tick < ahead; ++tick) grid.prepare(patch.middle);
    grid.begin(patch.middle);
    press(grid, patch, 12);
    return grid.force_on_tool_N();
  };
  const glm::dvec3 in_time = force(0);
  EXPECT_GT(in_time.z, 0.1);
  for (const int ahead : {1, 2, 4, 20}) EXPECT_EQ(force(ahead), in_time) << ahead;
}

// The contact is always well inside the patch of level 0, whether it jumps or slides.
TEST(CompositeGrid, TheFinestPatchHasTheContactAtEachTick) {
  const int n = 100;
  const Body body({n, n, n}, 0.1, everywhere, below);
  CompositeGrid grid(*body.lattice, 8);
  grid.begin({20, 20, n - 1});
  const auto has_all_round = [&](const Index3& at) {
    for (int j = -3; j <= 3; ++j) {
      for (int i = -3; i <= 3; ++i) {
        if (!grid.in_fine_patch({at[0] + i, at[1] + j, at[2]})) return false;
      }
    }
    return true;
  };
  for (int x = 20; x < 80; ++x) {
    grid.centre_on({x, 20, n - 1});
    EXPECT_TRUE(has_all_round({x, 20, n - 1})) << x;
  }
  grid.centre_on({30, 70, n - 1});
  EXPECT_TRUE(has_all_round({30, 70, n - 1}));
}

// Some anchored regions are smaller than the cells of coarse levels. Others are larger, but their borders do
// not follow the coarse nodes.
TEST(CompositeGrid, PatchesWithAnchorsAnywhere) {
  using At = const Index3&;
  const auto cube = [](int x, int y, int z, int half) {
    return [=](At p) {
      return std::abs(p[0] - x) <= half && std::abs(p[1] - y) <= half && std::abs(p[2] - z) <= half;
    };
  };
  const auto from_bone = [](At p) { return std::hypot(p[0] - 30.0, p[1] - 30.0, p[2] - 20.0); };
  const auto outside_bone = [&](At p) { return from_bone(p) > 12.0; };
  const auto anchored_by = [](const std::function<bool(At)>& filled,
                              const std::function<bool(At)>& anchored) {
    const int n = 61;
    return patches_against_all(Body({n, n, n}, 0.9, filled, anchored), {{30, 30, n - 1}, 4, kSpacing}, 60);
  };
  EXPECT_LT(anchored_by(everywhere, [](At p) { return p[2] == 21; }), 0.03);
  EXPECT_LT(anchored_by(everywhere, [](At p) { return p[2] == 21 || p[0] == 3; }), 0.03);
  EXPECT_LT(anchored_by(everywhere, [](At p) { return p[2] < 10 + p[0] / 4; }), 0.05);
  EXPECT_LT(anchored_by(everywhere, [](At p) { return p[0] % 8 == 3 && p[1] % 8 == 3 && p[2] == 20; }), 0.05);
  EXPECT_LT(anchored_by(everywhere, [](At p) { return p[0] % 8 == 0 && p[1] % 8 == 0 && p[2] == 16; }), 0.05);
  EXPECT_LT(anchored_by(everywhere, [](At p) { return p[0] % 4 == 1 && p[1] % 4 == 1 && p[2] == 21; }), 0.05);
  EXPECT_LT(anchored_by(outside_bone, [&](At p) { return from_bone(p) < 13.5; }), 0.03);
  EXPECT_LT(anchored_by(outside_bone, [&](At p) { return p[0] < 30 && from_bone(p) < 13.5; }), 0.05);
  // For a single small region, most of the resistance is the constriction around it.
  for (const int half : {0, 1, 4, 8})
    EXPECT_LT(anchored_by(everywhere, cube(27, 34, 25, half)), 0.08) << half;
  EXPECT_LT(anchored_by(everywhere, cube(30, 30, 0, 1)), 0.08);
  EXPECT_LT(anchored_by(everywhere, cube(22, 37, 0, 2)), 0.12);
  EXPECT_LT(anchored_by(everywhere, cube(22, 37, 0, 4)), 0.08);
}

TEST(CompositeGrid, SaysWhyAnObjectIsUnsuitable) {
  const Index3 dims{40, 40, 40};
  const auto reason = [](const Body& body) { return CompositeGrid::suitability(*body.lattice).reason; };
  EXPECT_EQ(reason(Body(dims, 0.1, everywhere, below)), "");
  const auto fins = [](const Index3& p) { return p[2] < 20 || p[0] % 4 == 0; };
  EXPECT_EQ(reason(Body(dims, 0.1, fins, below)), "much of it is one voxel thick");
  const auto specks = [](const Index3& p) { return p[0] % 8 == 4 && p[1] % 8 == 4 && p[2] == 20; };
  EXPECT_EQ(reason(Body(dims, 0.1, everywhere, specks)), "");
  const auto lump = [](const Index3& p) { return p[0] > 10 && p[0] < 30 && p[1] > 10 && p[2] < 10; };
  EXPECT_EQ(reason(Body(dims, 0.1, everywhere, lump)), "");
  voxel::LatticeOptions two = made_of(slack(0.1));
  voxel::LabelVolume volume = block(dims, glm::dvec3(kSpacing));
  std::fill_n(volume.labels.begin(), 40 * 40 * 20, std::uint8_t{2});
  const auto reason_with = [&](const LinkMaterial& other) {
    two.materials[2] = other;
    return CompositeGrid::suitability(Lattice(volume, two)).reason;
  };
  LinkMaterial stiff = slack(0.1);
  stiff.young_Pa *= 5.0;
  EXPECT_EQ(reason_with(stiff), "");
  EXPECT_EQ(reason_with(slack(0.2)), "");
  stiff.poisson = 0.4;
  EXPECT_NE(reason_with(stiff), "");
  const auto skin = [](const Index3& p) { return p[2] == 39 ? 20 : 1; };
  EXPECT_NE(reason(Body(dims, 0.1, everywhere, below, skin)), "");
}

}  // namespace
