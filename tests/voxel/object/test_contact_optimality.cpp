// SPDX-License-Identifier: GPL-3.0-or-later
// Does a contact come to rest at the least energy within the limits? The test checks the first-order
// conditions (Karush, Kuhn and Tucker). On every voxel, the springs' force must be balanced by forces of the
// tool and of links at their limits, each with the right sign. The test computes these multipliers itself.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <vector>

#include "tests/voxel/fixtures/soft_press.h"
#include "voxel/lattice/voxel_links.h"

namespace {

using voxel::VoxelId;

// An admissible force. It acts along `way` at one voxel. A link's force also acts against `way` at the link's
// other voxel.
struct Force {
  std::size_t a = 0, b = kNone;  // 3 v for voxel v; b: kNone for the tool
  glm::dvec3 way{0.0};
  double size_N = 0.0;
  static constexpr std::size_t kNone = ~std::size_t{0};
};

class Conditions {
 public:
  Conditions(const tests::SoftBlock& soft, const voxel::ToolInBody& tool)
      : soft_(soft), left_N_(3 * soft.lattice->size()) {
    for (std::size_t i = 0; i < soft.lattice->size(); ++i) {
      const auto v = static_cast<VoxelId>(i);
      if (!soft.lattice->filled(v)) continue;
      for (int d = 0; d < 3; ++d) add_link(v, d);
      const glm::dvec3 out = soft.object->position(v) - tool.centre;
      if (glm::length(out) < soft.object->reach(tool.radius) + kAtTool * soft.h)
        forces_.push_back({3 * i, Force::kNone, glm::normalize(out)});
    }
    for (std::size_t i = 0; i < left_N_.size(); ++i) {
      if (soft.lattice->anchored(static_cast<VoxelId>(i / 3))) left_N_[i] = 0.0;
    }
  }

  // Fits the admissible forces by least squares, one force at a time. Returns the largest residual force on a
  // voxel (N).
  double least_left_N() {
    for (int n = 0; n < kRounds; ++n) {
      for (Force& f : forces_) balance(f);
    }
    double most = 0.0;
    for (std::size_t i = 0; i < left_N_.size(); i += 3)
      most = std::max(most, glm::length(glm::dvec3(left_N_[i], left_N_[i + 1], left_N_[i + 2])));
    return most;
  }
  [[nodiscard]] std::size_t forces() const { return forces_.size(); }

 private:
  static constexpr double kAtTool = 1e-3, kAtLimit = 1e-3;  // in spacings
  static constexpr int kRounds = 20'000;

  void add_link(VoxelId v, int d) {
    const voxel::Lattice& lattice = *soft_.lattice;
    const VoxelId up = lattice.up(v, d);
    if (!lattice.filled(up)) return;
    const glm::dvec3 way = soft_.object->displacement(up) - soft_.object->displacement(v);
    const voxel::Spring spring = lattice.spring(v, d);
    for (int axis = 0; axis < 3; ++axis) {
      const auto ua = static_cast<std::size_t>(axis);
      const double pull = static_cast<double>(spring.on(axis, d)) * way[axis];
      left_N_[3 * v + ua] += pull;
      left_N_[3 * up + ua] -= pull;
      const auto b = lattice.bounds(v, d, axis);
      glm::dvec3 apart(0.0);
      apart[axis] = 1.0;
      if (way[axis] < static_cast<double>(b[0]) + kAtLimit * soft_.h)
        forces_.push_back({3 * up, 3 * v, apart});
      if (way[axis] > static_cast<double>(b[1]) - kAtLimit * soft_.h)
        forces_.push_back({3 * v, 3 * up, apart});
    }
  }

  void balance(Force& f) {
    const auto held = [&](std::size_t at) {
      return at == Force::kNone || soft_.lattice->anchored(static_cast<VoxelId>(at / 3));
    };
    double along = 0.0;
    int ends = 0;
    for (int axis = 0; axis < 3; ++axis) {
      if (!held(f.a)) along += f.way[axis] * left_N_[f.a + static_cast<std::size_t>(axis)];
      if (!held(f.b)) along -= f.way[axis] * left_N_[f.b + static_cast<std::size_t>(axis)];
    }
    ends = (held(f.a) ? 0 : 1) + (held(f.b) ? 0 : 1);
    if (ends == 0) return;
    const double to = std::max(0.0, f.size_N - along / ends), more = to - f.size_N;
    f.size_N = to;
    for (int axis = 0; axis < 3; ++axis) {
      if (!held(f.a)) left_N_[f.a + static_cast<std::size_t>(axis)] += more * f.way[axis];
      if (!held(f.b)) left_N_[f.b + static_cast<std::size_t>(axis)] -= more * f.way[axis];
    }
  }

  const tests::SoftBlock& soft_;
  std::vector<double> left_N_;  // [3 v + axis] residual force
  std::vector<Force> forces_;
};

class AtLimits : public testing::TestWithParam<double> {};  // parameter: depth in spacings

TEST_P(AtLimits, WhatABallPressesComesToItsLeastEnergy) {
  const voxel::LinkMaterial material{
      .young_Pa = 1e4, .poisson = 0.3, .stretch_min = 0.6, .stretch_max = 1.4, .shear = 0.4};
  tests::SoftBlock soft({20, 20, 14}, 1e-3, material);
  const voxel::ToolInBody tool = soft.ball(5e-3, GetParam() * soft.h);
  const voxel::Reaction felt = soft.press(tool, 9e-3, 1e-6, 400);
  Conditions conditions(soft, tool);
  const double left = conditions.least_left_N();
  RecordProperty("forces", static_cast<int>(conditions.forces()));
  RecordProperty("left_share", std::to_string(left / glm::length(felt.force_N)));
  EXPECT_GT(conditions.forces(), 50U) << "no limit is active";
  EXPECT_LE(left, 1e-4 * glm::length(felt.force_N)) << "of " << glm::length(felt.force_N) << " N";
}

INSTANTIATE_TEST_SUITE_P(Depths, AtLimits, testing::Values(2.0, 3.0, 4.0, 5.0));

}  // namespace
