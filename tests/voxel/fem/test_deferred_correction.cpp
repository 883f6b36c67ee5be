// SPDX-License-Identifier: GPL-3.0-or-later
// Relaxation of the accurate energy in a soft object, against finite elements and against a plain solver of
// the same energy.
#include "voxel/fem/deferred_correction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>

#include "tests/shared_data.h"
#include "tests/voxel/fixtures/reference_block.h"
#include "tests/voxel/fixtures/soft_press.h"
#include "voxel/lattice/voxel_links.h"
#include "voxel/object/shadow_object.h"
#include "voxel/object/soft_object.h"

namespace {

using tests::Random;

voxel::LinkMaterial bricks_of(double young_Pa, double poisson) {
  voxel::LinkMaterial out = tests::elastic(young_Pa, poisson);
  out.bricks = true;
  return out;
}

voxel::SoftObject object_of(const voxel::LabelVolume& volume, const voxel::LatticeOptions& options) {
  return voxel::SoftObject(std::make_shared<voxel::Lattice>(volume, options));
}

// ---- a cell's bricks compared with its links ----

TEST(BrickLoads, LinksOfACellAreItsShareOfTheLattice) {
  const glm::dvec3 spacing(1e-3, 0.7e-3, 2e-3);
  const voxel::LabelVolume volume = tests::block({4, 4, 4}, spacing);
  const voxel::Lattice lattice(volume, tests::made_of(tests::elastic(7e3, 0.4)));
  const voxel::NodeStencil inside = voxel::node_stencil(voxel::link_cell_stiffness(7e3, 0.4, spacing));
  const voxel::VoxelSprings springs = lattice.springs_of(lattice.at(1, 1, 1));
  const std::array<std::size_t, 3> up{14, 16, 22};  // [d] the upper neighbour's number in the stencil
  for (std::size_t d = 0; d < 3; ++d) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float k = springs.up[d].on(static_cast<int>(axis), static_cast<int>(d));
      EXPECT_NEAR(-inside.block[up[d]][4 * axis + axis], k, 1e-5F * k);
    }
  }
}

TEST(BrickLoads, NoDeformationTakesMoreThanTheLargestRatio) {
  const glm::dvec3 spacing(1e-3, 0.5e-3, 2e-3);
  const voxel::BrickStiffness brick = voxel::brick_stiffness(1e4, 0.45, spacing),
                              links = voxel::link_cell_stiffness(1e4, 0.45, spacing);
  const double most = voxel::largest_ratio(brick, links);
  const auto energy = [](const voxel::BrickStiffness& k, const std::array<double, 24>& u) {
    double sum = 0.0;
    for (std::size_t r = 0; r < 24; ++r) {
      for (std::size_t c = 0; c < 24; ++c) sum += u[r] * k.at(r, c) * u[c];
    }
    return sum;
  };
  Random random(5);
  double found = 0.0;
  for (int n = 0; n < 2000; ++n) {
    std::array<double, 24> u{};
    for (double& x : u) x = random.between(-1.0, 1.0);
    if (n == 0) {  // uniform swelling: bricks resist it far more than links
      for (std::size_t i = 0; i < 24; ++i) u[i] = (i / 3 >> i % 3 & 1U) != 0 ? 1.0 : -1.0;
    }
    found = std::max(found, energy(brick, u) / energy(links, u));
  }
  EXPECT_LE(found, most * (1 + 1e-9));
  EXPECT_GT(found, 0.3 * most);
}

// ---- the state of rest ----

// A body of random tissues with holes. It is held at its bottom, and at a few displaced voxels of its
// surface. plain() is the same body for the plain solver.
struct Pulled {
  tests::VoxelBody body;
  voxel::LatticeOptions options;
  voxel::LabelVolume volume;
  std::vector<std::array<int, 3>> held;
  std::vector<glm::dvec3> at_m;

