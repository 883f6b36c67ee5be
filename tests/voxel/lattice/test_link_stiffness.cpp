// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/lattice/link_stiffness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/voxel/fixtures/voxel_problem.h"

namespace {

using voxel::link_moduli;
using voxel::link_weight;
using voxel::LinkModuli;

// The bits of the parallel links (p, q) for which keep(p, q) is true.
template <typename Keep>
constexpr std::uint32_t parallels(Keep keep) {
  std::uint32_t out = 0;
  for (int q = -1; q <= 1; ++q) {
    for (int p = -1; p <= 1; ++p)
      out |= (keep(p, q) || (p == 0 && q == 0) ? 1U : 0U) << (p + 1 + 3 * (q + 1));
  }
  return out;
}

TEST(LinkWeight, IsTheShareOfItsAreaThatLiesWithin) {
  EXPECT_EQ(link_weight(parallels([](int, int) { return true; })), 1.0);
  EXPECT_EQ(link_weight(parallels([](int p, int) { return p <= 0; })), 0.5);
  EXPECT_EQ(link_weight(parallels([](int, int q) { return q >= 0; })), 0.5);
  EXPECT_EQ(link_weight(parallels([](int p, int q) { return p <= 0 && q <= 0; })), 0.25);
  EXPECT_EQ(link_weight(parallels([](int p, int q) { return p <= 0 || q <= 0; })), 0.75);
}

TEST(LinkWeight, KeepsTheThicknessOfWhatHasNoInside) {
  EXPECT_EQ(link_weight(parallels([](int, int q) { return q == 0; })), 1.0);              // a sheet
  EXPECT_EQ(link_weight(parallels([](int p, int q) { return q == 0 && p <= 0; })), 0.5);  // a sheet's border
  EXPECT_EQ(link_weight(parallels([](int, int) { return false; })), 1.0);                 // a row of voxels
  EXPECT_EQ(link_weight(parallels([](int p, int q) { return p == 0 || q == 0; })), 1.0);  // sheets that cross
}

TEST(LinkWeight, IsNeverNothingAndKnowsNoSideFromAnother) {
  for (std::uint32_t bits = 0; bits < 512; ++bits) {
    const double w = link_weight(bits);
    EXPECT_GT(w, 0.0);
    EXPECT_LE(w, 1.0);
    EXPECT_EQ(w, link_weight(bits | 16U));
    const auto mirrored = [bits](auto to) {
      std::uint32_t out = 0;
      for (int q = 0; q < 3; ++q) {
        for (int p = 0; p < 3; ++p) out |= (bits >> (p + 3 * q) & 1U) << to(p, q);
      }
      return out;
    };
    EXPECT_EQ(w, link_weight(mirrored([](int p, int q) { return 2 - p + 3 * q; })));
    EXPECT_EQ(w, link_weight(mirrored([](int p, int q) { return q + 3 * p; })));
  }
}

TEST(LinkWeight, ReadsTheNeighbourhoodOfAVoxel) {
  std::mt19937 random(3);
  for (int trial = 0; trial < 1000; ++trial) {
    const std::uint32_t filled = random() & 0x7FFFFFFU;
    const auto at = [filled](std::array<int, 3> c) {
      return (filled >> (c[0] + 1 + 3 * (c[1] + 1) + 9 * (c[2] + 1)) & 1U) != 0;
    };
    for (std::size_t d = 0; d < 3; ++d) {
      const std::uint32_t found = voxel::parallel_links(filled, static_cast<int>(d));
      for (int q = -1; q <= 1; ++q) {
        for (int p = -1; p <= 1; ++p) {
          std::array<int, 3> a{};
          a[(d + 1) % 3] = p;
          a[(d + 2) % 3] = q;
          std::array<int, 3> b = a;
          b[d] = 1;
          EXPECT_EQ((found >> (p + 1 + 3 * (q + 1)) & 1U) != 0, at(a) && at(b));
        }
      }
    }
  }
}

TEST(LinkModuli, AreTheWeightInOneMaterial) {
  const LinkModuli tissue{1e4, 3e3};
  for (std::uint32_t bits = 0; bits < 512; ++bits) {
    std::array<LinkModuli, 9> links{};
    for (std::size_t n = 0; n < 9; ++n) {
      if ((bits >> n & 1U) != 0 || n == voxel::kLinkItself) links[n] = tissue;
    }
    const LinkModuli found = link_moduli(links);
    EXPECT_DOUBLE_EQ(found.along_Pa, link_weight(bits) * 1e4);
    EXPECT_DOUBLE_EQ(found.across_Pa, link_weight(bits) * 3e3);
  }
}

TEST(LinkModuli, OfAStiffSheetInSoftTissueAreTheSheets) {
  const LinkModuli skin{1e6, 3e5}, fat{1e3, 3e2};
  std::array<LinkModuli, 9> links{};
  for (std::size_t n = 0; n < 9; ++n) links[n] = n / 3 == 1 ? skin : fat;
  EXPECT_EQ(link_moduli(links).along_Pa, 1e6);
  // Skin that is two voxels thick. Each layer of links carries half of the skin between the layers and half
  // of the fat beside it.
  for (std::size_t n = 6; n < 9; ++n) links[n] = skin;
  EXPECT_DOUBLE_EQ(link_moduli(links).along_Pa, 0.5 * 1e6 + 0.5 * 1e3);
  // A link in the plane where stiff tissue meets soft tissue.
  for (std::size_t n = 0; n < 9; ++n) links[n] = n >= 3 ? skin : fat;
  EXPECT_DOUBLE_EQ(link_moduli(links).across_Pa, 0.5 * 3e5 + 0.5 * 3e2);
}

// Both soft energies are sums over the same cells. So a uniform stretch along an axis at ν = 0 takes the same
// energy in both, whatever the body's edges, notches, thin parts and materials.
TEST(LinkModuli, AgreeWithTheBricksOnUniformStretch) {
  constexpr int n = 7;
  std::mt19937 random(5);
  for (int trial = 0; trial < 30; ++trial) {
    tests::VoxelBody body{{n, n, n},
                          {1e-3, 2e-3, 0.5e-3},
                          std::vector<int>(n * n * n, 0),
                          {{0, 0}, {1e4, 0}, {3e4, 0}, {7e4, 0}}};
    for (int box = 0; box < 6; ++box) {
      std::array<int, 3> low{}, high{};
      for (std::size_t d = 0; d < 3; ++d) {
        low[d] = static_cast<int>(random() % n);
        high[d] = std::min(n - 1, low[d] + static_cast<int>(random() % 4));
      }
      const int label = static_cast<int>(random() % 4);
      for (int k = low[2]; k <= high[2]; ++k) {
        for (int j = low[1]; j <= high[1]; ++j) {
          for (int i = low[0]; i <= high[0]; ++i) body.label[body.at(i, j, k)] = label;
        }
      }
    }
    tests::PlainProblem links = problem_of(body, tests::Energy::six_link);
    tests::PlainProblem bricks = problem_of(body, tests::Energy::accurate);
    for (int axis = 0; axis < 3; ++axis) {
      for (int k = 0; k < n; ++k) {
        for (int j = 0; j < n; ++j) {
          for (int i = 0; i < n; ++i) {
            const std::array<int, 3> c{i, j, k};
            Eigen::Vector3d u = Eigen::Vector3d::Zero();
            u[axis] = 0.1 * c[static_cast<std::size_t>(axis)] * body.spacing_m[axis];
            links.u[body.at(i, j, k)] = bricks.u[body.at(i, j, k)] = u;
          }
        }
      }
      EXPECT_NEAR(links.energy_J(), bricks.energy_J(), 1e-12 * links.energy_J());
    }
  }
}

// A sheet one voxel thick that stands on a block has no bricks. Its links hold it to the block's voxels.
TEST(LinkModuli, ASheetOnABlockIsHeldInTheAccurateEnergy) {
  constexpr int n = 7, nz = 8;
  tests::VoxelBody body{{n, n, nz}, glm::dvec3(1e-3), std::vector<int>(n * n * nz, 0), {{}, {1e4, 0.3}}};
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) body.label[body.at(i, j, k)] = k < 3 || j == 3 ? 1 : 0;
    }
  }
  tests::PlainProblem problem = problem_of(body, tests::Energy::accurate);
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) problem.free[body.at(i, j, 0)].setZero();
  }
  for (int i = 0; i < n; ++i) {
    problem.free[body.at(i, 3, nz - 1)].setZero();
    problem.u[body.at(i, 3, nz - 1)] = {0.0, 1e-4, 1e-4};
  }
  ASSERT_TRUE(problem.solve(1e-10));
  // The sheet is five links high and seven wide. The outermost links count half, so six links act in
  // parallel. `alone` is the sheet's energy on a rigid base. The block below is softer.
  const double alone = 0.5 * 6.0 * 1e4 * 1e-3 / 5.0 * 1e-8;
  EXPECT_LT(problem.energy_J(), 3.0 * alone);
  EXPECT_GT(problem.energy_J(), 0.3 * alone);
  // The upward displacement extends all the way down.
  for (int k = 1; k < nz; ++k)
    EXPECT_GT(problem.u[body.at(3, 3, k)].z(), problem.u[body.at(3, 3, k - 1)].z()) << k;
}

