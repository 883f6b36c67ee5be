// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/volume/analytic_shapes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <stdexcept>

namespace {

using voxel::Formula;
using voxel::Inclusion;
using voxel::LabelVolume;
using voxel::make_volume;

constexpr std::size_t kMillions = 20'000'000;

std::map<int, std::size_t> counts(const LabelVolume& volume) {
  std::map<int, std::size_t> result;
  for (const std::uint8_t label : volume.labels) ++result[label];
  return result;
}

glm::dvec3 centre_of(const LabelVolume& volume, int i, int j, int k) {
  return volume.origin_m + glm::dvec3(i, j, k) * volume.spacing_m;
}

// The message of the refusal; empty if the formula is accepted.
std::string refusal(const Formula& formula, std::size_t max_voxels = kMillions) {
  try {
    make_volume(formula, max_voxels);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return {};
}

Formula block(double x, double y, double z, double spacing) {
  Formula formula;
  formula.size_m = {x, y, z};
  formula.spacing_m = glm::dvec3(spacing);
  return formula;
}

TEST(Formula, BlockHasRoundedCountsAndItsMiddleAtTheOrigin) {
  Formula formula = block(0.1, 0.05, 0.03, 2.5e-3);
  formula.spacing_m.z = 2e-3;
  formula.label = 7;
  const LabelVolume volume = make_volume(formula, kMillions);
  EXPECT_EQ(volume.dims, (std::array{40, 20, 15}));
  EXPECT_EQ(counts(volume), (std::map<int, std::size_t>{{7, 40U * 20U * 15U}}));
  const glm::dvec3 middle = 0.5 * (centre_of(volume, 0, 0, 0) + centre_of(volume, 39, 19, 14));
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(middle[axis], 0.0, 1e-15);
}

TEST(Formula, BallHasItsVolumeAndHoldsExactlyTheCentresInside) {
  for (const double diameter : {0.021, 0.04, 0.0405}) {
    Formula formula = block(diameter, 0.0, 0.0, 1e-3);  // only x is used
    formula.shape = Formula::Shape::ball;
    formula.spacing_m = {1e-3, 0.8e-3, 1.3e-3};
    const LabelVolume volume = make_volume(formula, kMillions);
    const double cell = formula.spacing_m.x * formula.spacing_m.y * formula.spacing_m.z;
    const double exact = std::numbers::pi / 6.0 * std::pow(diameter, 3.0);
    EXPECT_NEAR(static_cast<double>(counts(volume)[1]) * cell, exact, 0.01 * exact);
    for (int k = 0; k < volume.dims[2]; ++k) {
      for (int j = 0; j < volume.dims[1]; ++j) {
        for (int i = 0; i < volume.dims[0]; ++i) {
          const glm::dvec3 p = centre_of(volume, i, j, k);
          const double distance = std::sqrt(p.x * p.x + p.y * p.y + p.z * p.z);
          if (std::abs(distance - 0.5 * diameter) < 1e-9) continue;
          ASSERT_EQ(volume.labels[volume.index(i, j, k)] != 0, distance < 0.5 * diameter);
        }
      }
    }
    // The lattice misses no voxel. One more voxel at either end would have its centre outside the shape.
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_LT(volume.origin_m[axis] - volume.spacing_m[axis], -0.5 * diameter + 1e-12);
    }
  }
}

TEST(Formula, LayersStackFromTheBottom) {
  Formula formula = block(0.01, 0.01, 0.02, 1e-3);
  formula.label = 9;
  formula.layers = {{0.004, 2}, {0.0035, 3}, {0.0025, 0}};  // boundaries at 4, 7.5 and 10 spacings
  const LabelVolume volume = make_volume(formula, kMillions);
  for (int k = 0; k < 20; ++k) {
    // The centre of slice 7 lies exactly on a boundary. It belongs to the layer above.
    const int expected = k < 4 ? 2 : k < 7 ? 3 : k < 10 ? 0 : 9;
    for (int j = 0; j < 10; ++j) {
      for (int i = 0; i < 10; ++i) ASSERT_EQ(volume.labels[volume.index(i, j, k)], expected) << k;
    }
  }
}

TEST(Formula, LaterInclusionsWinAndStayInsideTheShape) {
  Formula formula = block(0.04, 0.04, 0.04, 1e-3);
  Inclusion box;
  box.shape = Inclusion::Shape::box;
  box.size_m = {0.02, 0.01, 0.006};
  box.label = 2;
  Inclusion ball;
  ball.centre_m = {0.01, 0.0, 0.0};
  ball.size_m = {0.01, 0.0, 0.0};
  ball.label = 3;
  Inclusion cavity = box;
  cavity.size_m = {0.002, 0.002, 0.002};
  cavity.label = 0;
  formula.inclusions = {box, ball, cavity};
  const LabelVolume volume = make_volume(formula, kMillions);
  std::map<int, std::size_t> expected;
  for (int k = 0; k < 40; ++k) {
    for (int j = 0; j < 40; ++j) {
      for (int i = 0; i < 40; ++i) {
        const glm::dvec3 p = centre_of(volume, i, j, k) * 1e3;
        int label = 1;
        if (std::abs(p.x) < 10 && std::abs(p.y) < 5 && std::abs(p.z) < 3) label = 2;
        if ((p.x - 10) * (p.x - 10) + p.y * p.y + p.z * p.z <= 25.0) label = 3;
        if (std::abs(p.x) < 1 && std::abs(p.y) < 1 && std::abs(p.z) < 1) label = 0;
        ++expected[label];
        ASSERT_EQ(volume.labels[volume.index(i, j, k)], label);
      }
    }
  }
  EXPECT_EQ(counts(volume), expected);
  EXPECT_EQ(expected[0], 8U);

  formula.shape =
      Formula::Shape::ball;  // a box that is larger than the ball fills the whole ball and nothing else
  const std::size_t filled = kMillions;
  formula.inclusions = {};
  const std::size_t ball_voxels = counts(make_volume(formula, filled))[1];
  box.size_m = glm::dvec3(1.0);
  formula.inclusions = {cavity, box};
  std::map<int, std::size_t> found = counts(make_volume(formula, filled));
  EXPECT_EQ(found[2], ball_voxels);
  EXPECT_EQ(found[1], 0U);
}

TEST(Formula, InclusionFarOutsideOrHugeIsHarmless) {
  Formula formula = block(0.01, 0.01, 0.01, 1e-3);
  Inclusion far;
  far.centre_m = {1e6, 0.0, 0.0};
  far.size_m = glm::dvec3(1.0);
  formula.inclusions = {far};
  EXPECT_EQ(counts(make_volume(formula, kMillions))[1], 1000U);
  formula.inclusions[0].size_m = glm::dvec3(1e300);
  formula.inclusions[0].shape = Inclusion::Shape::box;
  EXPECT_EQ(counts(make_volume(formula, kMillions))[2], 1000U);
}

TEST(Formula, OneVoxelAndSheets) {
  EXPECT_EQ(make_volume(block(1e-6, 1e-6, 1e-6, 1e-6), 1).voxel_count(), 1U);
  EXPECT_EQ(make_volume(block(10.0, 100.0, 10.0, 10.0), 10).voxel_count(), 10U);
  EXPECT_EQ(make_volume(block(0.1, 0.1, 1e-3, 1e-3), kMillions).dims, (std::array{100, 100, 1}));
}

TEST(Formula, RefusesWithTheNumbers) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinite = std::numeric_limits<double>::infinity();
  for (const double bad : {0.0, -1.0, nan, infinite}) {
    EXPECT_NE(refusal(block(bad, 0.01, 0.01, 1e-3)), "") << bad;
    EXPECT_NE(refusal(block(0.01, 0.01, 0.01, bad)), "") << bad;
    Formula ball = block(bad, 0.01, 0.01, 1e-3);
    ball.shape = Formula::Shape::ball;
    EXPECT_NE(refusal(ball), "") << bad;
    Formula layered = block(0.01, 0.01, 0.01, 1e-3);
    layered.layers = {{bad, 2}};
    EXPECT_NE(refusal(layered), "") << bad;
    Formula included = block(0.01, 0.01, 0.01, 1e-3);
    included.inclusions.resize(1);
    included.inclusions[0].size_m = {bad, bad, bad};
    EXPECT_NE(refusal(included), "") << bad;
  }
  EXPECT_NE(refusal(block(0.1, 0.1, 0.1, 1e-3), 999'999).find("100 x 100 x 100"), std::string::npos);
  EXPECT_EQ(refusal(block(0.1, 0.1, 0.1, 1e-3), 1'000'000), "");
  EXPECT_NE(refusal(block(1e300, 1e300, 1e300, 1e-300)), "");
  EXPECT_NE(refusal(block(1e300, 1e-3, 1e-3, 1e-3), std::numeric_limits<std::size_t>::max()), "");
  EXPECT_NE(refusal(block(4e-4, 0.01, 0.01, 1e-3)).find("half of its spacing"), std::string::npos);
  Formula layered = block(0.01, 0.01, 0.01, 1e-3);
  layered.layers = {{0.006, 2}, {0.006, 3}};
  EXPECT_NE(refusal(layered).find("0.012"), std::string::npos);
  layered.layers = {{0.006, 2}};
  layered.shape = Formula::Shape::ball;
  EXPECT_NE(refusal(layered), "");
  Formula empty = block(0.01, 0.01, 0.01, 1e-3);
  empty.label = 0;
  EXPECT_NE(refusal(empty), "");
}

}  // namespace
