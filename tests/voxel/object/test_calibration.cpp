// SPDX-License-Identifier: GPL-3.0-or-later
// Forces from Young's modulus and Poisson's ratio, against Hertz's ball, the flat punch and a finite-element
// block. These tests use a complete block of soft tissue with its storage and relaxation. test_half_space.cpp
// and test_reference_block.cpp test the energies alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>
#include <string>
#include <vector>

#include "tests/shared_data.h"
#include "tests/voxel/fixtures/reference_block.h"
#include "tests/voxel/fixtures/soft_press.h"

namespace {

using tests::elastic;
using tests::SoftBlock;
using tests::voxel_at;
using voxel::Reaction;
using voxel::VoxelId;

constexpr double kH = 1e-3, kYoung = 1e4;

double contact_modulus(double poisson) {
  return kYoung / (1 - poisson * poisson);
}

// Runs cycles until the force on the held voxels is constant. Returns this force, upwards (N).
double relaxed_force(SoftBlock& soft, const std::vector<VoxelId>& held, double part = 1e-4) {
  double before = 0.0;
  for (int cycle = 0; cycle < 60; ++cycle) {
    soft.object->relax_cycle();
    double force = 0.0;
    for (const VoxelId v : held) force += voxel::link_force(*soft.lattice, soft.object->state(), v).z;
    if (std::fabs(force - before) < part * std::fabs(force) || soft.object->asleep()) return force;
    before = force;
  }
  ADD_FAILURE() << "not at rest after 60 cycles";
  return before;
}

// A quarter of a block that is 20 contact radii wide. It is pressed at the edge where its two inner faces
// meet. These faces act as planes of symmetry, because links in a face of the lattice count half.
struct Corner {
  SoftBlock soft;
  std::vector<VoxelId> held;
  std::vector<double> radius2;  // distance² of each voxel from the edge (spacings²)

  Corner(double a, double poisson)
      : soft({size(a), size(a), 2 * size(a) - 1}, kH, elastic(kYoung, poisson)) {}
  static int size(double a) { return static_cast<int>(std::ceil(10 * a)) + 1; }

