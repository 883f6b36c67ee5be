// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/fem/hex_forces.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "voxel/lattice/simd_dispatch.h"

namespace voxel {
namespace {

constexpr std::size_t kLanes = 8;  // voxels of a vector
constexpr std::size_t kSelf = 13;  // number of the middle one of 3 × 3 × 3 nodes

// Vector extension of GCC and Clang; equivalent loops over arrays are much slower.
using NodeLanes [[gnu::vector_size(kLanes * sizeof(float))]] = float;

[[gnu::always_inline]] inline void load(NodeLanes& out, const float* from) {
  std::memcpy(&out, from, sizeof out);
}

// Offset (x, y, z), each −1, 0 or 1, of neighbour o.
constexpr std::array<int, 3> offset_of(std::size_t o) {
  const int n = static_cast<int>(o);
  return {n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
}

// Can entry (r, c) of block o be non-zero inside a material? Mirroring the lattice in axis r changes the sign
// of u_r. So an entry with r ≠ c is odd in the offsets along r and c.
constexpr bool couples(std::size_t o, std::size_t r, std::size_t c) {
  return r == c || (offset_of(o)[r] != 0 && offset_of(o)[c] != 0);
}

// Adds the forces of the neighbours o and 26 − o to kLanes nodes from `at`.
template <std::size_t o>
[[gnu::always_inline]] inline void add_pair(const NodeStencil& stencil, const NodeField& field,
                                            std::size_t at, const NodeLanes* self, NodeLanes* sum) {
  constexpr std::array<int, 3> kOffset = offset_of(o);
  const std::ptrdiff_t away = kOffset[0] + kOffset[1] * field.stride_y + kOffset[2] * field.stride_z;
  for (std::size_t c = 0; c < 3; ++c) {
    NodeLanes one, other;
    load(one, field.u[c] + at + away);
    load(other, field.u[c] + at - away);
    const NodeLanes both = (one - self[c]) + (other - self[c]);
    for (std::size_t r = 0; r < 3; ++r) {
      if (couples(o, r, c)) sum[r] -= stencil.block[o][4 * c + r] * both;
    }
  }
}

template <std::size_t... o>
[[gnu::always_inline]] inline void add_pairs(std::index_sequence<o...>, const NodeStencil& stencil,
                                             const NodeField& field, std::size_t at, const NodeLanes* self,
                                             NodeLanes* sum) {
  (add_pair<o>(stencil, field, at, self, sum), ...);
}

}  // namespace

HYBRID_MULTIVERSIONED void row_forces(const NodeStencil& inside, const NodeField& field, std::size_t first,
                                      std::size_t count, const std::array<float*, 3>& force) {
  // The last vector overlaps the one before it, so that no node is left for a scalar loop.
  for (std::size_t done = 0; done < count && count >= kLanes; done += kLanes) {
    const std::size_t from = std::min(done, count - kLanes);
    NodeLanes self[3], sum[3] = {};
    for (std::size_t c = 0; c < 3; ++c) load(self[c], field.u[c] + first + from);
    add_pairs(std::make_index_sequence<kSelf>{}, inside, field, first + from, self, sum);
    for (std::size_t c = 0; c < 3; ++c) std::memcpy(force[c] + from, &sum[c], sizeof sum[c]);
  }
  for (std::size_t i = 0; i < count && count < kLanes; ++i) {
    const std::array<float, 3> f = node_force(inside, field, first + i);
    for (std::size_t c = 0; c < 3; ++c) force[c][i] = f[c];
  }
}

namespace {

// Sums a node's force in the lanes x, y and z. The fourth lane holds neighbouring data and is ignored.
using Quad [[gnu::vector_size(4 * sizeof(float))]] = float;

[[gnu::always_inline]] inline void add_column(Quad& sum, const float* column, float by) {
  Quad k;
  std::memcpy(&k, column, sizeof k);
  sum -= k * by;
}

// Differences of the 27 neighbours to the node: out[3·o + axis].
template <std::size_t... o>
[[gnu::always_inline]] inline void differences(std::index_sequence<o...>, const NodeField& field,
                                               std::size_t node, float* out) {
  for (std::size_t c = 0; c < 3; ++c) {
    const float* u = field.u[c] + node;
    const float self = *u;
    ((out[3 * o + c] =
          u[offset_of(o)[0] + offset_of(o)[1] * field.stride_y + offset_of(o)[2] * field.stride_z] - self),
     ...);
  }
}

}  // namespace

std::array<float, 3> node_force(const NodeStencil& stencil, const NodeField& field, std::size_t node) {
  std::array<float, 81> d;
  differences(std::make_index_sequence<27>{}, field, node, d.data());
  std::array<Quad, 3> sum{};  // three independent chains of additions
  for (std::size_t o = 0; o < 27; ++o) {
    for (std::size_t c = 0; c < 3; ++c) add_column(sum[c], &stencil.block[o][4 * c], d[3 * o + c]);
  }
  const Quad total = (sum[0] + sum[1]) + sum[2];
  return {total[0], total[1], total[2]};
}

BrickFloats in_floats(const BrickStiffness& brick) {
  BrickFloats out{};
  std::transform(brick.entry.begin(), brick.entry.end(), out.begin(),
                 [](double entry) { return static_cast<float>(entry); });
  return out;
}

std::array<float, 3> node_force(const std::array<const BrickFloats*, 8>& bricks, const NodeField& field,
                                std::size_t node) {
  std::array<float, 81> d;
  differences(std::make_index_sequence<27>{}, field, node, d.data());
  std::array<Quad, 3> sum{};
  for (std::size_t octant = 0; octant < 8; ++octant) {
    if (bricks[octant] == nullptr) continue;
    const auto number = [](std::size_t bits) { return (bits & 1) + 3 * (bits >> 1 & 1) + 9 * (bits >> 2); };
    // The matrix is symmetric. So the entries of a column in the node's three rows are contiguous in memory,
    // as a part of a row.
    const float* rows = bricks[octant]->data() + 3 * (7 - octant);
    for (std::size_t corner = 0; corner < 8; ++corner) {
      const float* from = d.data() + 3 * (number(octant) + number(corner));
      for (std::size_t c = 0; c < 3; ++c) add_column(sum[c], rows + 24 * (3 * corner + c), from[c]);
    }
  }
  const Quad total = (sum[0] + sum[1]) + sum[2];
  return {total[0], total[1], total[2]};
}

}  // namespace voxel
