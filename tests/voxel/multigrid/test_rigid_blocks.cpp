// SPDX-License-Identifier: GPL-3.0-or-later
// Rigid blocks in and on soft tissue, against a direct solution in which each block is one unknown per axis.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <memory>
#include <thread>
#include <vector>

#include "tests/voxel/fixtures/direct_solution.h"
#include "tests/voxel/fixtures/lattice_scenes.h"
#include "voxel/lattice/voxel_links.h"
#include "voxel/object/shadow_object.h"
#include "voxel/object/soft_object.h"
#include "voxel/object/validate.h"

namespace {

using voxel::VoxelId;

constexpr double kSpacing = 1e-3;
constexpr voxel::LinkMaterial kTight{.stretch_min = 1.0, .stretch_max = 1.0, .shear = 0.0};

// A block of tissue that is anchored below. Voxels with tight(i, j, k) get label 2, a material without slack.
struct Scene {
  voxel::LabelVolume volume;
  voxel::LatticeOptions options;
  std::shared_ptr<voxel::Lattice> lattice;
  std::unique_ptr<voxel::SoftObject> object;
  std::vector<VoxelId> near;

  template <class Tight>
  Scene(const std::array<int, 3>& dims, const voxel::LinkMaterial& tissue, const Tight& tight)
      : volume(tests::block(dims, glm::dvec3(kSpacing))), options(tests::made_of(tissue)) {
    options.materials[2] = kTight;
    for (int k = 0; k < dims[2]; ++k) {
      for (int j = 0; j < dims[1]; ++j) {
        for (int i = 0; i < dims[0]; ++i) {
          if (tight(i, j, k)) volume.labels[volume.index(i, j, k)] = 2;
        }
      }
    }
    lattice = std::make_shared<voxel::Lattice>(volume, options);
    object = std::make_unique<voxel::SoftObject>(lattice);
  }

