// SPDX-License-Identifier: GPL-3.0-or-later
// Contacts of a CompositeGrid with rigid surfaces at rest, against a brute-force solution. The reference is
// projected Gauss-Seidel over all voxels of the lattice, until no voxel moves.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <iostream>
#include <memory>
#include <random>
#include <vector>

#include "tests/voxel/composite/slack_material.h"
#include "tests/voxel/fixtures/lattice_scenes.h"
#include "voxel/composite/grid.h"

namespace {

using tests::block;
using tests::kSpacing;
using voxel::CompositeGrid;
using voxel::Lattice;
using voxel::Obstacle;
using voxel::VoxelId;
using Index3 = CompositeGrid::Index3;

// A material whose links never reach their limits in these tests.
const voxel::LinkMaterial kLoose{
    .young_Pa = 1e4, .poisson = 0.3, .stretch_min = 0.001, .stretch_max = 9.0, .shear = 9.0};

// A slab that is held at two of its sides. A square of its top is pressed down, and a rigid ball lies under
// it.
struct Slab {
  std::shared_ptr<const Lattice> lattice;
  std::vector<Obstacle> obstacles;  // [surface number]
  Index3 middle{};                  // middle voxel of the square
  int half = 2;
  double depth_m = 0.0;

  // `layers`: skin (three voxels) on fat on muscle, instead of one tissue.
  Slab(const Index3& dims, std::mt19937& random, bool layers = false) {
    const auto between = [&](double low, double high) {
      return std::uniform_real_distribution(low, high)(random);
    };
    voxel::LatticeOptions options = tests::made_of(kLoose, nullptr);
    std::size_t n = 0;
    for (int k = 0; k < dims[2]; ++k) {
      for (int j = 0; j < dims[1]; ++j) {
        for (int i = 0; i < dims[0]; ++i, ++n) {
          if (i == 0 || i == dims[0] - 1) options.anchor_voxels.push_back(n);
        }
      }
    }
    voxel::LabelVolume volume = block(dims, glm::dvec3(kSpacing));
    if (layers) {
      const std::size_t plane = static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]);
      const auto height = static_cast<std::size_t>(dims[2]);
      for (n = 0; n < volume.labels.size(); ++n)
        volume.labels[n] = n / plane + 3 >= height ? 1 : n / plane >= height / 2 - 1 ? 2 : 3;
      options.materials[1].young_Pa = 1e5;
      options.materials[2].young_Pa = 3e3;
      options.materials[3].young_Pa = 1e4;
    }
    lattice = std::make_shared<Lattice>(std::move(volume), options);
    middle = {dims[0] / 2 + static_cast<int>(between(-3.0, 3.0)),
              dims[1] / 2 + static_cast<int>(between(-3.0, 3.0)), dims[2] - 1};
    depth_m = between(1.5, 2.5) * kSpacing;
    const double radius_m = between(4.0, 15.0) * kSpacing;
    const glm::dvec3 centre_m(middle[0] * kSpacing + between(-3.0, 3.0) * kSpacing,
                              middle[1] * kSpacing + between(-3.0, 3.0) * kSpacing,
                              -radius_m - between(0.0, 0.5) * kSpacing);
    obstacles.resize(lattice->surface().size());
    for (std::size_t s = 0; s < obstacles.size(); ++s) {
      const glm::dvec3 away = lattice->rest(lattice->surface()[s]) - centre_m;
      const double gap_m = glm::length(away) - radius_m;
      if (gap_m < 4.0 * kSpacing)
        obstacles[s] = {glm::vec3(glm::normalize(away)), -static_cast<float>(std::max(gap_m, 0.0))};
    }
  }
  [[nodiscard]] bool is_pressed(const Index3& p) const {
    return p[2] == middle[2] && std::abs(p[0] - middle[0]) <= half && std::abs(p[1] - middle[1]) <= half;
  }
};

struct Solution {
  double tool_N = 0.0, rigid_N = 0.0;  // force of the tool and of the ball on the object, along z
  std::size_t on_rigid = 0;            // number of voxels that touch the ball
};

