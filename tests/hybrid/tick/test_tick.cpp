// SPDX-License-Identifier: GPL-3.0-or-later
// Rigid and soft objects in one tick: no energy gain where bone meets tissue, no penetration, and balance of
// forces.
#include "hybrid/tick/tick.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <sstream>

#include "hybrid/session/tick_invariants.h"
#include "hybrid/tick/tissue/soft_contacts.h"
#include "polygon/files/mesh_file.h"
#include "polygon/surface/primitives.h"
#include "tests/hybrid/fixtures/touch.h"

namespace {

using glm::dvec3;
using hybrid::TickResult;
using tests::coupling;
using tests::Touch;

const std::string tool_of_5 = "format = 1\n[tool]\nradius = 5\nstiffness = 1000\n" + tests::unlimited;

// ---- energy

struct Border {
  std::string name;
  std::string rigid, soft;  // scene text of both objects
  double tool_z_mm;         // height of the tool's centre where the loop presses
  double dwell_x_mm = 8.0;  // extent of the loop on either side of the border at x = 0
};

std::string box(double top_mm) {
  std::ostringstream text;
  text << "[[rigid]]\nname = \"bone\"\nprimitive = \"box\"\nsize = [30, 50, 20]\nposition = [-15, 0, "
       << top_mm - 10.0 << "]\n";
  return text.str();
}
// Tissue beside or under the bone: top at z = 0, 6 kPa.
std::string tissue(double from_x_mm, double to_x_mm) {
  std::ostringstream text;
  text << "[material.tissue]\nyoung = 6000\npoisson = 0.3\n[[soft]]\nname = \"tissue\"\nformula = "
          "\"block\"\nsize = ["
       << to_x_mm - from_x_mm << ", 40, 20]\nspacing = 2\nposition = [" << 0.5 * (from_x_mm + to_x_mm)
       << ", 0, -10]\nmaterial = \"tissue\"\nanchors = { faces = [\"-z\"], rigid_within = 2.5 }\n";
  return text.str();
}

class Energy : public tests::SceneFile, public ::testing::WithParamInterface<Border> {};

// The tool presses, crosses the border, moves sideways, crosses back, returns sideways and lifts. At the end,
// the tool and everything that it touched are where they began. So any energy that the hand has gained is an
// error.
TEST_P(Energy, AClosedLoopOverTheBorderGivesTheHandNothing) {
  const Border& border = GetParam();
  Touch touch(load(tool_of_5 + border.rigid + border.soft + tests::some_path),
              {-border.dwell_x_mm * 1e-3, -2e-3, 0.015});
  const double z = border.tool_z_mm, x = border.dwell_x_mm;
  // Runs the loop in both directions.
  for (const double way : {1.0, -1.0}) {
    const std::array<dvec3, 7> loop{{{-x, -2 * way, 15},
                                     {-x, -2 * way, z},
                                     {x, -2 * way, z},
                                     {x, 2 * way, z},
                                     {-x, 2 * way, z},
                                     {-x, -2 * way, z},
                                     {-x, -2 * way, 15}}};
    touch.go(1e-3 * loop[0], 5e-6);
    double work = 0.0, most = 0.0;  // energy gained by the hand (J); largest force (N)
    dvec3 before_m = touch.state().device_m, before_N(0.0);
    for (const dvec3& to : loop) {
      touch.go(1e-3 * to, 5e-6, 0, [&](const TickResult& felt) {  // 5 mm/s
        const dvec3 force = coupling(felt);
        work += 0.5 * glm::dot(force + before_N, felt.device_m - before_m);
        before_m = felt.device_m;
        before_N = force;
        most = std::max(most, glm::length(force));
      });
    }
    EXPECT_EQ(glm::length(before_N), 0.0) << "the loop ends in free space";
    std::printf("energy, %s: the hand gains %+.3f uJ a loop; at most %.2f N\n", border.name.c_str(),
                1e6 * work, most);
    EXPECT_LE(work, 1e-6);
    EXPECT_GT(most, 0.5);
  }
  EXPECT_EQ(touch.state().nonfinite, 0U);
}

INSTANTIATE_TEST_SUITE_P(
    OfBoneAndTissue, Energy,
    ::testing::Values(
        Border{"bone flush with tissue", box(0.0), tissue(0, 30), 3.0},
        Border{"bone 2 mm higher", box(2.0), tissue(0, 30), 4.0},
        Border{"bone 2 mm lower", box(-2.0), tissue(0, 30), 1.0},
        Border{"a sheet's edge 1 mm over tissue",
               "[[rigid]]\nname = \"sheet\"\nprimitive = \"plane\"\nsize = 30\nposition = [-15, 0, 1]\n",
               tissue(-20, 20), 3.0}),
    [](const auto& border) {
      std::string name = border.param.name;
      std::erase_if(name, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; });
      return name;
    });

