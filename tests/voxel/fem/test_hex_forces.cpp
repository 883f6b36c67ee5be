// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/fem/hex_forces.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>
#include <vector>

#include "tests/voxel/fixtures/energy_minimum.h"

namespace {

using voxel::brick_stiffness;
using voxel::BrickStiffness;
using voxel::NodeField;

// A lattice of nodes with random displacements of about `size` around `shift`.
struct Field {
  static constexpr int kX = 23, kY = 5, kZ = 5;
  std::array<std::vector<float>, 3> u;

  Field(float size, float shift, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> number(-size, size);
    for (auto& values : u) {
      values.resize(kX * kY * kZ);
      for (float& value : values) value = shift + (size > 0 ? number(random) : 0.0F);
    }
  }
  [[nodiscard]] static std::size_t at(int i, int j, int k) {
    const int number = (k * kY + j) * kX + i;
    return static_cast<std::size_t>(number);
  }
  [[nodiscard]] NodeField view() const { return {{u[0].data(), u[1].data(), u[2].data()}, kX, kX * kY}; }
};

// Force on a node, added up brick by brick in double.
Eigen::Vector3d expected_force(const voxel::BricksAround& bricks, const Field& field,
                               std::array<int, 3> node) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int octant = 0; octant < 8; ++octant) {
    if (bricks[static_cast<std::size_t>(octant)] == nullptr) continue;
    const tests::Brick k = tests::matrix_of(*bricks[static_cast<std::size_t>(octant)]);
    Eigen::Matrix<double, 24, 1> u;
    for (int c = 0; c < 8; ++c) {
      const auto away = [&](int bit) { return ((octant >> bit) & 1) - 1 + ((c >> bit) & 1); };
      const std::size_t v = Field::at(node[0] + away(0), node[1] + away(1), node[2] + away(2));
      for (std::size_t a = 0; a < 3; ++a) u[3 * c + static_cast<int>(a)] = static_cast<double>(field.u[a][v]);
    }
    sum -= (k * u).segment<3>(3 * (7 - octant));
  }
  return sum;
}

TEST(BrickForce, IsTheBricks) {
  const BrickStiffness soft = brick_stiffness(1e4, 0.45, {1e-3, 0.7e-3, 2e-3}),
                       stiff = brick_stiffness(1e6, 0.3, {1e-3, 0.7e-3, 2e-3});
  const voxel::BrickFloats soft_floats = voxel::in_floats(soft), stiff_floats = voxel::in_floats(stiff);
  std::mt19937 random(11);
  const Field field(1e-3F, 0.0F, 1);
  for (int trial = 0; trial < 100; ++trial) {
    voxel::BricksAround bricks{};
    std::array<const voxel::BrickFloats*, 8> floats{};
    for (std::size_t octant = 0; octant < 8; ++octant) {
      const auto kind = random() % 3;
      bricks[octant] = kind == 0 ? nullptr : kind == 1 ? &soft : &stiff;
      floats[octant] = kind == 0 ? nullptr : kind == 1 ? &soft_floats : &stiff_floats;
    }
    const std::array<int, 3> node{1 + trial % 20, 2, 1 + trial % 3};
    const Eigen::Vector3d expected = expected_force(bricks, field, node);
    const std::size_t v = Field::at(node[0], node[1], node[2]);
    for (const auto& found : {voxel::node_force(voxel::node_stencil(bricks), field.view(), v),
                              voxel::node_force(floats, field.view(), v)}) {
      for (std::size_t a = 0; a < 3; ++a)
        EXPECT_NEAR(static_cast<double>(found[a]), expected[static_cast<int>(a)], 2e-6 * expected.norm());
    }
  }
}

TEST(BrickForce, OfARowIsThatOfItsNodes) {
  const Field field(1e-3F, 0.0F, 2);
  for (const double poisson : {0.0, 0.499}) {
    const BrickStiffness brick = brick_stiffness(1e4, poisson, {1e-3, 2e-3, 0.5e-3});
    const voxel::BricksAround bricks{&brick, &brick, &brick, &brick, &brick, &brick, &brick, &brick};
    std::array<std::vector<float>, 3> force;
    for (const std::size_t count : {0U, 1U, 8U, 21U}) {
      for (auto& f : force) f.assign(21, -7.0F);
      voxel::row_forces(voxel::node_stencil(brick), field.view(), Field::at(1, 2, 2), count,
                        {force[0].data(), force[1].data(), force[2].data()});
      for (std::size_t i = 0; i < 21; ++i) {
        const Eigen::Vector3d expected = expected_force(bricks, field, {1 + static_cast<int>(i), 2, 2});
        for (std::size_t a = 0; a < 3; ++a) {
          const auto found = static_cast<double>(force[a][i]);
          EXPECT_NEAR(found, i < count ? expected[static_cast<int>(a)] : -7.0, 2e-6 * expected.norm());
        }
      }
    }
  }
}

TEST(BrickForce, OfAShiftIsExactlyNothing) {
  const Field field(0.0F, 1234.567F, 3);
  const BrickStiffness brick = brick_stiffness(1e4, 0.45, {1e-3, 1e-3, 1e-3});
  std::array<std::vector<float>, 3> force{std::vector<float>(21), std::vector<float>(21),
                                          std::vector<float>(21)};
  voxel::row_forces(voxel::node_stencil(brick), field.view(), Field::at(1, 2, 2), 21,
                    {force[0].data(), force[1].data(), force[2].data()});
  for (const auto& values : force) {
    for (const float f : values) EXPECT_EQ(f, 0.0F);
  }
}

TEST(BrickForce, DiagonalBlocksAreSymmetricAndPositive) {
  const BrickStiffness brick = brick_stiffness(1e4, 0.45, {1e-3, 0.7e-3, 2e-3});
  for (std::size_t there = 1; there < 256; ++there) {
    voxel::BricksAround bricks{};
    for (std::size_t octant = 0; octant < 8; ++octant)
      bricks[octant] = (there >> octant & 1) != 0 ? &brick : nullptr;
    const voxel::NodeStencil stencil = voxel::node_stencil(bricks);
    const auto block = [&stencil](std::size_t o) -> Eigen::Matrix3f {
      return Eigen::Map<const Eigen::Matrix<float, 4, 3>>(stencil.block[o].data()).topRows<3>();
    };
    const Eigen::Matrix3f own = block(13);
    EXPECT_EQ(own, own.transpose());
    EXPECT_GT(own.determinant(), 0.0F);
    // The 27 blocks of a node sum to zero.
    Eigen::Matrix3f sum = Eigen::Matrix3f::Zero();
    for (std::size_t o = 0; o < 27; ++o) sum += block(o);
    EXPECT_LT(sum.norm(), 1e-5F * own.norm());
  }
}

}  // namespace
