// SPDX-License-Identifier: GPL-3.0-or-later
// The tool presses tissue against a plate or against other tissue. Nothing penetrates, and the supports carry
// the felt force.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <sstream>
#include <vector>

#include "hybrid/tick/tissue/obstacles.h"
#include "polygon/files/mesh_file.h"
#include "polygon/surface/primitives.h"
#include "tests/hybrid/fixtures/touch.h"

namespace {

using glm::dvec3;
using hybrid::TickResult;
using tests::coupling;
using tests::Touch;

const std::string tool_of_5 = "format = 1\n[tool]\nradius = 5\nstiffness = 1000\n" + tests::unlimited;

class Arbitration : public tests::SceneFile {
 protected:
  // A scene with a block that is anchored at its sides, 1 mm above a rigid plate that is tilted about y.
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
  // Largest depth of a voxel's ball in the rigid object (spacings), minus the depth at rest (0).
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
    touch.go({0, 0, 0.009}, 4e-5, 0, [&](const TickResult&) {  // to a depth of 8 mm at 40 mm/s
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
    // The tool leaves. Then nothing overlaps, and nothing is felt.
    touch.go({0, 0, 0.04}, 1e-4, 1500);
    EXPECT_LE(deepest(touch), 0.05 + at_rest);
    EXPECT_EQ(touch.at({0, 0, 0.04}).force_N, dvec3(0.0));
  }
}

// After a jump into a solid, a voxel is on the inner side of the surface. Its half-space must still point
// outward, so that the voxel can come out.
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
    object.set_obstacle(object.surface_number(v), {});  // no half-space, as if the solid had been far away
    object.move(v, {0, 0, 10e-3});                      // beyond the solid's middle
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
    // The half-space brings the voxel out by a quarter of a spacing (0.5 mm) per query. It must not stay at
    // the voxel's present depth, or a fast tool would press the voxel deeper in each tick.
    EXPECT_GE(glm::dot(o.normal, glm::vec3(object.state().at(v))), o.bound - 0.5e-3F - 1e-9F)
        << "not thrown out at once";
  }
  EXPECT_EQ(seen, inside);
  // Then the voxel comes out and returns to rest.
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
  // 8 mm of tissue lie on a plate. The device moves 25 mm into the plate.
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

// Sum of the link forces on an object's anchors, the force that the object transfers to its supports (N).
dvec3 load_on_anchors(const voxel::SoftObject& object) {
  dvec3 sum(0.0);
  for (std::size_t i = 0; i < object.lattice().size(); ++i) {
    const auto v = static_cast<voxel::VoxelId>(i);
    if (object.lattice().filled(v) && object.lattice().anchored(v))
      sum += voxel::link_force(object.lattice(), object.state(), v);
  }
  return sum;
}

// Presses the scene to a depth below first contact (at z = 21 mm), holds, and checks the balance of forces.
void expect_balance(double depth_m, double share) {
  const hybrid::Scene scene = hybrid::load_scene(tests::source_folder / "scenes" / "two-soft.toml");
  Touch touch(scene, {0, 0, 0.035});
  touch.go({0, 0, 0.021 - depth_m}, 4e-5, 1500);
  const TickResult felt = touch.at({0, 0, 0.021 - depth_m});
  // The upper block without the lower one gives the force that its sides alone carry at this depth.
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
  // The support from below makes the block stiffer, and relieves the sides.
  EXPECT_GT(coupling(felt).z, sides_N);
  EXPECT_LT(coupling(felt).z, sides_N - lower.z);
  EXPECT_LT(lower.z, -0.004) << "the lower one carries part of it";
  EXPECT_LE(glm::length(lower + upper + coupling(felt)), share * coupling(felt).z);
  // Then the tool leaves.
  touch.go({0, 0, 0.035}, 1e-4, 3000);
  EXPECT_EQ(touch.at({0, 0, 0.035}).force_N, dvec3(0.0));
  EXPECT_LE(glm::length(load_on_anchors(*touch.state().soft[0])), 0.02 * coupling(felt).z);
}

TEST_F(Arbitration, TwoSoftObjectsBalanceWhatTheToolPresses) {
  for (const double depth : {2.5e-3, 4e-3}) expect_balance(depth, 0.02);
}
// The chain under the tool is tight down to voxels that the other object supports. The sum of forces lacks
// the limit forces of these links, which are 3 % of the force.
TEST_F(Arbitration, TwoSoftObjectsNearlyBalanceWhereTheChainIsTight) {
  expect_balance(8e-3, 0.05);
}

// With a single block, the anchors must carry the felt force.
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

}  // namespace