Solution brute_force(const Slab& slab) {
  struct Node {
    std::array<int, 6> beside{};         // [2 d + side] index of the neighbour; −1: none
    std::array<glm::dvec3, 6> spring{};  // [2 d + side] spring of the link (N/m)
    glm::dvec3 u{0.0}, compliance{0.0};
    const Obstacle* obstacle = nullptr;
    bool fixed = false, pressed = false;
  };
  const Lattice& lattice = *slab.lattice;
  std::vector<int> number(lattice.size(), -1);
  std::vector<VoxelId> voxels;
  for (VoxelId v = 0; v < lattice.size(); ++v) {
    if (!lattice.filled(v)) continue;
    number[v] = static_cast<int>(voxels.size());
    voxels.push_back(v);
  }
  std::vector<Node> nodes(voxels.size());
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    Node& node = nodes[n];
    node.fixed = lattice.anchored(voxels[n]);
    node.pressed = slab.is_pressed(lattice.coordinates(voxels[n]));
    glm::dvec3 sum(0.0);
    for (int d = 0; d < 3; ++d) {
      for (const bool up : {false, true}) {
        const VoxelId w = up ? lattice.up(voxels[n], d) : lattice.down(voxels[n], d);
        const std::size_t side = 2 * static_cast<std::size_t>(d) + (up ? 1 : 0);
        node.beside[side] = lattice.filled(w) ? number[w] : -1;
        if (node.beside[side] < 0) continue;
        const voxel::Spring spring = lattice.spring(up ? voxels[n] : w, d);
        for (int axis = 0; axis < 3; ++axis)
          node.spring[side][axis] = static_cast<double>(spring.on(axis, d));
        sum += node.spring[side];
      }
    }
    node.compliance = 1.0 / sum;
  }
  for (std::size_t s = 0; s < slab.obstacles.size(); ++s) {
    if (slab.obstacles[s].normal != glm::vec3(0.0F))
      nodes[static_cast<std::size_t>(number[lattice.surface()[s]])].obstacle = &slab.obstacles[s];
  }
  const auto minimum = [&nodes](const Node& node) {
    glm::dvec3 pull(0.0);
    for (std::size_t side = 0; side < 6; ++side) {
      if (node.beside[side] >= 0)
        pull += node.spring[side] * nodes[static_cast<std::size_t>(node.beside[side])].u;
    }
    return pull * node.compliance;
  };
  for (int sweep = 0; sweep < 20000; ++sweep) {
    double most_m = 0.0;
    for (Node& node : nodes) {
      if (node.fixed) continue;
      glm::dvec3 u = minimum(node);
      if (node.pressed) u.z = std::min(u.z, -slab.depth_m);
      if (node.obstacle != nullptr) {
        const glm::dvec3 n(node.obstacle->normal), way = n * node.compliance;
        const double overlap = static_cast<double>(node.obstacle->bound) - glm::dot(n, u);
        if (overlap > 0.0) u += overlap / glm::dot(way, n) * way;
      }
      most_m = std::max(most_m, glm::distance(u, node.u));
      node.u = u;
    }
    if (most_m < 1e-8 * kSpacing) break;
  }
  Solution result;
  for (const Node& node : nodes) {
    if (node.fixed) continue;
    const double on_it_N = (node.u.z - minimum(node).z) / node.compliance.z;
    if (node.pressed) result.tool_N += on_it_N;
    const bool on_rigid =
        node.obstacle != nullptr && glm::dot(glm::dvec3(node.obstacle->normal), node.u) <
                                        static_cast<double>(node.obstacle->bound) + 1e-6 * kSpacing;
    if (!on_rigid) continue;
    result.rigid_N += on_it_N;
    ++result.on_rigid;
  }
  return result;
}

struct Felt {
  double tool_N = 0.0, rigid_N = 0.0, overlap_m = 0.0;
};

