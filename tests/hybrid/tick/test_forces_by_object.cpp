// SPDX-License-Identifier: GPL-3.0-or-later
// The forces by object sum up to the felt force, in every shipped scene and where limits and anchors carry
// the load.
#include <algorithm>
#include <filesystem>
#include <glm/geometric.hpp>
#include <numeric>

#include "tests/hybrid/fixtures/touch.h"

namespace {

glm::dvec3 sum_by_object(const hybrid::WorldState& state) {
  return std::accumulate(
      state.feel.begin(), state.feel.end(), glm::dvec3(0.0),
      [](const glm::dvec3& sum, const hybrid::ObjectFeel& feel) { return sum + feel.on_hand_N; });
}

// The force before the limits on the felt force (N).
glm::dvec3 felt(const hybrid::TickResult& tick) {
  return tick.rigid_N + tick.soft_N;
}

class ForcesByObject : public tests::SceneFile, public testing::WithParamInterface<std::string> {};

TEST_P(ForcesByObject, SumUpToTheFeltForce) {
  const hybrid::Scene scene =
      hybrid::load_scene(std::string(HYBRID_SOURCE_DIR) + "/scenes/" + GetParam() + ".toml");
  const auto path = hybrid::scene_path(scene);
  tests::Touch touch(scene, path->position(0.0), true);
  const double dt_s = 1.0 / scene.rate_hz;
  const auto ticks = static_cast<int>(path->duration_s() / dt_s);
  int contact = 0;
  for (int n = 0; n < ticks; ++n) {
    const hybrid::TickResult tick = touch.at(path->position(n * dt_s), dt_s);
    const double off_N = glm::length(sum_by_object(touch.state()) - felt(tick));
    ASSERT_LE(off_N, std::max(0.01 * glm::length(felt(tick)), 1e-5)) << "at tick " << n;
    contact += tick.contacts != 0 ? 1 : 0;
  }
  EXPECT_GT(contact, 10);
}

std::vector<std::string> shipped_scenes() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(std::string(HYBRID_SOURCE_DIR) + "/scenes")) {
    if (entry.path().extension() == ".toml") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

INSTANTIATE_TEST_SUITE_P(Scenes, ForcesByObject, testing::ValuesIn(shipped_scenes()), [](const auto& scene) {
  std::string name = scene.param;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

class ForceOfAJammedBlock : public tests::SceneFile {};

// A thin block on its anchors is pressed deeper than its links allow. Anchors and limits carry nearly all of
// the force.
TEST_F(ForceOfAJammedBlock, IsItsOwn) {
  const hybrid::Scene scene = load(
      "format = 1\n[material.gel]\nyoung = 5000\npoisson = 0.3\nstretch = [0.7, 1.3]\nshear = 0.3\n"
      "[[soft]]\nname = \"block\"\nformula = \"block\"\nsize = [40, 40, 8]\nspacing = 2\nmaterial = \"gel\"\n"
      "anchors = { faces = [\"-z\"] }\n[tool]\nradius = 6\n" +
      tests::unlimited + tests::some_path);
  tests::Touch touch(scene, {0.0, 0.0, 0.02}, true);
  const hybrid::TickResult tick = touch.go({0.0, 0.0, 0.002}, 1e-4, 500);
  ASSERT_GT(glm::length(felt(tick)), 1.0);
  EXPECT_NEAR(touch.state().feel[0].force_N, glm::length(felt(tick)), 0.01 * glm::length(felt(tick)));
}

}  // namespace