// The energy of a rigid rotation by θ. Bricks are exact for small rotations only. They have a strain of 1 −
// cos θ in two directions, 1.5 % at 10 degrees. Six links also have the shear sin θ across them.
TEST(LinkModuli, RotationsCostWhatTheyDo) {
  constexpr int n = 4;
  const tests::VoxelBody body{{n, n, n}, glm::dvec3(1e-3), std::vector<int>(n * n * n, 1), {{}, {1e4, 0.0}}};
  const double volume = std::pow((n - 1) * 1e-3, 3), across = voxel::across_modulus_Pa(1e4, 0.0);
  for (const double angle : {0.01, 0.17, 0.52}) {
    const double shrunk = 1 - std::cos(angle), slipped = std::sin(angle);
    for (const tests::Energy energy : {tests::Energy::six_link, tests::Energy::accurate}) {
      tests::PlainProblem problem = problem_of(body, energy);
      for (int k = 0; k < n; ++k) {
        for (int j = 0; j < n; ++j) {
          for (int i = 0; i < n; ++i)
            problem.u[body.at(i, j, k)] = {1e-3 * (-shrunk * i - slipped * j),
                                           1e-3 * (slipped * i - shrunk * j), 0.0};
        }
      }
      const double stretch = 2 * 0.5 * 1e4 * shrunk * shrunk;
      const double slip = energy == tests::Energy::six_link ? 2 * 0.5 * across * slipped * slipped : 0.0;
      EXPECT_NEAR(problem.energy_J(), volume * (stretch + slip), 1e-12 * volume * 1e4);
    }
  }
}

}  // namespace
