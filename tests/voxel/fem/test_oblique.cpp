// SPDX-License-Identifier: GPL-3.0-or-later
// Blocks whose axes do not lie along the lattice: the effect of the lattice's directions on their stiffness.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <iostream>
#include <numbers>
#include <string>
#include <vector>

#include "tests/voxel/fixtures/voxel_problem.h"

namespace {

using tests::Energy;

constexpr double kYoung = 1e4;

// A rotation whose rows are the block's x, y and up in the lattice's frame.
Eigen::Matrix3d frame(const Eigen::Vector3d& x, const Eigen::Vector3d& up) {
  Eigen::Matrix3d out;
  out.row(0) = x.normalized();
  out.row(2) = up.normalized();
  out.row(1) = out.row(2).transpose().cross(out.row(0).transpose());
  return out;
}

struct Orientation {
  std::string name;
  Eigen::Matrix3d frame;
};

std::vector<Orientation> orientations() {
  return {{"(100)", Eigen::Matrix3d::Identity()},
          {"(110)", frame({0, 0, 1}, {1, 1, 0})},
          {"(111)", frame({1, -1, 0}, {1, 1, 1})}};
}

// Contact modulus of a half-space with normal n under the six-link energy. Each displacement component is a
// scalar field. Its stiffness tensor T is 1 along its own axis and `across` along the others. A surface wave
// along q meets the stiffness √(nTn·qTq − (nTq)²) per wavenumber. The traction along n loads each component
// by n[axis]. The compliance is the mean over all directions q, as in a round contact.
double six_link_face(const Eigen::Matrix3d& block, double across) {
  const Eigen::Vector3d n = block.row(2);
  double sum = 0.0;
  constexpr int kSteps = 720;
  for (int s = 0; s < kSteps; ++s) {
    const double angle = std::numbers::pi * (s + 0.5) / kSteps;
    const Eigen::Vector3d q = std::cos(angle) * block.row(0) + std::sin(angle) * block.row(1);
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::Vector3d tensor = Eigen::Vector3d::Constant(across);
      tensor[axis] = 1.0;
      const double nn = n.dot(tensor.cwiseProduct(n)), qq = q.dot(tensor.cwiseProduct(q)),
                   nq = n.dot(tensor.cwiseProduct(q));
      sum += n[axis] * n[axis] / std::sqrt(nn * qq - nq * nq) / kSteps;
    }
  }
  return 2 / sum;  // for a Young's modulus of 1
}

// The voxels of an oblique face form teeth. The ball pushes either only the outermost plane of voxels, or all
// voxels of the teeth, down to their feet, as one surface.
enum class Touched { outermost, surface };

