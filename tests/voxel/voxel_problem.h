// SPDX-License-Identifier: GPL-3.0-or-later
// A lattice of labels as a plain problem, in either energy.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "tests/voxel/plain_solution.h"
#include "voxel/link_weight.h"

namespace tests {

enum class Energy { six_link, accurate };

struct Tissue {
  double young_Pa = 1e4, poisson = 0.3;
};

// The voxels i < dims with a label above 0; `tissue` by label.
struct VoxelBody {
  std::array<int, 3> dims;
  glm::dvec3 spacing_m;
  std::vector<int> label;  // x fastest
  std::vector<Tissue> tissue;

  [[nodiscard]] std::size_t at(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(dims[1]) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(dims[0]) +
           static_cast<std::size_t>(i);
  }
  [[nodiscard]] int label_at(std::array<int, 3> c) const {
    for (std::size_t d = 0; d < 3; ++d) {
      if (c[d] < 0 || c[d] >= dims[d]) return 0;
    }
    return label[at(c[0], c[1], c[2])];
  }
};

inline voxel::LinkModuli moduli_at(const VoxelBody& body, std::array<int, 3> c) {
  const int label = body.label_at(c);
  if (label == 0) return {};
  const Tissue& t = body.tissue[static_cast<std::size_t>(label)];
  return {t.young_Pa, voxel::across_modulus_Pa(t.young_Pa, t.poisson)};
}

// Springs of the link that leaves voxel `a` in +d (N/m, by axis).
inline Eigen::Vector3d link_springs(const VoxelBody& body, std::array<int, 3> a, std::size_t d,
                                    Energy energy) {
  std::array<voxel::LinkModuli, 9> links;
  for (int q = -1; q <= 1; ++q) {
    for (int p = -1; p <= 1; ++p) {
      std::array<int, 3> from = a;
      from[(d + 1) % 3] += p;
      from[(d + 2) % 3] += q;
      std::array<int, 3> to = from;
      ++to[d];
      const int number = p + 1 + 3 * (q + 1);
      links[static_cast<std::size_t>(number)] = voxel::softer(moduli_at(body, from), moduli_at(body, to));
    }
  }
  const voxel::LinkModuli moduli =
      energy == Energy::six_link ? voxel::link_moduli(links) : voxel::link_moduli_beside_bricks(links);
  const glm::dvec3 h = body.spacing_m;
  const int axis = static_cast<int>(d);
  Eigen::Vector3d stiffness = Eigen::Vector3d::Constant(moduli.across_Pa);
  stiffness[axis] = moduli.along_Pa;
  return h.x * h.y * h.z / (h[axis] * h[axis]) * stiffness;
}

inline void add_springs(const VoxelBody& body, Energy energy, PlainProblem& out) {
  for (int k = 0; k < body.dims[2]; ++k) {
    for (int j = 0; j < body.dims[1]; ++j) {
      for (int i = 0; i < body.dims[0]; ++i) {
        if (body.label_at({i, j, k}) == 0) continue;
        for (std::size_t d = 0; d < 3; ++d) {
          std::array<int, 3> other{i, j, k};
          ++other[d];
          if (body.label_at(other) == 0) continue;
          const Eigen::Vector3d stiffness = link_springs(body, {i, j, k}, d, energy);
          if (stiffness.isZero()) continue;
          out.springs.push_back({body.at(i, j, k), body.at(other[0], other[1], other[2]), stiffness});
        }
      }
    }
  }
}

inline void add_bricks(const VoxelBody& body, PlainProblem& out) {
  std::map<int, std::size_t> kinds;
  for (int k = 0; k + 1 < body.dims[2]; ++k) {
    for (int j = 0; j + 1 < body.dims[1]; ++j) {
      for (int i = 0; i + 1 < body.dims[0]; ++i) {
        PlainProblem::PlacedBrick brick{};
        int softest = -1;
        for (int c = 0; c < 8; ++c) {
          const std::array<int, 3> at{i + (c & 1), j + ((c >> 1) & 1), k + (c >> 2)};
          const int label = body.label_at(at);
          brick.node[static_cast<std::size_t>(c)] = body.at(at[0], at[1], at[2]);
          if (softest < 0 || label == 0 ||
              (softest > 0 && body.tissue[static_cast<std::size_t>(label)].young_Pa <
                                  body.tissue[static_cast<std::size_t>(softest)].young_Pa)) {
            softest = softest == 0 ? 0 : label;
          }
        }
        if (softest == 0) continue;
        const auto [kind, fresh] = kinds.emplace(softest, out.bricks.size());
        if (fresh) {
          const Tissue& t = body.tissue[static_cast<std::size_t>(softest)];
          out.bricks.push_back(matrix_of(voxel::brick_stiffness(t.young_Pa, t.poisson, body.spacing_m)));
        }
        brick.kind = kind->second;
        out.placed.push_back(brick);
      }
    }
  }
}

inline PlainProblem problem_of(const VoxelBody& body, Energy energy) {
  PlainProblem out(body.label.size());
  add_springs(body, energy, out);
  if (energy == Energy::accurate) add_bricks(body, out);
  return out;
}

}  // namespace tests