  // A tool at x, y that is `depth` below its first contact with the top. All arguments are in spacings.
  [[nodiscard]] voxel::ToolInBody ball(double radius, double depth, double x, double y) const {
    voxel::ToolInBody tool;
    tool.radius = radius * kSpacing;
    tool.centre = glm::dvec3(x, y, volume.dims[2] - 1.0 - depth) * kSpacing;
    tool.centre.z += object->reach(tool.radius);
    return tool;
  }
  void touch(const voxel::ToolInBody& tool) {
    near.clear();
    for (const VoxelId v : lattice->surface()) {
      if (glm::distance(object->position(v), tool.centre) < object->reach(tool.radius) + kSpacing)
        near.push_back(v);
    }
    object->touch(near);
  }
  [[nodiscard]] double worst_violation() const {
    double worst = 0.0;
    for (std::size_t i = 0; i < lattice->size(); ++i) {
      const auto v = static_cast<VoxelId>(i);
      for (int d = 0; lattice->filled(v) && d < 3; ++d) {
        const VoxelId w = lattice->up(v, d);
        for (int axis = 0; lattice->filled(w) && axis < 3; ++axis) {
          const auto& u = object->state().u[static_cast<std::size_t>(axis)];
          const auto b = lattice->bounds(v, d, axis);
          worst = std::max(
              {worst, static_cast<double>(u[w] - u[v] - b[1]), static_cast<double>(b[0] - (u[w] - u[v]))});
        }
      }
    }
    return worst / kSpacing;
  }
  // Runs `ticks` ticks with the tool at one place. Tick and shadow relax the object in turns, as in a
  // session.
  enum class Relaxed { here, by_another_thread };
  void hold(voxel::ShadowObject& shadow, const voxel::ToolInBody& tool, int ticks,
            Relaxed relaxed = Relaxed::here) {
    for (int n = 0; n < ticks; ++n) {
      touch(tool);
      object->push_out(tool);
      object->relax_near(tool, 2);
      if (!voxel::ShadowObject::wanted(*object)) continue;
      shadow.submit(*object);
      if (relaxed == Relaxed::here) {
        shadow.relax();
      } else {
        std::jthread([&shadow] { shadow.relax(); }).join();
      }
      shadow.apply_near(*object);
      while (!shadow.all_applied()) shadow.apply_far(*object, lattice->grid().rows());
    }
  }
  // Moves the tool down to `depth` in steps, and keeps it there.
  void press(voxel::ShadowObject& shadow, double radius, double depth, double x, double y, int ticks = 120) {
    constexpr int kSteps = 10;
    for (int n = 1; n <= kSteps; ++n) hold(shadow, ball(radius, depth * n / kSteps, x, y), 1);
    hold(shadow, ball(radius, depth, x, y), ticks);
  }
  [[nodiscard]] double furthest_m() const {
    double most = 0.0;
    for (const auto& axis : object->state().u) {
      for (const float u : axis) most = std::max(most, static_cast<double>(std::fabs(u)));
    }
    return most;
  }
};

// The equilibrium problem on an axis. Pressed voxels keep their places, and each rigid block is one unknown.
tests::Problem condensed(const Scene& scene, int axis, const voxel::ToolInBody& tool) {
  const voxel::Lattice& lattice = *scene.lattice;
  const auto& u = scene.object->state().u[static_cast<std::size_t>(axis)];
  tests::Problem p{tests::links_of(lattice, scene.options, axis), std::vector<int>(lattice.size(), -1), 0,
                   std::vector<double>(u.begin(), u.end())};
  constexpr double kTouching = 1e-4;
  const auto touches = [&](VoxelId v) {
    return lattice.surface_number(v) != voxel::Lattice::kNoSurface &&
           glm::distance(scene.object->position(v), tool.centre) <
               scene.object->reach(tool.radius) + kTouching * kSpacing;
  };
  std::map<int, bool> held;
  for (std::size_t i = 0; i < lattice.size(); ++i) {
    const auto v = static_cast<VoxelId>(i);
    if (lattice.filled(v) && lattice.block(v) != 0 && touches(v)) held[lattice.block(v)] = true;
  }
  std::map<int, int> of_part;
  for (std::size_t i = 0; i < lattice.size(); ++i) {
    const auto v = static_cast<VoxelId>(i);
    const int part = lattice.block(v);
    if (!lattice.filled(v) || lattice.anchored(v) || (part != 0 ? held[part] : touches(v))) continue;
    if (part == 0) {
      p.unknown[i] = p.unknowns++;
      continue;
    }
    const auto [at, fresh] = of_part.emplace(part, p.unknowns);
    if (fresh) ++p.unknowns;
    p.unknown[i] = at->second;
  }
  return p;
}

// Force on the anchors in the solution `p` (N). Expects that none of the anchors' links is at its limit.
double carried(const Scene& scene, const tests::Problem& p) {
  double force = 0.0;
  for (const tests::Link& l : p.links) {
    if (scene.lattice->anchored(l.a) == scene.lattice->anchored(l.b)) continue;
    EXPECT_GT(p.u[l.b] - p.u[l.a], l.low);
    EXPECT_LT(p.u[l.b] - p.u[l.a], l.high);
    force += l.k * (scene.lattice->anchored(l.a) ? p.u[l.b] - p.u[l.a] : p.u[l.a] - p.u[l.b]);
  }
  return force;
}

enum class Limits { none, active };

// Expects the force and displacements of the direct solution, and small residuals on all free voxels and
// blocks.
void expect_at_equilibrium(Scene& scene, const voxel::ToolInBody& tool, Limits limits) {
  scene.touch(tool);
  scene.object->push_out(tool);
  scene.object->relax_near(tool, 1);
  const glm::dvec3 force = scene.object->reaction(tool).force_N;
  const double size = glm::length(force);
  ASSERT_GT(size, 0.0);
  for (int axis = 0; axis < 3; ++axis) {
    tests::Problem p = condensed(scene, axis, tool);
    if (limits == Limits::none) {
      tests::solve_without_limits(p);
    } else {
      tests::solve_with_limits(p, kSpacing);
    }
    EXPECT_NEAR(-force[axis], carried(scene, p), 0.01 * size) << "axis " << axis;
    // If links are at their limits, pressed voxels do not slide as far sideways as they could, with or
    // without blocks (tangential_contact.h).
    if (limits == Limits::active && axis != 2) continue;
    double off = 0.0;
    for (std::size_t v = 0; v < p.u.size(); ++v)
      off = std::max(
          off, std::fabs(p.u[v] -
                         static_cast<double>(scene.object->state().u[static_cast<std::size_t>(axis)][v])));
    EXPECT_LT(off, 0.01 * scene.furthest_m()) << "axis " << axis;
  }
  EXPECT_EQ(voxel::validate(*scene.lattice, scene.object->state(), 8.0), "");
  if (limits == Limits::active) return;
  // residual of the first-order conditions on each free voxel and on each block
  std::map<int, glm::dvec3> of_part;
  double most = 0.0;
  for (std::size_t i = 0; i < scene.lattice->size(); ++i) {
    const auto v = static_cast<VoxelId>(i);
    if (!scene.lattice->filled(v) || scene.lattice->anchored(v)) continue;
    const glm::dvec3 pull = voxel::link_force(*scene.lattice, scene.object->state(), v);
    if (scene.lattice->block(v) != 0) {
      of_part.emplace(scene.lattice->block(v), glm::dvec3(0.0)).first->second += pull;
    } else if (glm::distance(scene.object->position(v), tool.centre) >
               scene.object->reach(tool.radius) + 0.01 * kSpacing) {
      most = std::max(most, glm::length(pull));
    }
  }
  for (const auto& [part, pull] : of_part) {
    bool pressed = false;
    for (const VoxelId v : scene.object->touched())
      pressed = pressed ||
                (scene.lattice->block(v) == part && glm::distance(scene.object->position(v), tool.centre) <
                                                        scene.object->reach(tool.radius) + 1e-4 * kSpacing);
    if (!pressed) most = std::max(most, glm::length(pull));
  }
  EXPECT_LT(most, 1e-4 * size);
}

// Expects that the object returns to its undeformed state once the tool has left.
void expect_restored(Scene& scene, voxel::ShadowObject& shadow, voxel::ToolInBody tool, int ticks = 150) {
  tool.centre.z += 1.0;
  scene.hold(shadow, tool, ticks);
  EXPECT_LT(scene.furthest_m(), 1e-3 * kSpacing);
  EXPECT_TRUE(scene.object->asleep());
}

const voxel::LinkMaterial kLoose = tests::elastic(5e3, 0.3);
constexpr voxel::LinkMaterial kLimited{.stretch_min = 0.8, .stretch_max = 1.2, .shear = 0.2};
constexpr std::array<int, 3> kDims{24, 20, 16};

struct Shape {
  const char* name;
  bool (*tight)(int i, int j, int k);
  double depth;
};
const std::array<Shape, 4>& shapes() {
  static const std::array<Shape, 4> kShapes{
      Shape{"layer", [](int, int, int k) { return k >= 11; }, 2.0},
      Shape{"layer within", [](int, int, int k) { return k >= 8 && k < 11; }, 2.0},
      Shape{"inclusion at the top",
            [](int i, int j, int k) { return i > 7 && i < 16 && j > 6 && j < 14 && k > 8; }, 2.0},
      Shape{"inclusion within",
            [](int i, int j, int k) { return i > 7 && i < 16 && j > 6 && j < 14 && k > 6 && k < 13; }, 1.2}};
  return kShapes;
}

TEST(RigidBlocks, AreWhatHangsTogetherAndAtAnchorsAreAnchored) {
  // Two rigid plates, one of which lies on the anchors.
  const Scene scene({8, 7, 9}, kLoose, [](int, int, int k) { return k < 2 || k >= 6; });
  EXPECT_EQ(scene.lattice->block_count(), 1U);
  EXPECT_EQ(scene.lattice->anchored_count(), 2U * 8 * 7);
  for (int k = 0; k < 9; ++k)
    EXPECT_EQ(scene.lattice->block(scene.lattice->at(3, 3, k)), k >= 6 ? 1 : 0) << k;
}

TEST(RigidBlocks, OnAnchorsAreAsRigid) {
  Scene scene({8, 7, 6}, kLoose, [](int, int, int) { return true; });
  EXPECT_EQ(scene.lattice->anchored_count(), scene.lattice->voxel_count());
  const auto tool = scene.ball(3.0, 0.5, 3.5, 3.0);
  scene.touch(tool);
  scene.object->push_out(tool);
  scene.object->relax_near(tool, 2);
  EXPECT_EQ(scene.furthest_m(), 0.0);
  std::array<voxel::ToolBound, 64> bounds;
  EXPECT_GT(scene.object->give_way(tool, bounds), 0U);
}

// The tool is over the middle, moves sideways, and rests beside the middle.
TEST(RigidBlocks, AreFeltAsTheyAreHeldByTissue) {
  for (const Shape& shape : shapes()) {
    SCOPED_TRACE(shape.name);
    Scene scene(kDims, kLoose, shape.tight);
    EXPECT_EQ(scene.lattice->block_count(), 1U);
    voxel::ShadowObject shadow(*scene.object);
    scene.press(shadow, 4.0, shape.depth, 11.5, 9.5);
    expect_at_equilibrium(scene, scene.ball(4.0, shape.depth, 11.5, 9.5), Limits::none);
    for (int n = 1; n <= 20; ++n) {
      scene.hold(shadow, scene.ball(4.0, shape.depth, 11.5 + 0.2 * n, 9.5 - 0.1 * n), 1);
      EXPECT_EQ(voxel::validate(*scene.lattice, scene.object->state(), 8.0), "") << n;
    }
    const auto beside = scene.ball(4.0, shape.depth, 15.5, 7.5);
    scene.hold(shadow, beside, 120);
    expect_at_equilibrium(scene, beside, Limits::none);
    expect_restored(scene, shadow, beside);
  }
}

TEST(RigidBlocks, AreFeltThroughLinksAtTheirLimits) {
  for (const Shape& shape : shapes()) {
    SCOPED_TRACE(shape.name);
    Scene scene(kDims, kLimited, shape.tight);
    voxel::ShadowObject shadow(*scene.object);
    const double depth = 0.6 * shape.depth;
    scene.press(shadow, 4.0, depth, 11.5, 9.5);
    expect_at_equilibrium(scene, scene.ball(4.0, depth, 11.5, 9.5), Limits::active);
    expect_restored(scene, shadow, scene.ball(4.0, depth, 11.5, 9.5));
  }
}

// Many small blocks, and some that extend between the others.
TEST(RigidBlocks, ScatteredAreFeltToo) {
  for (const std::uint32_t seed : {1U, 2U, 3U}) {
    SCOPED_TRACE(seed);
    tests::Random random(seed);
    Scene scene({18, 16, 12}, kLoose, [&random](int, int, int k) { return random.unit() < 0.25 && k > 0; });
    EXPECT_GT(scene.lattice->block_count(), 50U);
    voxel::ShadowObject shadow(*scene.object);
    const auto tool = scene.ball(4.0, 1.0, 8.6, 7.3);
    scene.press(shadow, 4.0, 1.0, 8.6, 7.3, 300);
    expect_at_equilibrium(scene, tool, Limits::active);
    expect_restored(scene, shadow, tool, 400);
  }
}

TEST(RigidBlocks, AreTheSameToTheLastBitWhicheverThreadRelaxes) {
  for (const Shape& shape : shapes()) {
    std::array<std::unique_ptr<Scene>, 2> scenes;
    for (const auto relaxed : {Scene::Relaxed::here, Scene::Relaxed::by_another_thread}) {
      auto& scene = scenes[relaxed == Scene::Relaxed::here ? 0 : 1];
      scene = std::make_unique<Scene>(kDims, kLimited, shape.tight);
      voxel::ShadowObject shadow(*scene->object);
      for (int n = 0; n < 20; ++n) scene->hold(shadow, scene->ball(4.0, 0.05 * n, 11.5, 9.5), 1, relaxed);
    }
    for (std::size_t axis = 0; axis < 3; ++axis)
      EXPECT_TRUE(scenes[0]->object->state().u[axis] == scenes[1]->object->state().u[axis]) << shape.name;
  }
}

}  // namespace
