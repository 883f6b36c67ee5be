// SPDX-License-Identifier: GPL-3.0-or-later
// The map of the felt difference of two models. The block has two halves, and the models differ on one half.
#include "hybrid/models/difference_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "hybrid/feel/just_noticeable.h"
#include "hybrid/snapshot/make_drawn_scene.h"
#include "tests/hybrid/fixtures/equilibrium.h"
#include "tests/hybrid/fixtures/touch.h"

namespace {

using hybrid::DifferenceMap;
using hybrid::FeltDifference;

constexpr double kDepth_m = 1.5e-3, kRadius_m = 4e-3;
const std::atomic<bool> kGoOn{false};

class HalfChanged : public tests::SceneFile {
 protected:
  // A block of 64 x 24 x 10 mm. Its half at x > 0 has a modulus of its own.
  hybrid::Scene scene(double young_right, const std::string& keys = {}, const std::string& more = {}) const {
    return load(
        "format = 1\n[tool]\nradius = 4\nstiffness = 1000\n[material.left]\nyoung = 8000\n"
        "[material.right]\nyoung = " +
        std::to_string(young_right) +
        "\n[[soft]]\nname = \"block\"\nformula = \"block\"\nsize = [64, 24, 10]\nspacing = 2\n"
        "material = \"left\"\nmaterials = { \"2\" = \"right\" }\n"
        "inclusions = [{ shape = \"box\", centre = [16, 0, 0], size = [32, 40, 40], label = 2 }]\n" +
        keys + more + tests::some_path + tests::unlimited);
  }
  static polygon::TriangleMesh surface_of(const hybrid::Scene& scene, const hybrid::BuiltScene& built) {
    return hybrid::drawn_scene(scene, built, "block").objects[0].surface;
  }
  // The force at rest of a session that presses at `at_m`.
  static glm::dvec3 pressed(const hybrid::Scene& scene, const glm::dvec3& at_m, const glm::dvec3& outward) {
    tests::Touch touch(scene, at_m + 2.0 * kRadius_m * outward);
    touch.go(at_m + (kRadius_m - kDepth_m) * outward, 1e-4, 50);
    const auto force = tests::equilibrium_force(touch.world(), touch.state());
    return force.value_or(glm::dvec3(NAN));
  }
};

TEST_F(HalfChanged, IsFeltOnThatHalfAlone) {
  const hybrid::Scene soft = scene(8000.0), stiff = scene(24000.0);
  const auto a = hybrid::build_scene(soft), b = hybrid::build_scene(stiff);
  const polygon::TriangleMesh surface = surface_of(soft, a);
  DifferenceMap map("block", surface, a, b, kDepth_m, hybrid::kJndFloor_N);
  ASSERT_TRUE(map.press(160, 2, kGoOn));
  const FeltDifference found = map.now();
  EXPECT_EQ(found.places, 160U);
  ASSERT_EQ(found.jnd.size(), surface.vertices.size());
  std::size_t left = 0, right = 0;
  for (std::size_t v = 0; v < found.jnd.size(); ++v) {
    const glm::dvec3& at = surface.vertices[v];
    if (at.z < 0.0 || std::isnan(found.jnd[v])) continue;
    if (at.x < -3.0 * kRadius_m) {
      EXPECT_LT(found.jnd[v], 0.5F) << at.x;
      ++left;
    }
    if (at.x > 3.0 * kRadius_m && at.x < 28e-3 && std::abs(at.y) < 8e-3) {  // not at the rim
      EXPECT_GT(found.jnd[v], 1.0F) << at.x;
      ++right;
    }
  }
  EXPECT_GT(left, 50U);
  EXPECT_GT(right, 50U);
  EXPECT_GT(found.share_felt, 0.15);
  EXPECT_LT(found.share_felt, 0.5) << "on the half that differs, and not at its bottom";

  // The largest difference must equal that of two sessions that press at its place.
  std::size_t most = 0;
  for (std::size_t v = 0; v < surface.vertices.size(); ++v) {
    if (surface.vertices[v] == found.most.at_m) most = v;
  }
  glm::dvec3 normal(0.0);
  for (const polygon::TriangleIndices& t : surface.triangles) {
    if (t[0] != most && t[1] != most && t[2] != most) continue;
    normal += glm::cross(surface.vertices[t[1]] - surface.vertices[t[0]],
                         surface.vertices[t[2]] - surface.vertices[t[0]]);
  }
  const glm::dvec3 outward = glm::normalize(normal);
  const glm::dvec3 a_N = pressed(soft, found.most.at_m, outward),
                   b_N = pressed(stiff, found.most.at_m, outward);
  EXPECT_NEAR(found.most.a_N, glm::length(a_N), 0.02 * glm::length(a_N));
  EXPECT_NEAR(found.most.b_N, glm::length(b_N), 0.02 * glm::length(b_N));
  EXPECT_NEAR(found.most.jnd, hybrid::jnd_of(b_N, a_N, hybrid::kJndFloor_N), 0.03 * found.most.jnd);
}

TEST_F(HalfChanged, IsTheSameForAnyNumberOfThreads) {
  const hybrid::Scene soft = scene(8000.0), other = scene(8000.0, "energy = \"trilinear\"\n");
  const auto a = hybrid::build_scene(soft), b = hybrid::build_scene(other);
  const polygon::TriangleMesh surface = surface_of(soft, a);
  DifferenceMap one("block", surface, a, b, kDepth_m, hybrid::kJndFloor_N),
      three("block", surface, a, b, kDepth_m, hybrid::kJndFloor_N);
  ASSERT_TRUE(one.press(12, 1, kGoOn));
  ASSERT_TRUE(three.press(5, 3, kGoOn));
  ASSERT_TRUE(three.press(7, 3, kGoOn));
  const FeltDifference first = one.now(), second = three.now();
  EXPECT_GT(first.pressed, 0U);
  EXPECT_GT(first.most.jnd, 0.0);
  for (std::size_t v = 0; v < first.jnd.size(); ++v) {
    if (!std::isnan(first.jnd[v]) || !std::isnan(second.jnd[v])) {
      ASSERT_EQ(first.jnd[v], second.jnd[v]);
    }
  }
}

TEST_F(HalfChanged, IsNothingForOneModelAndUnknownWhereTheToolCannotCome) {
  // A plate lies over the left half, less than the tool's diameter above it.
  const hybrid::Scene covered = scene(
      8000.0, {},
      "[[rigid]]\nname = \"plate\"\nprimitive = \"box\"\nsize = [32, 60, 4]\nposition = [-16, 0, 12]\n");
  const auto a = hybrid::build_scene(covered), b = hybrid::build_scene(covered);
  const auto drawn = hybrid::drawn_scene(covered, a, "block");
  const polygon::TriangleMesh& surface = drawn.objects[1].surface;
  DifferenceMap map("block", surface, a, b, kDepth_m, hybrid::kJndFloor_N);
  ASSERT_TRUE(map.press(60, 2, kGoOn));
  const FeltDifference found = map.now();
  EXPECT_LT(found.pressed, found.places);
  EXPECT_EQ(found.most.jnd, 0.0);
  EXPECT_EQ(found.share_felt, 0.0);
  for (std::size_t v = 0; v < surface.vertices.size(); ++v) {
    const glm::dvec3& at = surface.vertices[v];
    if (std::abs(at.y) > 8e-3 || at.z < 4e-3) continue;
    if (at.x < -12e-3 && at.x > -24e-3) {
      EXPECT_TRUE(std::isnan(found.jnd[v])) << at.x;
    }
    if (at.x > 12e-3 && at.x < 24e-3) {
      EXPECT_EQ(found.jnd[v], 0.0F) << at.x;
    }
  }
}

TEST_F(HalfChanged, IsUnknownUnderSomethingThinAndKnownForATissueThatIsRigid) {
  const std::string sheet =
      "[[rigid]]\nname = \"sheet\"\nprimitive = \"box\"\nsize = [32, 60, 0.5]\nposition = [-16, 0, 5.5]\n";
  const hybrid::Scene covered = scene(8000.0, {}, sheet), rigid = scene(8000.0, "model = \"proxy\"\n", sheet);
  const auto a = hybrid::build_scene(covered), b = hybrid::build_scene(rigid);
  const auto drawn = hybrid::drawn_scene(covered, a, "block");
  const polygon::TriangleMesh& surface = drawn.objects[1].surface;
  DifferenceMap map("block", surface, a, b, kDepth_m, hybrid::kJndFloor_N);
  ASSERT_TRUE(map.press(60, 2, kGoOn));
  const FeltDifference found = map.now();
  for (std::size_t v = 0; v < surface.vertices.size(); ++v) {
    const glm::dvec3& at = surface.vertices[v];
    if (std::abs(at.y) > 6e-3 || at.z < 4.5e-3) continue;
    if (at.x < -12e-3 && at.x > -24e-3) {
      EXPECT_TRUE(std::isnan(found.jnd[v])) << at.x;
    }
    if (at.x > 12e-3 && at.x < 24e-3) {
      EXPECT_GT(found.jnd[v], 1.0F) << at.x;
    }
  }
}

TEST_F(HalfChanged, EndsWhenTheSurfaceIsCoveredOrWhenItIsStopped) {
  const hybrid::Scene soft = scene(8000.0);
  const auto a = hybrid::build_scene(soft);
  const polygon::TriangleMesh surface = surface_of(soft, a);
  const std::atomic<bool> stopped{true};
  DifferenceMap map("block", surface, a, a, kDepth_m, hybrid::kJndFloor_N);
  EXPECT_FALSE(map.press(1'000'000, 1, stopped)) << "no place is left out, and none pressed";
  EXPECT_EQ(map.now().pressed, 0U);
  EXPECT_LE(map.now().gap_m, 0.25 * kRadius_m);
  EXPECT_FALSE(map.press(1, 1, kGoOn)) << "it is covered";
}

}  // namespace
