// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/composite/brick_forces.h"

#include <array>
#include <cmath>

#include "voxel/composite/row_kernels.h"
#include "voxel/lattice/simd8.h"
#include "voxel/lattice/simd_dispatch.h"

namespace voxel::composite {
namespace {

constexpr int kCorners = 8;

constexpr double sign_at(std::size_t parity, std::size_t corner) {
  double sign = 1.0;
  for (std::size_t d = 0; d < 3; ++d) {
    if ((parity >> d & 1) != 0 && (corner >> d & 1) == 0) sign = -sign;
  }
  return sign;
}

// Replaces each pair of corners along y and along z by its sum and difference. The caller does the same along
// x, before or after.
HYBRID_INLINE void transform_across(Float8 (&m)[kCorners]) {
#pragma GCC unroll 2
  for (int bit = 2; bit <= 4; bit *= 2) {
#pragma GCC unroll 8
    for (int p = 0; p < kCorners; ++p) {
      if ((p & bit) != 0) continue;
      const Float8 low = m[p], high = m[p | bit];
      m[p] = low + high;
      m[p | bit] = high - low;
    }
  }
}
// The transposed transform along y and z.
HYBRID_INLINE void transform_back(Float8 (&m)[kCorners]) {
#pragma GCC unroll 2
  for (int bit = 2; bit <= 4; bit *= 2) {
#pragma GCC unroll 8
    for (int p = 0; p < kCorners; ++p) {
      if ((p & bit) != 0) continue;
      const Float8 even = m[p], odd = m[p | bit];
      m[p] = even - odd;
      m[p | bit] = even + odd;
    }
  }
}

// Calls deferred(m, f, at), which may add to the forces of the vector of cells at `at`.
template <class Deferred>
HYBRID_INLINE void add_forces(const BrickView& v, const BrickBlocks& blocks, const Deferred& deferred) {
  const int vectors = (v.cells[0] + 1 + kLanes - 1) / kLanes;
  const RowMask uncovered = uncovered_lanes(v.covered_first[0], v.covered_last[0], vectors);
  for (int k = 0; k < v.cells[2]; ++k) {
    for (int j = 0; j < v.cells[1]; ++j) {
      const std::size_t row = static_cast<std::size_t>(k) * v.plane + static_cast<std::size_t>(j) * v.stride;
      const bool covered = k >= v.covered_first[2] && k <= v.covered_last[2] && j >= v.covered_first[1] &&
                           j <= v.covered_last[1];
      // Forces of the vector before on the upper corners of its cells in x: [axis][y + 2z].
      Float8 before[3][4] = {};
      bool any_before = false;
      for (int o = 0; o < vectors; ++o) {
        const std::size_t at = row + static_cast<std::size_t>(o * kLanes);
        Float8 modulus;
        load(modulus, v.modulus + at);
        const bool any = lanes_set(modulus > Float8{}) != 0;
        if (!any && !any_before) continue;
        any_before = any;
        modulus *= v.scale;
        if (covered) {
          Float8 counts;
          load(counts, uncovered.data() + o * kLanes);
          modulus *= counts;
        }
        Float8 m[3][kCorners];
#pragma GCC unroll 3
        for (std::size_t a = 0; a < 3; ++a) {
          // Differences to one corner make the force of a rigid shift exactly zero.
          Float8 reference;
          load(reference, v.u[a] + at);
#pragma GCC unroll 4
          for (std::size_t yz = 0; yz < 4; ++yz) {
            const float* const u = v.u[a] + at + (yz & 1U) * v.stride + (yz >> 1U) * v.plane;
            Float8 low, high;
            load(low, u);
            load(high, u + 1);
            low -= reference;
            high -= reference;
            m[a][2 * yz] = low + high;
            m[a][2 * yz + 1] = high - low;
          }
          transform_across(m[a]);
        }
        Float8 f[3][kCorners];
#pragma GCC unroll 8
        for (std::size_t q = 0; q < kCorners; ++q) {
#pragma GCC unroll 3
          for (std::size_t a = 0; a < 3; ++a) {
            f[a][q ^ std::size_t{1} << a] = blocks.block[q][a][0] * m[0][q ^ 1U] +
                                            blocks.block[q][a][1] * m[1][q ^ 2U] +
                                            blocks.block[q][a][2] * m[2][q ^ 4U];
          }
        }
        deferred(m, f, at);
#pragma GCC unroll 3
        for (std::size_t a = 0; a < 3; ++a) {
          transform_back(f[a]);
#pragma GCC unroll 4
          for (std::size_t yz = 0; yz < 4; ++yz) {
            const Float8 even = f[a][2 * yz], odd = f[a][2 * yz + 1];
            const Float8 above = modulus * (even + odd);
            Float8 shifted, sum;
            shift_down(shifted, before[a][yz], above);
            before[a][yz] = above;
            float* const to = v.force[a] + at + (yz & 1U) * v.stride + (yz >> 1U) * v.plane;
            load(sum, to);
            sum += modulus * (even - odd) + shifted;
            store(to, sum);
          }
        }
      }
    }
  }
}

}  // namespace

BrickBlocks brick_blocks(const BrickStiffness& brick) {
  BrickBlocks out;
  for (std::size_t q = 0; q < kCorners; ++q) {
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t b = 0; b < 3; ++b) {
        const std::size_t of_a = q ^ std::size_t{1} << a, of_b = q ^ std::size_t{1} << b;
        double sum = 0.0;
        for (std::size_t c = 0; c < kCorners; ++c) {
          for (std::size_t d = 0; d < kCorners; ++d)
            sum += sign_at(of_a, c) * brick.at(3 * c + a, 3 * d + b) * sign_at(of_b, d);
        }
        // A shift of the whole brick causes no force; rounding must not make one.
        const bool shifts = of_a == 0 || of_b == 0;
        out.block[q][a][b] = shifts ? 0.0F : static_cast<float>(-sum / (kCorners * kCorners));
      }
    }
  }
  return out;
}

