// SPDX-License-Identifier: GPL-3.0-or-later
// One cycle over the levels of a composite grid, axis by axis.
#include <algorithm>

#include "voxel/composite/grid.h"
#include "voxel/composite/row_kernels.h"
#include "voxel/composite/transfer.h"

namespace voxel {
namespace {

constexpr int kCoarsestSweeps = 10;       // of the coarsest level
constexpr std::size_t kMaxAcross = 640;  // nodes of a row, one further on either side

std::size_t index(int i) {
  return static_cast<std::size_t>(i);
}

}  // namespace

composite::LevelView CompositeGrid::view(std::size_t l, std::size_t axis) noexcept {
  Level& level = levels_[l];
  const std::size_t from = level.first_row();
  composite::LevelView v{};
  v.u = level.u[axis].data() + from;
  v.f = l == 0 ? nullptr : level.f.data() + from;
  v.least = level.bounded[0] ? level.bound[0].data() + from : nullptr;
  v.most_negative = level.bounded[1] ? level.bound[1].data() + from : nullptr;
  v.residual = level.residual.data() + from;
  v.is_free = level.is_free.data() + from;
  v.is_active = level.is_active.data() + from;
  v.active_stiffness = level.active_stiffness.data() + from;
  v.inverse_with_active = level.has_active_stiffness ? level.inverse_with_active.data() + from : nullptr;
  for (std::size_t d = 0; d < 3; ++d) {
    v.link[d] = weights_on(level, axis)[d].data() + from;
    v.spring[d] = spring_N_per_m_[d][axis];
    v.first[d] = level.line[d].first;
    v.last[d] = level.line[d].last;
  }
  v.inverse = level.inverse[axis].data() + from;
  v.all = level.all[axis].data() + from;
  v.stride = level.stride;
  v.plane = level.plane;
  return v;
}

// Under a finer level a level has what that has.
void CompositeGrid::inject_from_finer(std::size_t l, std::size_t a) noexcept {
  const Level& fine = levels_[l - 1];
  Level& coarse = levels_[l];
  const auto& line = fine.line;
  // One that stands beyond the last node of the finer level has what that has.
  const auto nearest = [&](std::size_t d, int c) {
    return index(std::clamp(line[d].fine[index(c)], 0, line[d].count - 1));
  };
  for (int k = line[2].coarse_first; k <= line[2].coarse_last; ++k) {
    for (int j = line[1].coarse_first; j <= line[1].coarse_last; ++j) {
      const float* from =
          fine.u[a].data() + fine.row(static_cast<int>(nearest(1, j)), static_cast<int>(nearest(2, k)));
      float* to = coarse.u[a].data() + coarse.row(j, k);
      for (int i = line[0].coarse_first; i <= line[0].coarse_last; ++i) to[i] = from[nearest(0, i)];
    }
  }
  spread_to_ghosts(coarse, coarse.u[a].data());
}

// Under a level the next one has what it has, and loads with which it is as far from rest.
void CompositeGrid::restrict_residual(std::size_t l, std::size_t a) noexcept {
  Level& fine = levels_[l];
  Level& coarse = levels_[l + 1];
  const auto& line = fine.line;
  Index3 first{}, last{};
  for (std::size_t d = 0; d < 3; ++d) {
    first[d] = line[d].coarse_first;
    last[d] = line[d].coarse_last;
  }
  const composite::LevelView here = view(l, a);
  composite::residual_of_level(here);
  // Boxes end where something else is known of: what is stuck there is stuck here.
  const bool any_active = fine.bounded[0] || fine.bounded[1] || fine.has_active_stiffness;
  if (any_active) {
    if (!fine.has_active_stiffness) std::fill(fine.active_stiffness.begin(), fine.active_stiffness.end(), 0.0F);
    add_active_stiffness(l, a);
    composite::find_active_stiffness(here);
  }
  inject_from_finer(l + 1, a);
  const std::size_t begin = coarse.first_row(), floats = coarse.floats();
  std::fill_n(coarse.f.begin() + static_cast<std::ptrdiff_t>(begin), floats, 0.0F);
  composite::link_forces_of_level(view(l + 1, a), first, last);
  restrict_values(coarse, fine, a, fine.residual.data(), coarse.f.data());
  for (int k = first[2]; k <= last[2]; ++k) {
    for (int j = first[1]; j <= last[1]; ++j) {
      float* f = coarse.f.data() + coarse.row(j, k);
      const float* links = coarse.residual.data() + coarse.row(j, k);
      for (int i = first[0]; i <= last[0]; ++i) f[i] -= links[i];
    }
  }
  coarse.has_active_stiffness = any_active;
  if (any_active) {
    std::fill_n(coarse.active_stiffness.begin() + static_cast<std::ptrdiff_t>(begin), floats, 0.0F);
    restrict_values(coarse, fine, a, fine.active_stiffness.data(), coarse.active_stiffness.data());
  }
  std::copy_n(coarse.u[a].begin() + static_cast<std::ptrdiff_t>(begin), floats,
              coarse.old.begin() + static_cast<std::ptrdiff_t>(begin));
}

// What nodes of a level carry, shared by those of the next as these are interpolated.
void CompositeGrid::restrict_values(Level& coarse, const Level& fine, std::size_t axis, const float* from,
                                float* to) const noexcept {
  if (cells_.several()) return restrict_by_links(coarse, fine, axis, from, to);
  const auto& line = fine.line;
  Index3 first{}, last{};
  for (std::size_t d = 0; d < 3; ++d) {
    first[d] = line[d].coarse_first;
    last[d] = line[d].coarse_last;
  }
  for (int k = first[2]; k <= last[2]; ++k) {
    const int fk = line[2].fine[index(k)];
    const std::array<float, 3> wk{line[2].from_low[index(k)], line[2].from_own[index(k)],
                                  line[2].from_high[index(k)]};
    for (int j = first[1]; j <= last[1]; ++j) {
      const int fj = line[1].fine[index(j)];
      const std::array<float, 3> wj{line[1].from_low[index(j)], line[1].from_own[index(j)],
                                    line[1].from_high[index(j)]};
      std::array<float, kMaxAcross + 2> sum;
      const std::size_t lanes = fine.stride;
      std::fill_n(sum.begin(), lanes + 3, 0.0F);
      for (int dk = -1; dk <= 1; ++dk) {
        for (int dj = -1; dj <= 1; ++dj) {
          const float w = wk[index(dk + 1)] * wj[index(dj + 1)];
          if (w == 0.0F) continue;
          const float* row = from + fine.row(fj + dj, fk + dk);
          for (std::size_t i = 0; i < lanes; ++i) sum[i + 1] += w * row[i];
        }
      }
      float* f = to + coarse.row(j, k);
      for (int i = first[0]; i <= last[0]; ++i) {
        const int at = line[0].fine[index(i)] + 1;  // 0: one before the first
        float all =
            line[0].from_own[index(i)] * sum[index(at)] + line[0].from_high[index(i)] * sum[index(at + 1)];
        if (at > 0) all += line[0].from_low[index(i)] * sum[index(at - 1)];
        f[i] = all;
      }
    }
  }
  gather_from_ghosts(coarse, to);
}

// What is stuck holds what follows the next level, and that level knows nothing of it but by this: what moves
// with a node there, and is tied to something stuck, drags at it. (Without it a coarse level moved a contact
// as a whole that no node of its own was in, and for ever to and fro.)
void CompositeGrid::add_active_stiffness(std::size_t l, std::size_t a) noexcept {
  Level& level = levels_[l];
  if (!level.has_active_stiffness) return;
  composite::add_active_stiffness(view(l, a), level.f.data() + level.first_row());
}

// A row of a level, as the next coarser one has it in `from`.
void CompositeGrid::prolong_row(Level& fine, const Level& coarse, std::size_t axis, const float* from, int j,
                             int k, bool adds) const noexcept {
  const auto& line = fine.line;
  composite::ProlongArgs t{};
  const std::size_t row = fine.row(j, k);
  t.odd = line[0].odd;
  t.along = line[0].along.data();
  t.least = fine.bounded[0] ? fine.bound[0].data() + row : nullptr;
  t.most_negative = fine.bounded[1] ? fine.bound[1].data() + row : nullptr;
  t.is_free = fine.is_free.data() + row;
  t.u = fine.u[axis].data() + row;
  t.octets = static_cast<int>(fine.stride / 8);
  t.adds = adds;
  if (cells_.several()) return prolong_row_by_links(t, fine, coarse, axis, from, j, k);
  for (int corner = 0; corner < 4; ++corner) {
    const int dj = corner & 1, dk = corner >> 1;
    const float pj = line[1].part[index(j)], pk = line[2].part[index(k)];
    const float w = (dj != 0 ? pj : 1.0F - pj) * (dk != 0 ? pk : 1.0F - pk);
    if (w == 0.0F) continue;
    t.weights[index(t.count)] = w;
    t.rows[index(t.count++)] =
        from + coarse.row(line[1].coarse[index(j)] + dj, line[2].coarse[index(k)] + dk) + line[0].base;
  }
  composite::prolong_row(t);
}

// What the next level did, a level does as well; and the sides of its box, where that ends within the object,
// are where the next level has them.
void CompositeGrid::prolong(std::size_t l, std::size_t a) noexcept {
  Level& fine = levels_[l];
  Level& coarse = levels_[l + 1];
  const auto& line = fine.line;
  spread_to_ghosts(coarse, coarse.u[a].data());
  float* const change = coarse.old.data();
  const float* const now = coarse.u[a].data();
  const std::size_t begin = coarse.first_row(), end = begin + coarse.floats();
  for (std::size_t n = begin; n < end; ++n) change[n] = now[n] - change[n];
  for (int k = 0; k < line[2].count; ++k) {
    const bool side_k = k < line[2].first || k > line[2].last;
    for (int j = 0; j < line[1].count; ++j) {
      const bool side = side_k || j < line[1].first || j > line[1].last;
      prolong_row(fine, coarse, a, side ? now : change, j, k, !side);
      for (const bool high : {false, true}) {
        if (side || !(high ? line[0].open_high : line[0].open_low)) continue;
        const int i = high ? line[0].count - 1 : 0;
        // At its ends along x a box has nodes of the next level.
        const auto prolonged = [&] {
          if (cells_.several()) return prolonged_by_links(fine, coarse, a, now, i, j, k);
          const float pj = line[1].part[index(j)], pk = line[2].part[index(k)];
          const std::size_t at =
              coarse.node(line[0].coarse[index(i)], line[1].coarse[index(j)], line[2].coarse[index(k)]);
          const std::size_t by_j = pj != 0.0F ? coarse.stride : 0, by_k = pk != 0.0F ? coarse.plane : 0;
          return (1.0F - pk) * ((1.0F - pj) * now[at] + pj * now[at + by_j]) +
                 pk * ((1.0F - pj) * now[at + by_k] + pj * now[at + by_j + by_k]);
        };
        float u = prolonged();
        const std::size_t here = fine.node(i, j, k);
        if (fine.bounded[0]) u = std::max(u, fine.bound[0][here]);
        if (fine.bounded[1]) u = std::min(u, -fine.bound[1][here]);
        fine.u[a][here] = u;
      }
    }
  }
}

void CompositeGrid::cycle(const std::array<bool, 3>& axes) noexcept {
  work_ = 0;
  const std::size_t last = levels_.size() - 1;
  for (std::size_t a = 0; a < 3; ++a) {
    if (!axes[a]) continue;
    find_bounds(a);
    const auto bound = [](Level& level, std::size_t kind) {
      return level.bounded[kind] ? level.bound[kind].data() + level.first_row() : nullptr;
    };
    for (Level& level : levels_) {
      if (!level.bounded[0] && !level.bounded[1]) continue;
      composite::follow_bounds(level.u[a].data() + level.first_row(),
                               level.held[a].data() + level.first_row(), bound(level, 0), bound(level, 1),
                               level.floats());
    }
    const auto smooth = [this, a](std::size_t l) {
      composite::smooth_level(view(l, a));
      work_ += levels_[l].floats() / 8;
    };
    // Nothing is smoothed on the way down: from far away, as when a tool jumps, a level that follows its
    // bounds alone pulls the coarser ones beyond where they belong.
    levels_[0].has_active_stiffness = false;
    for (std::size_t l = 0; l < last; ++l) restrict_residual(l, a);
    add_active_stiffness(last, a);
    for (int n = 0; n < kCoarsestSweeps; ++n) smooth(last);
    for (std::size_t l = last; l-- > 0;) {
      // Beside links at their limits a correction may go further than its energy asks. (Without this cycles
      // over lumps of 200 : 1 that were squeezed went away from rest, skin on fat near its chain's end too.)
      if (multipliers_active_[a]) {
        Level& level = levels_[l];
        std::copy(level.u[a].begin(), level.u[a].end(), level.residual.begin());
        prolong(l, a);
        composite::shorten_correction(view(l, a), level.residual.data() + level.first_row());
      } else {
        prolong(l, a);
      }
      smooth(l);
      // Twice where the contact is. (Once, at some depths a contact was let go of and pressed in turns for
      // ever, with a tenth of its force.)
      if (l <= 1) smooth(l);
    }
    for (Level& level : levels_) {
      composite::note_at_bound(level.held[a].data() + level.first_row(), level.u[a].data() + level.first_row(),
                           bound(level, 0), bound(level, 1), level.floats());
    }
    spread_to_ghosts(levels_[0], levels_[0].u[a].data());
    fit_far_field(a);
    update_multipliers(a);
  }
  patch_moved_ = false;
}

}  // namespace voxel
