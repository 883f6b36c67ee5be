// SPDX-License-Identifier: GPL-3.0-or-later
// The error of the force that thinning causes, at equilibrium and against the full object.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <glm/geometric.hpp>
#include <memory>
#include <vector>

#include "tests/voxel/fixtures/soft_press.h"
#include "voxel/volume/interior_coarsening.h"

namespace {

using voxel::LabelVolume;

constexpr std::uint8_t kTissue = 1, kBone = 2;
constexpr double kTissuePa = 1e4;

// A block of tissue with bone under `cover` voxels of it.
struct Block {
  int cover;         // voxels of tissue above the bone
  double ratio;      // modulus of bone, divided by the modulus of tissue
  bool embedded;     // true: a slab of bone with tissue around it; false: all below the cover is bone
  int every, shell;  // as in ThinningOptions; every = 0: not thinned
  int high;          // height (voxels)
};

constexpr int kWide = 48;

struct Pressed {
  double force_N = 0.0;
  std::size_t stiff = 0, removed = 0;
};

Pressed press(const Block& block) {
  LabelVolume v = tests::block({kWide, kWide, block.high}, glm::dvec3(1e-3));
  for (int k = 0; k < block.high; ++k) {
    for (int j = 0; j < kWide; ++j) {
      for (int i = 0; i < kWide; ++i) {
        bool bone = k < block.high - block.cover;
        if (block.embedded) bone = bone && k >= 6 && std::min(i, j) >= 6 && std::max(i, j) < kWide - 6;
        v.labels[v.index(i, j, k)] = bone ? kBone : kTissue;
      }
    }
  }
  voxel::LatticeOptions options =
      tests::made_of({.young_Pa = kTissuePa, .stretch_min = 0.01, .stretch_max = 9.0, .shear = 9.0});
  options.materials[kBone].young_Pa = kTissuePa * block.ratio;
  Pressed result;
  if (block.every > 0) {
    voxel::Thinned thinned = voxel::thin_labels(
        std::move(v), {.labels = {kBone}, .every = block.every, .shell = block.shell, .tool_radius_m = 6e-3});
    v = std::move(thinned.volume);
    options.materials[thinned.strut_label[kBone]] = options.materials[kBone];
    options.materials[thinned.strut_label[kBone]].young_Pa *= block.every * block.every;
    result.stiff = thinned.stiff;
    result.removed = thinned.removed;
  }
  const auto lattice = std::make_shared<const voxel::Lattice>(v, options);
  voxel::SoftObject object(lattice);
  voxel::ToolInBody tool;
  tool.radius = 6e-3;
  const double top = (block.high - 1) * 1e-3, middle = 0.5e-3 * (kWide - 1);
  tool.centre = {middle, middle, top + object.reach(tool.radius) - 1.5e-3};
  std::vector<voxel::VoxelId> near;
  for (const voxel::VoxelId s : lattice->surface()) {
    const glm::dvec3 rest = lattice->rest(s);
    if (rest.z > top - 0.5e-3 && glm::length(glm::dvec2(rest - tool.centre)) <= 8e-3) near.push_back(s);
  }
  object.touch(near);
  const bool settled = object.settle(tool, 1e-5 * lattice->force_scale_N(), 3000);
  result.force_N = glm::length(object.reaction(tool).force_N);
  if (!settled) std::printf("(not settled: %.2g N left)\n", object.residual_N());
  return result;
}

struct Case {
  const char* name;
  int cover;
  bool embedded;
};
constexpr Case kDeep{"slab of bone in tissue, 6 voxels deep", 6, true};
constexpr Case kShallow{"slab of bone in tissue, 2 voxels deep", 2, true};
constexpr Case kUnder{"bone under 2 voxels of tissue", 2, false};
constexpr Case kBare{"bare bone", 0, false};

// Prints a row for each kind of thinning and returns the largest error of the force.
double worst_error(const Case& c, int high, const std::vector<std::array<int, 2>>& every_and_shell) {
  const Pressed full = press({c.cover, 100.0, c.embedded, 0, 0, high});
  double worst = 0.0;
  for (const auto& [every, shell] : every_and_shell) {
    const Pressed thin = press({c.cover, 100.0, c.embedded, every, shell, high});
    const double error = thin.force_N / full.force_N - 1.0;
    const double left = 1.0 - static_cast<double>(thin.removed) / static_cast<double>(thin.stiff);
    std::printf("| %s, %d voxels high | %d | %d | %.0f %% | %+.1f %% |\n", c.name, high, every, shell,
                100.0 * left, 100.0 * error);
    worst = std::max(worst, std::abs(error));
  }
  return worst;
}

constexpr double kJnd = 0.07;

// A plane of struts right under the surface carries the load, but a plane further down does not. So the
// height decides where the planes of struts lie, and several heights are tested.
constexpr std::array<int, 3> kHeights{35, 36, 37};

TEST(ThinnedForce, IsWithinAJustNoticeableDifferenceWithTheDefaultShell) {
  for (const int high : kHeights) EXPECT_LT(worst_error(kBare, high, {{2, 1}, {3, 2}, {4, 3}, {6, 5}}), kJnd);
  EXPECT_LT(worst_error(kShallow, 36, {{3, 2}, {4, 3}}), kJnd);
}

TEST(ThinnedForce, IsWithinAJustNoticeableDifferenceWithAThinShell) {
  for (const int high : kHeights) EXPECT_LT(worst_error(kBare, high, {{3, 1}, {4, 1}}), kJnd);
  EXPECT_LT(worst_error(kShallow, 36, {{3, 1}, {4, 1}, {6, 1}}), kJnd);
}

// The thinned inside has the modulus of the material. Within one cube of struts, the links through each plane
// add up. Over n planes in a row, they are as stiff as the links of the full object.
TEST(ThinnedForce, StrutsAreAsStiffAsWhatTheyStandFor) {
  for (const int n : {2, 3, 4, 6}) {
    LabelVolume v = tests::block({40, 40, 40}, {1e-3, 1.5e-3, 2e-3}, kBone);
    voxel::LatticeOptions options = tests::made_of(tests::elastic(1e6, 0.3));
    const voxel::Lattice full(v, options);
    const voxel::Thinned thinned =
        voxel::thin_labels(v, {.labels = {kBone}, .every = n, .shell = 2, .tool_radius_m = 0.1});
    options.materials[thinned.strut_label[kBone]].young_Pa *= n * n;
    const voxel::Lattice thin(thinned.volume, options);
    const int first = 2 * n, last = first + n;  // a cube of struts far from the surface
    for (int d = 0; d < 3; ++d) {
      std::array<double, 2> along{},
          across{};  // compliance of the n planes in a row: [0] full object, [1] struts
      for (int plane = first; plane < last; ++plane) {
        std::array<double, 2> sum_along{}, sum_across{};
        for (int b = first; b < last; ++b) {
          for (int a = first; a < last; ++a) {
            std::array<int, 3> at{};
            at[static_cast<std::size_t>(d)] = plane;
            at[static_cast<std::size_t>((d + 1) % 3)] = a;
            at[static_cast<std::size_t>((d + 2) % 3)] = b;
            const voxel::Spring was = full.spring(tests::voxel_at(full, at[0], at[1], at[2]), d);
            const voxel::Spring is = thin.spring(tests::voxel_at(thin, at[0], at[1], at[2]), d);
            sum_along[0] += static_cast<double>(was.along);
            sum_along[1] += static_cast<double>(is.along);
            sum_across[0] += static_cast<double>(was.across);
            sum_across[1] += static_cast<double>(is.across);
          }
        }
        for (std::size_t which = 0; which < 2; ++which) {
          along[which] += 1.0 / sum_along[which];
          across[which] += 1.0 / sum_across[which];
        }
      }
      EXPECT_NEAR(along[1], along[0], 1e-6 * along[0]) << "every " << n << ", direction " << d;
      EXPECT_NEAR(across[1], across[0], 1e-6 * across[0]) << "every " << n << ", direction " << d;
    }
  }
}

// Prints every row of the table of thinning. The table gives the worst of the three heights.
TEST(ThinnedForce, DISABLED_Table) {
  for (const Case& c : {kDeep, kShallow, kUnder, kBare}) {
    for (const int high : kHeights)
      worst_error(c, high, {{2, 1}, {3, 1}, {3, 2}, {4, 1}, {4, 3}, {6, 1}, {6, 5}});
  }
}

}  // namespace
