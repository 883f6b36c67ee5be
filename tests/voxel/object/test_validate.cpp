// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/object/validate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/voxel/fixtures/lattice_scenes.h"
#include "tests/voxel/fixtures/soft_press.h"

namespace {

using tests::block;
using tests::voxel_at;
using voxel::Displacement;
using voxel::Lattice;
using voxel::VoxelId;

TEST(Validate, SaysWhatIsWrong) {
  const Lattice lattice(block({5, 4, 3}, glm::dvec3(1e-3)),
                        tests::made_of({.stretch_min = 0.5, .stretch_max = 1.5, .shear = 0.5}));
  EXPECT_EQ(voxel::validate(lattice), "");
  const Displacement rest(lattice);
  EXPECT_EQ(voxel::validate(lattice, rest, 8.0), "");
  const VoxelId v = voxel_at(lattice, 2, 2, 2), anchor = voxel_at(lattice, 2, 2, 0);
  const auto says = [&](const char* what, const auto& spoil) {
    Displacement state = rest;
    spoil(state);
    const std::string wrong = voxel::validate(lattice, state, 8.0);
    EXPECT_NE(wrong.find(what), std::string::npos) << "'" << wrong << "'";
  };
  says("is at nan", [&](Displacement& s) { s.u[1][v] = std::nanf(""); });
  says("anchored and displaced", [&](Displacement& s) { s.u[0][anchor] = 1e-6F; });
  says("empty and displaced", [&](Displacement& s) { s.u[2][voxel_at(lattice, -1, 2, 2)] = 1e-6F; });
  says("beyond its limits on axis 2", [&](Displacement& s) { s.u[2][v] = -1e-3F; });
  says("counts its roles wrongly", [&](Displacement& s) { s.role[v] = Displacement::held; });
  says("is empty", [&](Displacement& s) { s.set_role(voxel_at(lattice, -1, 2, 2), Displacement::held); });
  says("lies inside",
       [&](Displacement& s) { s.set_role(voxel_at(lattice, 2, 2, 1), Displacement::obstacle); });
}

// A moving tool presses a block tick by tick, until the chain is at its limits. Then the block is released.
TEST(Validate, FindsNothingWhileATickPresses) {
  constexpr double h = 1e-3;
  tests::SoftBlock soft(
      {37, 21, 15}, h,
      {.young_Pa = 1e4, .poisson = 0.3, .stretch_min = 0.9, .stretch_max = 1.1, .shear = 0.1});
  for (int n = 0; n < 60; ++n) {
    voxel::ToolInBody tool = soft.ball(4 * h, (n < 50 ? 0.05 * n : -1.0) * h);
    tool.centre.x += h * std::sin(0.3 * n);
    soft.touch(tool, 8 * h);
    soft.object->push_out(tool);
    soft.object->relax_near(tool, 1);
    soft.object->relax_background(5000);
    ASSERT_EQ(voxel::validate(*soft.lattice, soft.object->state(), 32.0), "") << "tick " << n;
  }
  EXPECT_EQ(voxel::validate(*soft.lattice), "");
}

}  // namespace