// ---- the tick itself

class Tick : public tests::SceneFile {
 protected:
  static std::string deep_block(double tool_radius_mm, double spacing_mm) {
    std::ostringstream text;
    text << "format = 1\n[tool]\nradius = " << tool_radius_mm << "\nstiffness = 1000\n"
         << tests::unlimited
         << "[material.gel]\nyoung = 5000\npoisson = 0.3\n[[soft]]\nname = \"block\"\nformula = "
            "\"block\"\nsize = [60, 60, 30]\nspacing = "
         << spacing_mm << "\nposition = [0, 0, -15]\nmaterial = \"gel\"\n"
         << tests::some_path;
    return text.str();
  }
};

TEST_F(Tick, TheForceIsTheCouplingsWhateverIsTouched) {
  Touch touch(load(deep_block(5, 2) + tests::ball), {0, 0, 0.03});
  for (const dvec3& to :
       {dvec3(0, 0, 0.004), dvec3(0.01, 0, 0.001), dvec3(0.002, 0.003, -0.002), dvec3(0, 0, 0.03)}) {
    touch.go(to, 5e-5, 50, [](const TickResult& felt) {
      ASSERT_LE(glm::length(felt.force_N - 1000.0 * (felt.proxy_m - felt.device_m)), 1e-9);
      ASSERT_LE(glm::length(felt.rigid_N + felt.soft_N - felt.force_N), 1e-9);
      if (felt.contacts == 0) {
        ASSERT_EQ(felt.proxy_m, felt.device_m);
      }
    });
  }
}

// The window's chart shows these parts.
TEST_F(Tick, ThePartsSumUpToTheForce) {
  Touch touch(
      load("format = 1\n[tool]\nradius = 5\nstiffness = 1000\n[safety]\nmax_force = 2\npassivity = true\n"
           "[[rigid]]\nname = \"plate\"\nprimitive = \"box\"\nsize = [200, 200, 10]\n"
           "position = [0, 0, -5]\nfriction = [0.5, 0.4]\ndamping = 3\n" +
           std::string(tests::some_path)),
      {0, 0, 0.01});
  double friction = 0.0, damping = 0.0, limits = 0.0;
  for (const dvec3& to :
       {dvec3(0, 0, 0.004), dvec3(0.02, 0, 0.002), dvec3(0.02, 0.01, 0.0), dvec3(0, 0, 0.01)}) {
    touch.go(to, 5e-5, 20, [&](const TickResult& felt) {
      const dvec3 sum = felt.rigid_N + felt.soft_N + felt.limits_N + felt.passivity_N;
      ASSERT_LE(glm::length(sum - felt.force_N), 1e-9);
      friction = std::max(friction, glm::length(felt.friction_N));
      damping = std::max(damping, glm::length(felt.damping_N));
      limits = std::max(limits, glm::length(felt.limits_N));
    });
  }
  EXPECT_GT(friction, 0.5);
  EXPECT_GT(damping, 0.0);
  EXPECT_GT(limits, 1.0);
}

TEST_F(Tick, AJumpIntoTissueEndsWhereASlowPressDoes) {
  for (const double depth_mm : {3.0, 8.0}) {
    const dvec3 end(0, 0, 5e-3 - 1e-3 * depth_mm);
    Touch slow(load(deep_block(5, 2)), {0, 0, 0.3});
    slow.go({0, 0, 0.01}, 1e-3);
    const TickResult pressed = slow.go(end, 2e-5, 1500);
    Touch jump(load(deep_block(5, 2)), {0, 0, 0.3});
    const TickResult jumped = jump.go(end, 1.0, 1500);
    std::printf("jump of 0.3 m to %.0f mm: %.4f N, slow press %.4f N\n", depth_mm, coupling(jumped).z,
                coupling(pressed).z);
    EXPECT_LE(glm::length(coupling(jumped) - coupling(pressed)), 0.05 * glm::length(coupling(pressed)));
  }
}

