// SPDX-License-Identifier: GPL-3.0-or-later
// The block of reference/fem-block.csv, a voxel a node: a quarter of it, because it is symmetric.
#pragma once

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "tests/voxel/lattice_scenes.h"
#include "tests/voxel/voxel_problem.h"

namespace tests {

struct ReferenceRow {
  std::string material;
  double spacing_m, width_m, poisson, force_N;
  [[nodiscard]] double spacings() const { return width_m / spacing_m; }
};

inline std::vector<ReferenceRow> reference_rows(const std::filesystem::path& folder) {
  std::vector<ReferenceRow> rows;
  std::ifstream file(folder / "fem-block.csv");
  std::string line;
  while (std::getline(file, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream stream(line);
    ReferenceRow row{};
    stream >> row.material >> row.spacing_m >> row.width_m >> row.poisson >> row.force_N;
    if (stream) rows.push_back(row);
  }
  return rows;
}

// Labels are 1 for 10 kPa and what the row's material adds. A voxel on an interface is of the stiffer side,
// as one on the surface is of the object.
inline std::vector<double> young_by_label(const std::string& material) {
  if (material == "layers") return {0.0, 1e4, 3e4, 5e3};
  if (material == "inclusion") return {0.0, 1e4, 1e5};
  return {0.0, 1e4};
}

inline int label_in_block(const std::string& material, double x, double y, double z) {
  constexpr double e = 1e-9;
  if (material == "layers") return z > 0.055 + e ? 3 : z > 0.04 - e ? 2 : 1;
  if (material == "inclusion") {
    const auto inside = [](double v, double low, double high) { return v > low - e && v < high + e; };
    return inside(x, 0.035, 0.065) && inside(y, 0.035, 0.065) && inside(z, 0.03, 0.045) ? 2 : 1;
  }
  return 1;
}

// The whole block, a voxel at each of its nodes.
inline voxel::LabelVolume reference_volume(const ReferenceRow& row) {
  const double h = row.spacing_m;
  const int n = static_cast<int>(std::lround(0.1 / h)) + 1, nz = static_cast<int>(std::lround(0.06 / h)) + 1;
  voxel::LabelVolume volume = block({n, n, nz}, glm::dvec3(h));
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        volume.labels[volume.index(i, j, k)] =
            static_cast<std::uint8_t>(label_in_block(row.material, i * h, j * h, k * h));
      }
    }
  }
  return volume;
}

// Reaction on the punch (N); NaN where the solver did not come to its end.
inline double pressed_block(const ReferenceRow& row, Energy energy) {
  const double h = row.spacing_m, depth = 1e-3;
  const int half = static_cast<int>(std::lround(0.05 / h)), nz = static_cast<int>(std::lround(0.06 / h)) + 1;
  VoxelBody body{{half + 1, half + 1, nz}, glm::dvec3(h), {}, {}};
  for (const double young : young_by_label(row.material)) body.tissue.push_back({young, row.poisson});
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j <= half; ++j) {
      for (int i = 0; i <= half; ++i) body.label.push_back(label_in_block(row.material, i * h, j * h, k * h));
    }
  }
  PlainProblem problem = problem_of(body, energy);
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j <= half; ++j) {
      for (int i = 0; i <= half; ++i) {
        const std::size_t v = body.at(i, j, k);
        Eigen::Matrix3d& free = problem.free[v];
        if (k == 0) free.setZero();
        if (i == half) free(0, 0) = 0.0;
        if (j == half) free(1, 1) = 0.0;
        if (k == nz - 1 && std::max(half - i, half - j) * h < 0.5 * row.width_m + 1e-9) {
          free(2, 2) = 0.0;
          problem.u[v].z() = -depth;
        }
      }
    }
  }
  // The energy is right to the square of the residual.
  if (!problem.solve(3e-4)) return std::numeric_limits<double>::quiet_NaN();
  return 4.0 * 2.0 * problem.energy_J() / depth;
}

}  // namespace tests
