// SPDX-License-Identifier: GPL-3.0-or-later
// The accurate energy on a CompositeGrid, against finite elements of the same spacing
// (reference/fem-block.csv).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <iostream>
#include <numbers>
#include <random>
#include <vector>

#include "tests/shared_data.h"
#include "tests/voxel/composite/slack_material.h"
#include "tests/voxel/fixtures/reference_block.h"
#include "voxel/composite/grid.h"

namespace {

using voxel::CompositeGrid;
using voxel::Lattice;
using Index3 = CompositeGrid::Index3;

Lattice block_of_bricks(const tests::ReferenceRow& row) {
  voxel::LatticeOptions options = tests::made_of(tests::slack(0.9), nullptr);
  const std::vector<double> young = tests::young_by_label(row.material);
  for (std::size_t label = 1; label < young.size(); ++label) {
    options.materials[label] = options.materials[1];
    options.materials[label].young_Pa = young[label];
    options.materials[label].poisson = row.poisson;
    options.materials[label].bricks = true;
  }
  voxel::LabelVolume volume = tests::reference_volume(row);
  for (std::size_t n = 0; n < static_cast<std::size_t>(volume.dims[0]) * volume.dims[1]; ++n)
    options.anchor_voxels.push_back(n);
  return Lattice(std::move(volume), options);
}

struct Forces {
  double force_N, by_energy_N;
};
Forces press_block(const tests::ReferenceRow& row, int half_width, int cycles) {
  const Lattice lattice = block_of_bricks(row);
  CompositeGrid grid(lattice, half_width);
  const auto& dims = lattice.grid().dims;
  const double depth_m = 1e-3;
  const int half = static_cast<int>(std::lround(0.5 * row.width_m / row.spacing_m));
  const Index3 middle{dims[0] / 2, dims[1] / 2, dims[2] - 1};
  grid.begin(middle);
  for (int n = 0; n < cycles; ++n) {
    grid.clear_pressed();
    for (int j = -half; j <= half; ++j) {
      for (int i = -half; i <= half; ++i)
        grid.press({middle[0] + i, middle[1] + j, middle[2]}, {0.0, 0.0, -depth_m}, {0.0, 0.0, -1.0});
    }
    grid.cycle();
  }
  return {grid.force_on_tool_N().z, 2.0 * grid.energy_J() / depth_m};
}

TEST(GridBricks, AllVoxelsAreTheFiniteElements) {
  const auto folder = tests::shared_data("reference");
  SKIP_WITHOUT(folder);
  double worst = 0.0, worst_work = 0.0;
  for (const tests::ReferenceRow& row : tests::reference_rows(folder)) {
    if (row.spacing_m < 0.004) continue;
    const Forces pressed = press_block(row, CompositeGrid::kRefineAll, 80);
    worst = std::max(worst, std::fabs(pressed.force_N / row.force_N - 1.0));
    worst_work = std::max(worst_work, std::fabs(pressed.by_energy_N / pressed.force_N - 1.0));
    EXPECT_NEAR(pressed.force_N, row.force_N, 5e-3 * row.force_N)
        << row.material << ' ' << row.width_m << ' ' << row.poisson;
  }
  std::cout << "[ measured ] all voxels: within " << 100.0 * worst << " %; force against energy "
            << 100.0 * worst_work << " %\n";
  EXPECT_LT(worst_work, 2e-3);
}

TEST(GridBricks, PatchesAreNearTheFiniteElements) {
  const auto folder = tests::shared_data("reference");
  SKIP_WITHOUT(folder);
  double worst = 0.0;
  for (const tests::ReferenceRow& row : tests::reference_rows(folder)) {
    if (row.spacing_m > 0.003 || row.width_m > 0.03) continue;
    const int half = static_cast<int>(std::lround(0.5 * row.width_m / row.spacing_m));
    const Forces pressed = press_block(row, half + CompositeGrid::kHalfWidth, 40);
    std::cout << "[ measured ] patches | " << row.material << " | " << 1e3 * row.width_m << " mm | nu "
              << row.poisson << " | " << 100.0 * (pressed.force_N / row.force_N - 1.0) << " %\n";
    worst = std::max(worst, std::fabs(pressed.force_N / row.force_N - 1.0));
  }
  EXPECT_LT(worst, 0.07);
}

// A ball with smaller balls all over its surface, held at its lower end. Clefts and necks between them lie on
// the sides of patches.
Lattice lumps_of_bricks(unsigned seed) {
  constexpr int kEdge = 64, kLumps = 60;
  constexpr double kMiddle = 0.5 * kEdge, kRadius = 20.0, kLeastLump = 2.0, kLargestLump = 8.0;
  voxel::LatticeOptions options = tests::made_of(tests::slack(0.9), nullptr);
  options.materials[1].poisson = 0.3;
  options.materials[1].bricks = true;
  std::mt19937 random(seed);
  const auto share = [&] { return static_cast<double>(random()) / static_cast<double>(std::mt19937::max()); };
  struct Ball {
    glm::dvec3 centre;
    double radius;
  };
  std::vector<Ball> balls{{glm::dvec3(kMiddle), kRadius}};
  for (int n = 0; n < kLumps; ++n) {
    const double height = 2.0 * share() - 1.0, angle = 2.0 * std::numbers::pi * share();
    const double level = std::sqrt(1.0 - height * height);
    const glm::dvec3 way(level * std::cos(angle), level * std::sin(angle), height);
    balls.push_back({kMiddle + kRadius * way, kLeastLump + (kLargestLump - kLeastLump) * share()});
  }
  voxel::LabelVolume volume;
  volume.dims = {kEdge, kEdge, kEdge};
  volume.spacing_m = glm::dvec3(2e-3);
  volume.labels.assign(static_cast<std::size_t>(kEdge) * kEdge * kEdge, 0);
  for (int k = 0; k < kEdge; ++k) {
    for (int j = 0; j < kEdge; ++j) {
      for (int i = 0; i < kEdge; ++i) {
        const glm::dvec3 at(i, j, k);
        if (std::ranges::none_of(balls,
                                 [&](const Ball& b) { return glm::distance(at, b.centre) < b.radius; }))
          continue;
        const std::size_t n = volume.index(i, j, k);
        volume.labels[n] = 1;
        if (glm::distance(at, balls[0].centre) < kRadius && k < kMiddle - 0.8 * kRadius)
          options.anchor_voxels.push_back(n);
      }
    }
  }
  return Lattice(std::move(volume), options);
}

// Weak nodes beside stiff bricks, at sides of patches and at anchors, must not make cycles diverge.
TEST(GridBricks, BodiesThatPatchesCutComeToRest) {
  double worst = 0.0;
  for (const unsigned seed : {1U, 7U, 11U}) {
    const CompositeGrid::Suitability found = CompositeGrid::suitability(lumps_of_bricks(seed));
    EXPECT_EQ(found.reason, "") << "seed " << seed;
    worst = std::max(worst, found.force_error);
  }
  std::cout << "[ measured ] beside patches twice as wide: within " << 100.0 * worst << " %\n";
  EXPECT_LT(worst, 0.03);
}

// Nearly incompressible tissue comes to rest, and in few cycles.
TEST(GridBricks, NearlyIncompressibleTissueComesToRest) {
  for (const int half_width : {CompositeGrid::kRefineAll, 8}) {
    const tests::ReferenceRow row{"layers", 0.0025, 0.02, 0.49, 0.0};
    const Forces soon = press_block(row, half_width, 15), late = press_block(row, half_width, 60),
                 later = press_block(row, half_width, 120);
    std::cout << "[ measured ] " << soon.force_N << ' ' << late.force_N << ' ' << later.force_N << " N\n";
    EXPECT_NEAR(soon.force_N, later.force_N, 0.02 * later.force_N);
    EXPECT_NEAR(late.force_N, later.force_N, 1e-3 * later.force_N);
  }
}

}  // namespace
