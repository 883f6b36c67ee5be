// SPDX-License-Identifier: GPL-3.0-or-later
// The cells and patches that a window shows are those of the map and of the contact.
#include "hybrid/snapshot/map_boxes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <iterator>
#include <vector>

#include "hybrid/build/build_world.h"
#include "hybrid/session/player.h"
#include "hybrid/snapshot/make_drawn_scene.h"
#include "tests/hybrid/fixtures/scene_file_fixture.h"

namespace {

using hybrid::MapBox;
using MapBoxes = tests::SceneFile;

bool has(const MapBox& box, const glm::dvec3& at, double margin) {
  const glm::dvec3 size(box.edges_m[0].x, box.edges_m[1].y, box.edges_m[2].z);
  const glm::dvec3 in = at - box.corner_m;
  return glm::all(glm::greaterThanEqual(in, glm::dvec3(-margin))) &&
         glm::all(glm::lessThanEqual(in, size + margin));
}

TEST_F(MapBoxes, HoldEverySurfaceNearTheToolAndNothingElse) {
  const hybrid::Scene scene = load("format = 1\n[device]\nmodel = \"ideal\"\n" + tests::block + tests::ball +
                                   "position = [12, 0, 8]\n" + tests::path);
  const hybrid::BuiltScene built = hybrid::build_scene(scene);
  hybrid::WorldState& state = *built.state;
  state.proxy_m = {8e-3, 0.0, 7e-3};
  const auto boxes = hybrid::map_boxes(*built.world, state);
  const double cell = state.map.cell_m(), reach = (0.5 * hybrid::kCellsAlong - 1.0) * cell;
  std::size_t soft = 0, rigid = 0;
  for (const MapBox& box : boxes) {
    soft += box.kind == MapBox::Kind::soft ? 1U : 0U;
    rigid += box.kind == MapBox::Kind::rigid ? 1U : 0U;
    EXPECT_NE(box.kind, MapBox::Kind::patch) << "nothing is pressed";
    if (box.kind != MapBox::Kind::rigid) continue;
    const glm::dvec3 middle = box.corner_m + glm::dvec3(0.5 * cell);
    EXPECT_LT(std::abs(glm::distance(middle, {12e-3, 0.0, 8e-3}) - 4e-3), 1.8 * cell) << "the ball's surface";
  }
  EXPECT_GT(soft, 4U);
  EXPECT_GT(rigid, 4U);
  std::size_t near = 0;
  for (const glm::dvec3& v : built.world->rigid[0].drawn->vertices) {
    const glm::dvec3 at = built.world->rigid[0].to_scene(v), way = glm::abs(at - state.proxy_m);
    if (std::max({way.x, way.y, way.z}) > reach) continue;
    ++near;
    EXPECT_TRUE(std::ranges::any_of(boxes, [&](const MapBox& box) {
      return box.kind == MapBox::Kind::rigid && has(box, at, 1e-3 * cell);
    }));
  }
  EXPECT_GT(near, 3U);
}

TEST_F(MapBoxes, PatchesLieWithinOneAnotherAroundTheContact) {
  hybrid::Scene scene = load(
      "format = 1\n[device]\nmodel = \"ideal\"\n[[soft]]\nname = \"block\"\nformula = \"block\"\nsize = [60, "
      "60, 40]\nspacing = 1.25\n[path]\nkind = \"press\"\nfrom = [0, 0, 40]\nto = [0, 0, 19]\nspeed = "
      "200\nhold = 5\n");
  hybrid::BuiltScene built = hybrid::build_scene(scene);
  const hybrid::DrawnScene drawn = hybrid::drawn_scene(scene, built, "test");
  hybrid::Player player(scene, built, drawn, nullptr);
  player.relax_at_once();
  for (int n = 0; n < 200; ++n) player.step({});
  const auto boxes = hybrid::map_boxes(*built.world, player.state());
  std::vector<MapBox> patches;
  std::ranges::copy_if(boxes, std::back_inserter(patches),
                       [](const MapBox& box) { return box.kind == MapBox::Kind::patch; });
  ASSERT_GT(player.state().reactions[0].pressed, 0) << "the tool presses";
  ASSERT_GE(patches.size(), 2U);
  const auto volume = [](const MapBox& box) {
    return box.edges_m[0].x * box.edges_m[1].y * box.edges_m[2].z;
  };
  for (std::size_t n = 0; n < patches.size(); ++n) {
    EXPECT_EQ(patches[n].level, n);
    EXPECT_TRUE(has(patches[n], {0.0, 0.0, 18e-3}, 2.5e-3)) << "tissue below the tool";
    if (n == 0) continue;
    EXPECT_GE(volume(patches[n]), volume(patches[n - 1]));
  }
}

}  // namespace