  explicit Pulled(unsigned seed) {
    Random random(seed);
    body.dims = {6 + random.below(30), 5 + random.below(4), 4 + random.below(4)};
    body.spacing_m = {random.between(0.5e-3, 2e-3), random.between(0.5e-3, 2e-3),
                      random.between(0.5e-3, 2e-3)};
    body.tissue = {{}};
    const int kinds = 1 + random.below(3);
    for (int n = 0; n < kinds; ++n)
      body.tissue.push_back({std::pow(10.0, random.between(3.0, 5.0)), random.between(0.0, 0.42)});
    volume = tests::block(body.dims, body.spacing_m);
    body.label.assign(volume.labels.size(), 1);
    const double holes = random.between(0.0, 0.12);
    for (int k = 1; k < body.dims[2]; ++k) {
      for (int j = 0; j < body.dims[1]; ++j) {
        for (int i = 0; i < body.dims[0]; ++i) {
          int& label = body.label[body.at(i, j, k)];
          label = 1 + (i / 3 + j / 2 + k / 2) * 7 % kinds;
          if (random.unit() < holes) label = 0;
        }
      }
    }
    // A loose piece has no state of rest. So every voxel without a voxel below it is removed, until none is
    // left.
    for (bool again = true; again;) {
      again = false;
      for (int k = 1; k < body.dims[2]; ++k) {
        for (int j = 0; j < body.dims[1]; ++j) {
          for (int i = 0; i < body.dims[0]; ++i) {
            int& label = body.label[body.at(i, j, k)];
            if (label == 0 || body.label_at({i, j, k - 1}) != 0) continue;
            label = 0;
            again = true;
          }
        }
      }
    }
    for (std::size_t v = 0; v < body.label.size(); ++v)
      volume.labels[v] = static_cast<std::uint8_t>(body.label[v]);
    for (int n = 1; n <= kinds; ++n) {
      const tests::Tissue& t = body.tissue[static_cast<std::size_t>(n)];
      options.materials[static_cast<std::size_t>(n)] = bricks_of(t.young_Pa, t.poisson);
    }
    options.anchor_faces = {"-z"};
    for (int j = 1; j < 3; ++j) {
      for (int i = 2; i < 5; ++i) {
        int k = body.dims[2] - 1;
        while (k > 0 && body.label_at({i, j, k}) == 0) --k;
        if (k == 0) continue;
        held.push_back({i, j, k});
        const double size = 0.2 * body.spacing_m.z;
        at_m.emplace_back(random.between(-size, size), random.between(-size, size),
                          random.between(-size, size));
      }
    }
  }

  // The solved equilibrium.
  [[nodiscard]] tests::PlainProblem plain() const {
    tests::PlainProblem out = problem_of(body, tests::Energy::accurate);
    for (int j = 0; j < body.dims[1]; ++j) {
      for (int i = 0; i < body.dims[0]; ++i) out.free[body.at(i, j, 0)].setZero();
    }
    for (std::size_t n = 0; n < held.size(); ++n) {
      const std::size_t v = body.at(held[n][0], held[n][1], held[n][2]);
      out.free[v].setZero();
      out.u[v] = {at_m[n].x, at_m[n].y, at_m[n].z};
    }
    EXPECT_TRUE(out.solve(1e-7, 20'000));
    return out;
  }
  void hold(voxel::SoftObject& object) const {
    const voxel::Lattice& lattice = object.lattice();
    for (std::size_t n = 0; n < held.size(); ++n) {
      const voxel::VoxelId v = lattice.at(held[n][0], held[n][1], held[n][2]);
      object.claim(v);
      object.drag(v, at_m[n] - object.state().at(v));
    }
    object.settle_dragged();
  }
};

// Largest error of a displacement, relative to the largest displacement.
double difference(const voxel::SoftObject& object, const Pulled& scene, const tests::PlainProblem& plain) {
  double most = 0.0, worst = 0.0;
  for (int k = 0; k < scene.body.dims[2]; ++k) {
    for (int j = 0; j < scene.body.dims[1]; ++j) {
      for (int i = 0; i < scene.body.dims[0]; ++i) {
        if (scene.body.label_at({i, j, k}) == 0) continue;
        const Eigen::Vector3d& expected = plain.u[scene.body.at(i, j, k)];
        const glm::dvec3 found = object.state().at(object.lattice().at(i, j, k));
        most = std::max(most, expected.norm());
        worst = std::max(worst, (expected - Eigen::Vector3d(found.x, found.y, found.z)).norm());
      }
    }
  }
  return worst / most;
}

// An object is at rest if no residual exceeds a fraction of the force scale of the whole object. Then even
// tissue that is a hundred times softer than its neighbours is within 1 % of its equilibrium.
TEST(BrickLoads, AnyBodyComesToRestWhereItsBricksDo) {
  double worst = 0.0;
  int cycles = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const Pulled scene(seed);
    if (scene.held.empty()) continue;
    const tests::PlainProblem plain = scene.plain();
    voxel::SoftObject object = object_of(scene.volume, scene.options);
    scene.hold(object);
    int n = 0;
    for (; n < 3000 && !object.asleep(); ++n) object.relax_cycle();
    EXPECT_TRUE(object.asleep()) << seed;
    const double off = difference(object, scene, plain);
    EXPECT_LT(off, 0.02) << seed;
    EXPECT_NEAR(object.energy_J(), plain.energy_J(), 0.002 * plain.energy_J()) << seed;
    worst = std::max(worst, off);
    cycles = std::max(cycles, n);
  }
  std::cout << "bodies of bricks | at most " << 100 * worst << " % of the largest displacement | " << cycles
            << " cycles\n";
}

// A ShadowObject that relaxes the object also transfers the brick loads. So both come to the same rest.
TEST(BrickLoads, AnotherThatRelaxesItComesToTheSameRest) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const Pulled scene(seed);
    if (scene.held.empty()) continue;
    const tests::PlainProblem plain = scene.plain();
    voxel::SoftObject object = object_of(scene.volume, scene.options);
    voxel::ShadowObject shadow(object);
    scene.hold(object);
    for (int n = 0; n < 3000 && voxel::ShadowObject::wanted(object); ++n) {
      shadow.submit(object);
      shadow.relax();
      shadow.apply_near(object);
      shadow.apply_far(object, 1'000'000);
    }
    EXPECT_FALSE(voxel::ShadowObject::wanted(object)) << seed;
    EXPECT_LT(difference(object, scene, plain), 0.02) << seed;
  }
}