// Rows of voxels that hardly shorten and stand on anchors are almost rigid. A tool between two rows must not
// drive them apart like a wedge, which would also create energy.
TEST_F(Tick, AToolOnRowsThatStandOnAnchorsIsNoWedge) {
  const std::string rows =
      "format = 1\n[tool]\nradius = 3\nstiffness = 1000\n" + tests::unlimited +
      "[material.gel]\nyoung = 8000\nstretch = [0.99, 1.01]\nshear = 0.6\n[[soft]]\nname = \"block\"\n"
      "formula = \"block\"\nsize = [40, 40, 20]\nspacing = 2\nposition = [0, 0, 0]\nmaterial = \"gel\"\n" +
      tests::some_path;
  // The tool is over a voxel, beside a voxel, or between two voxels.
  for (const double x_mm : {11.0, 10.6, 10.0}) {
    const dvec3 above(1e-3 * x_mm, 1e-3, 0.0135), below = above - dvec3(0, 0, 3e-3);
    Touch touch(load(rows), above);
    double work = 0.0, most = 0.0;
    TickResult before = touch.go(above, 1e-4, 1);
    const auto see = [&](const TickResult& felt) {
      work += 0.5 * glm::dot(before.force_N + felt.force_N, felt.device_m - before.device_m);
      most = std::max(most, glm::length(felt.force_N));
      before = felt;
    };
    const TickResult pressed = touch.go(below, 1.5e-4, 200, see);
    const double aside = glm::length(glm::dvec2(coupling(pressed)));
    touch.go(above, 1.5e-4, 200, see);
    std::printf("x = %.1f mm: %.3f N, %.4f N of it aside, at most %.3f N; %.4f mJ given there and back\n",
                x_mm, glm::length(coupling(pressed)), aside, most, 1e3 * work);
    EXPECT_GT(most, 1.5);
    if (x_mm != 10.6) {  // a tool beside a voxel slides off, which is right
      EXPECT_LE(aside, 0.01 * most);
    }
    EXPECT_LE(most, 3.0);  // the coupling's force, at most 3 mm from the device
    EXPECT_LE(std::abs(work), 1e-5);
  }
}

// The tool presses on almost rigid rows of voxels beside a wall of many small triangles, more than a tick
// examines near the tool. It must stop as it does beside the same wall made of two triangles.
TEST_F(Tick, AToolOnRowsThatStandOnAnchorsIsStoppedBesideAFineMeshAsBesideACoarseOne) {
  std::array<TickResult, 2> pressed;
  for (std::size_t fine = 0; fine < 2; ++fine) {
    polygon::save_ply(folder_ / "wall.ply", polygon::make_plane_mesh(0.015, fine == 1 ? 150 : 1));
    Touch touch(
        load("format = 1\n[tool]\nradius = 3\nstiffness = 1000\n" + tests::unlimited +
             "[[rigid]]\nname = \"wall\"\nmesh = \"wall.ply\"\nunit = \"m\"\nposition = [21, 0, 10]\n"
             "rotation = [0, 90, 0]\n"
             "[material.gel]\nyoung = 8000\nstretch = [0.99, 1.01]\nshear = 0.6\n[[soft]]\nname = \"block\"\n"
             "formula = \"block\"\nsize = [40, 40, 20]\nspacing = 2\nposition = [0, 0, 0]\n"
             "material = \"gel\"\n" +
             tests::some_path),
        {0.017, 1e-3, 0.0135});
    pressed[fine] = touch.go({0.0175, 1e-3, 0.0105}, 1.5e-4, 200);
    EXPECT_EQ(touch.state().faults, 0U);
  }
  std::printf("beside two triangles %.4f N, beside 45,000 %.4f N\n", glm::length(coupling(pressed[0])),
              glm::length(coupling(pressed[1])));
  EXPECT_GT(coupling(pressed[0]).z, 1.5);
  EXPECT_LE(glm::length(coupling(pressed[1]) - coupling(pressed[0])),
            0.01 * glm::length(coupling(pressed[0])));
}

