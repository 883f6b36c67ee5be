// SPDX-License-Identifier: GPL-3.0-or-later
// CompositeGrid in objects of several tissues, which differ in stiffness or in limits.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <initializer_list>
#include <iostream>

#include "tests/voxel/composite/body_on_grid.h"
#include "voxel/composite/grid.h"

namespace {

using tests::below;
using tests::Body;
using tests::compare;
using tests::Difference;
using tests::everywhere;
using tests::kSpacing;
using tests::patches_against_all;
using tests::PressedSquare;
using voxel::CompositeGrid;
using voxel::LinkMaterial;
using Index3 = CompositeGrid::Index3;

// Layers and lumps of tissues whose stiffnesses differ by factors of 4 to 200. Soft layers between stiff ones
// reach their limits. The depth is a fraction of the depth at which all links below the
// square reach their limits.
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

// Stiff tissue one voxel thick within soft tissue: a skin, a membrane, walls that cross, straight and oblique
// rows.
int skin_of_30(const Index3& p) {
  return p[2] == 12 ? 30 : 1;
}
int membrane_of_30(const Index3& p) {
  return p[2] == 7 ? 30 : 1;
}
int walls_of_30(const Index3& p) {
  return p[0] % 4 == 1 || p[1] % 5 == 2 ? 30 : 1;
}
int rows_of_100(const Index3& p) {
  return (p[1] % 4 == 2 && p[2] % 4 == 1) || (p[1] == 4 && p[2] == p[0]) ? 100 : 1;
}

TEST(CompositeGrid, TissueOneVoxelThickIsTheLatticeAtEquilibrium) {
  const Index3 dims{13, 13, 13};
  for (const auto& tissue : {skin_of_30, membrane_of_30, walls_of_30, rows_of_100}) {
    for (const double depth : {0.1, 0.5}) {
      const Body body(dims, 0.15, everywhere, below, tissue);
      const PressedSquare patch{{6, 6, 12}, 2, depth * 0.15 * 12 * kSpacing};
      const Difference d = compare(body, patch, CompositeGrid::kRefineAll);
      EXPECT_LT(d.displacement, 0.01);
      EXPECT_LT(d.force, 0.01);
    }
  }
}

TEST(CompositeGrid, PatchesInTissueOneVoxelThick) {
  const int n = 64;
  const PressedSquare patch{{n / 2, n / 2, n - 1}, 4, 2.5 * kSpacing};
  const auto skin = [](const Index3& p) { return p[2] == 63 ? 30 : 1; };
  EXPECT_LT(patches_against_all(Body({n, n, n}, 0.1, everywhere, below, skin), patch), 0.05);
  const auto membrane = [](const Index3& p) { return p[2] == 50 ? 30 : 1; };
  EXPECT_LT(patches_against_all(Body({n, n, n}, 0.1, everywhere, below, membrane), patch), 0.05);
  const auto walls = [](const Index3& p) { return p[0] % 12 == 5 || p[1] % 10 == 3 ? 20 : 1; };
  EXPECT_LT(patches_against_all(Body({n, n, n}, 0.1, everywhere, below, walls), patch), 0.05);
  const auto rows = [](const Index3& p) { return p[1] % 8 == 2 && p[2] % 8 == 5 ? 50 : 1; };
  EXPECT_LT(patches_against_all(Body({n, n, n}, 0.1, everywhere, below, rows), patch), 0.05);
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

// The lattice has the limits of its voxels. A coarse level has means over the tissue around its nodes.
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
    EXPECT_LT(patches_against_all(Body({n, n, n}, 0.1, everywhere, below, layers), patch), 0.06)
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

}  // namespace