// Presses a shallow ball with Hertz's contact radius `a` into the top of a block with a held base. The block
// is 2·half wide and `height` tall. On average, the hull of the voxels is the block's surface. Lengths are in
// spacings. Returns the force divided by the depth, in units of kYoung and spacings.
double pressed(const Eigen::Matrix3d& block, Energy energy, Touched touched, double poisson, double a,
               double half, double height) {
  const Eigen::Vector3d up = block.row(2);
  // For these orientations, the lattice planes parallel to the top are `plane` apart. The teeth are `teeth`
  // high, and on average the hull lies half a tooth inside the outermost voxels.
  const double plane = up.cwiseAbs().maxCoeff(), teeth = up.cwiseAbs().sum() - plane;
  const double inside = 0.5 * teeth, top = height + inside, skin = touched == Touched::surface ? teeth : 0.0;
  const auto margin = [&](int row) { return 0.5 * block.row(row).cwiseAbs().sum(); };
  const int reach = static_cast<int>(std::ceil(std::sqrt(2 * half * half + height * height))) + 4;
  const int n = 2 * reach + 1;
  tests::VoxelBody body{{n, n, n},
                        glm::dvec3(1.0),
                        std::vector<int>(static_cast<std::size_t>(n) * n * n, 0),
                        {{}, {kYoung, poisson}}};
  // The offset puts a voxel of the top plane onto the block's axis.
  const auto in_block = [&](int i, int j, int k) -> Eigen::Vector3d {
    return block * Eigen::Vector3d(i - reach, j - reach, k - reach) +
           Eigen::Vector3d(0, 0, top - std::floor(0.5 * height / plane) * plane);
  };
  struct Voxel {
    std::size_t id;
    Eigen::Vector3d at;
  };
  std::vector<Voxel> voxels;
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        const Eigen::Vector3d p = in_block(i, j, k);
        if (std::fabs(p.x()) > half + margin(0) - 1e-6 || std::fabs(p.y()) > half + margin(1) - 1e-6)
          continue;
        if (p.z() > height + margin(2) - 1e-6 || p.z() < -margin(2) + 1e-6) continue;
        body.label[body.at(i, j, k)] = 1;
        voxels.push_back({body.at(i, j, k), p});
      }
    }
  }
  tests::PlainProblem problem = problem_of(body, energy);
  std::vector<std::size_t> number(body.label.size());
  for (std::size_t v = 0; v < voxels.size(); ++v) number[voxels[v].id] = v;
  for (auto& spring : problem.springs) spring = {number[spring.a], number[spring.b], spring.stiffness};
  for (auto& brick : problem.placed) {
    for (std::size_t& node : brick.node) node = number[node];
  }
  problem.u.assign(voxels.size(), Eigen::Vector3d::Zero());
  problem.free.assign(voxels.size(), Eigen::Matrix3d::Identity());
  for (std::size_t v = 0; v < voxels.size(); ++v) voxels[v].id = v;
  const Eigen::Matrix3d slides = Eigen::Matrix3d::Identity() - up * up.transpose();
  const double depth = 1e-3;
  std::vector<Voxel> touching;
  for (const Voxel& v : voxels) {
    if (v.at.z() < inside + 1e-6) problem.free[v.id].setZero();
    const double r2 = v.at.head<2>().squaredNorm();
    if (v.at.z() < top - skin - 1e-6 || r2 > 1.3 * a * a) continue;
    touching.push_back(v);
    problem.free[v.id] = slides;
    problem.u[v.id] = -depth * (1 - r2 / (2 * a * a)) * up;
  }
  double force = 0.0;
  std::vector<Eigen::Vector3d> f;
  for (int round = 0; round < 6; ++round) {
    EXPECT_TRUE(problem.solve(1e-4));
    problem.apply(problem.u, f);
    force = 0.0;
    bool pulled = false;
    for (const Voxel& v : touching) {
      if (problem.free[v.id] != slides) continue;
      const double push = -f[v.id].dot(up);
      force += push;
      if (push >= 0.0) continue;
      pulled = true;
      problem.free[v.id].setIdentity();
    }
    if (!pulled) break;
  }
  return force / (depth * kYoung);
}

TEST(Oblique, BlocksAreAsStiffAsAlongTheLattice) {
  const double poisson = 0.3, across = voxel::across_modulus_Pa(1.0, poisson);
  for (const Energy energy : {Energy::six_link, Energy::accurate}) {
    const bool accurate = energy == Energy::accurate;
    double along = 0.0;
    for (const Orientation& o : orientations()) {
      const double surface = pressed(o.frame, energy, Touched::surface, poisson, 6, 16, 20);
      if (along == 0.0) along = surface;
      const auto percent = [](double part) { return 100 * (part - 1); };
      std::cout << (accurate ? "accurate | " : "six-link | ") << o.name << std::showpos << " | "
                << percent(surface / along);
      if (accurate) {
        // Teeth give way, so a ball that pushes only their tips is a different contact. Its result is only
        // printed.
        std::cout << " % | tips alone "
                  << percent(pressed(o.frame, energy, Touched::outermost, poisson, 6, 16, 20) / along);
        EXPECT_NEAR(surface, along, 0.05 * along) << o.name;
      } else {
        std::cout << " % | half-space " << percent(six_link_face(o.frame, across) / (2 * std::sqrt(across)));
        // The six-link block is softer in bulk as well as at the surface. Stretched along (111), it is half
        // as stiff.
        EXPECT_NEAR(surface, along, 0.35 * along) << o.name;
      }
      std::cout << std::noshowpos << " %\n";
    }
  }
}

TEST(Oblique, ASixLinkFaceOnTheLatticeIsItsContactModulus) {
  EXPECT_NEAR(six_link_face(Eigen::Matrix3d::Identity(), 0.25), 1.0, 1e-12);
}

}  // namespace
