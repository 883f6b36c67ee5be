// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/fem/hex_element.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

#include "voxel/lattice/link_stiffness.h"

namespace voxel {
namespace {

using Strain = Eigen::Matrix<double, 6, 1>;  // xx, yy, zz, xy, yz, zx, the last three doubled
using Elasticity = Eigen::Matrix<double, 6, 6>;
using CornerStrain = Eigen::Matrix<double, 6, 24>;
using ModeStrain = Eigen::Matrix<double, 6, 9>;

Elasticity elasticity(double young, double poisson) {
  const double lame = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
  const double shear = young / (2.0 * (1.0 + poisson));
  Elasticity d = Elasticity::Zero();
  d.topLeftCorner<3, 3>().setConstant(lame);
  for (int i = 0; i < 3; ++i) {
    d(i, i) += 2.0 * shear;
    d(i + 3, i + 3) = shear;
  }
  return d;
}

// Strain-displacement columns of one shape function: column a is the strain for displacement component a,
// given the gradient of the shape function.
template <typename Columns>
void put_gradient(Columns columns, const Eigen::Vector3d& gradient) {
  columns.setZero();
  for (int a = 0; a < 3; ++a) {
    const int b = (a + 1) % 3;
    columns(a, a) = gradient[a];
    columns(3 + a, a) = gradient[b];
    columns(3 + a, b) = gradient[a];
  }
}

// Strain-displacement matrix of the eight corners at (ξ, η, ζ), each −1 to 1.
CornerStrain corner_strain(const Eigen::Vector3d& at, const Eigen::Vector3d& spacing) {
  CornerStrain out;
  for (int corner = 0; corner < 8; ++corner) {
    Eigen::Vector3d side, shape, gradient;
    for (int a = 0; a < 3; ++a) {
      side[a] = ((corner >> a) & 1) != 0 ? 1.0 : -1.0;
      shape[a] = 0.5 * (1.0 + side[a] * at[a]);
    }
    for (int a = 0; a < 3; ++a) gradient[a] = side[a] / spacing[a] * shape[(a + 1) % 3] * shape[(a + 2) % 3];
    put_gradient(out.block<6, 3>(0, 3 * corner), gradient);
  }
  return out;
}

// The incompatible modes 1 − ξ², 1 − η², 1 − ζ². Their mean strain over a brick is zero, so that a constant
// strain does not excite them (patch test).
ModeStrain mode_strain(const Eigen::Vector3d& at, const Eigen::Vector3d& spacing) {
  ModeStrain out;
  for (int mode = 0; mode < 3; ++mode) {
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    gradient[mode] = -4.0 * at[mode] / spacing[mode];
    put_gradient(out.block<6, 3>(0, 3 * mode), gradient);
  }
  return out;
}

void check(double young_Pa, double poisson, const glm::dvec3& spacing_m) {
  if (!std::isfinite(young_Pa) || young_Pa <= 0.0)
    throw std::invalid_argument("a brick needs a Young's modulus above 0, in Pa, e.g. 5000");
  if (!(poisson >= 0.0 && poisson < 0.5))
    throw std::invalid_argument("a brick needs a Poisson's ratio of 0 <= nu < 0.5, e.g. 0.3");
  for (int a = 0; a < 3; ++a) {
    if (!std::isfinite(spacing_m[a]) || spacing_m[a] <= 0.0)
      throw std::invalid_argument("a brick needs spacings above 0, in m");
  }
}

}  // namespace

BrickStiffness brick_stiffness(double young_Pa, double poisson, const glm::dvec3& spacing_m) {
  check(young_Pa, poisson, spacing_m);
  // Units are the longest edge and E, so that values neither under- nor overflow at 1 µm or 1 TPa.
  const Eigen::Vector3d metres(spacing_m.x, spacing_m.y, spacing_m.z);
  const double unit = metres.maxCoeff();
  const Eigen::Vector3d spacing = metres / unit;
  const Elasticity d = elasticity(1.0, poisson);
  const double volume = spacing.prod() / 8.0, gauss = 1.0 / std::sqrt(3.0);

  Eigen::Matrix<double, 24, 24> corners = Eigen::Matrix<double, 24, 24>::Zero();
  Eigen::Matrix<double, 24, 9> mixed = Eigen::Matrix<double, 24, 9>::Zero();
  Eigen::Matrix<double, 9, 9> modes = Eigen::Matrix<double, 9, 9>::Zero();
  for (int point = 0; point < 8; ++point) {
    Eigen::Vector3d at;
    for (int a = 0; a < 3; ++a) at[a] = ((point >> a) & 1) != 0 ? gauss : -gauss;
    const CornerStrain b = corner_strain(at, spacing);
    const ModeStrain m = mode_strain(at, spacing);
    const CornerStrain stress = volume * d * b;
    corners.noalias() += b.transpose() * stress;
    mixed.noalias() += stress.transpose() * m;
    modes.noalias() += volume * m.transpose() * d * m;
  }
  corners -= mixed * modes.ldlt().solve(mixed.transpose());

  BrickStiffness out;
  // Symmetrises: rounding leaves the upper and lower triangle slightly different.
  const Eigen::Matrix<double, 24, 24> symmetric = 0.5 * young_Pa * unit * (corners + corners.transpose());
  std::copy_n(symmetric.data(), symmetric.size(), out.entry.begin());
  return out;
}

BrickStiffness link_cell_stiffness(double young_Pa, double poisson, const glm::dvec3& spacing_m) {
  check(young_Pa, poisson, spacing_m);
  const double across = across_modulus_Pa(young_Pa, poisson);
  BrickStiffness out;
  for (std::size_t corner = 0; corner < 8; ++corner) {
    for (std::size_t d = 0; d < 3; ++d) {
      const std::size_t other = corner ^ (std::size_t{1} << d);
      const double h = spacing_m[static_cast<int>(d)];
      const double area_by_length = spacing_m.x * spacing_m.y * spacing_m.z / (h * h);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double k = 0.25 * area_by_length * (axis == d ? young_Pa : across);
        out.entry[24 * (3 * corner + axis) + 3 * corner + axis] += k;
        out.entry[24 * (3 * corner + axis) + 3 * other + axis] -= k;
      }
    }
  }
  return out;
}