// A punch has no sides. If it is dragged sideways against almost rigid rows of voxels, some voxels are
// suddenly far above its face and cannot give way. They must stop the punch without lifting it, because
// lifting would create energy.
TEST_F(Tick, APunchDrawnAgainstRowsThatStandOnAnchorsIsStoppedAndNotLifted) {
  const std::string rows =
      "format = 1\n[tool]\nshape = \"punch\"\nradius = 6\nstiffness = 1000\n" + tests::unlimited +
      "[material.gel]\nyoung = 4000\nstretch = [0.99, 1.01]\nshear = 0.6\n[[soft]]\nname = \"block\"\n"
      "formula = \"block\"\nsize = [40, 40, 20]\nspacing = 2\nposition = [0, 0, 0]\nmaterial = \"gel\"\n" +
      tests::some_path;
  constexpr double edge_m = 0.019;  // x of the centres of the outermost voxels
  for (const double depth_mm : {1.0, 3.0, 6.0}) {
    const double z = 0.01 - 1e-3 * depth_mm;
    Touch touch(load(rows), {0.06, 0, z});
    hybrid::TickInvariants watch(touch.world(), touch.state());
    double lifted = 0.0, furthest = 1.0;
    const auto see = [&](const TickResult& felt) {
      watch.check_tick(touch.state(), felt, 1e-3);
      lifted = std::max(lifted, felt.proxy_m.z - felt.device_m.z);
      furthest = std::min(furthest, felt.proxy_m.x);
    };
    touch.go({0.02, 0, z}, 4e-3, 50, see);
    const TickResult back = touch.go({0.06, 0, z}, 4e-3, 50, see);
    std::printf(
        "%.0f mm under the top: %.3f mm into the block, lifted by %.3f mm; %.4f mJ beyond its account\n",
        depth_mm, 1e3 * (edge_m + 6e-3 - furthest), 1e3 * lifted, 1e3 * watch.excess_J());
    EXPECT_LE(watch.excess_J(), watch.tolerance_J());
    EXPECT_LE(lifted, 0.1e-3);
    EXPECT_GE(furthest, edge_m + 6e-3 - 2e-3);  // a spacing
    EXPECT_EQ(coupling(back), dvec3(0.0));
  }
}

// A tool of many spacings touches thousands of voxels. It must feel them or report the overload. A zero force
// is wrong.
TEST_F(Tick, AToolOfManySpacingsIsFelt) {
  Touch touch(load(deep_block(20, 0.75)), {0, 0, 0.03});
  const TickResult felt = touch.go({0, 0, 0.0185}, 5e-5, 500);
  // Hertz contact in series with the coupling. The block is small for a half-space.
  const double at_rest = 20e-3 - felt.proxy_m.z;
  const double hertz = 4.0 / 3.0 * 5000.0 / 0.91 * std::sqrt(20e-3) * std::pow(at_rest, 1.5);
  std::printf("tool of 27 spacings: %.4f N, Hertz %.4f N; %zu voxels near\n", coupling(felt).z, hertz,
              touch.state().soft[0]->touched().size());
  EXPECT_NEAR(coupling(felt).z, hertz, 0.3 * hertz);
  EXPECT_EQ(touch.state().faults, 0U);
}

TEST_F(Tick, FarFromTheOriginFeelsTheSame) {
  std::array<dvec3, 2> felt{};
  for (int n = 0; n < 2; ++n) {
    const dvec3 shift = n == 0 ? dvec3(0.0) : dvec3(1e3, -2e3, 1e3);
    hybrid::Scene scene = load(deep_block(5, 2) + tests::ball);
    for (auto& o : scene.rigid) o.pose.position_m += shift;
    for (auto& o : scene.soft) o.pose.position_m += shift;
    Touch touch(scene, shift + dvec3(0, 0, 0.03));
    felt[static_cast<std::size_t>(n)] = coupling(touch.go(shift + dvec3(8e-3, 1e-3, 2e-3), 2e-4, 300));
  }
  EXPECT_LE(glm::length(felt[0] - felt[1]), 1e-3 * glm::length(felt[0]));
}

TEST_F(Tick, NothingSoftMeansNoVoxelState) {
  Touch touch(load("format = 1\n" + tests::ball + tests::some_path), {0, 0, 0.03});
  EXPECT_TRUE(touch.state().soft.empty());
  EXPECT_TRUE(touch.state().scratch.map_hits.empty());
  EXPECT_TRUE(touch.state().facet_contacts.empty());
  EXPECT_EQ(touch.state().facet_contacts.capacity(), 0U);
}

}  // namespace
