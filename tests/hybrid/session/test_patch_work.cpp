// SPDX-License-Identifier: GPL-3.0-or-later
// The scene keys `work` and `patch`: less work in a tick at a contact, and other widths of the finest patch.
#include <algorithm>
#include <string>

#include "hybrid/feel/just_noticeable.h"
#include "tests/hybrid/fixtures/touch.h"

namespace {

// A scene with a block of 64 mm per edge. Its top is at z = 32 mm.
std::string block_with(const std::string& more) {
  return "format = 1\n[material.gel]\nyoung = 10000\npoisson = 0.3\nstretch = [0.9, 1.1]\nshear = 0.1\n"
         "[[soft]]\nname = \"block\"\nformula = \"block\"\nsize = [64, 64, 64]\nmaterial = \"gel\"\n" +
         more + "[tool]\nradius = 8\n" + tests::unlimited + tests::some_path;
}

using PatchWork = tests::SceneFile;

// A share of the work delays the force, but does not change it. With the tool held still, the force becomes
// the same on nested patches (2 mm) and voxel by voxel (4 mm). A patch of another width is another
// approximation.
TEST_F(PatchWork, LessWorkIsFeltLaterNotOtherwise) {
  const double top = 0.032 - 0.002 + 0.008;
  const auto held = [&](const std::string& more) {
    tests::Touch touch(load(block_with(more)), {0.0, 0.0, top + 0.005}, true);
    glm::dvec3 last(0.0);
    const auto keep = [&](const hybrid::TickResult& tick) { last = tick.force_N; };
    touch.go({0.0, 0.0, top - 0.004}, 2e-4, 400, keep);
    EXPECT_EQ(touch.state().faults, 0U);
    return last;
  };
  for (const std::string spacing : {"spacing = 2\n", "spacing = 4\n"}) {
    const glm::dvec3 whole = held(spacing);
    EXPECT_GT(whole.z, 0.1);
    // Voxel by voxel, 0.4 s with a tenth of the work are not quite enough, so the second bound is wider.
    EXPECT_LT(hybrid::jnd_of(held(spacing + "work = 0.5\n"), whole, hybrid::kJndFloor_N), 0.1) << spacing;
    EXPECT_LT(hybrid::jnd_of(held(spacing + "work = 0.1\n"), whole, hybrid::kJndFloor_N), 0.5) << spacing;
  }
  for (const std::string patch : {"patch = 4\n", "patch = 10\n"}) {
    const double jnd =
        hybrid::jnd_of(held("spacing = 2\n" + patch), held("spacing = 2\n"), hybrid::kJndFloor_N);
    EXPECT_LT(jnd, 0.6) << patch;
    EXPECT_GT(jnd, 0.0) << patch;
  }
}

TEST_F(PatchWork, APatchWithoutPatchesIsPointedOut) {
  const auto warned = [&](const std::string& more) {
    const hybrid::BuiltScene built = hybrid::build_scene(load(block_with(more)));
    return std::ranges::any_of(built.notes, [](const hybrid::BuildNote& note) {
      return note.text.find("'patch' has no effect") != std::string::npos;
    });
  };
  EXPECT_FALSE(warned("spacing = 2\npatch = 4\n"));
  EXPECT_TRUE(warned("spacing = 4\npatch = 4\n"));
  EXPECT_FALSE(warned("spacing = 4\n"));
}

}  // namespace