Felt on_patches(const Slab& slab, int half_width) {
  CompositeGrid grid(*slab.lattice, half_width);
  grid.begin(slab.middle);
  grid.watch_obstacles(slab.obstacles);
  for (int n = 0; n < 60; ++n) {
    grid.clear_pressed();
    grid.press_on_obstacles();
    for (int j = -slab.half; j <= slab.half; ++j) {
      for (int i = -slab.half; i <= slab.half; ++i) {
        grid.press({slab.middle[0] + i, slab.middle[1] + j, slab.middle[2]},
                   glm::dvec3(0.0, 0.0, -slab.depth_m), glm::dvec3(0.0, 0.0, -1.0));
      }
    }
    grid.cycle();
    grid.settle_on_obstacles();
  }
  Felt felt{.tool_N = -grid.force_on_tool_N().z};
  for (const CompositeGrid::ObstacleForce& force : grid.obstacle_forces())
    felt.rigid_N += force.on_object_N.z;
  for (std::size_t s = 0; s < slab.obstacles.size(); ++s) {
    const Obstacle& o = slab.obstacles[s];
    const Index3 at = slab.lattice->coordinates(slab.lattice->surface()[s]);
    if (o.normal == glm::vec3(0.0F) || !grid.in_fine_patch(at)) continue;
    felt.overlap_m =
        std::max(felt.overlap_m, static_cast<double>(o.bound) - glm::dot(glm::dvec3(o.normal), grid.at(at)));
  }
  return felt;
}

// With all voxels on level 0, the result is the lattice's equilibrium. The grid meets an oblique plane on one
// axis, and applies the plane's load on the other axes. The reference projects along the plane's normal. Both
// must give the same result.
TEST(RigidContacts, AllVoxelsAreTheLatticeAtEquilibrium) {
  std::mt19937 random(1);
  for (int scene = 0; scene < 40; ++scene) {
    const Slab slab({26, 20, 8}, random);
    const Solution right = brute_force(slab);
    const Felt felt = on_patches(slab, CompositeGrid::kRefineAll);
    std::cout << "[ measured ] tool " << felt.tool_N << " of " << right.tool_N << " N, rigid ball "
              << felt.rigid_N << " of " << right.rigid_N << " N on " << right.on_rigid << " voxels, overlap "
              << felt.overlap_m / kSpacing << " spacings\n";
    EXPECT_NEAR(felt.tool_N, right.tool_N, 1e-3 * std::fabs(right.tool_N));
    EXPECT_NEAR(felt.rigid_N, right.rigid_N, 1e-3 * std::fabs(right.tool_N));
    EXPECT_LT(felt.overlap_m, 1e-3 * kSpacing);
  }
}

// With nested patches, coarse nodes may represent the contact. The tolerance is the same as for patches of
// this width without rigid surfaces.
TEST(RigidContacts, PatchesComeNearTheLattice) {
  constexpr int kHalfWidth = 8;
  std::mt19937 random(2);
  for (int scene = 0; scene < 6; ++scene) {
    Slab slab({40, 30, 12}, random);
    const Solution right = brute_force(slab);
    const Felt felt = on_patches(slab, kHalfWidth);
    std::cout << "[ measured ] tool " << felt.tool_N << " of " << right.tool_N << " N, rigid ball "
              << felt.rigid_N << " of " << right.rigid_N << " N on " << right.on_rigid << " voxels\n";
    EXPECT_NEAR(felt.tool_N, right.tool_N, 0.03 * std::fabs(right.tool_N));
  }
}

// The same comparison for tissues of different stiffness.
TEST(RigidContacts, LayersAreTheLatticeAtEquilibrium) {
  std::mt19937 random(3);
  for (int scene = 0; scene < 10; ++scene) {
    const Slab slab({26, 20, 10}, random, true);
    const Solution right = brute_force(slab);
    const Felt felt = on_patches(slab, CompositeGrid::kRefineAll);
    const Felt patches = on_patches(slab, 8);
    std::cout << "[ measured ] tool " << felt.tool_N << " (patches " << patches.tool_N << ") of "
              << right.tool_N << " N, rigid ball " << felt.rigid_N << " (patches " << patches.rigid_N
              << ") of " << right.rigid_N << " N on " << right.on_rigid << " voxels\n";
    EXPECT_NEAR(felt.tool_N, right.tool_N, 1e-3 * std::fabs(right.tool_N));
    EXPECT_NEAR(felt.rigid_N, right.rigid_N, 1e-3 * std::fabs(right.tool_N));
  }
}

}  // namespace
