// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/fem/hex_element.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstdint>
#include <random>
#include <stdexcept>
#include <vector>

#include "tests/voxel/fixtures/energy_minimum.h"

namespace {

using tests::Brick;
using tests::matrix_of;
using voxel::brick_stiffness;

using Corners = Eigen::Matrix<double, 24, 1>;

Eigen::Vector3d corner_of(int c, const glm::dvec3& h) {
  return {(c & 1) * h.x, ((c >> 1) & 1) * h.y, (c >> 2) * h.z};
}

Corners field(const Eigen::Matrix3d& gradient, const Eigen::Vector3d& shift, const glm::dvec3& h) {
  Corners u;
  for (int c = 0; c < 8; ++c) u.segment<3>(3 * c) = shift + gradient * corner_of(c, h);
  return u;
}

Eigen::Matrix3d stress_of(const Eigen::Matrix3d& gradient, double young, double poisson) {
  const Eigen::Matrix3d strain = 0.5 * (gradient + gradient.transpose());
  const double shear = young / (2 * (1 + poisson)), lame = 2 * shear * poisson / (1 - 2 * poisson);
  return 2 * shear * strain + lame * strain.trace() * Eigen::Matrix3d::Identity();
}

const std::vector<glm::dvec3> kSpacings{
    {1e-3, 1e-3, 1e-3}, {0.7e-3, 1e-3, 3e-3}, {1e-6, 1e-6, 1e-6}, {10, 10, 10}, {1e-3, 1e-3, 5e-3}};

TEST(BrickElement, IsSymmetricAndHasSixZeroModes) {
  for (const glm::dvec3& h : kSpacings) {
    for (const double poisson : {0.0, 0.3, 0.45, 0.499}) {
      for (const double young : {1.0, 1e4, 1e12}) {
        const Brick k = matrix_of(brick_stiffness(young, poisson, h));
        EXPECT_EQ(k, k.transpose());
        const Eigen::VectorXd values = Eigen::SelfAdjointEigenSolver<Brick>(k).eigenvalues();
        for (int i = 0; i < 6; ++i) EXPECT_LT(std::fabs(values[i]), 1e-12 * values[23]) << i;
        EXPECT_GT(values[6], 1e-5 * values[23]) << h.z << ' ' << poisson;
      }
    }
  }
}

TEST(BrickElement, RigidMotionsCostNothing) {
  const glm::dvec3 h(0.7e-3, 1e-3, 3e-3);
  const Brick k = matrix_of(brick_stiffness(1e4, 0.3, h));
  for (int mode = 0; mode < 6; ++mode) {
    Eigen::Matrix3d spin = Eigen::Matrix3d::Zero();
    Eigen::Vector3d shift = Eigen::Vector3d::Zero();
    if (mode < 3) shift[mode] = 1e-3;
    if (mode >= 3) {
      spin((mode + 1) % 3, (mode + 2) % 3) = 1.0;
      spin((mode + 2) % 3, (mode + 1) % 3) = -1.0;
    }
    const Corners u = field(spin, shift, h);
    EXPECT_LT((k * u).norm(), 1e-13 * k.norm() * u.norm());
  }
}

// Patch test of one element: under a constant strain, its forces are those of the closed form.
TEST(BrickElement, ReproducesAConstantStrain) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  for (const glm::dvec3& h : kSpacings) {
    for (const double poisson : {0.0, 0.3, 0.45}) {
      const Brick k = matrix_of(brick_stiffness(1e4, poisson, h));
      for (int trial = 0; trial < 10; ++trial) {
        const Eigen::Matrix3d gradient = Eigen::Matrix3d::NullaryExpr([&] { return 1e-2 * number(random); });
        const Eigen::Matrix3d stress = stress_of(gradient, 1e4, poisson);
        const Corners force = k * field(gradient, Eigen::Vector3d::Zero(), h);
        const Eigen::Vector3d area(h.y * h.z / 4, h.x * h.z / 4, h.x * h.y / 4);
        for (int c = 0; c < 8; ++c) {
          Eigen::Vector3d side;
          for (int a = 0; a < 3; ++a) side[a] = ((c >> a) & 1) != 0 ? 1.0 : -1.0;
          const Eigen::Vector3d expected = stress * side.cwiseProduct(area);
          EXPECT_LT((force.segment<3>(3 * c) - expected).norm(), 1e-12 * force.norm());
        }
      }
    }
  }
}

