// SPDX-License-Identifier: GPL-3.0-or-later
// The equilibrium, written down once more as links with a stiffness and limits, and solved directly: sparse
// Cholesky where no limit is near, an augmented Lagrangian where limits hold.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "voxel/displacement.h"
#include "voxel/lattice.h"
#include "voxel/link_weight.h"

namespace tests {

struct Link {
  voxel::VoxelId a, b;
  double k, low, high;
};

// Moduli of the link that leaves voxel `c` in +d, from labels and materials and not from the lattice's own
// springs: the voxels around it one by one.
inline voxel::LinkModuli moduli_of(const voxel::Lattice& lattice, const voxel::LatticeOptions& options,
                                   const std::array<int, 3>& c, std::size_t d) {
  const auto at = [&](const std::array<int, 3>& place) {
    const std::uint8_t label = lattice.label(lattice.at(place[0], place[1], place[2]));
    if (label == 0) return voxel::LinkModuli{};
    const voxel::LinkMaterial& m = options.materials[label];
    return voxel::LinkModuli{m.young_Pa, voxel::across_modulus_Pa(m.young_Pa, m.poisson)};
  };
  std::array<voxel::LinkModuli, 9> links;
  for (int n = 0; n < 9; ++n) {
    std::array<int, 3> from = c;
    from[(d + 1) % 3] += n % 3 - 1;
    from[(d + 2) % 3] += n / 3 - 1;
    std::array<int, 3> to = from;
    ++to[d];
    links[static_cast<std::size_t>(n)] = voxel::softer(at(from), at(to));
  }
  return voxel::link_moduli(links);
}

inline std::vector<Link> links_of(const voxel::Lattice& lattice, const voxel::LatticeOptions& options,
                                  int axis) {
  std::vector<Link> links;
  const glm::dvec3 h = lattice.spacing_m();
  for (std::size_t i = 0; i < lattice.size(); ++i) {
    const auto a = static_cast<voxel::VoxelId>(i);
    if (!lattice.filled(a)) continue;
    for (int d = 0; d < 3; ++d) {
      const voxel::VoxelId b = lattice.up(a, d);
      if (!lattice.filled(b)) continue;
      const voxel::LinkModuli m =
          moduli_of(lattice, options, lattice.coordinates(a), static_cast<std::size_t>(d));
      const double area = h.x * h.y * h.z / h[d];
      const auto bounds = lattice.bounds(a, d, axis);
      links.push_back({a, b, (axis == d ? m.along_Pa : m.across_Pa) * area / h[d],
                       static_cast<double>(bounds[0]), static_cast<double>(bounds[1])});
    }
  }
  return links;
}

struct Problem {
  std::vector<Link> links;
  std::vector<int> unknown;  // [v] number, or −1 where the displacement is given
  int unknowns = 0;
  std::vector<double> u;  // [v]
  // [link] of the limit, where links have any: > 0 resists stretching, < 0 resists shortening (N)
  std::vector<double> limit_N = {};
};

inline Problem problem_of(const voxel::Lattice& lattice, const voxel::LatticeOptions& options,
                          const voxel::Displacement& state, int axis) {
  Problem p{links_of(lattice, options, axis), std::vector<int>(lattice.size(), -1), 0, {}};
  const auto& u = state.u[static_cast<std::size_t>(axis)];
  p.u.assign(u.begin(), u.end());
  for (std::size_t v = 0; v < lattice.size(); ++v) {
    const auto id = static_cast<voxel::VoxelId>(v);
    if (!lattice.filled(id) || lattice.anchored(id) || state.role[v] == voxel::Displacement::held) continue;
    p.unknown[v] = p.unknowns++;
  }
  return p;
}

inline double energy_of(const Problem& p) {
  double energy = 0.0;
  for (const Link& l : p.links) energy += 0.5 * l.k * (p.u[l.b] - p.u[l.a]) * (p.u[l.b] - p.u[l.a]);
  return energy;
}

// One Newton step on ½ Σ k Δ² + ½ Σ ρ (Δ − target)² over the links that `push` names; exact when nothing
// changes sides.
struct Push {
  double weight = 0.0, target = 0.0;
};
inline void newton(Problem& p, const std::vector<Push>& push) {
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd right = Eigen::VectorXd::Zero(p.unknowns);
  for (std::size_t i = 0; i < p.links.size(); ++i) {
    const Link& l = p.links[i];
    const double k = l.k + push[i].weight, offset = push[i].weight * push[i].target;
    const int a = p.unknown[l.a], b = p.unknown[l.b];
    if (a >= 0) {
      entries.emplace_back(a, a, k);
      right[a] -= offset;
      if (b < 0) right[a] += k * p.u[l.b];
    }
    if (b >= 0) {
      entries.emplace_back(b, b, k);
      right[b] += offset;
      if (a < 0) right[b] += k * p.u[l.a];
    }
    if (a >= 0 && b >= 0) {
      entries.emplace_back(a, b, -k);
      entries.emplace_back(b, a, -k);
    }
  }
  Eigen::SparseMatrix<double> matrix(p.unknowns, p.unknowns);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(matrix);
  ASSERT_EQ(solver.info(), Eigen::Success);
  const Eigen::VectorXd x = solver.solve(right);
  for (std::size_t v = 0; v < p.unknown.size(); ++v) {
    if (p.unknown[v] >= 0) p.u[v] = x[p.unknown[v]];
  }
}

inline void solve_without_limits(Problem& p) {
  newton(p, std::vector<Push>(p.links.size()));
}

// Augmented Lagrangian: multipliers on the links at a limit, until no link is violated by more than 1e-9 of
// its length.
inline void solve_with_limits(Problem& p, double spacing) {
  std::vector<double>& force = p.limit_N;
  force.assign(p.links.size(), 0.0);
  for (int outer = 0; outer < 60; ++outer) {
    for (int inner = 0; inner < 60; ++inner) {
      std::vector<Push> push(p.links.size());
      const std::vector<double> before = p.u;
      for (std::size_t i = 0; i < p.links.size(); ++i) {
        const Link& l = p.links[i];
        const double rho = 1e3 * l.k, difference = p.u[l.b] - p.u[l.a];
        if (force[i] + rho * (difference - l.high) > 0.0) {
          push[i] = {rho, l.high - force[i] / rho};
        } else if (force[i] + rho * (difference - l.low) < 0.0) {
          push[i] = {rho, l.low - force[i] / rho};
        }
      }
      newton(p, push);
      double moved = 0.0;
      for (std::size_t v = 0; v < p.u.size(); ++v) moved = std::max(moved, std::fabs(p.u[v] - before[v]));
      if (moved < 1e-12 * spacing) break;
    }
    double worst = 0.0;
    for (std::size_t i = 0; i < p.links.size(); ++i) {
      const Link& l = p.links[i];
      const double rho = 1e3 * l.k, difference = p.u[l.b] - p.u[l.a];
      force[i] = std::max(0.0, force[i] + rho * (difference - l.high)) +
                 std::min(0.0, force[i] + rho * (difference - l.low));
      worst = std::max({worst, difference - l.high, l.low - difference});
    }
    if (worst < 1e-9 * spacing) break;
  }
}

}  // namespace tests
