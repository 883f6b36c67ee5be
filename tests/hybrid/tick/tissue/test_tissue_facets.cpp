// SPDX-License-Identifier: GPL-3.0-or-later
// Tools with a radius of up to one spacing do not pass between the voxels of a surface. If very wide limits
// of the links let a tool through, a fault reports this.
#include "hybrid/tick/tissue/tissue_facets.h"

#include <array>
#include <sstream>
#include <tuple>

#include "tests/hybrid/fixtures/touch.h"

namespace {

constexpr double kSpacing_m = 2e-3;

struct Limits {
  double shortest, longest, shear;
};

std::string gel(double radius_mm, double thickness_mm, const Limits& limits) {
  std::ostringstream scene;
  scene << "format = 1\n[tool]\nradius = " << radius_mm << "\nstiffness = 1000\n"
        << tests::unlimited << tests::some_path << "[material.gel]\nyoung = 5000\npoisson = 0.3\nstretch = ["
        << limits.shortest << ", " << limits.longest << "]\nshear = " << limits.shear
        << "\n[[soft]]\nname = \"gel\"\nformula = \"block\"\nsize = [40, 40, " << thickness_mm
        << "]\nspacing = 2\nmaterial = \"gel\"\n";
  return scene.str();
}

class TissueFacets : public tests::SceneFile {};

// The surface of a block at rest is the box of its voxel centres, grown by half a spacing.
TEST_F(TissueFacets, OfABlockAtRestAreItsFaces) {
  tests::Touch touch(load(gel(2.0, 20.0, {0.5, 1.5, 0.5})), {0.0, 0.0, 0.013});
  touch.at({0.0, 0.0, 0.01205});  // near enough to list voxels, without touching any
  const voxel::SoftObject& block = *touch.state().soft[0];
  const auto& dims = block.lattice().grid().dims;
  const double top = block.lattice().rest(block.lattice().at(0, 0, dims[2] - 1)).z;
  std::array<voxel::ToolBound, 64> bounds;
  voxel::ToolInBody tool;
  tool.radius = 2e-3;
  const double x = 20.3e-3, y = 19.4e-3;
  std::size_t count = 0;
  for (const double height : {0.3e-3, 1.4e-3, -0.4e-3}) {
    tool.centre = {x, y, top + 0.5 * kSpacing_m + height};
    count = hybrid::facet_bounds(block, tool, 1.5e-3, bounds);
    ASSERT_GT(count, 0U) << height;
    for (std::size_t i = 0; i < count; ++i) {
      EXPECT_NEAR(bounds[i].normal.z, 1.0, 1e-12);
      EXPECT_NEAR(bounds[i].offset, top + 0.5 * kSpacing_m, 1e-9);
    }
  }
  tool.centre = {x, y, top + 0.5 * kSpacing_m + 1.6e-3};  // too far
  EXPECT_EQ(hybrid::facet_bounds(block, tool, 1.5e-3, bounds), 0U);
  // Just outside an edge of the top, the facets are those of the side, so the tool can slide down the side.
  tests::Touch beside(load(gel(2.0, 20.0, {0.5, 1.5, 0.5})), {0.0235, 0.0, 0.0095});
  beside.at({0.02205, 0.0, 0.0095});
  const double side = block.lattice().rest(block.lattice().at(dims[0] - 1, 0, 0)).x;
  tool.centre = {side + 0.5 * kSpacing_m + 0.2e-3, y, top - 0.3e-3};
  count = hybrid::facet_bounds(*beside.state().soft[0], tool, 1.5e-3, bounds);
  ASSERT_GT(count, 0U);
  for (std::size_t i = 0; i < count; ++i) EXPECT_NEAR(bounds[i].normal.x, 1.0, 1e-12);
}

// Presses a tool until links exceed their limits. There must be a force as long as the tool is held, and the
// tool must come out on the side where it went in.
TEST_F(TissueFacets, NoSmallToolIsLost) {
  for (const Limits& limits : {Limits{0.5, 1.5, 0.5}, Limits{0.5, 2.0, 1.0}}) {
    for (const double radius_mm : {0.2, 1.0, 2.0}) {
      for (const double thickness_mm : {10.0, 20.0}) {
        for (const glm::dvec2& at : {glm::dvec2(0.0, 0.0), glm::dvec2(0.6e-3, 0.3e-3)}) {
          SCOPED_TRACE(testing::Message() << radius_mm << " mm in " << thickness_mm << " mm, links up to "
                                          << limits.longest << ", at " << at.x << ", " << at.y);
          const double top = 0.5e-3 * thickness_mm;
          tests::Touch touch(load(gel(radius_mm, thickness_mm, limits)), {at.x, at.y, top + 6e-3});
          // The tool goes down through 0.9 of the thickness.
          double least_N = 1e9;
          touch.go({at.x, at.y, top - 0.9e-3 * thickness_mm}, 4e-5);
          touch.go(touch.state().device_m, 4e-5, 600, [&](const hybrid::TickResult& tick) {
            least_N = std::min(least_N, tests::coupling(tick).z);
          });
          EXPECT_GT(least_N, 0.1);
          double pulled_N = 0.0;
          touch.go({at.x, at.y, top + 8e-3}, 4e-5, 100, [&](const hybrid::TickResult& tick) {
            pulled_N = std::min(pulled_N, tests::coupling(tick).z);
          });
          EXPECT_GT(pulled_N, -0.1);
        }
      }
    }
  }
}

// Links that may stretch to three times their length can let the tool through. If they do, the fault bit is
// set.
TEST_F(TissueFacets, AToolThatGotThroughIsAFault) {
  tests::Touch touch(load(gel(1.0, 20.0, {0.2, 3.0, 2.0})), {0.0, 0.0, 0.016});
  const hybrid::TickResult held = touch.go({0.0, 0.0, -0.004}, 4e-5, 600);
  const bool lost = tests::coupling(held).z < 0.1;
  EXPECT_EQ((touch.state().faults & hybrid::fault_tool_in_tissue) != 0, lost);
  tests::Touch firm(load(gel(1.0, 20.0, {0.5, 1.5, 0.5})), {0.0, 0.0, 0.016});
  EXPECT_GT(tests::coupling(firm.go({0.0, 0.0, -0.004}, 4e-5, 600)).z, 0.1);
  EXPECT_EQ(firm.state().faults & hybrid::fault_tool_in_tissue, 0U);
}

}  // namespace