namespace {

// Takes the mean strain of all components with a weight other than 0 out of `less` (bricks less links), and
// finds the share by which this strain follows. The stiffnesses of brick and links have the ratio r if all
// components take part in a motion, and a ratio nearer to 1 if only one does. The share is best for the mean
// of both cases.
MeanStrain take_strain(BrickBlocks& less, const BrickBlocks& links, std::size_t q,
                       const std::array<float, 3>& weight) {
  MeanStrain out{.weight = weight};
  double sum = 0.0, of_links = 0.0, parts = 0.0;
  for (std::size_t a = 0; a < 3; ++a) {
    if (weight[a] == 0.0F) continue;
    parts += 1.0;
    of_links -= static_cast<double>(links.block[q][a][a] / (weight[a] * weight[a]));
    for (std::size_t b = 0; b < 3; ++b) {
      if (weight[b] != 0.0F) sum -= static_cast<double>(less.block[q][a][b] / (weight[a] * weight[b]));
    }
  }
  const double stiffness = sum / (parts * parts), beyond = sum / of_links;
  out.stiffness = static_cast<float>(stiffness);
  out.follows = static_cast<float>(2.0 / (2.0 + beyond + beyond / parts));
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t b = 0; b < 3; ++b) less.block[q][a][b] += out.stiffness * weight[a] * weight[b];
  }
  return out;
}

}  // namespace

DeferredBrick deferred_brick(const BrickStiffness& brick, const BrickStiffness& links) {
  DeferredBrick out;
  out.rest = brick_blocks(difference(brick, links));
  const BrickBlocks of_links = brick_blocks(links);
  // The stiffness of a link along d is E · volume / h_d². So the root of the ratio of two such stiffnesses
  // weighs the axes by 1 / h_d.
  std::array<float, 3> w{};
  for (std::size_t d = 0; d < 3; ++d) w[d] = std::sqrt(of_links.block[0][d][d] / of_links.block[0][0][0]);
  // In a plane of two axes, each component varies along the other axis.
  const std::array<std::array<float, 3>, DeferredBrick::kStrains> weights{
      {w, {w[1], w[0], 0.0F}, {w[2], 0.0F, w[0]}, {0.0F, w[2], w[1]}}};
  for (std::size_t n = 0; n < DeferredBrick::kStrains; ++n)
    out.strain[n] = take_strain(out.rest, of_links, DeferredBrick::kQ[n], weights[n]);
  return out;
}

HYBRID_MULTIVERSIONED void add_brick_forces(const BrickView& view, const BrickBlocks& blocks) noexcept {
  add_forces(view, blocks, [](const auto&, auto&, std::size_t) __attribute__((always_inline)){});
}

HYBRID_MULTIVERSIONED void add_deferred_forces(
    const BrickView& view, const DeferredBrick& brick,
    const std::array<float*, DeferredBrick::kStrains>& strains) noexcept {
  add_forces(
      view, brick.rest, [&](const auto& m, auto& f, std::size_t at) __attribute__((always_inline)) {
#pragma GCC unroll 4
        for (std::size_t s = 0; s < DeferredBrick::kStrains; ++s) {
          const std::size_t q = DeferredBrick::kQ[s];
          const MeanStrain& of = brick.strain[s];
          Float8 known;
          load(known, strains[s] + at);
          const Float8 now =
              of.weight[0] * m[0][q ^ 1U] + of.weight[1] * m[1][q ^ 2U] + of.weight[2] * m[2][q ^ 4U];
          const Float8 followed = known + of.follows * (now - known);
          const Float8 limit = Float8{} + 0.5F * kNewStrain;
          known = known > limit ? now : followed;
          store(strains[s] + at, known);
          const Float8 stress = -of.stiffness * known;
          f[0][q ^ 1U] += of.weight[0] * stress;
          f[1][q ^ 2U] += of.weight[1] * stress;
          f[2][q ^ 4U] += of.weight[2] * stress;
        }
      });
}

}  // namespace voxel::composite
