// SPDX-License-Identifier: GPL-3.0-or-later
// Newtons from Young's modulus and Poisson's ratio: Hertz's ball, the flat punch, and a finite-element block.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <numbers>
#include <sstream>
#include <string>

#include "tests/shared_data.h"
#include "tests/voxel/soft_press.h"

namespace {

using tests::elastic;
using tests::SoftBlock;
using tests::voxel_at;
using voxel::Reaction;
using voxel::VoxelId;

constexpr double kH = 1e-3, kYoung = 1e4;

double contact_modulus(double poisson) {
  return kYoung / (1 - poisson * poisson);
}

// Under a sanitizer a smaller block, where the far field is cut off sooner: it looks for errors, not for
// percents.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr std::array<int, 3> kBlock{41, 41, 31};
constexpr double kPart = 0.35;
#else
constexpr std::array<int, 3> kBlock{100, 100, 80};
constexpr double kPart = 0.1;
#endif

TEST(Calibration, ABallIsHertzs) {
  const double radius = 20 * kH;
  for (const double poisson : {0.0, 0.3, 0.45}) {
    SoftBlock soft(kBlock, kH, elastic(kYoung, poisson));
    for (const double a : {4.0, 6.0, 9.0}) {  // contact radius, in spacings
      const double depth = a * a / 20 * kH;
      const double found = soft.press(soft.ball(radius, depth), 16 * kH, 1e-4, 200).force_N.z;
      const double expected = 4.0 / 3.0 * contact_modulus(poisson) * std::sqrt(radius) * std::pow(depth, 1.5);
      std::cout << "Hertz | nu " << poisson << " | contact radius " << a << " | " << found << " N | "
                << expected << " N | " << std::showpos << 100 * (found / expected - 1) << std::noshowpos
                << " %\n";
      EXPECT_TRUE(soft.settled);
      EXPECT_NEAR(found, expected, kPart * expected);
    }
  }
}

TEST(Calibration, AFlatPunchIsTheHalfSpaces) {
  const double depth = 1.0 * kH;
  for (const double radius : {4.6, 8.6}) {
    for (const double poisson : {0.0, 0.3, 0.45}) {
      SoftBlock soft(kBlock, kH, elastic(kYoung, poisson));
      const Reaction felt = soft.press(soft.punch(radius * kH, depth), (radius + 4) * kH, 1e-4, 200);
      // The punch ends somewhere between its outermost voxels and those it just misses: its area is that of
      // its voxels.
      const double a = std::sqrt(felt.pressed / std::numbers::pi) * kH;
      const double expected = 2 * a * contact_modulus(poisson) * depth;
      std::cout << "punch | radius " << radius << " (" << felt.pressed << " voxels, a = " << a / kH
                << ") | nu " << poisson << " | " << felt.force_N.z << " N | " << expected << " N | "
                << std::showpos << 100 * (felt.force_N.z / expected - 1) << std::noshowpos << " %\n";
      EXPECT_TRUE(soft.settled);
      EXPECT_NEAR(felt.force_N.z, expected, (radius < 5 ? kPart : std::max(kPart, 0.15)) * expected);
    }
  }
}

// The block of the reference is 100 × 100 × 60 mm with its base held and a square punch on top
// (reference/README.md). Two ways to make voxels of it: one in each finite element, as a volume file would
// have it, and one at each node, so that the same points are held. A layer of anchors stands below either.
enum class Voxels { in_elements, at_nodes };

double pressed_square(Voxels voxels, double spacing, double width, double poisson) {
  const int extra = voxels == Voxels::at_nodes ? 1 : 0;
  const int n = static_cast<int>(std::lround(0.1 / spacing)) + extra,
            nz = static_cast<int>(std::lround(0.06 / spacing)) + 1;
  SoftBlock soft({n, n, nz}, spacing, elastic(kYoung, poisson));
  std::vector<VoxelId> held;
  const int wide = static_cast<int>(std::lround(width / spacing)) + extra, first = (n - wide) / 2;
  for (int j = first; j < first + wide; ++j) {
    for (int i = first; i < first + wide; ++i) held.push_back(voxel_at(*soft.lattice, i, j, nz - 1));
  }
  for (const VoxelId v : held) soft.object->hold(v);
  for (const VoxelId v : held) soft.object->move(v, {0.0, 0.0, -1e-3});
  for (int cycle = 0; cycle < 400 && !soft.object->asleep(); ++cycle) {
    soft.object->relax_background(soft.object->relaxation().cycle_cost());
  }
  double force = 0.0;
  for (const VoxelId v : held) {
    EXPECT_FLOAT_EQ(static_cast<float>(soft.object->state().at(v).z), -1e-3F);
    force += voxel::link_force(*soft.lattice, soft.object->state(), v).z;
  }
  return force;
}

TEST(Calibration, AHomogeneousBlockIsTheFiniteElements) {
  const auto folder = tests::shared_data("reference");
  SKIP_WITHOUT(folder);
  std::ifstream file(folder / "fem-block.csv");
  std::string line;
  std::getline(file, line);
  int rows = 0;
  while (std::getline(file, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream stream(line);
    std::string material;
    double spacing = 0.0, width = 0.0, poisson = 0.0, expected = 0.0;
    stream >> material >> spacing >> width >> poisson >> expected;
    if (material != "hom" || !stream) continue;
    ++rows;
    const double found = pressed_square(Voxels::in_elements, spacing, width, poisson);
    const double at_nodes = pressed_square(Voxels::at_nodes, spacing, width, poisson);
    std::cout << "FEM | spacing " << spacing * 1e3 << " mm | punch " << width * 1e3 << " mm | nu " << poisson
              << " | " << found << " N | " << expected << " N | " << std::showpos
              << 100 * (found / expected - 1)
              << " % (a voxel at each node: " << 100 * (at_nodes / expected - 1) << std::noshowpos << " %)\n";
    EXPECT_NEAR(found, expected, 0.1 * expected) << line;
  }
  EXPECT_GE(rows, 18);
}

}  // namespace