// ---- against finite elements and other references ----

double pressed_by_punch(const tests::ReferenceRow& row) {
  const double h = row.spacing_m, depth = 1e-3;
  const voxel::LabelVolume volume = tests::reference_volume(row);
  voxel::LatticeOptions options;
  const std::vector<double> young = tests::young_by_label(row.material);
  for (std::size_t label = 1; label < young.size(); ++label)
    options.materials[label] = bricks_of(young[label], row.poisson);
  options.anchor_faces = {"-z"};
  voxel::SoftObject object = object_of(volume, options);
  const voxel::Lattice& lattice = object.lattice();
  std::vector<voxel::VoxelId> punched;
  const double top = (volume.dims[2] - 1) * h;
  for (const voxel::VoxelId v : lattice.surface()) {
    const glm::dvec3 at = lattice.rest(v);
    if (at.z < top - 0.5 * h) continue;
    if (std::max(std::fabs(at.x - 0.05), std::fabs(at.y - 0.05)) > 0.5 * row.width_m + 1e-9) continue;
    punched.push_back(v);
    object.claim(v);
    object.drag(v, {0.0, 0.0, -depth});
  }
  object.settle_dragged();
  double force = 0.0, before = 0.0;
  for (int cycle = 1; cycle <= 400; ++cycle) {
    // The punch is smooth, so the pressed voxels slide along its face.
    for (const voxel::VoxelId v : punched) {
      const glm::dvec3 wanted = object.unconstrained_minimum(v);
      object.move(v, {wanted.x, wanted.y, -depth});
    }
    object.relax_cycle();
    if (cycle % 20 != 0) continue;
    force = 0.0;
    for (const voxel::VoxelId v : punched) force += voxel::link_force(lattice, object.state(), v).z;
    if (std::fabs(force - before) < 1e-4 * std::fabs(force)) break;
    before = force;
  }
  return force;
}

TEST(BrickLoads, ABlockIsTheFiniteElements) {
  const auto folder = tests::shared_data("reference");
  SKIP_WITHOUT(folder);
  double worst = 0.0;
  int rows = 0;
  for (const tests::ReferenceRow& row : tests::reference_rows(folder)) {
    const double error = pressed_by_punch(row) / row.force_N - 1.0;
    EXPECT_LT(std::fabs(error), row.material == "hom" ? 0.03 : 0.05)
        << row.material << ' ' << row.spacing_m << ' ' << row.width_m << ' ' << row.poisson;
    worst = std::max(worst, std::fabs(error));
    ++rows;
  }
  std::cout << "bricks in the store | " << rows << " rows, 2.5 and 5 mm | within " << 100 * worst << " %\n";
}

// A ball with a radius of 4 spacings presses the block by contact, not by prescribed displacements. Its force
// must be the slope of the energy.
TEST(BrickLoads, TheToolFeelsTheSlopeOfItsEnergy) {
  for (const double poisson : {0.3, 0.45}) {
    const double h = 1e-3, radius = 4e-3;
    tests::SoftBlock block({25, 25, 13}, h, bricks_of(1e4, poisson));
    std::array<double, 2> energy{};
    const double depth = 1.0e-3, step = 2e-5;
    double force = 0.0;
    for (const int side : {-1, 1}) {
      (void)block.press(block.ball(radius, depth + side * step), 6e-3, 1e-5, 1000);
      energy[side < 0 ? 0 : 1] = block.object->energy_J();
    }
    force = block.press(block.ball(radius, depth), 6e-3, 1e-5, 1000).force_N.z;
    const double slope = (energy[1] - energy[0]) / (2 * step);
    EXPECT_NEAR(force, slope, 0.005 * slope) << poisson;
  }
}