// Patch test of an assembly of bricks with three different edge lengths. The border is prescribed, and the
// nodes inside are solved.
TEST(BrickElement, ReproducesAConstantStrainInAPatch) {
  const glm::dvec3 h(1e-3, 2e-3, 3e-3);
  const int n = 4;
  tests::PlainProblem patch(n * n * n);
  patch.bricks.push_back(matrix_of(brick_stiffness(1e4, 0.45, h)));
  Eigen::Matrix3d gradient;
  gradient << 1e-2, 2e-3, -1e-3, 5e-3, -4e-3, 3e-3, 2e-3, -6e-3, 7e-3;
  const auto at = [](int i, int j, int k) {
    const int number = (k * n + j) * n + i;
    return static_cast<std::size_t>(number);
  };
  std::vector<Eigen::Vector3d> expected(patch.u.size());
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        expected[at(i, j, k)] = gradient * Eigen::Vector3d(i * h.x, j * h.y, k * h.z);
        const auto border = [](int c) { return c == 0 || c == n - 1; };
        if (border(i) || border(j) || border(k)) {
          patch.u[at(i, j, k)] = expected[at(i, j, k)];
          patch.free[at(i, j, k)].setZero();
        }
        if (i == n - 1 || j == n - 1 || k == n - 1) continue;
        tests::PlainProblem::PlacedBrick brick{};
        for (int c = 0; c < 8; ++c)
          brick.node[static_cast<std::size_t>(c)] = at(i + (c & 1), j + ((c >> 1) & 1), k + (c >> 2));
        patch.placed.push_back(brick);
      }
    }
  }
  ASSERT_TRUE(patch.solve(1e-14));
  for (std::size_t v = 0; v < expected.size(); ++v)
    EXPECT_LT((patch.u[v] - expected[v]).norm(), 1e-12 * expected.back().norm());
}

// Stiffness of an Euler beam under a transverse force at its end. With one brick over the thickness, plain
// bricks lock.
double cantilever_stiffness(double poisson, int long_, int thick, double edge) {
  const glm::dvec3 h(edge, 1e-3, 1e-3);
  const auto at = [&](int i, int j, int k) {
    const int number = (k * (thick + 1) + j) * (long_ + 1) + i;
    return static_cast<std::size_t>(number);
  };
  tests::PlainProblem beam(at(long_, thick, thick) + 1);
  beam.bricks.push_back(matrix_of(brick_stiffness(1e4, poisson, h)));
  const double depth = 1e-4;
  for (int k = 0; k <= thick; ++k) {
    for (int j = 0; j <= thick; ++j) {
      beam.free[at(0, j, k)](0, 0) = 0.0;
      if (k == 0) beam.free[at(0, j, k)](2, 2) = 0.0;
      if (j == 0) beam.free[at(0, j, k)](1, 1) = 0.0;
      beam.free[at(long_, j, k)](2, 2) = 0.0;
      beam.u[at(long_, j, k)].z() = depth;
      for (int i = 0; i < long_; ++i) {
        if (j == thick || k == thick) continue;
        tests::PlainProblem::PlacedBrick brick{};
        for (int c = 0; c < 8; ++c)
          brick.node[static_cast<std::size_t>(c)] = at(i + (c & 1), j + ((c >> 1) & 1), k + (c >> 2));
        beam.placed.push_back(brick);
      }
    }
  }
  EXPECT_TRUE(beam.solve(1e-10, 100000));
  return 2 * beam.energy_J() / (depth * depth);
}

TEST(BrickElement, BendsAsABeamDoes) {
  const double length = 16e-3, inertia = std::pow(1e-3, 4) / 12,
               euler = 3 * 1e4 * inertia / std::pow(length, 3);
  for (const double poisson : {0.0, 0.3, 0.499}) {
    // Timoshenko's shear adds the fraction 1.2 · E h² / (4 G l²) to the compliance: 0.2 to 0.4 %.
    EXPECT_NEAR(cantilever_stiffness(poisson, 16, 1, 1e-3), euler, 0.03 * euler) << poisson;
    // Bricks four times as long as the beam is thick prevent most of the deformation of its section. This
    // adds 8.6 % at a Poisson's ratio of 0.499.
    const double part = poisson < 0.4 ? 0.03 : 0.1;
    EXPECT_NEAR(cantilever_stiffness(poisson, 4, 1, 4e-3), euler, part * euler) << poisson;
  }
}

TEST(BrickElement, RefusesWhatNoTissueHas) {
  const glm::dvec3 h(1e-3);
  for (const double young : {0.0, -1.0, std::nan(""), static_cast<double>(HUGE_VAL)}) {
    EXPECT_THROW((void)brick_stiffness(young, 0.3, h), std::invalid_argument);
  }
  for (const double poisson : {-0.1, 0.5, 1.0, std::nan("")}) {
    EXPECT_THROW((void)brick_stiffness(1e4, poisson, h), std::invalid_argument);
  }
  EXPECT_THROW((void)brick_stiffness(1e4, 0.3, {1e-3, 0.0, 1e-3}), std::invalid_argument);
}

}  // namespace
