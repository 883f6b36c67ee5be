// SPDX-License-Identifier: GPL-3.0-or-later
// The accurate energy as a soft object relaxes it, against the same energy solved plainly.
#include <gtest/gtest.h>

#include <iostream>
#include <random>

#include "tests/shared_data.h"
#include "tests/voxel/reference_block.h"
#include "tests/voxel/soft_press.h"
#include "voxel/brick_loads.h"
#include "voxel/links.h"
#include "voxel/soft_object.h"

namespace {

// The block of the reference, all of it, in the store.
struct Block {
  std::shared_ptr<const voxel::Lattice> lattice;
  std::unique_ptr<voxel::SoftObject> object;
};

Block block_of(const tests::ReferenceRow& row, bool bricks) {
  const double h = row.spacing_m;
  const int n = static_cast<int>(std::lround(0.1 / h)) + 1, nz = static_cast<int>(std::lround(0.06 / h)) + 1;
  voxel::LabelVolume volume = tests::block({n, n, nz}, glm::dvec3(h));
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        volume.labels[volume.index(i, j, k)] =
            static_cast<std::uint8_t>(tests::label_in_block(row.material, i * h, j * h, k * h));
      }
    }
  }
  voxel::LatticeOptions options;
  const std::vector<double> young = tests::young_by_label(row.material);
  for (std::size_t label = 1; label < young.size(); ++label) {
    options.materials[label] = {.young_Pa = young[label], .poisson = row.poisson, .bricks = bricks};
  }
  options.anchor_faces = {"-z"};
  Block out;
  out.lattice = std::make_shared<voxel::Lattice>(volume, options);
  out.object = std::make_unique<voxel::SoftObject>(out.lattice);
  return out;
}

// Force on a square punch that moves 1 mm down, its voxels free to slide along its face (N), after `cycles`.
double pressed(const Block& block, const tests::ReferenceRow& row, int cycles, double& left) {
  const voxel::Lattice& lattice = *block.lattice;
  voxel::SoftObject& object = *block.object;
  std::vector<voxel::VoxelId> punched;
  const double h = row.spacing_m, top = std::round(0.06 / h) * h;
  for (const voxel::VoxelId v : lattice.surface()) {
    const glm::dvec3 at = lattice.rest(v);
    if (at.z > top - 0.5 * h && std::max(std::abs(at.x - 0.05), std::abs(at.y - 0.05)) < 0.5 * row.width_m + 1e-9)
      punched.push_back(v);
  }
  double force = 0.0;
  for (int n = 0; n < cycles; ++n) {
    for (const voxel::VoxelId v : punched) {
      if (n == 0) object.hold(v);
      glm::dvec3 place = object.free_displacement(v);
      place.z = -1e-3;
      if (n == 0) {
        object.drag(v, place - object.state().at(v));
      } else {
        object.move(v, place);
      }
    }
    if (n == 0) object.settle_dragged();
    object.relax_cycle();
  }
  for (const voxel::VoxelId v : punched) force -= voxel::link_force(lattice, object.state(), v).z;
  left = object.residual_N();
  return -force;
}

TEST(BrickLoads, ABlockIsTheFiniteElements) {
  const auto folder = tests::shared_data("reference");
  SKIP_WITHOUT(folder);
  for (const tests::ReferenceRow& row : tests::reference_rows(folder)) {
    if (row.spacing_m < 0.004) continue;
    const Block block = block_of(row, true);
    for (const int cycles : {10, 30, 60}) {
      double left = 0.0;
      const double force = pressed(block, row, cycles, left);
      std::cout << "bricks | " << row.material << " | " << row.spacing_m * 1e3 << " mm | " << row.width_m * 1e3
                << " mm | nu " << row.poisson << " | " << cycles << " cycles | " << std::showpos
                << 100 * (std::abs(force) / row.force_N - 1) << std::noshowpos << " % | left " << left << " N\n";
    }
  }
}

}  // namespace
