// SPDX-License-Identifier: GPL-3.0-or-later
// Links of a composite grid that bounds of its nodes do not hold.
//
// In a body of one tissue bounds are enough (grid.h). Where a soft tissue lies between stiffer ones
// it would be squeezed beyond its limits while these hardly yield: what a link then carries over and above
// its spring has to be known, link by link. It is known as a stiffness: a link beyond its limit is taken to
// be that much stiffer, cycle by cycle, until it is at its limit, and one that is within it again softens
// until it is its spring alone. At rest that is the multiplier of the limit (u is the least of the energy
// within limits: force along the link, only at its limit, and never the other way), and since all that is
// asked of a level is what its links are worth, cycles stay what they are. What the springs store does not
// count it.
#include <algorithm>

#include "voxel/composite/grid.h"
#include "voxel/composite/row_kernels.h"

namespace voxel {
namespace {

constexpr float kMaxFactor = 1e3F;
constexpr float kTolerance = 2e-3F;  // of a limit

std::size_t index(int i) {
  return static_cast<std::size_t>(i);
}

}  // namespace

composite::LinkMultiplier CompositeGrid::link_multiplier(const Level& level, std::size_t a, std::size_t d) const noexcept {
  const auto step = static_cast<float>(level.step);
  return {1.0F / (step * limit_m_[d][a][1]), 1.0F / (step * limit_m_[d][a][0]), kTolerance, kMaxFactor};
}

// After a cycle.
void CompositeGrid::update_multipliers(std::size_t a) noexcept {
  if (!cells_.several()) return;
  if (!multipliers_active_[a]) {
    float most = 0.0F;
    for (std::size_t l = 0; l <= covering_level_; ++l) {
      const Level& level = levels_[l];
      const std::size_t from = level.first_row();
      for (std::size_t d = 0; d < 3; ++d) {
        most =
            std::max(most, composite::largest_limit_ratio(level.u[a].data() + from, level.weight[d].data() + from,
                                                    level.by(d), link_multiplier(level, a, d), level.floats()));
      }
    }
    if (most <= 1.0F + kTolerance) return;
    multipliers_active_[a] = true;
    for (Level& level : levels_) {
      for (std::size_t d = 0; d < 3; ++d) {
        std::copy(level.weight[d].begin(), level.weight[d].end(), level.link[a][d].begin());
        std::copy(level.hold[d].begin(), level.hold[d].end(), level.held_link[a][d].begin());
      }
    }
  }
  float most = 0.0F;
  for (std::size_t l = 0; l <= covering_level_; ++l) {
    Level& level = levels_[l];
    const std::size_t from = level.first_row();
    for (std::size_t d = 0; d < 3; ++d) {
      const composite::LinkMultiplier limit = link_multiplier(level, a, d);
      most = std::max(
          most, composite::update_row_weights(level.u[a].data() + from, level.weight[d].data() + from, level.by(d),
                                         limit, level.link[a][d].data() + from, level.floats()));
      most = std::max(most, update_anchor_multipliers(level, a, d));
    }
  }
  if (most > 1.0F) {
    for (std::size_t l = 1; l < levels_.size(); ++l) restrict_multipliers(l, a);
  } else {
    multipliers_active_[a] = false;
  }
  for (Level& level : levels_) update_diagonal(level, a);
}

// Links to anchors, likewise.
float CompositeGrid::update_anchor_multipliers(Level& level, std::size_t a, std::size_t d) noexcept {
  float most = 1.0F;
  if (!level.holds) return most;
  const std::size_t from = level.first_row(), end = from + level.floats();
  const float *const hold = level.hold[d].data(), *const reach = level.reach[d].data();
  const float* const u = level.u[a].data();
  float* const held = level.held_link[a][d].data();
  for (std::size_t n = from; n < end; ++n) {
    if (hold[n] == 0.0F) continue;
    // Longer by −u where the anchor is ahead.
    const float longer = -u[n] / reach[n];
    const float of_limit = std::max(longer / limit_m_[d][a][1], -longer / limit_m_[d][a][0]);
    held[n] = composite::updated_weight(held[n], hold[n], of_limit, link_multiplier(level, a, d));
    most = std::max(most, held[n] / hold[n]);
  }
  return most;
}

// Under a finer level, what its two links on the way are worth one after the other.
void CompositeGrid::restrict_multipliers(std::size_t l, std::size_t a) noexcept {
  const Level& fine = levels_[l - 1];
  Level& coarse = levels_[l];
  const auto& line = fine.line;
  const auto within = [&](std::size_t d, int c) {
    const int here = line[d].fine[index(c)];
    return here >= 0 && here < line[d].count;
  };
  for (int k = line[2].coarse_first; k <= line[2].coarse_last; ++k) {
    for (int j = line[1].coarse_first; j <= line[1].coarse_last; ++j) {
      for (int i = line[0].coarse_first; i <= line[0].coarse_last; ++i) {
        const Index3 c{i, j, k};
        if (!within(0, i) || !within(1, j) || !within(2, k)) continue;
        const std::size_t at =
            fine.node(line[0].fine[index(i)], line[1].fine[index(j)], line[2].fine[index(k)]);
        const std::size_t here = coarse.node(i, j, k);
        for (std::size_t d = 0; d < 3; ++d) {
          if (line[d].fine[index(c[d])] + 2 >= line[d].count) continue;
          const std::size_t next = at + fine.by(d);
          const float one = fine.weight[d][at], other = fine.weight[d][next];
          const float one_held = fine.link[a][d][at], other_held = fine.link[a][d][next];
          if (one <= 0.0F || other <= 0.0F) continue;
          const float stiffer = (1.0F / one + 1.0F / other) / (1.0F / one_held + 1.0F / other_held);
          coarse.link[a][d][here] = stiffer * coarse.weight[d][here];
        }
      }
    }
  }
}

// What all links of a node are worth on an axis.
void CompositeGrid::update_diagonal(Level& level, std::size_t a) const noexcept {
  const auto& line = level.line;
  const auto& link = weights_on(level, a);
  const auto& hold = anchor_weights_on(level, a);
  const float sx = spring_N_per_m_[0][a], sy = spring_N_per_m_[1][a], sz = spring_N_per_m_[2][a];
  for (int k = line[2].first; k <= line[2].last; ++k) {
    for (int j = line[1].first; j <= line[1].last; ++j) {
      const std::size_t row = level.row(j, k);
      const float *const x = link[0].data() + row, *const y = link[1].data() + row,
                         *const z = link[2].data() + row;
      const float *const back_x = x - 1, *const back_y = y - level.stride, *const back_z = z - level.plane;
      const float *const hx = hold[0].data() + row, *const hy = hold[1].data() + row,
                         *const hz = hold[2].data() + row;
      float *const all = level.all[a].data() + row, *const inverse = level.inverse[a].data() + row;
      for (int i = line[0].first; i <= line[0].last; ++i) {
        const float sum = sx * (x[i] + back_x[i] + hx[i]) + sy * (y[i] + back_y[i] + hy[i]) +
                          sz * (z[i] + back_z[i] + hz[i]);
        const bool moves = inverse[i] > 0.0F;
        all[i] = moves ? sum : all[i];
        inverse[i] = moves ? 1.0F / sum : 0.0F;
      }
    }
  }
}

// Of a contact that is over.
void CompositeGrid::release_multipliers() noexcept {
  for (std::size_t a = 0; a < 3; ++a) {
    if (!multipliers_active_[a]) continue;
    multipliers_active_[a] = false;
    for (Level& level : levels_) update_diagonal(level, a);
  }
}

// Of a level whose box moves: how many times stiffer its links are, into before_move_.
void CompositeGrid::save_multipliers(const Level& level) noexcept {
  for (std::size_t a = 0; a < 3; ++a) {
    if (!multipliers_active_[a]) continue;
    for (std::size_t d = 0; d < 3; ++d) {
      const auto keep = [](const Floats& held, const Floats& link, Floats& to) {
        for (std::size_t n = 0; n < held.size(); ++n) to[n] = link[n] > 0.0F ? held[n] / link[n] : 1.0F;
      };
      keep(level.link[a][d], level.weight[d], before_move_.link[a][d]);
      keep(level.held_link[a][d], level.hold[d], before_move_.held_link[a][d]);
    }
  }
}

// … and in the box where it is now, `by` nodes further on.
void CompositeGrid::restore_multipliers(Level& level, const Index3& by) noexcept {
  const auto& line = level.line;
  for (std::size_t a = 0; a < 3; ++a) {
    if (!multipliers_active_[a]) continue;
    for (std::size_t d = 0; d < 3; ++d) {
      std::copy(level.weight[d].begin(), level.weight[d].end(), level.link[a][d].begin());
      std::copy(level.hold[d].begin(), level.hold[d].end(), level.held_link[a][d].begin());
    }
    for (int k = 0; k < line[2].count; ++k) {
      for (int j = 0; j < line[1].count; ++j) {
        for (int i = 0; i < line[0].count; ++i) {
          const Index3 was{i + by[0], j + by[1], k + by[2]};
          bool known = true;
          for (std::size_t d = 0; d < 3; ++d) known = known && was[d] >= 0 && was[d] < before_move_.line[d].count;
          if (!known) continue;
          const std::size_t to = level.node(i, j, k), from = before_move_.node(was[0], was[1], was[2]);
          for (std::size_t d = 0; d < 3; ++d) {
            level.link[a][d][to] *= before_move_.link[a][d][from];
            level.held_link[a][d][to] *= before_move_.held_link[a][d][from];
          }
        }
      }
    }
    update_diagonal(level, a);
  }
}

}  // namespace voxel
