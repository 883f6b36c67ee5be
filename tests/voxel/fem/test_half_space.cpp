// SPDX-License-Identifier: GPL-3.0-or-later
// Forces from Young's modulus and Poisson's ratio with the six-link energy, against Hertz's ball and the flat
// punch.
//
// With this energy, pressing a block's face moves its voxels only along the face's normal. In a block of one
// material, the lattice's modes are cosines across the face, and each mode decays downwards in closed form.
// So the contact is solved exactly, for blocks of any size. Its only unknowns are the forces on the pressed
// voxels.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <array>
#include <cmath>
#include <iostream>
#include <numbers>
#include <vector>

#include "tests/voxel/fixtures/voxel_problem.h"

namespace {

// Compliance between top voxels of a block of n × n × nz voxels with a held base. It covers the voxels first
// to first + wide − 1 in x and in y. The spacing and Young's modulus are 1.
class Face {
 public:
  Face(int n, int nz, double across, int first, int wide) : wide_(wide) {
    const int last = n - 1;
    Eigen::MatrixXd pairs(n, wide * wide);
    Eigen::VectorXd norm(n), curvature(n);
    for (int m = 0; m < n; ++m) {
      norm[m] = m == 0 || m == last ? last : 0.5 * last;
      curvature[m] = 4 * std::pow(std::sin(0.5 * std::numbers::pi * m / last), 2);
      const auto mode = [&](int i) { return std::cos(std::numbers::pi * m * (i + first) / last); };
      for (int a = 0; a < wide; ++a) {
        for (int b = 0; b < wide; ++b) pairs(m, a * wide + b) = mode(a) * mode(b);
      }
    }
    Eigen::MatrixXd compliance(n, n);
    for (int a = 0; a < n; ++a) {
      for (int b = 0; b < n; ++b) {
        // A mode decays by e^−μ per layer. The top layer's links count half, so a deep block has the
        // stiffness sinh μ at its surface.
        const double mu = 2 * std::asinh(0.5 * std::sqrt(across * (curvature[a] + curvature[b])));
        const double stiffness = mu < 1e-12 ? 1.0 / (nz - 1) : std::sinh(mu) / std::tanh(mu * (nz - 1));
        compliance(a, b) = 1 / (norm[a] * norm[b] * stiffness);
      }
    }
    table_ = pairs.transpose() * compliance * pairs;
  }

  // Displacement of voxel `at` by a force of 1 on voxel `load`. Both are (x, y), counted from `first`.
  [[nodiscard]] double operator()(std::array<int, 2> at, std::array<int, 2> load) const {
    return table_(at[0] * wide_ + load[0], at[1] * wide_ + load[1]);
  }

 private:
  int wide_;
  Eigen::MatrixXd table_;
};

struct Contact {
  double force = 0.0;
  int voxels = 0;
};

// Presses the voxels `at` to `depth`. Voxels that would be pulled are released. Under a punch all forces
// push, so none is released.
Contact press(const Face& face, std::vector<std::array<int, 2>> at, std::vector<double> depth) {
  for (;;) {
    const auto n = static_cast<Eigen::Index>(at.size());
    Eigen::MatrixXd matrix(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j < n; ++j)
        matrix(i, j) = face(at[static_cast<std::size_t>(i)], at[static_cast<std::size_t>(j)]);
    }
    const Eigen::VectorXd force = matrix.ldlt().solve(Eigen::Map<Eigen::VectorXd>(depth.data(), n));
    std::vector<std::array<int, 2>> pushed;
    std::vector<double> how_deep;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (force[i] <= 0.0) continue;
      pushed.push_back(at[static_cast<std::size_t>(i)]);
      how_deep.push_back(depth[static_cast<std::size_t>(i)]);
    }
    if (pushed.size() == at.size()) return {force.sum(), static_cast<int>(n)};
    at = pushed;
    depth = how_deep;
  }
}

double across(double poisson) {
  return voxel::across_modulus_Pa(1.0, poisson);
}

