// SPDX-License-Identifier: GPL-3.0-or-later
// Relaxation lets pressed voxels slide on the tool's surface.
#include "voxel/multigrid/tangential_contact.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <iostream>
#include <random>
#include <vector>

#include "tests/voxel/fixtures/lattice_scenes.h"
#include "tests/voxel/fixtures/soft_press.h"
#include "voxel/lattice/voxel_links.h"

namespace {

using tests::elastic;
using tests::SoftBlock;
using voxel::Displacement;
using voxel::Lattice;
using voxel::LevelStiffness;
using voxel::VoxelId;

constexpr double kH = 2e-3;  // spacing (m)

// One voxel on an inclined surface, with random displacements of its neighbours. It moves along the surface,
// in the direction of the force, to the point without tangential force.
TEST(Sliding, GoesToTheLeastEnergyAlongTheTool) {
  const Lattice lattice(tests::block({6, 6, 6}, glm::dvec3(kH)), tests::made_of(elastic(1e4, 0.3)));
  LevelStiffness couplings(lattice, nullptr);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> some(-0.1F, 0.1F);
  std::normal_distribution<float> any;
  const VoxelId v = lattice.grid().at(2, 3, 5);
  for (int n = 0; n < 100; ++n) {
    Displacement state(lattice);
    for (VoxelId w = 0; w < lattice.size(); ++w) {
      for (auto& axis : state.u) axis[w] = lattice.filled(w) ? some(random) * static_cast<float>(kH) : 0.0F;
    }
    const glm::vec3 normal = glm::normalize(glm::vec3(any(random), any(random), any(random)));
    state.set_role(v, Displacement::pressed);
    state.tool_normal[lattice.surface_number(v)] = normal;
    const glm::dvec3 load(1e-3 * static_cast<double>(any(random)), 0.0, 2e-4), before = state.at(v);
    const auto pulled = voxel::sliding_force(couplings, state, v, load);
    ASSERT_TRUE(pulled);
    EXPECT_NEAR(glm::dot(*pulled, glm::dvec3(normal)), 0.0, 1e-6 * glm::length(*pulled));
    const float went = voxel::slide(couplings, state, v, load);
    const glm::dvec3 way = state.at(v) - before;
    EXPECT_NEAR(glm::dot(way, glm::dvec3(normal)), 0.0, 1e-5 * kH);
    EXPECT_GT(glm::dot(way, *pulled), 0.0);
    EXPECT_LE(went, static_cast<float>(glm::length(way)) * 1.001F);
    EXPECT_LT(glm::length(*voxel::sliding_force(couplings, state, v, load)), 1e-3 * glm::length(*pulled));
  }
}

// A voxel at its limit on one axis does not move along the others, because it would leave the surface.
TEST(Sliding, StaysWhereLinksKeepIt) {
  const voxel::LinkMaterial tied{.young_Pa = 1e4, .stretch_min = 0.99, .stretch_max = 1.01, .shear = 0.01};
  const Lattice lattice(tests::block({6, 6, 6}, glm::dvec3(kH)), tests::made_of(tied));
  LevelStiffness couplings(lattice, nullptr);
  Displacement state(lattice);
  const VoxelId v = lattice.grid().at(2, 3, 5);
  state.set_role(v, Displacement::pressed);
  state.tool_normal[lattice.surface_number(v)] = glm::normalize(glm::vec3(1.0F, 0.5F, 0.2F));
  const glm::dvec3 far(0.0, 0.1 * kH, -0.1 * kH), load(0.0, 1.0, -0.5);
  EXPECT_EQ(voxel::slide_by(couplings, state, v, far), 0.0F);
  EXPECT_EQ(voxel::slide(couplings, state, v, load), 0.0F);
  EXPECT_FALSE(voxel::sliding_force(couplings, state, v, load));
  EXPECT_EQ(state.at(v), glm::dvec3(0.0));
}

// A ball at rest in a block moves further by `step` spacings. Returns the error of the force after `cycles`
// whole cycles, relative to the change of the force.
double left_after(int cycles, int edge, double radius, double depth, double step) {
  const auto force_at = [&](SoftBlock& soft, double deep) {
    return soft.press(soft.ball(radius * kH, deep * kH), (radius + 4.0) * kH, 1e-6, 400).force_N.z;
  };
  SoftBlock soft({edge, edge, edge}, kH, elastic(1e4, 0.3)), there({edge, edge, edge}, kH, elastic(1e4, 0.3));
  const double from = force_at(soft, depth), to = force_at(there, depth + step);
  const voxel::ToolInBody tool = soft.ball(radius * kH, (depth + step) * kH);
  soft.object->follow({0.0, 0.0, -step * kH});
  for (int n = 0; n < cycles; ++n) {
    soft.touch(tool, (radius + 4.0) * kH);
    soft.object->push_out(tool);
    soft.object->relax_cycle();
    soft.object->relax_near(tool, 1);
  }
  return std::fabs((soft.object->reaction(tool).force_N.z - to) / (to - from));
}

// A contact that slides during cycles converges as fast as the rest of the object.
TEST(Sliding, AContactComesToRestWithAllElse) {
  const double steep = left_after(6, 24, 4.0, 3.0, -0.1), flat = left_after(6, 24, 10.0, 1.0, 0.1),
               deep = left_after(6, 32, 8.0, 6.0, 0.05);
  std::cout << "left after six cycles: " << steep << ", " << flat << ", " << deep << '\n';
  EXPECT_LT(steep, 1e-3);
  EXPECT_LT(flat, 5e-4);
  EXPECT_LT(deep, 0.01);
}

}  // namespace