  void hold_within(double radius) {
    for (int j = 0; j <= radius; ++j) {
      for (int i = 0; i <= radius; ++i) {
        if (i * i + j * j > radius * radius) continue;
        held.push_back(voxel_at(*soft.lattice, i, j, soft.dims[2] - 1));
        radius2.push_back(i * i + j * j);
        soft.object->claim(held.back());
      }
    }
  }
  // Reaction of the whole block on a tool, with the voxels at their present places.
  Reaction felt(const voxel::ToolInBody& tool) {
    for (const VoxelId v : held) soft.object->release(v);
    soft.object->touch(held);
    EXPECT_TRUE(soft.object->push_out(tool));
    Reaction reaction = soft.object->reaction(tool);
    reaction.force_N *= 4.0;
    return reaction;
  }
};

struct Felt {
  double force_N, theory_N, radius;
};

// Presses a ball with a contact radius of `a` spacings. Its depth is a tenth of a spacing.
Felt ball(double a, double poisson) {
  const double depth = 0.1 * kH, radius = a * a * kH * kH / depth;
  Corner corner(a, poisson);
  // Hertz's paraboloid and the ball differ by less than 1e-6 of the depth here.
  const double nudge = 1e-6 * depth;
  voxel::ToolInBody tool;
  tool.radius = radius - corner.soft.object->voxel_radius();
  tool.centre = {0.0, 0.0, corner.soft.top() + radius - depth};
  const auto bottom = [&](double r2) {
    return tool.centre.z - std::sqrt(radius * radius - r2 * kH * kH) - corner.soft.top();
  };
  corner.hold_within(a);
  for (std::size_t n = 0; n < corner.held.size(); ++n)
    corner.soft.object->move(corner.held[n], {0.0, 0.0, bottom(corner.radius2[n]) + nudge});
  relaxed_force(corner.soft, corner.held);
  // repeated until all held voxels push and no other voxel lies in the ball
  for (int round = 0; round < 6; ++round) {
    std::size_t changed = 0;
    for (std::size_t n = corner.held.size(); n-- > 0;) {
      const VoxelId v = corner.held[n];
      if (voxel::link_force(*corner.soft.lattice, corner.soft.object->state(), v).z > 0.0) continue;
      corner.soft.object->release(v);
      corner.held.erase(corner.held.begin() + static_cast<std::ptrdiff_t>(n));
      corner.radius2.erase(corner.radius2.begin() + static_cast<std::ptrdiff_t>(n));
      ++changed;
    }
    const int reach = static_cast<int>(1.5 * a);
    for (int j = 0; j <= reach; ++j) {
      for (int i = 0; i <= reach; ++i) {
        const VoxelId v = voxel_at(*corner.soft.lattice, i, j, corner.soft.dims[2] - 1);
        const double r2 = i * i + j * j, z = bottom(r2) + nudge;
        if (corner.soft.object->state().at(v).z <= z + nudge) continue;
        if (std::find(corner.held.begin(), corner.held.end(), v) != corner.held.end()) continue;
        corner.held.push_back(v);
        corner.radius2.push_back(r2);
        corner.soft.object->claim(v);
        corner.soft.object->move(v, {0.0, 0.0, z});
        ++changed;
      }
    }
    if (changed == 0) break;
    relaxed_force(corner.soft, corner.held);
  }
  const double found = corner.felt(tool).force_N.z;
  return {found, 4.0 / 3.0 * contact_modulus(poisson) * std::sqrt(radius) * std::pow(depth, 1.5),
          std::sqrt(radius * depth) / kH};
}

Felt punch(double a, double poisson) {
  const double depth = 0.1 * kH;
  Corner corner(a, poisson);
  corner.hold_within(a);
  for (const VoxelId v : corner.held) corner.soft.object->move(v, {0.0, 0.0, -depth * (1 - 1e-6)});
  relaxed_force(corner.soft, corner.held);
  voxel::ToolInBody tool;
  tool.shape = voxel::ToolInBody::Shape::punch;
  tool.radius = (a + 1e-3) * kH;
  tool.centre = {0.0, 0.0, corner.soft.top() + corner.soft.object->voxel_radius() - depth};
  const double found = corner.felt(tool).force_N.z;
  // The number of voxels of the whole punch. A voxel inside the quarter stands for four, a voxel on a face
  // for two, and the voxel on the edge for one.
  double voxels = 0.0;
  for (const VoxelId v : corner.held) {
    const auto c = corner.soft.lattice->coordinates(v);
    voxels += (c[0] > 0 ? 2 : 1) * (c[1] > 0 ? 2 : 1);
  }
  const double radius = std::sqrt(voxels / std::numbers::pi) * kH;
  return {found, 2 * radius * contact_modulus(poisson) * depth, radius / kH};
}

void compare(const char* what, double poisson, const Felt& felt) {
  const double error = felt.force_N / felt.theory_N - 1;
  std::cout << what << " | contact radius " << felt.radius << " | nu " << poisson << " | " << felt.force_N
            << " N | " << felt.theory_N << " N | " << std::showpos << 100 * error << std::noshowpos << " %\n";
  EXPECT_LT(std::fabs(error), felt.radius < 7.5 ? 0.07 : 0.04)
      << what << ' ' << felt.radius << ' ' << poisson;
}

// Under a sanitizer only the small block runs, because the run looks for memory errors, not for accuracy.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
const std::vector<double> kRadii{4.0};
#else
const std::vector<double> kRadii{4.0, 8.0};
#endif

TEST(Calibration, ABallIsHertzs) {
  for (const double a : kRadii) {
    for (const double poisson : {0.0, 0.3, 0.45}) compare("Hertz", poisson, ball(a, poisson));
  }
}

TEST(Calibration, AFlatPunchIsTheHalfSpaces) {
  for (const double a : kRadii) {
    for (const double poisson : {0.0, 0.3, 0.45}) compare("punch", poisson, punch(a, poisson));
  }
}

// Force on a square punch on a block of 100 × 100 × 60 mm with a held base (N). The block has a voxel at each
// node of the reference (reference/README.md).
double pressed_square(const tests::ReferenceRow& row) {
  const double h = row.spacing_m, depth = 1e-3;
  const int n = static_cast<int>(std::lround(0.1 / h)) + 1, nz = static_cast<int>(std::lround(0.06 / h)) + 1;
  const std::vector<double> young = tests::young_by_label(row.material);
  const voxel::LabelVolume volume = tests::reference_volume(row);
  voxel::LatticeOptions options = tests::made_of(elastic(kYoung, row.poisson));
  for (std::size_t label = 1; label < young.size(); ++label)
    options.materials[label] = elastic(young[label], row.poisson);
  SoftBlock soft({n, n, nz}, h, elastic(kYoung, row.poisson));
  soft.lattice = std::make_shared<voxel::Lattice>(volume, options);
  soft.object = std::make_unique<voxel::SoftObject>(soft.lattice);
  std::vector<VoxelId> held;
  const int wide = static_cast<int>(std::lround(row.width_m / h)) + 1, first = (n - wide) / 2;
  for (int j = first; j < first + wide; ++j) {
    for (int i = first; i < first + wide; ++i) held.push_back(voxel_at(*soft.lattice, i, j, nz - 1));
  }
  for (const VoxelId v : held) soft.object->claim(v);
  for (const VoxelId v : held) soft.object->move(v, {0.0, 0.0, -depth});
  return relaxed_force(soft, held, 1e-5);
}

TEST(Calibration, ABlockIsTheFiniteElements) {
  const auto folder = tests::shared_data("reference");
  SKIP_WITHOUT(folder);
  std::size_t homogeneous = 0;
  for (const tests::ReferenceRow& row : tests::reference_rows(folder)) {
    const double error = pressed_square(row) / row.force_N - 1.0;
    std::cout << "FEM | " << row.material << " | " << row.spacing_m * 1e3 << " mm | " << row.width_m * 1e3
              << " mm | nu " << row.poisson << " | " << std::showpos << 100 * error << std::noshowpos
              << " %\n";
    if (row.material == "hom" && row.spacings() > 3.9) {
      ++homogeneous;
      EXPECT_LT(std::fabs(error), 0.1);
    }
    // The plain solver of the same energy must agree within 0.1 %.
    if (row.spacing_m > 0.004) {
      EXPECT_NEAR(error, tests::pressed_block(row, tests::Energy::six_link) / row.force_N - 1.0, 0.001);
    }
  }
  EXPECT_GE(homogeneous, 12U);
}

}  // namespace
