// SPDX-License-Identifier: GPL-3.0-or-later
// Voxelised meshes against exact volumes and against the labels from which a surface was made. Damaged meshes
// are tested too.
#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <string>

#include "hybrid/geometry/surface_nets.h"
#include "tests/hybrid/fixtures/label_volumes.h"

namespace {

using polygon::TriangleMesh;
using tests::ball;
using tests::cell_volume;
using tests::count;
using tests::noise;
using tests::refusal;
using tests::signed_volume;
using voxel::LabelVolume;

TriangleMesh box_mesh(glm::dvec3 low, glm::dvec3 high) {
  TriangleMesh mesh;
  for (int c = 0; c < 8; ++c) {
    mesh.vertices.emplace_back((c & 1) != 0 ? high.x : low.x, (c & 2) != 0 ? high.y : low.y,
                               (c & 4) != 0 ? high.z : low.z);
  }
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

TEST(VoxeliseMesh, AlignedBoxIsExact) {
  const TriangleMesh mesh = box_mesh({0.1, -0.2, 0.3}, {0.1 + 0.012, -0.2 + 0.02, 0.3 + 0.007});
  const LabelVolume volume = hybrid::voxelise_mesh(mesh, glm::dvec3(1e-3), 4, 1'000'000);
  EXPECT_EQ(volume.dims, (std::array{12, 20, 7}));
  EXPECT_EQ(count(volume), 12U * 20U * 7U);
  EXPECT_NEAR(volume.origin_m.x, 0.1005, 1e-12);
  EXPECT_EQ(volume.labels[0], 4);
}

TEST(VoxeliseMesh, RowsThroughEdgesAndVerticesCountRight) {
  // An octahedron whose equator, edges and tips all lie on rows of voxel centres.
  TriangleMesh mesh;
  mesh.vertices = {{4, 0, 0}, {-4, 0, 0}, {0, 4, 0},          {0, -4, 0},
                   {0, 0, 4}, {0, 0, -4}, {-4.5, -4.5, -4.5}, {4.5, 4.5, 4.5}};
  for (const std::uint32_t z : {4U, 5U}) {
    mesh.triangles.push_back({0, 2, z});
    mesh.triangles.push_back({2, 1, z});
    mesh.triangles.push_back({1, 3, z});
    mesh.triangles.push_back({3, 0, z});
  }
  mesh.triangles.push_back(
      {6, 6, 7});  // has no area; only widens the lattice, so that centres are whole numbers
  mesh.triangles.push_back({6, 6, 7});
  const LabelVolume volume = hybrid::voxelise_mesh(mesh, glm::dvec3(1.0), 1, 100'000);
  ASSERT_EQ(volume.dims, (std::array{9, 9, 9}));
  for (int k = 0; k < 9; ++k) {
    for (int j = 0; j < 9; ++j) {
      for (int i = 0; i < 9; ++i) {
        const int distance = std::abs(i - 4) + std::abs(j - 4) + std::abs(k - 4);
        if (distance == 4)
          continue;  // on the surface both answers are right, if the rest of the row is right
        ASSERT_EQ(volume.labels[volume.index(i, j, k)], distance < 4 ? 1 : 0) << i << j << k;
      }
    }
  }
}

TEST(VoxeliseMesh, SurfaceOfLabelsGivesTheLabelsBack) {
  for (unsigned seed = 0; seed < 30; ++seed) {
    LabelVolume volume = noise(8, 7, 6, 0.3, seed);
    volume.spacing_m = {1e-3, 2e-3, 0.5e-3};
    const TriangleMesh mesh = hybrid::surface_from_labels(volume, 0);
    // The lattice is centred on the mesh, and the mesh's box has a whole number of voxels. So the voxel
    // centres coincide with those of `volume`. In a cell that two sheets share, a vertex is moved, but not
    // close to a voxel centre.
    const LabelVolume back = hybrid::voxelise_mesh(mesh, volume.spacing_m, 1, 1'000'000);
    EXPECT_EQ(count(back), count(volume)) << seed;
  }
}

TEST(VoxeliseMesh, TurnedBallHasItsVolume) {
  const TriangleMesh rough = hybrid::surface_from_labels(ball(40, 17.3, glm::dvec3(1.0)), 4);
  for (unsigned seed = 0; seed < 5; ++seed) {
    TriangleMesh mesh = rough;
    const glm::dquat turn = glm::angleAxis(0.3 + seed, glm::normalize(glm::dvec3(1.0, seed, 2.0)));
    for (glm::dvec3& p : mesh.vertices) p = turn * p;
    const LabelVolume volume = hybrid::voxelise_mesh(mesh, {0.7, 0.9, 0.8}, 1, 10'000'000);
    const double expected = signed_volume(mesh);
    EXPECT_NEAR(static_cast<double>(count(volume)) * cell_volume(volume), expected, 0.005 * expected);
    // A wrong parity would fill a row to its end. So the border of the box must be empty.
    for (int k = 0; k < volume.dims[2]; ++k) {
      EXPECT_EQ(volume.labels[volume.index(volume.dims[0] - 1, 0, k)], 0);
    }
  }
}

TEST(VoxeliseMesh, InsideOutAndSoupsAreClosedToo) {
  TriangleMesh mesh = box_mesh(glm::dvec3(0.0), glm::dvec3(0.01));
  for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
  EXPECT_EQ(count(hybrid::voxelise_mesh(mesh, glm::dvec3(1e-3), 1, 10'000)), 1000U);
  TriangleMesh soup;
  for (const auto& t : mesh.triangles) {
    for (const auto v : t) soup.vertices.push_back(mesh.vertices[v]);
    const auto n = static_cast<std::uint32_t>(soup.vertices.size());
    soup.triangles.push_back({n - 3, n - 2, n - 1});
  }
  EXPECT_EQ(count(hybrid::voxelise_mesh(soup, glm::dvec3(1e-3), 1, 10'000)), 1000U);
  for (int copies = 0; copies < 4; ++copies) {  // coincident triangles cancel in pairs
    soup.triangles.push_back(soup.triangles[0]);
    soup.triangles.push_back(soup.triangles[0]);
  }
  EXPECT_EQ(count(hybrid::voxelise_mesh(soup, glm::dvec3(1e-3), 1, 10'000)), 1000U);
}

TEST(VoxeliseMesh, FarAwayAndMixedSpacings) {
  const double far = 1e6;  // (m) a double still resolves 0.1 nm there
  const TriangleMesh mesh = box_mesh({far, -far, far}, {far + 0.01, -far + 0.02, far + 0.03});
  EXPECT_EQ(count(hybrid::voxelise_mesh(mesh, {1e-3, 2e-3, 3e-3}, 1, 10'000)), 1000U);
  const TriangleMesh sheet = box_mesh({0, 0, 0}, {0.1, 0.1, 1e-4});
  EXPECT_EQ(count(hybrid::voxelise_mesh(sheet, glm::dvec3(1e-3), 1, 100'000)), 10'000U);
}

TEST(VoxeliseMesh, RefusesWithTheNumbers) {
  TriangleMesh open = box_mesh(glm::dvec3(0.0), glm::dvec3(0.01));
  open.triangles.pop_back();
  const auto voxelise = [](const TriangleMesh& mesh, double spacing, std::size_t most,
                           std::uint8_t label = 1) {
    return refusal([&] { hybrid::voxelise_mesh(mesh, glm::dvec3(spacing), label, most); });
  };
  EXPECT_NE(voxelise(open, 1e-3, 10'000).find("not closed: 3 of its edges"), std::string::npos);
  const TriangleMesh box = box_mesh(glm::dvec3(0.0), glm::dvec3(0.01));
  EXPECT_NE(voxelise(box, 1e-3, 999).find("10 x 10 x 10"), std::string::npos);
  EXPECT_NE(voxelise(box, 1e-300, 1'000'000), "");
  EXPECT_NE(voxelise(box, 0.0, 1'000), "");
  EXPECT_NE(voxelise(box, std::numeric_limits<double>::quiet_NaN(), 1'000), "");
  EXPECT_NE(voxelise(box, 1e-3, 1'000, 0), "");
  EXPECT_NE(voxelise({}, 1e-3, 1'000), "");
  TriangleMesh flat = box_mesh(glm::dvec3(0.0), {0.01, 0.01, 0.0});
  EXPECT_NE(voxelise(flat, 1e-3, 1'000).find("no voxel centre lies inside"), std::string::npos);
  TriangleMesh broken = box;
  broken.vertices[3].y = std::numeric_limits<double>::infinity();
  EXPECT_NE(voxelise(broken, 1e-3, 1'000).find("vertex 3"), std::string::npos);
  broken = box;
  broken.triangles[5][1] = 77;
  EXPECT_NE(voxelise(broken, 1e-3, 1'000).find("triangle 5"), std::string::npos);
}

}  // namespace
