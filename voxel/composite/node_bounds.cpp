// SPDX-License-Identifier: GPL-3.0-or-later
// The bounds of a composite grid's nodes: cones of what is pressed, along the links there are.
#include <algorithm>
#include <cmath>

#include "voxel/composite/grid.h"

namespace voxel {
namespace {

constexpr float kNoBound = -1e30F;  // no bound
// Of a normal: an axis of which less is in it does not hold what is pressed. (With a quarter, what a ball
// pressed aside by little came back, axis by axis, and went to and fro.)
constexpr float kAlong = 0.02F;
constexpr int kRounds = 2;  // of sweeps where paths may bend

std::size_t index(int i) {
  return static_cast<std::size_t>(i);
}

}  // namespace

// From the nodes of a box, low … high, which are right among themselves, to all nodes: where all links are
// there the shortest path goes axis by axis.
void CompositeGrid::spread_bounds(Level& level, std::size_t a, std::size_t kind, const Index3& low,
                                  const Index3& high) const noexcept {
  float* const bound = level.bound[kind].data();
  const auto& line = level.line;
  const auto step = static_cast<float>(level.step);
  // u(b) >= u(a) − shorter, and u(a) >= u(b) − longer; of −u the reverse.
  const auto fall = [&](std::size_t d, bool up) { return limit_m_[d][a][(up ? 0U : 1U) ^ kind] * step; };
  for (int k = low[2]; k <= high[2]; ++k) {
    for (int j = low[1]; j <= high[1]; ++j) {
      float* row = bound + level.row(j, k);
      for (int i = low[0] + 1; i < line[0].count; ++i) row[i] = std::max(row[i], row[i - 1] - fall(0, true));
      for (int i = high[0] - 1; i >= 0; --i) row[i] = std::max(row[i], row[i + 1] - fall(0, false));
    }
  }
  const std::size_t lanes = level.stride;
  const auto from_row = [lanes](float* to, const float* from, float by) {
    for (std::size_t i = 0; i < lanes; ++i) to[i] = std::max(to[i], from[i] - by);
  };
  for (int k = low[2]; k <= high[2]; ++k) {
    for (int j = low[1] + 1; j < line[1].count; ++j)
      from_row(bound + level.row(j, k), bound + level.row(j - 1, k), fall(1, true));
    for (int j = high[1] - 1; j >= 0; --j)
      from_row(bound + level.row(j, k), bound + level.row(j + 1, k), fall(1, false));
  }
  for (int k = low[2] + 1; k < line[2].count; ++k) {
    for (int j = 0; j < line[1].count; ++j)
      from_row(bound + level.row(j, k), bound + level.row(j, k - 1), fall(2, true));
  }
  for (int k = high[2] - 1; k >= 0; --k) {
    for (int j = 0; j < line[1].count; ++j)
      from_row(bound + level.row(j, k), bound + level.row(j, k + 1), fall(2, false));
  }
}

// The same where links are missing: sweeps to and fro, no path bends more often than they do.
void CompositeGrid::spread_round_gaps(Level& level, std::size_t a, std::size_t kind) const noexcept {
  float* const bound = level.bound[kind].data();
  const auto& line = level.line;
  const auto step = static_cast<float>(level.step);
  const auto fall = [&](std::size_t d, bool up) { return limit_m_[d][a][(up ? 0U : 1U) ^ kind] * step; };
  const std::size_t lanes = level.stride;
  const auto from_row = [lanes](float* to, const float* from, const float* link, float by) {
    for (std::size_t i = 0; i < lanes; ++i) {
      const float asked = link[i] > 0.0F ? from[i] - by : kNoBound;
      to[i] = std::max(to[i], asked);
    }
  };
  const int nx = line[0].count, ny = line[1].count, nz = line[2].count;
  for (int round = 0; round < kRounds; ++round) {
    for (int k = 0; k < nz; ++k) {
      for (int j = 0; j < ny; ++j) {
        float* row = bound + level.row(j, k);
        const float* link = level.weight[0].data() + level.row(j, k);
        for (int i = 1; i < nx; ++i) {
          if (link[i - 1] > 0.0F) row[i] = std::max(row[i], row[i - 1] - fall(0, true));
        }
        for (int i = nx - 2; i >= 0; --i) {
          if (link[i] > 0.0F) row[i] = std::max(row[i], row[i + 1] - fall(0, false));
        }
      }
    }
    const float *link_y = level.weight[1].data(), *link_z = level.weight[2].data();
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
  float furthest = 0.0F;
  for (const Pressed& p : pressed_) furthest = std::max(furthest, std::fabs(p.u[axis]));
  for (std::size_t kind = 0; kind < 2; ++kind) {
    const float sign = kind == 0 ? 1.0F : -1.0F;
    for (Level& level : levels_) level.bounded[kind] = false;
    const auto holds = [&](const Pressed& p) { return sign * p.normal[axis] > kAlong; };
    float most = kNoBound;
    for (const Pressed& p : pressed_) {
      if (holds(p)) most = std::max(most, sign * p.u[axis]);
    }
    if (most == kNoBound) continue;
    Index3 low{1 << 20, 1 << 20, 1 << 20}, high{-1, -1, -1};
    for (std::size_t l = 0; l < levels_.size(); ++l) {
      Level& level = levels_[l];
      Floats& bound = level.bound[kind];
      std::fill_n(bound.begin(), level.first_row() + level.floats() + kPad, kNoBound);
      level.bounded[kind] = true;
      if (l == 0) {
        for (const Pressed& p : pressed_) {
          if (!holds(p)) continue;
          float& at = bound[level.node(p.node[0], p.node[1], p.node[2])];
          at = std::max(at, sign * p.u[axis]);
          for (std::size_t d = 0; d < 3; ++d) {
            low[d] = std::min(low[d], p.node[d]);
            high[d] = std::max(high[d], p.node[d]);
          }
        }
      } else {
        const Level& fine = levels_[l - 1];
        const auto& line = fine.line;
        // Nodes of this level that are nodes of that.
        for (std::size_t d = 0; d < 3; ++d) {
          low[d] = level.line[d].count;
          high[d] = -1;
          for (int c = 0; c < level.line[d].count; ++c) {
            const int here = line[d].fine[index(c)];
            if (here < 0 || here >= line[d].count) continue;
            low[d] = std::min(low[d], c);
            high[d] = std::max(high[d], c);
          }
        }
        for (int k = low[2]; k <= high[2]; ++k) {
          for (int j = low[1]; j <= high[1]; ++j) {
            const float* from =
                fine.bound[kind].data() + fine.row(line[1].fine[index(j)], line[2].fine[index(k)]);
            float* to = bound.data() + level.row(j, k);
            for (int i = low[0]; i <= high[0]; ++i) to[i] = from[line[0].fine[index(i)]];
          }
        }
      }
      if (level.broken) {
        spread_round_gaps(level, a, kind);
      } else {
        spread_bounds(level, a, kind, low, high);
      }
    }
  }
}

}  // namespace voxel
