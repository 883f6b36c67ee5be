// SPDX-License-Identifier: GPL-3.0-or-later
// Rigid and soft in one tick: no energy out of nothing where bone meets tissue, nothing pressed through
// anything, and what presses is pressed back.
#include "hybrid/tick/tick.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <sstream>
#include <vector>

#include "hybrid/tick/tissue/obstacles.h"
#include "hybrid/tick/tissue/soft_contacts.h"
#include "hybrid/session/tick_invariants.h"
#include "polygon/files/mesh_file.h"
#include "polygon/surface/primitives.h"
#include "tests/hybrid/fixtures/touch.h"
#include "voxel/relaxation/relaxation.h"

namespace {

using glm::dvec3;
using hybrid::TickResult;
using tests::coupling;
using tests::Touch;

const std::string tool_of_5 = "format = 1\n[tool]\nradius = 5\nstiffness = 1000\n" + tests::unlimited;

// ---- energy
// ------------------------------------------------------------------------------------------------

struct Border {
  std::string name;
  std::string rigid, soft;  // their tables
  double tool_z_mm;         // of the loop: 2 mm in the higher of the two
  double dwell_x_mm = 8.0;  // how far the loop goes to either side of the border at x = 0
};

std::string box(double top_mm) {
  std::ostringstream text;
  text << "[[rigid]]\nname = \"bone\"\nprimitive = \"box\"\nsize = [30, 50, 20]\nposition = [-15, 0, "
       << top_mm - 10.0 << "]\n";
  return text.str();
}
// Tissue beside or under the bone, its top at z = 0, 6 kPa.
std::string tissue(double from_x_mm, double to_x_mm) {
  std::ostringstream text;
  text << "[material.tissue]\nyoung = 6000\npoisson = 0.3\n[[soft]]\nname = \"tissue\"\nformula = "
          "\"block\"\nsize = ["
       << to_x_mm - from_x_mm << ", 40, 20]\nspacing = 2\nposition = [" << 0.5 * (from_x_mm + to_x_mm)
       << ", 0, -10]\nmaterial = \"tissue\"\nanchors = { faces = [\"-z\"], rigid_within = 2.5 }\n";
  return text.str();
}

class Energy : public tests::SceneFile, public ::testing::WithParamInterface<Border> {};

// Pressed, moved over the border, sideways, back over it, sideways to where it began, and lifted: the hand
// ends where it began, and so does everything it touched. What the hand then has gained came out of nothing.
TEST_P(Energy, AClosedLoopOverTheBorderGivesTheHandNothing) {
  const Border& border = GetParam();
  Touch touch(load(tool_of_5 + border.rigid + border.soft + tests::some_path),
              {-border.dwell_x_mm * 1e-3, -2e-3, 0.015});
  const double z = border.tool_z_mm, x = border.dwell_x_mm;
  // One way round and then the other.
  for (const double way : {1.0, -1.0}) {
    const std::array<dvec3, 7> loop{{{-x, -2 * way, 15},
                                     {-x, -2 * way, z},
                                     {x, -2 * way, z},
                                     {x, 2 * way, z},
                                     {-x, 2 * way, z},
                                     {-x, -2 * way, z},
                                     {-x, -2 * way, 15}}};
    touch.go(1e-3 * loop[0], 5e-6);
    double work = 0.0, most = 0.0;  // J, gained by the hand; N
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

// ---- arbitration
// -------------------------------------------------------------------------------------------

class Arbitration : public tests::SceneFile {
 protected:
  // A block held at its sides, 1 mm above a rigid plate that is tilted about y.
  static std::string block_over_plate(double tilt_degrees, const std::string& plate) {
    std::ostringstream text;
    text << tool_of_5 << "[material.gel]\nyoung = 5000\npoisson = 0.3\n"
         << "[[soft]]\nname = \"block\"\nformula = \"block\"\nsize = [60, 60, 12]\nspacing = 2\nposition = "
            "[0, 0, 6]\nmaterial = \"gel\"\n"
         << "anchors = { faces = [\"-x\", \"+x\", \"-y\", \"+y\"] }\n"
         << "[[rigid]]\nname = \"plate\"\n"
         << plate << "\nrotation = [0, " << tilt_degrees << ", 0]\n"
         << tests::some_path;
    return text.str();
  }
  // The deepest any voxel's ball lies in the rigid object, in spacings, beyond what it did at rest (0).
  static double deepest(Touch& touch) {
    double worst = 0.0;
    const auto& rigid = touch.world().rigid[0];
    for (std::size_t o = 0; o < touch.world().soft.size(); ++o) {
      const auto& object = *touch.state().soft[o];
      for (const voxel::VoxelId v : object.lattice().surface()) {
        if (object.lattice().anchored(v)) continue;
        const dvec3 p = rigid.to_body(touch.world().soft[o].to_scene(object.position(v)));
        polygon::NearPoint near;
        double distance = object.voxel_radius();
        if (rigid.surface->inside(p)) {
          distance = 0.0;
          if (rigid.surface->nearest(p, 1.0, near)) distance = -glm::length(p - near.point);
        } else if (rigid.surface->nearest(p, distance, near)) {
          distance = near.distance;
        }
        worst = std::max(worst, (object.voxel_radius() - distance) / object.lattice().min_spacing_m());
      }
    }
    return worst;
  }
};

TEST_F(Arbitration, NoVoxelIsPressedIntoAPlate) {
  struct Case {
    const char* name;
    double tilt;
    std::string plate;
  };
  const std::vector<Case> cases{
      {"plate", 0.0, "primitive = \"box\"\nsize = [100, 100, 10]\nposition = [0, 0, -6]"},
      {"sheet", 0.0, "primitive = \"plane\"\nsize = 100\nposition = [0, 0, -1]"},
      {"plate tilted by 10 degrees", 10.0,
       "primitive = \"box\"\nsize = [56, 100, 10]\nposition = [0, 0, -10.2]"},
      {"ball", 0.0, "primitive = \"ball\"\nradius = 20\nposition = [0, 0, -21]"}};
  for (const Case& c : cases) {
    SCOPED_TRACE(c.name);
    Touch touch(load(block_over_plate(c.tilt, c.plate)), {0, 0, 0.03});
    const double at_rest = deepest(touch);
    double during = 0.0;
    int n = 0;
    touch.go({0, 0, 0.009}, 4e-5, 0, [&](const TickResult&) {  // 8 mm deep at 40 mm/s
      if (++n % 20 == 0) during = std::max(during, deepest(touch));
    });
    const TickResult early = touch.go({0, 0, 0.009}, 1.0, 200);
    const TickResult felt = touch.go({0, 0, 0.009}, 1.0, 800);
    const double held = deepest(touch);
    std::printf(
        "arbitration, %s: at most %.3f spacings deep while pressed, %.3f when held (%.3f at rest); %.3f N\n",
        c.name, during, held, at_rest, coupling(felt).z);
    EXPECT_LE(held, 0.05 + at_rest);
    EXPECT_GT(coupling(felt).z, 0.1);
    EXPECT_NEAR(coupling(felt).z, coupling(early).z, 0.05 * coupling(felt).z) << "it holds still";
    EXPECT_EQ(touch.state().nonfinite, 0U);
    // The tissue does reach the plate: without one it is softer.
    touch.go({0, 0, 0.04}, 1e-4, 1500);
    EXPECT_LE(deepest(touch), 0.05 + at_rest);
    EXPECT_EQ(touch.at({0, 0, 0.04}).force_N, dvec3(0.0));
  }
}

// Driven into a solid by a jump, a voxel sees its surface from within: the way out is still out. (It was held
// on the inside, for ever: a fuzzed session found it after 48,936 ticks.)
TEST_F(Arbitration, AVoxelWithinASolidIsShownTheWayOut) {
  polygon::save_ply(folder_ / "ball.ply", polygon::make_ball_mesh(6e-3, 3));
  Touch touch(load(tool_of_5 + "[material.loose]\nstretch = [0.001, 1000]\nshear = 1000\n" +
                   "[[soft]]\nname = \"block\"\nformula = \"block\"\nsize = [40, 40, 20]\nspacing = 2\n"
                   "position = [0, 0, 0]\nmaterial = \"loose\"\n"
                   "[[rigid]]\nname = \"ball\"\nmesh = \"ball.ply\"\nunit = \"m\"\nposition = [0, 0, 14]\n" +
                   tests::some_path),
              {0, 0, 0.05});
  voxel::SoftObject& object = *touch.state().soft[0];
  const dvec3 centre(0, 0, 0.014);
  const auto place = [&](voxel::VoxelId v) { return touch.world().soft[0].to_scene(object.position(v)); };
  std::size_t inside = 0;
  for (const voxel::VoxelId v : object.lattice().surface()) {
    const dvec3 at = place(v);
    if (at.z < 6.5e-3 || std::hypot(at.x, at.y) > 4e-3) continue;
    object.set_obstacle(object.surface_number(v), {});  // as one that was far away has none
    object.move(v, {0, 0, 10e-3});                      // past the middle
    ++inside;
  }
  ASSERT_GE(inside, 4U);
  for (int n = 0; n < 100; ++n) hybrid::refresh_obstacles(touch.world(), touch.state());
  std::size_t seen = 0;
  for (const voxel::VoxelId v : object.lattice().surface()) {
    const voxel::Obstacle& o = object.obstacles()[object.surface_number(v)];
    const dvec3 away = place(v) - centre;
    if (glm::length(away) >= 6e-3 || o.normal == glm::vec3(0.0F)) continue;
    ++seen;
    EXPECT_GT(glm::dot(dvec3(o.normal), away), 0.9 * glm::length(away));
    // By a quarter of a spacing of 2 mm each time that it is looked at. (It was left as deep as it is; then
    // what a fast tool presses into a ridge, tick by tick, is let in deeper in each.)
    EXPECT_GE(glm::dot(o.normal, glm::vec3(object.state().at(v))), o.bound - 0.5e-3F - 1e-9F)
        << "not thrown out at once";
  }
  EXPECT_EQ(seen, inside);
  // And from there it comes out, and back.
  for (int n = 0; n < 4000 && !object.asleep(); ++n) touch.at({0, 0, 0.05});
  EXPECT_TRUE(object.asleep());
  for (const voxel::VoxelId v : object.lattice().surface())
    ASSERT_LE(glm::length(dvec3(object.state().at(v))), 2e-5) << "of a spacing of 2 mm";
}

TEST_F(Arbitration, APlateBelowIsFeltThroughTheTissue) {
  const std::string plate = "primitive = \"box\"\nsize = [100, 100, 10]\nposition = [0, 0, -6]";
  const std::string far_plate = "primitive = \"box\"\nsize = [100, 100, 10]\nposition = [0, 0, -56]";
  double force[2] = {0.0, 0.0};
  for (int n = 0; n < 2; ++n) {
    Touch touch(load(block_over_plate(0.0, n == 0 ? plate : far_plate)), {0, 0, 0.03});
    force[n] = coupling(touch.go({0, 0, 0.009}, 4e-5, 600)).z;
  }
  EXPECT_GT(force[0], 1.1 * force[1]);
}

TEST_F(Arbitration, ToolThatSqueezesTissueAgainstAPlateStopsAtWhatIsLeftOfIt) {
  // Tissue of 8 mm on a plate; the device goes 25 mm into the plate.
  const std::string scene =
      tool_of_5 +
      "[material.gel]\nyoung = 3000\npoisson = 0.3\n[[soft]]\nname = \"pad\"\nformula = \"block\"\nsize = "
      "[40, 40, 8]\n"
      "spacing = 2\nposition = [0, 0, 4]\nmaterial = \"gel\"\n"
      "[[rigid]]\nname = \"plate\"\nprimitive = \"box\"\nsize = [80, 80, 10]\nposition = [0, 0, -5]\n" +
      tests::some_path;
  Touch touch(load(scene), {0, 0, 0.03});
  double lowest = 1.0, most = 0.0;
  const auto look = [&](const TickResult& felt) {
    lowest = std::min(lowest, felt.proxy_m.z);
    most = std::max(most, glm::length(coupling(felt)));
    ASSERT_TRUE(tests::finite(coupling(felt)));
  };
  touch.go({0, 0, -0.025}, 5e-5, 0, look);
  const TickResult held = touch.go({0, 0, -0.025}, 1.0, 400, look);
  const TickResult later = touch.go({0, 0, -0.025}, 1.0, 400, look);
  EXPECT_GE(lowest, 5e-3 * (1.0 - 1e-9)) << "never into the plate";
  EXPECT_LE(most, 1000.0 * 0.055) << "no more than the coupling's stretch";
  EXPECT_NEAR(coupling(later).z, coupling(held).z, 0.05 * coupling(held).z);
  EXPECT_LE(std::hypot(later.proxy_m.x, later.proxy_m.y), 1e-3) << "squeezed, not slipped aside";
  std::printf("squeeze: proxy %.2f mm above the plate at %.1f N; voxels %.3f spacings deep\n",
              1e3 * (later.proxy_m.z - 5e-3), coupling(later).z, deepest(touch));
  EXPECT_LE(deepest(touch), 0.05);
  touch.go({0, 0, 0.03}, 1e-4, 500, look);
  EXPECT_EQ(touch.at({0, 0, 0.03}).force_N, dvec3(0.0));
}

// What links pull at the anchors of an object: what it hands on to where it is held.
dvec3 load_on_anchors(const voxel::SoftObject& object) {
  dvec3 sum(0.0);
  for (std::size_t i = 0; i < object.lattice().size(); ++i) {
    const auto v = static_cast<voxel::VoxelId>(i);
    if (object.lattice().filled(v) && object.lattice().anchored(v))
      sum += voxel::link_force(object.lattice(), object.state(), v);
  }
  return sum;
}

// The scene, pressed to a depth below first contact (z = 21 mm) and held.
void expect_balance(double depth_m, double share) {
  const hybrid::Scene scene = hybrid::load_scene(tests::source_folder / "scenes" / "two-soft.toml");
  Touch touch(scene, {0, 0, 0.035});
  touch.go({0, 0, 0.021 - depth_m}, 4e-5, 1500);
  const TickResult felt = touch.at({0, 0, 0.021 - depth_m});
  // The upper one without the lower, settled: what its sides alone can bear at this depth.
  hybrid::Scene without = scene;
  without.soft.erase(without.soft.begin());
  Touch alone(without, {0, 0, 0.035});
  const double sides_N = coupling(alone.go({0, 0, 0.021 - depth_m}, 4e-5, 1500)).z;
  const dvec3 lower = load_on_anchors(*touch.state().soft[0]),
              upper = load_on_anchors(*touch.state().soft[1]);
  std::printf(
      "two soft, %.1f mm: tool %.4f N (the upper alone %.4f N), lower base %.4f N, upper sides %.4f N; "
      "off by %+.2f %%\n",
      1e3 * depth_m, coupling(felt).z, sides_N, lower.z, upper.z,
      100.0 * (lower + upper + coupling(felt)).z / coupling(felt).z);
  ASSERT_EQ(scene.soft[0].name, "lower");
  ASSERT_GT(sides_N, 0.0);
  // What holds it up from below makes it stiffer, and takes from the sides what they need not bear.
  EXPECT_GT(coupling(felt).z, sides_N);
  EXPECT_LT(coupling(felt).z, sides_N - lower.z);
  EXPECT_LT(lower.z, -0.004) << "the lower one carries part of it";
  EXPECT_LE(glm::length(lower + upper + coupling(felt)), share * coupling(felt).z);
  // And lets go.
  touch.go({0, 0, 0.035}, 1e-4, 3000);
  EXPECT_EQ(touch.at({0, 0, 0.035}).force_N, dvec3(0.0));
  EXPECT_LE(glm::length(load_on_anchors(*touch.state().soft[0])), 0.02 * coupling(felt).z);
}

TEST_F(Arbitration, TwoSoftObjectsBalanceWhatTheToolPresses) {
  for (const double depth : {2.5e-3, 4e-3}) expect_balance(depth, 0.02);
}
// Where the chain under the tool is tight down to voxels that the other object holds, what those hand on is
// not in the sum: 3 %.
TEST_F(Arbitration, TwoSoftObjectsNearlyBalanceWhereTheChainIsTight) {
  expect_balance(8e-3, 0.05);
}

// One block, no neighbour: what the tool feels is what the anchors carry.
class Reaction : public tests::SceneFile {
 protected:
  void expect_reaction(double depth_m) const {
    Touch touch(load("format = 1\n[tool]\nradius = 8\nstiffness = 1000\n" + tests::unlimited +
                     "[[soft]]\nname = \"block\"\nformula = \"block\"\nsize = [60, 60, 12]\nspacing = 2\n"
                     "position = [0, 0, -6]\nanchors = { faces = [\"-x\", \"+x\", \"-y\", \"+y\"] }\n" +
                     tests::some_path),
                {0, 0, 0.03});
    const TickResult felt = touch.go({0, 0, 8e-3 - depth_m}, 4e-5, 2000);
    const dvec3 carried = load_on_anchors(*touch.state().soft[0]);
    std::printf("reaction, %.0f mm: tool %.5f N, anchors %.5f N; off by %+.2f %%\n", 1e3 * depth_m,
                coupling(felt).z, carried.z, 100.0 * (carried + coupling(felt)).z / coupling(felt).z);
    EXPECT_LE(glm::length(carried + coupling(felt)), 0.01 * coupling(felt).z);
  }
};

TEST_F(Reaction, IsWhatTheAnchorsCarry) {
  for (const double depth : {2e-3, 4e-3, 6e-3}) expect_reaction(depth);
}
TEST_F(Reaction, IsWhatTheAnchorsCarryWhereTheChainIsTight) {
  for (const double depth : {8e-3, 10e-3}) expect_reaction(depth);
}

// ---- the tick itself
// ---------------------------------------------------------------------------------------

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

// Rows of voxels that hardly shorten and stand on anchors are as good as rigid: a tool between two of them is
// no wedge that drives them apart, pass by pass, and is paid for it.
TEST_F(Tick, AToolOnRowsThatStandOnAnchorsIsNoWedge) {
  const std::string rows =
      "format = 1\n[tool]\nradius = 3\nstiffness = 1000\n" + tests::unlimited +
      "[material.gel]\nyoung = 8000\nstretch = [0.99, 1.01]\nshear = 0.6\n[[soft]]\nname = \"block\"\n"
      "formula = \"block\"\nsize = [40, 40, 20]\nspacing = 2\nposition = [0, 0, 0]\nmaterial = \"gel\"\n" +
      tests::some_path;
  // Over a voxel, beside one, and between two.
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
    if (x_mm != 10.6) {  // from beside a voxel it slides off, as it should
      EXPECT_LE(aside, 0.01 * most);
    }
    EXPECT_LE(most, 3.0);  // the coupling's, 3 mm from the device at most
    EXPECT_LE(std::abs(work), 1e-5);
  }
}

// Beside a surface of many small triangles, too: there are more of them near the tool than a tick looks at,
// and it is stopped as beside the same surface of two.
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

// A punch has no sides: one that is drawn against such rows from aside suddenly has some far above its face,
// that cannot go where it would push them. They stop it there, and do not lift it: nobody paid for that.
TEST_F(Tick, APunchDrawnAgainstRowsThatStandOnAnchorsIsStoppedAndNotLifted) {
  const std::string rows =
      "format = 1\n[tool]\nshape = \"punch\"\nradius = 6\nstiffness = 1000\n" + tests::unlimited +
      "[material.gel]\nyoung = 4000\nstretch = [0.99, 1.01]\nshear = 0.6\n[[soft]]\nname = \"block\"\n"
      "formula = \"block\"\nsize = [40, 40, 20]\nspacing = 2\nposition = [0, 0, 0]\nmaterial = \"gel\"\n" +
      tests::some_path;
  constexpr double edge_m = 0.019;  // of the outermost voxels' centres
  for (const double depth_mm : {1.0, 3.0, 6.0}) {
    const double z = 0.01 - 1e-3 * depth_mm;
    Touch touch(load(rows), {0.06, 0, z});
    hybrid::TickWatch watch(touch.world(), touch.state());
    double lifted = 0.0, furthest = 1.0;
    const auto see = [&](const TickResult& felt) {
      watch.see(touch.state(), felt, 1e-3);
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

// A tool of many spacings touches thousands of voxels: it is felt, or said to be too much; not felt as
// nothing.
TEST_F(Tick, AToolOfManySpacingsIsFelt) {
  Touch touch(load(deep_block(20, 0.75)), {0, 0, 0.03});
  const TickResult felt = touch.go({0, 0, 0.0185}, 5e-5, 500);
  // Hertz, in series with the coupling; the block is small for it.
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
  EXPECT_TRUE(touch.state().found.empty());
  EXPECT_TRUE(touch.state().pairs.empty());
  EXPECT_EQ(touch.state().pairs.capacity(), 0U);
}

}  // namespace
