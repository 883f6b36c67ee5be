// SPDX-License-Identifier: GPL-3.0-or-later
// The composite grid against what it stands for: the whole lattice at equilibrium within its limits, solved
// directly where that is small enough; and boxes of nodes against all voxels where it is not.
#include "voxel/composite/grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <memory>

#include "tests/voxel/fixtures/direct_solution.h"
#include "tests/voxel/fixtures/lattice_scenes.h"
#include "tests/voxel/fixtures/soft_press.h"

namespace {

using tests::block;
using tests::made_of;
using voxel::CompositeGrid;
using voxel::Lattice;
using voxel::LinkMaterial;
using voxel::VoxelId;
using Index3 = CompositeGrid::Index3;

constexpr double kSpacing = 1e-3;

LinkMaterial slack(double play) {
  return {
      .young_Pa = 1e4, .poisson = 0.3, .stretch_min = 1.0 - play, .stretch_max = 1.0 + play, .shear = play};
}

// A body; where it is and where it is anchored, by voxel. `tissue`: how stiff it is there, times the first
// tissue; null: of one.
struct Body {
  voxel::LatticeOptions options;
  std::shared_ptr<const Lattice> lattice;

  Body(const Index3& dims, double play, const std::function<bool(const Index3&)>& filled,
       const std::function<bool(const Index3&)>& anchored,
       const std::function<int(const Index3&)>& tissue = nullptr)
      : options(made_of(slack(play), nullptr)) {
    voxel::LabelVolume volume = block(dims, glm::dvec3(kSpacing));
    std::size_t n = 0;
    for (int k = 0; k < dims[2]; ++k) {
      for (int j = 0; j < dims[1]; ++j) {
        for (int i = 0; i < dims[0]; ++i, ++n) {
          volume.labels[n] = filled({i, j, k}) ? 1 : 0;
          if (tissue && volume.labels[n] != 0) {
            volume.labels[n] = static_cast<std::uint8_t>(tissue({i, j, k}));
            options.materials[volume.labels[n]].young_Pa = 1e4 * volume.labels[n];
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

// A square patch of the top pressed down by `depth`.
struct Patch {
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

void press(CompositeGrid& grid, const Patch& patch, int cycles) {
  for (int n = 0; n < cycles; ++n) {
    grid.clear_pressed();
    patch.for_voxels([&](const Index3& p) {
      grid.press(p, glm::dvec3(0.0, 0.0, -patch.depth), glm::dvec3(0.0, 0.0, -1.0));
    });
    grid.cycle({false, false, true});
  }
}

// The same by the links of the lattice and their limits, with sparse Cholesky and an augmented Lagrangian.
// The patch is stuck to the tool; that is no difference, since all of it is pulled up.
tests::Problem solved_directly(const Body& body, const Patch& patch) {
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
  double displacement = 0.0, force = 0.0;  // of the depth; of the force
};
Difference compare(const Body& body, const Patch& patch, int half_width) {
  const tests::Problem direct = solved_directly(body, patch);
  CompositeGrid grid(*body.lattice, half_width);
  grid.begin(patch.middle);
  press(grid, patch, 100);
  Difference most;
  for (std::size_t i = 0; i < body.lattice->size(); ++i) {
    const auto v = static_cast<VoxelId>(i);
    if (!body.lattice->filled(v)) continue;
    const double apart = std::fabs(grid.at(body.lattice->coordinates(v)).z - direct.u[i]);
    most.displacement = std::max(most.displacement, apart / patch.depth);
  }
  const double force = force_of(body, direct);
  most.force = std::fabs(grid.force_on_tool_N().z - force) / force;
  std::cout << "[ measured ] " << force << " N; off by " << most.displacement << " of the depth, "
            << most.force << " of the force; links beyond by " << grid.worst_violation() / kSpacing
            << " spacings\n";
  return most;
}

// Without boxes it is the lattice, whatever its sides are.
TEST(CompositeGrid, AllVoxelsAreTheLatticeAtEquilibrium) {
  for (const Index3& dims : {Index3{13, 13, 11}, Index3{12, 15, 10}, Index3{9, 16, 14}}) {
    for (const double depth : {0.3, 1.0}) {
      const Body body(dims, 0.15, everywhere, below);
      const Patch patch{{dims[0] / 2, dims[1] / 2, dims[2] - 1}, 2, depth * kSpacing};
      const Difference d = compare(body, patch, CompositeGrid::kRefineAll);
      EXPECT_LT(d.displacement, 1e-3);
      EXPECT_LT(d.force, 2e-3);
    }
  }
}

TEST(CompositeGrid, AnchorsAreHeldWhereverTheyAre) {
  const Index3 dims{15, 13, 12};
  const Patch patch{{7, 6, 11}, 2, 0.8 * kSpacing};
  const Body sides(dims, 0.2, everywhere,
                   [](const Index3& p) { return p[0] == 0 || p[0] == 14 || p[1] == 0; });
  Difference d = compare(sides, patch, CompositeGrid::kRefineAll);
  EXPECT_LT(d.displacement, 2e-3);
  EXPECT_LT(d.force, 5e-3);
  const Body lump(dims, 0.2, everywhere, [](const Index3& p) { return p[0] < 5 && p[1] > 7 && p[2] < 6; });
  // At the edge of what is anchored links would go beyond their limits, which bounds do not say.
  d = compare(lump, patch, CompositeGrid::kRefineAll);
  EXPECT_LT(d.displacement, 0.06);
  EXPECT_LT(d.force, 0.03);
}

TEST(CompositeGrid, HolesAndNotchesAreInTheLinks) {
  const Index3 dims{15, 14, 13};
  const Patch patch{{7, 7, 12}, 2, 0.8 * kSpacing};
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

// Layers and lumps of tissues that differ in stiffness, and what a soft layer between two stiff ones carries
// when it is squeezed to its limits (contrast 4 to 200, depth a part of where the chain ends).
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
      const Patch patch{{6, 6, 12}, 2, depth * 0.15 * 12 * kSpacing};
      const Difference d = compare(body, patch, CompositeGrid::kRefineAll);
      EXPECT_LT(d.displacement, 0.01);
      EXPECT_LT(d.force, 0.01);
    }
  }
}

// Boxes against all voxels, of a patch as large as a tool's contact.
double boxes_against_all(const Body& body, const Patch& patch) {
  CompositeGrid all(*body.lattice, CompositeGrid::kRefineAll), boxes(*body.lattice, 10);
  all.begin(patch.middle);
  boxes.begin(patch.middle);
  press(all, patch, 25);
  press(boxes, patch, 25);
  const double share = boxes.force_on_tool_N().z / all.force_on_tool_N().z - 1.0;
  std::cout << "[ measured ] " << all.force_on_tool_N().z << " N of all voxels, boxes " << 100.0 * share
            << " %\n";
  return std::fabs(share);
}

TEST(CompositeGrid, BoxesAreWithinAFewPartsInAHundredOfAllVoxels) {
  for (const int n : {57, 64, 70}) {
    const Patch patch{{n / 2, n / 2, n - 1}, 4, 2.5 * kSpacing};
    EXPECT_LT(boxes_against_all(Body({n, n, n}, 0.1, everywhere, below), patch), 0.03) << n;
  }
}

TEST(CompositeGrid, BoxesOfOtherShapes) {
  const int n = 60;
  const Patch patch{{n / 2, n / 2, n - 1}, 4, 2.0 * kSpacing};
  const auto sides = [](const Index3& p) { return p[0] == 0 || p[0] == 59 || p[1] == 0 || p[1] == 59; };
  EXPECT_LT(boxes_against_all(Body({n, n, n}, 0.1, everywhere, sides), patch), 0.05);
  const auto notched = [](const Index3& p) { return p[2] < 40 || p[0] < 42 || p[0] > 46; };
  EXPECT_LT(boxes_against_all(Body({n, n, n}, 0.1, notched, below), patch), 0.05);
  const auto hollow = [](const Index3& p) { return std::hypot(p[0] - 30.0, p[2] - 22.0) > 9.0; };
  EXPECT_LT(boxes_against_all(Body({n, n, n}, 0.1, hollow, below), patch), 0.07);
}

TEST(CompositeGrid, BoxesOfSeveralTissues) {
  const int n = 64;
  const Patch patch{{n / 2, n / 2, n - 1}, 4, 2.5 * kSpacing};
  const auto layers = [](const Index3& p) { return p[2] < 32 ? 2 : p[2] < 60 ? 1 : 4; };
  EXPECT_LT(boxes_against_all(Body({n, n, n}, 0.1, everywhere, below, layers), patch), 0.04);
  const auto lumps = [](const Index3& p) { return (p[0] / 9 + p[1] / 7 + p[2] / 8) % 2 == 0 ? 1 : 5; };
  EXPECT_LT(boxes_against_all(Body({n, n, n}, 0.1, everywhere, below, lumps), patch), 0.05);
  const auto core = [](const Index3& p) {
    return std::hypot(p[0] - 31.5, p[1] - 31.5, p[2] - 40.0) < 12.0 ? 10 : 1;
  };
  EXPECT_LT(boxes_against_all(Body({n, n, n}, 0.1, everywhere, below, core), patch), 0.04);
}

// Skin on fat on muscle, and stiffer: what a cycle leaves, of any state, and what is felt.
TEST(CompositeGrid, BoxesOfTissuesThatDifferMuch) {
  const int n = 64;
  const Patch patch{{n / 2, n / 2, n - 1}, 4, 2.5 * kSpacing};
  // Skin, fat, muscle.
  for (const auto& stiff : {std::array{31, 1, 3}, {100, 1, 10}, {1, 100, 10}, {3, 200, 11}}) {
    const auto layers = [&](const Index3& p) {
      return p[2] < 32 ? stiff[2] : p[2] < 60 ? stiff[1] : stiff[0];
    };
    EXPECT_LT(boxes_against_all(Body({n, n, n}, 0.1, everywhere, below, layers), patch), 0.05)
        << stiff[0] << ":" << stiff[1] << ":" << stiff[2];
  }
}

// What of a cube of cells is there, and how stiff it is, of cubes of any size: layers along an axis yield one
// after the other, side by side they bear together.
TEST(CompositeGrid, CubesAreAsStiffAsTheirLayers) {
  const int n = 33;
  const auto layers = [](const Index3& p) { return p[2] <= 16 ? 1 : 4; };
  const Body body({n, n, n}, 0.1, everywhere, below, layers);
  voxel::CoarseMaterial cells(*body.lattice);
  cells.make_room(n + 1);
  for (const int m : {0, 1, 2, 3, 4, 5}) {
    const int edge = 1 << m, count = 32 / edge;
    const auto area = static_cast<std::size_t>(count) * static_cast<std::size_t>(count);
    std::array<std::vector<float>, 3> stiff;
    for (auto& axis : stiff) axis.resize(area);
    for (int z = 0; z < count; ++z) {
      cells.stiff_plane(m, z, 0, count, 0, count, {stiff[0].data(), stiff[1].data(), stiff[2].data()});
      // A cell between two layers is as stiff as the softer.
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

// Where boxes were, and how the tool came there, does not matter.
TEST(CompositeGrid, TheWayThereIsForgotten) {
  const int n = 64;
  const Body body({n, n, n}, 0.1, everywhere, below);
  const auto at = [&](int x, double depth) { return Patch{{x, n / 2, n - 1}, 3, depth * kSpacing}; };
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

// What was laid ahead of a contact, all of it or a part, is what the contact would lay, to the last bit.
TEST(CompositeGrid, LaidAheadIsLaidAsInTime) {
  const int n = 100;
  const Body body({n, n, n}, 0.1, everywhere, below);
  const Patch patch{{80, 31, n - 1}, 3, 2.0 * kSpacing};
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

// A contact that jumps is within level 0 in the same tick; one that glides is at each tick.
TEST(CompositeGrid, TheFinestBoxHasTheContactAtEachTick) {
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

TEST(CompositeGrid, SaysWhatIsInItsWay) {
  const Index3 dims{40, 40, 40};
  EXPECT_EQ(CompositeGrid::reason_unsuitable(*Body(dims, 0.1, everywhere, below).lattice), "");
  const auto sheet = [](const Index3& p) { return p[2] < 20 || p[0] == 20; };
  EXPECT_NE(CompositeGrid::reason_unsuitable(*Body(dims, 0.1, sheet, below).lattice), "");
  const auto specks = [](const Index3& p) { return p[0] % 8 == 4 && p[1] % 8 == 4 && p[2] == 20; };
  EXPECT_NE(CompositeGrid::reason_unsuitable(*Body(dims, 0.1, everywhere, specks).lattice), "");
  const auto lump = [](const Index3& p) { return p[0] > 10 && p[0] < 30 && p[1] > 10 && p[2] < 10; };
  EXPECT_NE(CompositeGrid::reason_unsuitable(*Body(dims, 0.1, everywhere, lump).lattice), "");
  voxel::LatticeOptions two = made_of(slack(0.1));
  voxel::LabelVolume volume = block(dims, glm::dvec3(kSpacing));
  std::fill_n(volume.labels.begin(), 40 * 40 * 20, std::uint8_t{2});
  const auto obstacle_with = [&](const LinkMaterial& other) {
    two.materials[2] = other;
    return CompositeGrid::reason_unsuitable(Lattice(volume, two));
  };
  LinkMaterial stiff = slack(0.1);
  stiff.young_Pa *= 5.0;
  EXPECT_EQ(obstacle_with(stiff), "");
  EXPECT_NE(obstacle_with(slack(0.2)), "");
  stiff.poisson = 0.4;
  EXPECT_NE(obstacle_with(stiff), "");
  const auto skin = [](const Index3& p) { return p[2] == 39 ? 20 : 1; };
  EXPECT_NE(CompositeGrid::reason_unsuitable(*Body(dims, 0.1, everywhere, below, skin).lattice), "");
}

// ---- an object that has its contact there ----

struct Pressed {
  tests::SoftBlock block{{64, 64, 64}, kSpacing, slack(0.1)};
  bool on_grid = block.object->use_composite_grid(block.ball(8.0 * kSpacing, 0.0)).empty();

  voxel::Reaction to(double depth, int ticks) {
    const voxel::ToolInBody tool = block.ball(8.0 * kSpacing, depth * kSpacing);
    voxel::Reaction felt;
    for (int n = 0; n < ticks; ++n) {
      block.touch(tool, 12.0 * kSpacing);
      block.object->push_out(tool);
      block.object->relax_near(tool, 1);
      felt = block.object->reaction(tool);
    }
    return felt;
  }
};

TEST(ObjectOnGrid, FeelsTheLatticeAtEquilibriumThatAnchorsCarry) {
  Pressed pressed;
  ASSERT_TRUE(pressed.on_grid);
  tests::SoftBlock lattice({64, 64, 64}, kSpacing, slack(0.1));
  for (const double depth : {1.0, 2.0, 3.0}) {
    const double felt = pressed.to(depth, 40).force_N.z;
    const double right =
        lattice.press(lattice.ball(8.0 * kSpacing, depth * kSpacing), 12.0 * kSpacing).force_N.z;
    const auto carried = lattice.object->carried_by_anchors_N();
    ASSERT_TRUE(carried.has_value());
    EXPECT_NEAR(-carried->z, right, 0.01 * right);
    EXPECT_NEAR(felt, right, 0.03 * right) << depth;
  }
}

// At half a spacing a tick, in and out, the force is that of where the tool is, not of where it was.
TEST(ObjectOnGrid, AMovingToolIsAnsweredForWhereItIs) {
  Pressed pressed;
  ASSERT_TRUE(pressed.on_grid);
  for (const double way : {1.0, -1.0}) {
    const double from = way > 0.0 ? 1.0 : 4.0;
    pressed.to(from, 60);
    for (int n = 1; n <= 4; ++n) pressed.to(from + 0.5 * way * n, 1);
    const double to = from + 2.0 * way, moving = pressed.to(to + 0.5 * way, 1).force_N.z;
    const double right = pressed.to(to + 0.5 * way, 60).force_N.z;
    std::cout << "[ measured ] " << moving << " N moving, at rest " << right << " N\n";
    EXPECT_NEAR(moving, right, std::max(0.07 * right, 0.03));  // just noticeable
  }
}

TEST(ObjectOnGrid, ShowsItsDentAndKeepsItsState) {
  Pressed pressed;
  ASSERT_TRUE(pressed.on_grid);
  pressed.to(3.0, 20);
  const voxel::SoftObject& object = *pressed.block.object;
  const glm::dvec2 middle = pressed.block.middle();
  const glm::dvec3 top(middle, pressed.block.top());
  EXPECT_NEAR(object.displacement_at(top).z, -3.0 * kSpacing, 0.1 * kSpacing);
  const VoxelId v = pressed.block.lattice->at(32, 32, 63);
  EXPECT_NEAR(object.displacement(v).z, -3.0 * kSpacing, 0.1 * kSpacing);
  EXPECT_GT(object.energy_J(), 0.0);
  const auto copy = object.copy();
  EXPECT_EQ(copy->displacement(v), object.displacement(v));
  for (const auto& axis : object.state().u) {
    EXPECT_TRUE(std::all_of(axis.begin(), axis.end(), [](float u) { return u == 0.0F; }));
  }
  pressed.block.object->touch({});
  EXPECT_EQ(object.displacement(v), glm::dvec3(0.0));
  EXPECT_EQ(object.energy_J(), 0.0);
}

// Force is the slope of the energy, so that what a hand gives is what it gets back.
TEST(ObjectOnGrid, StoresWhatIsGiven) {
  Pressed pressed;
  ASSERT_TRUE(pressed.on_grid);
  const double step = 0.1, below = pressed.to(2.0 - step, 60).force_N.z;
  const double stored = pressed.block.object->energy_J();
  const double force = pressed.to(2.0, 60).force_N.z;
  const double above = pressed.to(2.0 + step, 60).force_N.z;
  const double given = step * kSpacing * (0.5 * below + force + 0.5 * above);
  EXPECT_NEAR(pressed.block.object->energy_J() - stored, given, 0.06 * given);
}

}  // namespace
