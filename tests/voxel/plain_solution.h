// SPDX-License-Identifier: GPL-3.0-or-later
// The soft energies solved plainly: springs and bricks in a list, conjugate gradients, doubles. Slow and
// short, and independent of the store and the solver that it is the reference for.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "voxel/brick_element.h"

namespace tests {

using Brick = Eigen::Matrix<double, 24, 24>;

inline Brick matrix_of(const voxel::BrickStiffness& brick) {
  return Eigen::Map<const Eigen::Matrix<double, 24, 24, Eigen::RowMajor>>(brick.entry.data());
}

struct PlainProblem {
  struct Spring {
    std::size_t a, b;
    Eigen::Vector3d stiffness;  // by axis (N/m)
  };
  struct PlacedBrick {
    std::array<std::size_t, 8> node;
    std::size_t kind;  // index into `bricks`
  };

  std::vector<Eigen::Vector3d> u;     // [node], the held ones as given (m)
  std::vector<Eigen::Matrix3d> free;  // [node] projector on the directions in which it may move
  std::vector<Spring> springs;
  std::vector<PlacedBrick> placed;
  std::vector<Brick> bricks;

  explicit PlainProblem(std::size_t nodes)
      : u(nodes, Eigen::Vector3d::Zero()), free(nodes, Eigen::Matrix3d::Identity()) {}

  // Gradient of the energy: the force that it takes to hold `x` (N).
  void apply(const std::vector<Eigen::Vector3d>& x, std::vector<Eigen::Vector3d>& out) const {
    out.assign(x.size(), Eigen::Vector3d::Zero());
    for (const Spring& s : springs) {
      const Eigen::Vector3d f = s.stiffness.cwiseProduct(x[s.b] - x[s.a]);
      out[s.b] += f;
      out[s.a] -= f;
    }
    Eigen::Matrix<double, 24, 1> corner, force;
    for (const PlacedBrick& p : placed) {
      for (int c = 0; c < 8; ++c) corner.segment<3>(3 * c) = x[p.node[static_cast<std::size_t>(c)]];
      force.noalias() = bricks[p.kind] * corner;
      for (int c = 0; c < 8; ++c) out[p.node[static_cast<std::size_t>(c)]] += force.segment<3>(3 * c);
    }
  }

  // Relaxes u to the least energy; false where it does not come down to `tolerance` of where it began. Nodes
  // that nothing holds stay.
  [[nodiscard]] bool solve(double tolerance, int most = 5000) {
    const std::size_t n = u.size();
    std::vector<Eigen::Vector3d> r(n), p(n), q(n);
    std::vector<double> weight(n, 0.0);  // Jacobi, one number a node so that it commutes with the projectors
    for (const Spring& s : springs) {
      weight[s.a] += s.stiffness.sum();
      weight[s.b] += s.stiffness.sum();
    }
    for (const PlacedBrick& b : placed) {
      for (int c = 0; c < 8; ++c)
        weight[b.node[static_cast<std::size_t>(c)]] += bricks[b.kind].diagonal().segment<3>(3 * c).sum();
    }
    for (double& w : weight) w = w > 0.0 ? 3.0 / w : 0.0;
    apply(u, q);
    double rr = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      r[i] = -(free[i] * q[i]);
      p[i] = weight[i] * r[i];
      rr += r[i].dot(p[i]);
    }
    const double goal = tolerance * tolerance * rr;
    for (int step = 0; step < most; ++step) {
      if (rr <= goal) return true;
      apply(p, q);
      double pq = 0.0;
      for (std::size_t i = 0; i < n; ++i) {
        q[i] = free[i] * q[i];
        pq += p[i].dot(q[i]);
      }
      const double length = rr / pq;
      double next = 0.0;
      for (std::size_t i = 0; i < n; ++i) {
        u[i] += length * p[i];
        r[i] -= length * q[i];
        next += weight[i] * r[i].squaredNorm();
      }
      for (std::size_t i = 0; i < n; ++i) p[i] = weight[i] * r[i] + next / rr * p[i];
      rr = next;
    }
    return false;
  }

  [[nodiscard]] double energy_J() const {
    std::vector<Eigen::Vector3d> f;
    apply(u, f);
    double sum = 0.0;
    for (std::size_t i = 0; i < u.size(); ++i) sum += 0.5 * f[i].dot(u[i]);
    return sum;
  }
};

}  // namespace tests
