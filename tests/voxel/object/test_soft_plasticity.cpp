// SPDX-License-Identifier: GPL-3.0-or-later
// Plasticity of a whole soft object: a row of links against closed forms, and a dent.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <iostream>
#include <memory>
#include <vector>

#include "tests/voxel/fixtures/soft_press.h"

namespace {

using tests::SoftBlock;
using tests::voxel_at;
using voxel::LinkMaterial;
using voxel::SoftObject;
using voxel::VoxelId;

constexpr double kH = 1e-3, kYoung = 1e4;

LinkMaterial yielding(double yield) {
  LinkMaterial m = tests::elastic(kYoung, 0.3);
  m.yield = yield;
  return m;
}

// A row of ten voxels on an anchor. The top voxel has another label.
struct Column {
  std::shared_ptr<const voxel::Lattice> lattice;
  SoftObject object;
  VoxelId top;

  Column(double yield, double yield_at_top)
      : lattice(lattice_of(yield, yield_at_top)), object(lattice), top(voxel_at(*lattice, 0, 0, 9)) {}

  static std::shared_ptr<const voxel::Lattice> lattice_of(double yield, double yield_at_top) {
    voxel::LabelVolume volume = tests::block({1, 1, 10}, glm::dvec3(kH));
    volume.labels.back() = 2;
    voxel::LatticeOptions options = tests::made_of(yielding(yield));
    options.materials[2] = yielding(yield_at_top);
    return std::make_shared<voxel::Lattice>(volume, options);
  }
  void rest() {
    for (int n = 0; n < 3000 && !object.asleep(); ++n) object.relax_cycle();
    EXPECT_TRUE(object.asleep());
  }
  // Upward force on the top voxel while it is held at the displacement `u` (N).
  double hold_at(double u) {
    object.claim(top);
    object.move(top, {0.0, 0.0, u});
    rest();
    return voxel::link_force(*lattice, object.state(), top).z;
  }
  double let_go() {
    object.release(top);
    rest();
    return object.state().at(top).z;
  }
};

constexpr double kStiffness = kYoung * kH;  // of a link of a row (N/m)

TEST(SoftYield, ARowOfLinksYieldsAsOne) {
  const double yield = 0.05, most = 9 * yield * kH;
  Column column(yield, yield);
  EXPECT_NEAR(column.hold_at(-0.9 * most), kStiffness * 0.9 * yield * kH, 1e-3 * kStiffness * yield * kH);
  EXPECT_NEAR(column.let_go(), 0.0, 1e-3 * most);
  // at twice the yield strain, half of the strain stays
  EXPECT_NEAR(column.hold_at(-2.0 * most), kStiffness * yield * kH, 1e-3 * kStiffness * yield * kH);
  EXPECT_NEAR(column.let_go(), -most, 1e-3 * most);
  // from there the row is elastic up to the previous depth, and up to yield in the other direction
  EXPECT_NEAR(column.hold_at(-1.5 * most), 0.5 * kStiffness * yield * kH, 1e-3 * kStiffness * yield * kH);
  EXPECT_NEAR(column.let_go(), -most, 1e-3 * most);
  EXPECT_NEAR(column.hold_at(1.0 * most), -kStiffness * yield * kH, 1e-3 * kStiffness * yield * kH);
  EXPECT_NEAR(column.let_go(), 0.0, 2e-3 * most);
}

TEST(SoftYield, TheWeakestLinkTakesWhatIsBeyond) {
  const double weak = 0.02, pressed = 0.5 * kH;
  Column column(0.2, weak);
  // Eight links are compressed by the force at which the ninth yields. The ninth takes the rest.
  EXPECT_NEAR(column.hold_at(-pressed), kStiffness * weak * kH, 2e-3 * kStiffness * weak * kH);
  EXPECT_NEAR(column.let_go(), -(pressed - 9 * weak * kH), 2e-3 * pressed);
}

// A block that a ball presses and then leaves.
struct Dented {
  static constexpr std::array<int, 3> kSize{25, 25, 17};

  SoftBlock soft{kSize, kH, yielding(0.1)};
  const double radius = 6 * kH, depth = 2.5 * kH, range = 9 * kH;

  double press(double to) {
    const voxel::ToolInBody tool = soft.ball(radius, to);
    soft.press(tool, range, 1e-5, 300);
    while (!soft.object->asleep()) soft.object->relax_cycle();
    return soft.object->reaction(tool).force_N.z;
  }
  double leave() {
    soft.object->touch({});
    while (!soft.object->asleep()) soft.object->relax_cycle();
    return -soft.object->state().at(middle()).z;
  }
  [[nodiscard]] VoxelId middle() const { return voxel_at(*soft.lattice, 12, 12, 16); }
};

TEST(SoftYield, ABlockKeepsItsDent) {
  Dented first, second;
  SoftBlock elastic(Dented::kSize, kH, tests::elastic(kYoung, 0.3));
  const double full = elastic.press(elastic.ball(first.radius, first.depth), first.range).force_N.z;
  const double force = first.press(first.depth), dent = first.leave();
  std::cout << "pressed " << first.depth / kH << " spacings deep: " << force << " N (elastic " << full
            << " N), a dent of " << dent / kH << " spacings stays\n";
  EXPECT_LT(force, 0.95 * full);
  EXPECT_GT(force, 0.1 * full);
  EXPECT_GT(dent, 0.2 * first.depth);
  EXPECT_LT(dent, first.depth);
  EXPECT_LE(voxel::worst_violation(*first.soft.lattice, first.soft.object->state()), 1e-8);
  // a second run is the same to the last bit
  EXPECT_EQ(second.press(second.depth), force);
  EXPECT_EQ(second.leave(), dent);
  // a load below the last one does not change the dent
  const double less = first.press(dent + 0.4 * (first.depth - dent));
  EXPECT_GT(less, 0.0);
  EXPECT_LT(less, 0.9 * force);
  const double again = first.leave();
  std::cout << "after " << less << " N: " << again / kH << " spacings\n";
  EXPECT_NEAR(again, dent, 0.01 * dent);
}

// A copy has the dent, and continues like the original.
TEST(SoftYield, ACopyHasTheDent) {
  Dented dented;
  dented.press(dented.depth);
  const double dent = dented.leave();
  const auto copy = dented.soft.object->copy();
  EXPECT_EQ(-copy->state().at(dented.middle()).z, dent);
  copy->touch({});
  for (int n = 0; n < 50; ++n) copy->relax_cycle();
  EXPECT_NEAR(-copy->state().at(dented.middle()).z, dent, 1e-3 * dent);
  EXPECT_NEAR(copy->energy_J(), dented.soft.object->energy_J(), 1e-3 * copy->energy_J());
}

// Tissue that cannot yield takes no memory for plasticity.
TEST(SoftYield, CostsNothingWhereNothingYields) {
  SoftBlock soft(Dented::kSize, kH, tests::elastic(kYoung, 0.3));
  EXPECT_EQ(soft.object->state().plastic.row.size(), 0U);
  Dented dented;
  dented.press(0.05 * kH);
  dented.leave();
  const voxel::PlasticOffsets& rest = dented.soft.object->state().plastic;
  EXPECT_LE(rest.memory_bytes(), rest.row.size());
}

}  // namespace