// The force from the cosine modes (Face) equals the force from solving the springs directly.
TEST(HalfSpace, ModesAreTheSprings) {
  constexpr int n = 9, nz = 6;
  for (const double poisson : {0.0, 0.45}) {
    tests::VoxelBody body{{n, n, nz}, glm::dvec3(1.0), std::vector<int>(n * n * nz, 1), {{}, {1.0, poisson}}};
    tests::PlainProblem block = problem_of(body, tests::Energy::six_link);
    std::vector<std::array<int, 2>> at;
    for (int k = 0; k < nz; ++k) {
      for (int j = 0; j < n; ++j) {
        for (int i = 0; i < n; ++i) {
          if (k == 0) block.free[body.at(i, j, k)].setZero();
          if (k < nz - 1 || i < 3 || i > 5 || j < 2 || j > 5) continue;
          block.free[body.at(i, j, k)].setZero();
          block.u[body.at(i, j, k)].z() = -0.1;
          at.push_back({i, j});
        }
      }
    }
    const std::vector<double> depth(at.size(), 0.1);
    ASSERT_TRUE(block.solve(1e-10));
    EXPECT_NEAR(press(Face(n, nz, across(poisson), 0, n), at, depth).force, 2 * block.energy_J() / 0.1, 1e-9);
  }
}

struct Errors {
  double hertz, punch, punch_radius;
};

// Relative errors of a cube against the half-space. The contact radius is `a` spacings, and the cube is
// `width` contact radii wide.
Errors errors_of(double a, double poisson, double width) {
  const int n = static_cast<int>(width * a) | 1, reach = static_cast<int>(1.42 * a) + 1;
  const Face face(n, n, across(poisson), n / 2 - reach, 2 * reach + 1);
  const double modulus = 1 / (1 - poisson * poisson);
  std::vector<std::array<int, 2>> under_ball, under_punch;
  std::vector<double> depth;
  for (int j = -reach; j <= reach; ++j) {
    for (int i = -reach; i <= reach; ++i) {
      const double r2 = i * i + j * j;
      if (r2 <= a * a) under_punch.push_back({i + reach, j + reach});
      if (r2 >= 2 * a * a) continue;
      under_ball.push_back({i + reach, j + reach});
      depth.push_back(1 -
                      r2 / (2 * a * a));  // a ball of radius a² at a depth of 1 has Hertz's contact radius a
    }
  }
  const double ball = press(face, under_ball, depth).force;
  const Contact punch = press(face, under_punch, std::vector<double>(under_punch.size(), 1.0));
  const double radius = std::sqrt(punch.voxels / std::numbers::pi);
  return {ball / (4.0 / 3.0 * modulus * a) - 1, punch.force / (2 * radius * modulus) - 1, radius};
}

TEST(HalfSpace, ABallAndAPunchAreHertzs) {
  for (const double a : {4.0, 6.0, 8.0}) {
    for (const double width : {20.0, 40.0}) {
      for (const double poisson : {0.0, 0.3, 0.45}) {
        const Errors found = errors_of(a, poisson, width);
        std::cout << "radius " << a << " | block " << width << " radii | nu " << poisson << " | Hertz "
                  << std::showpos << 100 * found.hertz << " % | punch " << std::noshowpos
                  << found.punch_radius << ' ' << std::showpos << 100 * found.punch << std::noshowpos
                  << " %\n";
        const double part = a < 8 ? 0.07 : 0.04;
        EXPECT_LT(std::fabs(found.hertz), part);
        EXPECT_LT(std::fabs(found.punch), part);
      }
    }
  }
}

// The remaining error is due to the finite block and is inversely proportional to its width. Extrapolated to
// infinite width, the forces are those of the half-space. The punch has an effective radius, 0.11 spacings
// smaller than that of a circle with its voxels' area. The effective edge of a straight row of
// nodes lies 0.25 to 0.28 spacings outside the nodes (from the factors of the surface's Wiener-Hopf problem).
// The voxels' area ends half a spacing outside. The steps of a circle's edge reduce this difference to 0.11
// spacings.
TEST(HalfSpace, TheRestIsTheBlocks) {
  for (const double a : {4.0, 6.0, 8.0}) {
    for (const double poisson : {0.0, 0.3, 0.45}) {
      const Errors narrow = errors_of(a, poisson, 20.0), wide = errors_of(a, poisson, 40.0);
      EXPECT_NEAR(2 * wide.hertz - narrow.hertz, 0.0, 0.005);
      const double punch = 1 + 2 * wide.punch - narrow.punch, radius = wide.punch_radius;
      EXPECT_NEAR(punch * radius / (radius - 0.11), 1.0, 0.008);
    }
  }
}

}  // namespace
