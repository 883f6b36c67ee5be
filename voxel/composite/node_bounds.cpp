// SPDX-License-Identifier: GPL-3.0-or-later
// Bounds of the nodes of a CompositeGrid: cones from the pressed voxels, along existing links (grid.h).
#include <algorithm>

#include "voxel/composite/grid.h"
#include "voxel/composite/row_kernels.h"

namespace voxel {
namespace {

using composite::index;

using composite::kNoBound;

constexpr int kSweepRounds = 2;
constexpr int kRowsAtOnce = 8;  // rows that are swept together: along x each node waits for the one before

}  // namespace

// Propagates bounds from the nodes low … high, whose bounds are consistent, to all nodes of a level without
// gaps. There a shortest path takes one axis after another.
void CompositeGrid::propagate_bounds(Level& level, std::size_t a, std::size_t kind, const Index3& low,
                                     const Index3& high) const noexcept {
  float* const bound = level.bound[kind].data();
  const auto& nodes = level.nodes;
  const auto step = static_cast<float>(level.step);
  // For a link from a up to b: u(b) >= u(a) − limit[0] and u(a) >= u(b) − limit[1]; for −u the reverse.
  const auto fall = [&](std::size_t d, bool up) { return limit_m_[d][a][(up ? 0U : 1U) ^ kind] * step; };
  for (int k = low[2]; k <= high[2]; ++k) {
    for (int j = low[1]; j <= high[1]; ++j) {
      float* row = bound + level.row(j, k);
      for (int i = low[0] + 1; i < nodes[0].count; ++i) row[i] = std::max(row[i], row[i - 1] - fall(0, true));
      for (int i = high[0] - 1; i >= 0; --i) row[i] = std::max(row[i], row[i + 1] - fall(0, false));
    }
  }
  const std::size_t lanes = level.stride;
  const auto from_row = [lanes](float* to, const float* from, float by) {
    for (std::size_t i = 0; i < lanes; ++i) to[i] = std::max(to[i], from[i] - by);
  };
  for (int k = low[2]; k <= high[2]; ++k) {
    for (int j = low[1] + 1; j < nodes[1].count; ++j)
      from_row(bound + level.row(j, k), bound + level.row(j - 1, k), fall(1, true));
    for (int j = high[1] - 1; j >= 0; --j)
      from_row(bound + level.row(j, k), bound + level.row(j + 1, k), fall(1, false));
  }
  for (int k = low[2] + 1; k < nodes[2].count; ++k) {
    for (int j = 0; j < nodes[1].count; ++j)
      from_row(bound + level.row(j, k), bound + level.row(j, k - 1), fall(2, true));
  }
  for (int k = high[2] - 1; k >= 0; --k) {
    for (int j = 0; j < nodes[1].count; ++j)
      from_row(bound + level.row(j, k), bound + level.row(j, k + 1), fall(2, false));
  }
}

// Propagates bounds where links are missing, by alternating sweeps. It misses shortest paths with more bends
// than kSweepRounds rounds of sweeps can follow.
void CompositeGrid::propagate_bounds_round_gaps(Level& level, std::size_t a,
                                                std::size_t kind) const noexcept {
  float* const bound = level.bound[kind].data();
  const auto& nodes = level.nodes;
  const auto step = static_cast<float>(level.step);
  const auto fall = [&](std::size_t d, bool up) { return limit_m_[d][a][(up ? 0U : 1U) ^ kind] * step; };
  const std::size_t lanes = level.stride;
  const auto from_row = [lanes](float* to, const float* from, const float* link, float by) {
    for (std::size_t i = 0; i < lanes; ++i) {
      const float asked = link[i] > 0.0F ? from[i] - by : kNoBound;
      to[i] = std::max(to[i], asked);
    }
  };
  const int nx = nodes[0].count, ny = nodes[1].count, nz = nodes[2].count;
  const float *const link_x = level.weight[0].data(), *const link_y = level.weight[1].data(),
                     *const link_z = level.weight[2].data();
  for (int round = 0; round < kSweepRounds; ++round) {
    for (int k = 0; k < nz; ++k) {
      for (int j = 0; j < ny; j += kRowsAtOnce) {
        const int rows = std::min(kRowsAtOnce, ny - j);
        const auto sweep = [&](int i, int from, int link, float by) {
          for (int r = 0; r < rows; ++r) {
            float* const row = bound + level.row(j + r, k);
            const float asked = link_x[level.row(j + r, k) + index(link)] > 0.0F ? row[from] - by : kNoBound;
            row[i] = std::max(row[i], asked);
          }
        };
        for (int i = 1; i < nx; ++i) sweep(i, i - 1, i - 1, fall(0, true));
        for (int i = nx - 2; i >= 0; --i) sweep(i, i + 1, i, fall(0, false));
      }
    }
    for (int k = 0; k < nz; ++k) {
      for (int j = 1; j < ny; ++j) {
        const std::size_t from = level.row(j - 1, k);
        from_row(bound + level.row(j, k), bound + from, link_y + from, fall(1, true));
      }
      for (int j = ny - 2; j >= 0; --j) {
        const std::size_t to = level.row(j, k);
        from_row(bound + to, bound + level.row(j + 1, k), link_y + to, fall(1, false));
      }
    }
    for (int k = 1; k < nz; ++k) {
      for (int j = 0; j < ny; ++j) {
        const std::size_t from = level.row(j, k - 1);
        from_row(bound + level.row(j, k), bound + from, link_z + from, fall(2, true));
      }
    }
    for (int k = nz - 2; k >= 0; --k) {
      for (int j = 0; j < ny; ++j) {
        const std::size_t to = level.row(j, k);
        from_row(bound + to, bound + level.row(j, k + 1), link_z + to, fall(2, false));
      }
    }
  }
}

void CompositeGrid::find_bounds(std::size_t a) noexcept {
  const int axis = static_cast<int>(a);
  for (std::size_t kind = 0; kind < 2; ++kind) {
    const float sign = kind == 0 ? 1.0F : -1.0F;
    for (Level& level : levels_) level.bounded[kind] = false;
    const auto constrains = [&](const Pressed& p) { return sign * p.normal[axis] > kAlong; };
    float strongest = kNoBound;
    for (const Pressed& p : pressed_) {
      if (constrains(p)) strongest = std::max(strongest, sign * p.u[axis]);
    }
    if (strongest == kNoBound) continue;
    Index3 low{1 << 20, 1 << 20, 1 << 20}, high{-1, -1, -1};
    for (std::size_t l = 0; l < levels_.size(); ++l) {
      Level& level = levels_[l];
      Floats& bound = level.bound[kind];
      std::fill_n(bound.begin(), level.first_row() + level.floats() + kPad, kNoBound);
      level.bounded[kind] = true;
      if (l == 0) {
        for (const Pressed& p : pressed_) {
          if (!constrains(p)) continue;
          float& at = bound[level.node(p.node[0], p.node[1], p.node[2])];
          at = std::max(at, sign * p.u[axis]);
          for (std::size_t d = 0; d < 3; ++d) {
            low[d] = std::min(low[d], p.node[d]);
            high[d] = std::max(high[d], p.node[d]);
          }
        }
      } else {
        const Level& fine = levels_[l - 1];
        const auto& nodes = fine.nodes;
        // Nodes of this level that coincide with nodes of the finer level take their bounds.
        for (std::size_t d = 0; d < 3; ++d) {
          low[d] = level.nodes[d].count;
          high[d] = -1;
          for (int c = 0; c < level.nodes[d].count; ++c) {
            const int here = nodes[d].fine[index(c)];
            if (here < 0 || here >= nodes[d].count) continue;
            low[d] = std::min(low[d], c);
            high[d] = std::max(high[d], c);
          }
        }
        for (int k = low[2]; k <= high[2]; ++k) {
          for (int j = low[1]; j <= high[1]; ++j) {
            const float* from =
                fine.bound[kind].data() + fine.row(nodes[1].fine[index(j)], nodes[2].fine[index(k)]);
            float* to = bound.data() + level.row(j, k);
            for (int i = low[0]; i <= high[0]; ++i) to[i] = from[nodes[0].fine[index(i)]];
          }
        }
      }
      if (level.has_gaps) {
        propagate_bounds_round_gaps(level, a, kind);
      } else {
        propagate_bounds(level, a, kind, low, high);
      }
    }
  }
}

}  // namespace voxel
