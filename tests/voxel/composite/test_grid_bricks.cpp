// SPDX-License-Identifier: GPL-3.0-or-later
// The accurate energy on a CompositeGrid, against finite elements of the same spacing
// (reference/fem-block.csv).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>

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
  for (std::size_t n = 0; n < static_cast<std::size_t>(volume.dims[0] * volume.dims[1]); ++n)
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
