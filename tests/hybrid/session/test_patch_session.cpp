// SPDX-License-Identifier: GPL-3.0-or-later
// Scenes whose soft object solves its contact on nested patches: the conditions for this, the felt force, and
// the surface for graphics.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <iostream>

#include "hybrid/feel/just_noticeable.h"
#include "hybrid/session/forces_between.h"
#include "hybrid/snapshot/fill_snapshot.h"
#include "hybrid/snapshot/make_drawn_scene.h"
#include "hybrid/snapshot/merge_live_surface.h"
#include "hybrid/tick/tissue/obstacles.h"
#include "tests/hybrid/fixtures/equilibrium.h"
#include "tests/hybrid/fixtures/touch.h"

namespace {

// A scene with a block of 64 mm per edge. Its top is at z = 32 mm.
std::string block(const std::string& more) {
  return "format = 1\n[material.gel]\nyoung = 10000\npoisson = 0.3\nstretch = [0.9, 1.1]\nshear = 0.1\n"
         "[material.stiff]\nyoung = 50000\npoisson = 0.3\n"
         "[[soft]]\nname = \"block\"\nformula = \"block\"\nsize = [64, 64, 64]\nmaterial = \"gel\"\n" +
         more + "[tool]\nradius = 8\n" + tests::unlimited + tests::some_path;
}

class GridSession : public tests::SceneFile {
 protected:
  // The build's note on whether contacts are solved on nested patches.
  std::string note_of(const std::string& text) {
    const hybrid::BuiltScene built = hybrid::build_scene(load(text));
    for (const hybrid::BuildNote& note : built.notes) {
      if (note.text.find("nested patches") != std::string::npos) return note.text;
    }
    return {};
  }
};

TEST_F(GridSession, SaysWhereContactsAreKeptAndWhy) {
  EXPECT_NE(note_of(block("spacing = 1\n")).find("kept on nested patches"), std::string::npos);
  EXPECT_NE(note_of(block("spacing = 2\n")).find("kept on nested patches"), std::string::npos);
  EXPECT_NE(note_of(block("spacing = 4\n")).find("fewer than 10000 voxels"), std::string::npos);
  const std::string wall =
      "spacing = 1\n[[rigid]]\nname = \"wall\"\nprimitive = \"box\"\nsize = [10, 90, 90]\nposition = [45, 0, "
      "0]\n";
  EXPECT_NE(note_of(block(wall)).find("kept on nested patches"), std::string::npos);
  EXPECT_NE(note_of(block(wall + "motion = \"free\"\nmass = 1\n")).find("\"wall\" moves and may meet it"),
            std::string::npos);
  const std::string other =
      "spacing = 1\n[[soft]]\nname = \"other\"\nformula = \"block\"\nsize = [20, 20, 20]\nspacing = 2\n"
      "material = \"gel\"\nposition = [45, 0, 0]\n";
  EXPECT_NE(note_of(block(other)).find("\"other\" is nearer than 16.2 mm"), std::string::npos);
}

// Rigid surfaces out of reach do not change the felt force, during and after motion. The proxy's steps may
// differ a little.
TEST_F(GridSession, ABallFarAwayChangesNothing) {
  const std::string ball =
      "[[rigid]]\nname = \"ball\"\nprimitive = \"ball\"\nradius = 20\nposition = [150, 0, 20]\n";
  const double top = 0.032 - 0.002 + 0.008;
  const auto play = [&](const std::string& more) {
    std::vector<glm::dvec3> forces;
    tests::Touch touch(load(block("spacing = 1\n" + more)), {0.0, 0.0, top + 0.005}, true);
    const auto keep = [&](const hybrid::TickResult& tick) { forces.push_back(tick.force_N); };
    touch.go({0.0, 0.0, top - 0.004}, 2e-4, 30, keep);
    touch.go({0.008, 0.002, top - 0.002}, 2e-4, 30, keep);
    return forces;
  };
  const auto beside = play(ball), alone = play("");
  ASSERT_EQ(beside.size(), alone.size());
  for (std::size_t n = 0; n < alone.size(); ++n)
    ASSERT_LT(hybrid::jnd_of(beside[n], alone[n], hybrid::kJndFloor_N), 0.1) << "tick " << n;
}

// The window gets the nodes of the patches. The surface computed from them must equal the object's own
// surface.
TEST_F(GridSession, TheWindowShowsTheDent) {
  const hybrid::Scene scene = load(block("spacing = 1\nposition = [5, 3, -2]\nrotation = [0, 0, 30]\n"));
  const double top = 0.032 - 0.002 + 0.008;
  tests::Touch touch(scene, {0.005, 0.003, top + 0.005}, true);
  ASSERT_TRUE(touch.state().soft[0]->uses_patches());
  touch.go({0.005, 0.003, top - 0.003}, 2e-4, 20);
  const hybrid::DrawnScene drawn = hybrid::drawn_scene(scene, touch.built, "block");
  const auto shown = [&] {
    hybrid::Snapshot snapshot, live;
    hybrid::fill_moved_near(touch.world(), touch.state(), snapshot);
    hybrid::merge_live_surface(drawn, snapshot, {}, nullptr, live);
    return live.soft_moved_m[0];
  };
  const auto pressed = shown();
  hybrid::Snapshot right;
  // Points in the object that a view asks for must move as in a snapshot of the whole object.
  hybrid::AskedPoints asked{.number = 7, .at_rest_m = {{}}};
  for (const glm::dvec3& v : drawn.objects[0].surface.vertices)
    asked.at_rest_m[0].push_back(glm::mix(drawn.objects[0].inside.from_voxels({30.0, 30.0, 12.0}), v, 0.7));
  hybrid::Snapshot near, merged;
  hybrid::fill_moved_near(touch.world(), touch.state(), near);
  hybrid::fill_asked(touch.world(), touch.state(), asked, true, near);
  EXPECT_TRUE(near.asked.moved_m[0].empty()) << "the tick leaves them to the drawing thread";
  hybrid::merge_live_surface(drawn, near, {}, &asked, merged);
  hybrid::fill_asked(touch.world(), touch.state(), asked, false, right);
  ASSERT_EQ(merged.asked.number, 7U);
  ASSERT_EQ(merged.asked.moved_m[0].size(), right.asked.moved_m[0].size());
  for (std::size_t p = 0; p < right.asked.moved_m[0].size(); ++p)
    EXPECT_LT(glm::distance(merged.asked.moved_m[0][p], right.asked.moved_m[0][p]), 1e-4F);
  hybrid::fill_moved(touch.world(), touch.state(), right);
  ASSERT_EQ(pressed.size(), right.soft_moved_m[0].size());
  float deepest = 0.0F, tolerance = 0.0F;
  for (std::size_t v = 0; v < pressed.size(); ++v) {
    deepest = std::max(deepest, -pressed[v].z);
    tolerance = std::max(tolerance, glm::distance(pressed[v], right.soft_moved_m[0][v]));
  }
  EXPECT_GT(deepest, 2e-3F);
  EXPECT_LT(tolerance, 1e-3F * deepest);
  touch.go({0.005, 0.003, top + 0.02}, 1e-3, 5);
  for (const glm::vec3& moved : shown()) ASSERT_EQ(moved, glm::vec3(0.0F));
}

// If the chain is tight over nearly the whole object, the force must equal the force at rest. Relaxation of
// single links stalls in this case. Tests objects that fit into one patch, and larger ones. Then the tool is
// held still, and the force must stay the same from tick to tick.
TEST_F(GridSession, ATightChainIsFeltAsAtRest) {
  for (const int edge : {24, 38, 58}) {
    std::string text = block("spacing = 1\n");
    text.replace(text.find("[64, 64, 64]"), 12, fmt::format("[{0}, {0}, {0}]", edge));
    const double top = 0.5e-3 * edge + 0.008, depth = 0.75 * 0.1e-3 * (edge - 1);
    tests::Touch touch(load(text), {0.0, 0.0, top + 0.003}, true);
    ASSERT_TRUE(touch.state().soft[0]->uses_patches());
    const double felt_N = touch.go({0.0, 0.0, top - depth}, 2e-5, 100).force_N.z;
    const auto equilibrium = tests::equilibrium_force(touch.world(), touch.state());
    ASSERT_TRUE(equilibrium) << edge;
    std::printf("%d voxels an edge, %.2f mm deep: %.4f N, at rest in wide boxes %.4f N\n", edge, 1e3 * depth,
                felt_N, equilibrium->z);
    EXPECT_NEAR(felt_N, equilibrium->z, 0.02 * equilibrium->z);
    double least_N = felt_N, most_N = felt_N;
    touch.go({0.0, 0.0, top - depth}, 2e-5, 100, [&](const hybrid::TickResult& felt) {
      least_N = std::min(least_N, felt.force_N.z);
      most_N = std::max(most_N, felt.force_N.z);
    });
    EXPECT_LE(most_N - least_N, 1e-3 * felt_N);
  }
}

// A scene with a block of 64 mm per edge: 4 mm of skin on fat on muscle, with the given Young's moduli (Pa).
std::string layers(const std::array<int, 3>& young, const char* play) {
  std::string text;
  for (const auto& [name, young_Pa] : {std::pair{"skin", young[0]}, {"fat", young[1]}, {"muscle", young[2]}})
    text += fmt::format("[material.{}]\nyoung = {}\npoisson = 0.3\nstretch = {}\n", name, young_Pa, play);
  text = "format = 1\n" + text +
         "[[soft]]\nname = \"block\"\nformula = \"block\"\nsize = [64, 64, 64]\nspacing = 1\nlabel = 1\n"
         "layers = [{ thickness = 32, label = 3 }, { thickness = 28, label = 2 }, { thickness = 4, label = "
         "1 }]\n"
         "material = \"skin\"\nmaterials = { \"2\" = \"fat\", \"3\" = \"muscle\" }\n[tool]\nradius = 8\n" +
         tests::unlimited + tests::some_path;
  return text;
}

// Skin, fat and muscle with a tight chain. The fat between skin and muscle is squeezed to its limits. The
// force must equal the force at rest, also while the tool moves.
TEST_F(GridSession, LayersWithATightChainAreFeltAsAtRest) {
  constexpr std::array alike{20000, 5000, 10000}, real{100000, 3250, 11100};  // (Pa)
  for (const auto& [young, play] : {std::pair{alike, "[0.9, 1.1]\nshear = 0.1"},
                                    {alike, "[0.8, 1.2]\nshear = 0.2"},
                                    {alike, "[0.5, 1.5]\nshear = 0.5"},
                                    {real, "[0.9, 1.1]\nshear = 0.1"}}) {
    const std::string text = layers(young, play);
    const double top = 0.032 + 0.008;
    tests::Touch touch(load(text), {0.0, 0.0, top + 0.001}, true);
    ASSERT_TRUE(touch.state().soft[0]->uses_patches());
    for (const double depth : {2e-3, 4e-3, 1.5e-3}) {
      for (const double step : {1e-4, 2e-5}) {
        touch.go({0.0, 0.0, top - depth}, step, 0);
        const double moving_N = touch.at({0.0, 0.0, top - depth}).force_N.z;
        const auto at_rest = tests::equilibrium_force(touch.world(), touch.state());
        ASSERT_TRUE(at_rest) << depth;
        std::printf("%.1f mm deep: %.4f N, at rest in wide boxes %.4f N\n", 1e3 * depth, moving_N,
                    at_rest->z);
        EXPECT_NEAR(moving_N, at_rest->z, 0.35 * std::max(0.07 * at_rest->z, 0.04));
        touch.go({0.0, 0.0, top - depth + 1e-3}, 1e-4, 0);
      }
    }
  }
}

// A ball with a radius of nine spacings is pressed five spacings deep at 0.1 m/s, with no active limit. The
// force must equal the force at rest.
TEST_F(GridSession, AWideToolIsFeltAsAtRest) {
  std::string text = block("spacing = 1\n");
  const auto put = [&](const std::string& what, const std::string& with) {
    text.replace(text.find(what), what.size(), with);
  };
  put("[0.9, 1.1]\nshear = 0.1", "[0.01, 6]\nshear = 5");
  put("radius = 8", "radius = 9");
  const double top = 0.032 + 0.009;
  tests::Touch touch(load(text), {0.0, 0.0, top + 0.002}, true);
  ASSERT_TRUE(touch.state().soft[0]->uses_patches());
  const double felt_N = touch.go({0.0, 0.0, top - 5e-3}, 1e-4, 0).force_N.z;
  const auto at_rest = tests::equilibrium_force(touch.world(), touch.state());
  ASSERT_TRUE(at_rest);
  EXPECT_NEAR(felt_N, at_rest->z, 0.35 * 0.04);  // 0.35 of the least just noticeable difference
}

// A ball with a radius of 2.5 spacings is pressed up to four spacings deep, with wide limits and with active
// limits. Its force must be that of the same links relaxed one by one, and must not oscillate.
TEST_F(GridSession, ASmallBallFeelsWhatLinksDoAndHoldsStill) {
  // Near a body that may move, an object is relaxed link by link.
  const std::string body =
      "[[rigid]]\nname = \"body\"\nprimitive = \"box\"\nsize = [10, 10, 10]\nposition = [500, 0, 0]\nmotion "
      "= "
      "\"path\"\n[rigid.path]\nkind = \"press\"\nfrom = [0, 0, 0]\nto = [0, 0, 0.001]\n";
  struct Row {
    const char* limits;
    double tolerance, still;  // relative to the force
  };
  // If links are at their limits, their force on a voxel is not known. So the voxel swings sideways by a
  // fiftieth of a spacing, and the second row has wider tolerances.
  for (const auto& [limits, tolerance, still] :
       {Row{"[0.01, 2.5]\nshear = 2", 0.01, 1e-3}, Row{"[0.5, 1.5]\nshear = 0.5", 0.025, 0.01}}) {
    std::string text = block("spacing = 2\n");
    const auto put = [&](const std::string& what, const std::string& with) {
      text.replace(text.find(what), what.size(), with);
    };
    put("[64, 64, 64]", "[60, 60, 30]");
    put("[0.9, 1.1]\nshear = 0.1", limits);
    put("radius = 8", "radius = 5");
    for (const double x_m : {0.0, 3e-4, 1e-3}) {
      for (const double depth_m : {3e-3, 5e-3, 8e-3}) {
        std::array<glm::dvec3, 2> felt_N{};
        for (const bool by_links : {false, true}) {
          tests::Touch touch(load(by_links ? text + body : text), {x_m, x_m, 0.021}, true);
          ASSERT_EQ(touch.state().soft[0]->uses_patches(), !by_links);
          const glm::dvec3 end(x_m, x_m, 0.02 - depth_m);
          felt_N[by_links ? 1 : 0] = touch.go(end, 2e-5, 1000).force_N;
          if (by_links) continue;
          double difference_N = 0.0;
          touch.go(end, 2e-5, 50, [&](const hybrid::TickResult& felt) {
            difference_N = std::max(difference_N, glm::distance(felt.force_N, felt_N[0]));
          });
          EXPECT_LE(difference_N, still * felt_N[0].z);
        }
        std::printf("x = y = %.1f mm, %.0f mm deep: %.5f N, link by link %.5f N\n", 1e3 * x_m, 1e3 * depth_m,
                    felt_N[0].z, felt_N[1].z);
        EXPECT_NEAR(felt_N[0].z, felt_N[1].z, tolerance * felt_N[1].z);
      }
    }
  }
}

// Distant tissue must follow at once, inwards and outwards. A step of a tenth of a spacing changes the force
// by an eighth. One tick later the force must equal the force at rest.
TEST_F(GridSession, ATickAfterAStepTheForceIsThatAtRest) {
  const hybrid::Scene scene = load(block("spacing = 1\n"));
  for (const double step_m : {-1e-4, 1e-4}) {
    tests::Touch touch(scene, {0.0, 0.0, 0.043}, true);
    const double before = touch.go({0.0, 0.0, 0.0385}, 1e-4, 60).force_N.z;
    const glm::dvec3 there(0.0, 0.0, 0.0385 + step_m);
    touch.at(there);
    const double felt = touch.at(there).force_N.z, at_rest = touch.go(there, 1e-4, 60).force_N.z;
    std::cout << "[ measured ] from " << before << " to " << at_rest << " N, after a tick " << felt << " N\n";
    EXPECT_GT(std::fabs(at_rest - before), 0.1 * before);
    EXPECT_NEAR(felt, at_rest, 0.005 * at_rest);
  }
}

// On closed paths, slow or fast, frictionless tissue gives the hand no energy. The first path is down and up.
// The second is down, aside, up and back. The third is the second in reverse. At the place aside, the tissue
// is 1 % softer.
TEST_F(GridSession, AClosedPathGivesTheHandNoEnergy) {
  const glm::dvec3 above(0.0, 0.0, 0.043), deep(0.0, 0.0, 0.037), aside(0.005, 0.0, 0.0);
  const std::vector<std::vector<glm::dvec3>> paths{
      {deep, above}, {deep, deep + aside, above + aside, above}, {above + aside, deep + aside, deep, above}};
  const hybrid::Scene scene = load(block("spacing = 1\n"));
  for (const auto& path : paths) {
    for (const double step_m : {2e-5, 1e-4, 5e-4}) {
      tests::Touch touch(scene, above, true);
      ASSERT_TRUE(touch.state().soft[0]->uses_patches());
      double gained_J = 0.0, given_J = 0.0;
      glm::dvec3 last_m = above, last_N(0.0);
      const auto account = [&](const hybrid::TickResult& felt) {
        const double work_J = 0.5 * glm::dot(last_N + felt.force_N, felt.device_m - last_m);
        gained_J += work_J;
        given_J += std::max(0.0, -work_J);
        last_m = felt.device_m;
        last_N = felt.force_N;
      };
      for (const glm::dvec3& corner : path) touch.go(corner, step_m, 0, account);
      std::cout << "[ measured ] " << path.size() << " corners, " << 1e3 * step_m << " mm a tick: gained "
                << 1e6 * gained_J << " of " << 1e6 * given_J << " uJ\n";
      EXPECT_GT(given_J, 1e-4);
      EXPECT_LT(gained_J, 1e-6);
    }
  }
}

// A tool slides on skin that squeezes fat to its limits, without steps in its force. From tick to tick the
// force changes at most 1.2 times as much as during pressing at the same speed.
TEST_F(GridSession, ATightChainOfLayersIsSmoothToSlideOn) {
  for (const auto& young : {std::array{20000, 5000, 10000}, {100000, 3250, 11100}}) {
    const glm::dvec3 above(0.0, 0.0, 0.041), deep(0.0, 0.0, 0.036), aside(0.005, 0.0, 0.0);
    tests::Touch touch(load(layers(young, "[0.9, 1.1]\nshear = 0.1")), above, true);
    ASSERT_TRUE(touch.state().soft[0]->uses_patches());
    glm::dvec3 last_N(0.0);
    const auto most_of = [&](const glm::dvec3& to) {
      double most_N = 0.0;
      touch.go(to, 2e-5, 0, [&](const hybrid::TickResult& felt) {
        most_N = std::max(most_N, glm::distance(felt.force_N, last_N));
        last_N = felt.force_N;
      });
      return most_N;
    };
    const double in_N = most_of(deep), along_N = most_of(deep + aside);
    std::cout << "[ measured ] steps of the force: pressed in " << 1e3 * in_N << " mN, along "
              << 1e3 * along_N << " mN\n";
    EXPECT_LT(along_N, 1.2 * in_N);
  }
}

// A scene with a slab of 15,360 voxels, held at two sides. It lies 1 mm above a round bone, and a wall is
// beside it.
std::string slab_on_bone(double turned_deg) {
  return fmt::format(
             "format = 1\n[tool]\nradius = 6\nstiffness = 1000\n[material.tissue]\nyoung = 5000\npoisson = "
             "0.3\n"
             "[[rigid]]\nname = \"bone\"\nprimitive = \"ball\"\nradius = 12\nposition = [0, 0, -13]\n"
             "[[rigid]]\nname = \"wall\"\nprimitive = \"box\"\nsize = [60, 10, 40]\nposition = [0, 22, 6]\n"
             "[[soft]]\nname = \"tissue\"\nformula = \"block\"\nsize = [40, 32, 12]\nspacing = 1\n"
             "position = [0, 0, 6]\nrotation = [0, 0, {}]\nmaterial = \"tissue\"\nanchors = {{ faces = "
             "[\"-x\", \"+x\"] }}\n",
             turned_deg) +
         tests::unlimited + tests::some_path;
}

// Deepest overlap of tissue and rigid objects (spacings).
double overlap(tests::Touch& touch) {
  const voxel::SoftObject& object = *touch.state().soft[0];
  double most = 0.0;
  for (const voxel::VoxelId v : object.lattice().surface()) {
    const glm::dvec3 at = touch.world().soft[0].to_scene(object.position(v));
    const hybrid::NearestRigid near = hybrid::nearest_rigid(touch.world(), touch.state(), at, 2e-3);
    if (near.found) most = std::max(most, (object.voxel_radius() - near.distance) / 1e-3);
  }
  return most;
}

// The tool presses tissue onto a bone. While the tool moves, the force equals the force at rest. The forces
// of hand, bone and anchors balance. The bone is outside the finest patch, so voxels between coarse nodes may
// overlap it by a fiftieth of a spacing.
TEST_F(GridSession, TissueOnABoneIsFeltAsAtRest) {
  for (const double turned_deg : {0.0, 180.0}) {
    const hybrid::Scene scene = load(slab_on_bone(turned_deg));
    const glm::dvec3 above(0.0, 0.0, 0.019), deep(0.0, 0.0, 0.0135), aside(0.002, 0.001, 0.0);
    tests::Touch fast(scene, above, true), slow(scene, above, true);
    ASSERT_TRUE(fast.state().soft[0]->uses_patches());
    double most_jnd = 0.0, most_overlap = 0.0;
    for (const auto& [to, steps] : {std::pair{deep, 100}, {deep + aside, 40}, {deep, 40}, {above, 100}}) {
      const glm::dvec3 from = fast.state().device_m;
      for (int n = 1; n <= steps; ++n) {
        const glm::dvec3 at = from + (to - from) * (static_cast<double>(n) / steps);
        const glm::dvec3 moving_N = fast.at(at).force_N;
        const glm::dvec3 at_rest_N = slow.go(at, 5e-6, 10).force_N;
        most_jnd = std::max(most_jnd, hybrid::jnd_of(moving_N, at_rest_N, hybrid::kJndFloor_N));
        most_overlap = std::max(most_overlap, overlap(fast));
      }
      if (to != deep) continue;
      slow.go(deep, 1e-4, 50);
      const hybrid::ForcesBetween forces = hybrid::forces_between(slow.world(), slow.state());
      ASSERT_EQ(forces.pairs.size(), 2U);  // anchors and bone
      ASSERT_TRUE(forces.balance[0].sum_N);
      EXPECT_LT(*forces.balance[0].sum_N, 0.01 * forces.balance[0].largest_N);
      EXPECT_GT(forces.pairs[1].on_soft_N->z, 0.01);
    }
    std::cout << "[ measured ] at most " << most_jnd << " JND off, " << most_overlap
              << " spacings in the bone\n";
    EXPECT_LT(most_jnd, 0.5);
    EXPECT_LT(most_overlap, 0.03);
  }
}

// After a contact, tissue is at rest at once, and has the same obstacles as before the contact.
TEST_F(GridSession, ObstaclesAreThoseOfRestAfterAContact) {
  tests::Touch touch(load(slab_on_bone(0.0)), {0.0, 0.0, 0.019}, true);
  const auto obstacles = touch.state().soft[0]->obstacles();
  const std::vector<voxel::Obstacle> before(obstacles.begin(), obstacles.end());
  touch.go({0.004, 0.0, 0.012}, 1e-4, 100);
  touch.go({0.0, 0.0, 0.03}, 1e-4, 5);
  for (std::size_t s = 0; s < before.size(); ++s) {
    ASSERT_EQ(obstacles[s].normal, before[s].normal) << s;
    ASSERT_EQ(obstacles[s].bound, before[s].bound) << s;
  }
}

// On a closed path beside a bone, frictionless tissue gives the hand no energy.
TEST_F(GridSession, AClosedPathBesideABoneGivesTheHandNoEnergy) {
  const glm::dvec3 above(0.0, 0.0, 0.019), deep(0.0, 0.0, 0.0135), aside(0.003, 0.0, 0.0);
  const hybrid::Scene scene = load(slab_on_bone(0.0));
  for (const auto& path : std::vector<std::vector<glm::dvec3>>{{deep, above},
                                                               {deep, deep + aside, above + aside, above},
                                                               {above + aside, deep + aside, deep, above}}) {
    for (const double step_m : {2e-5, 1e-4}) {
      tests::Touch touch(scene, above, true);
      double gained_J = 0.0;
      glm::dvec3 last_m = above, last_N(0.0);
      for (const glm::dvec3& corner : path) {
        touch.go(corner, step_m, 0, [&](const hybrid::TickResult& felt) {
          gained_J += 0.5 * glm::dot(last_N + felt.force_N, felt.device_m - last_m);
          last_m = felt.device_m;
          last_N = felt.force_N;
        });
      }
      std::cout << "[ measured ] " << path.size() << " corners, " << 1e3 * step_m << " mm a tick: gained "
                << 1e6 * gained_J << " uJ\n";
      EXPECT_LT(gained_J, 1e-6);
    }
  }
}

// A copied state plays like its original, also if the patches come to tissue that they did not have at the
// copy. Here these are stiff parts, and the far end of the block, whose nodes are partly outside.
TEST_F(GridSession, ACopyFeelsTheSame) {
  const hybrid::Scene scene = load(
      block("spacing = 1\ninclusions = [{ shape = \"ball\", centre = [14, 6, 24], size = 9, label = 2 }, "
            "{ shape = \"ball\", centre = [22, -8, 26], size = 7, label = 2 }]\n"
            "materials = { \"2\" = \"stiff\" }\n"
            "[[rigid]]\nname = \"wall\"\nprimitive = \"box\"\nsize = [10, 90, 90]\nposition = [39, 0, 0]\n"));
  const glm::dvec3 start(-0.020, -0.018, 0.045);
  tests::Touch original(scene, start), copied(scene, start);
  copied.built.state = hybrid::copy_state(*copied.built.world, *copied.built.state);
  hybrid::begin_session(scene, copied.world(), copied.state(), start);
  const auto felt = [](tests::Touch& touch) {
    std::vector<glm::dvec3> forces_N;
    const auto keep = [&](const hybrid::TickResult& tick) { forces_N.push_back(tick.force_N); };
    touch.go({-0.020, -0.018, 0.037}, 2e-4, 10, keep);
    touch.go({0.014, 0.006, 0.036}, 2e-4, 10, keep);
    touch.go({0.026, -0.008, 0.036}, 2e-4, 10, keep);
    return forces_N;
  };
  const std::vector<glm::dvec3> expected = felt(original), of_copy = felt(copied);
  ASSERT_EQ(expected.size(), of_copy.size());
  EXPECT_GT(glm::length(expected.back()), 0.1);
  for (std::size_t n = 0; n < expected.size(); ++n) ASSERT_EQ(expected[n], of_copy[n]) << "tick " << n;
}

}  // namespace