BrickStiffness difference(const BrickStiffness& a, const BrickStiffness& b) {
  BrickStiffness out;
  std::transform(a.entry.begin(), a.entry.end(), b.entry.begin(), out.entry.begin(), std::minus<>{});
  return out;
}

double largest_ratio(const BrickStiffness& brick, const BrickStiffness& links) {
  using Matrix = Eigen::Matrix<double, 24, 24>;
  const Matrix of = Eigen::Map<const Matrix>(brick.entry.data());
  Matrix to = Eigen::Map<const Matrix>(links.entry.data());
  // Rigid shifts are zero modes of both matrices. Stiffness added on them makes `to` non-singular.
  const double stiffness = to.trace() / 24.0;
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::Matrix<double, 24, 1> shift = Eigen::Matrix<double, 24, 1>::Zero();
    for (int corner = 0; corner < 8; ++corner) shift[3 * corner + axis] = 1.0;
    to += stiffness / 8.0 * shift * shift.transpose();
  }
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix> solver(of, to, Eigen::EigenvaluesOnly);
  return solver.eigenvalues().maxCoeff();
}

NodeStencil node_stencil(const BricksAround& bricks) {
  std::array<std::array<double, 12>, 27> sum{};
  for (std::size_t octant = 0; octant < 8; ++octant) {
    if (bricks[octant] == nullptr) continue;
    const std::size_t self = 7 - octant;  // corner of the brick at the node
    for (std::size_t corner = 0; corner < 8; ++corner) {
      std::size_t o = 0;
      for (std::size_t a = 0, step = 1; a < 3; ++a, step *= 3) {
        const std::size_t bit = std::size_t{1} << a;
        o += step * (((octant & bit) != 0 ? 1 : 0) + ((corner & bit) != 0 ? 1 : 0));
      }
      for (std::size_t r = 0; r < 3; ++r) {
        for (std::size_t c = 0; c < 3; ++c)
          sum[o][4 * c + r] += bricks[octant]->at(3 * self + r, 3 * corner + c);
      }
    }
  }
  NodeStencil out;
  for (std::size_t o = 0; o < 27; ++o) {
    for (std::size_t e = 0; e < 12; ++e) out.block[o][e] = static_cast<float>(sum[o][e]);
  }
  return out;
}

NodeStencil node_stencil(const BrickStiffness& brick) {
  return node_stencil({&brick, &brick, &brick, &brick, &brick, &brick, &brick, &brick});
}

}  // namespace voxel