TEST(BrickLoads, MaterialsChooseEachForItself) {
  voxel::LabelVolume volume = tests::block({40, 8, 8}, glm::dvec3(1e-3));
  for (int k = 0; k < 8; ++k) {
    for (int j = 0; j < 8; ++j) {
      for (int i = 20; i < 40; ++i) volume.labels[volume.index(i, j, k)] = 2;
    }
  }
  voxel::LatticeOptions options;
  options.materials[1] = bricks_of(1e4, 0.3);
  options.materials[2] = tests::elastic(1e5, 0.3);
  options.anchor_faces = {"-z"};
  voxel::SoftObject object = object_of(volume, options);
  const voxel::VoxelId v = object.lattice().at(20, 4, 7);
  object.claim(v);
  object.drag(v, {0.0, 0.0, -0.3e-3});
  object.settle_dragged();
  for (int n = 0; n < 500 && !object.asleep(); ++n) object.relax_cycle();
  EXPECT_TRUE(object.asleep());
  const auto load_at = [&](int i) {
    const auto load = object.state().bricks.at(object.lattice().at(i, 4, 6));
    return std::fabs(load[0]) + std::fabs(load[1]) + std::fabs(load[2]);
  };
  EXPECT_GT(load_at(19), 0.0F);
  EXPECT_GT(load_at(20), 0.0F);  // cells between the two materials belong to the softer one, which has bricks
  EXPECT_EQ(load_at(22), 0.0F);
}

TEST(BrickLoads, LeavesNothingBehind) {
  tests::SoftBlock block({33, 33, 17}, 1e-3, bricks_of(1e4, 0.4));
  (void)block.press(block.ball(4e-3, 1.5e-3), 6e-3);
  block.object->touch({});
  for (int n = 0; n < 2000 && !block.object->asleep(); ++n) block.object->relax_cycle();
  EXPECT_TRUE(block.object->asleep());
  double most = 0.0;
  for (const voxel::VoxelId v : block.lattice->surface())
    most = std::max(most, glm::length(block.object->state().at(v)));
  EXPECT_LT(most, 1e-3 * 1.5e-3);
}

// The force divided by Young's modulus and the spacing squared is a constant, for spacings from 1 µm to 10 m
// and moduli from 1 Pa to 1 TPa.
TEST(BrickLoads, UnitsDoNotMatter) {
  double expected = 0.0;
  for (const double h : {1e-3, 1e-6, 10.0}) {
    for (const double young : {1e4, 1.0, 1e12}) {
      tests::SoftBlock block({17, 17, 9}, h, bricks_of(young, 0.3));
      const double force =
          block.press(block.ball(3 * h, 0.7 * h), 5 * h, 1e-5, 1000).force_N.z / (young * h * h);
      ASSERT_TRUE(std::isfinite(force)) << h << ' ' << young;
      if (expected == 0.0) expected = force;
      EXPECT_NEAR(force, expected, 1e-3 * expected) << h << ' ' << young;
    }
  }
  EXPECT_GT(expected, 0.1);
}

// Thin bodies have few bricks, and tissue without slack has bricks that never deform.
TEST(BrickLoads, WhatIsThinOrTightIsFiniteAndComesToRest) {
  for (const std::array<int, 3>& dims : {std::array{17, 17, 2}, std::array{9, 2, 12}, std::array{2, 2, 2}}) {
    for (const bool tight : {false, true}) {
      voxel::LinkMaterial material = bricks_of(1e4, 0.45);
      if (tight) {
        material.stretch_min = material.stretch_max = 1.0;
        material.shear = 0.0;
      }
      tests::SoftBlock block(dims, 1e-3, material);
      const voxel::Reaction felt = block.press(block.ball(3e-3, 0.3e-3), 5e-3, 1e-5, 1000);
      EXPECT_TRUE(std::isfinite(glm::length(felt.force_N))) << dims[0] << ' ' << tight;
      for (const voxel::VoxelId v : block.lattice->surface())
        ASSERT_LT(glm::length(block.object->state().at(v)), 1e-2) << dims[0] << ' ' << tight;
      block.object->touch({});
      for (int n = 0; n < 2000 && !block.object->asleep(); ++n) block.object->relax_cycle();
      EXPECT_TRUE(block.object->asleep()) << dims[0] << ' ' << tight;
    }
  }
}

TEST(BrickLoads, RefusesWhatWouldNotComeToRest) {
  const voxel::LabelVolume volume = tests::block({4, 4, 4}, glm::dvec3(1e-3));
  EXPECT_THROW(voxel::Lattice(volume, tests::made_of(bricks_of(1e4, 0.495))), std::invalid_argument);
  voxel::LinkMaterial yields = bricks_of(1e4, 0.3);
  yields.yield = 0.1;
  EXPECT_THROW(voxel::Lattice(volume, tests::made_of(yields)), std::invalid_argument);
}

}  // namespace
