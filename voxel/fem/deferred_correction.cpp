// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/fem/deferred_correction.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace voxel {
namespace {

// Approximate least eigenvalue of K_links⁻¹·K_bricks (shear along (110)), bending excluded. The largest comes
// from largest_ratio().
constexpr double kLeastRatio = 0.5;
// Step as a fraction of the stability limit, and upper bound of the momentum. More momentum converges sooner
// for a held tool, but increases the error for a moving tool. With the optimal momentum tissue of ν 0.49
// oscillates.
constexpr double kBelowLimit = 0.6, kMostCarriedOn = 0.3;
// Progress of the rounds, by their largest error of a load (end_round()). An error below kGain times the
// least one so far is a gain. An error above kElsewhere times the least one shows that the tissue has moved,
// and damping and search start again. In each round without gain after the first kPatience, step and momentum
// are multiplied by kCalmer.
constexpr float kGain = 0.98F, kElsewhere = 2.0F, kCalmer = 0.9F;
constexpr int kPatience = 20;

// A row and its eight neighbour rows, [z][y], each with one more voxel at both ends.
constexpr std::size_t kStrideY = 40, kStrideZ = 3 * kStrideY, kOwn = kStrideZ + kStrideY + 1;
using Around = std::array<float, 3 * kStrideZ>;

RowId row_around(const Grid& grid, RowId row, std::size_t n) {
  return row - grid.row_z - 1 + static_cast<RowId>(n / 3) * grid.row_z + static_cast<RowId>(n % 3);
}

}  // namespace

BrickLoads::BrickLoads(const Lattice& lattice) : lattice_(lattice) {
  if (!lattice.has_bricks()) return;
  double ratio = 0.0;
  for (const LinkMaterial& m : lattice.materials()) {
    kind_.emplace_back();
    if (!m.bricks) continue;
    const BrickStiffness brick = brick_stiffness(m.young_Pa, m.poisson, lattice.spacing_m());
    const BrickStiffness links = link_cell_stiffness(m.young_Pa, m.poisson, lattice.spacing_m());
    const BrickStiffness beyond = difference(brick, links);
    kind_.back() = std::make_unique<Kind>(Kind{node_stencil(beyond), in_floats(beyond)});
    ratio = std::max(ratio, largest_ratio(brick, links));
  }
  // Richardson's iteration with momentum (Polyak 1964). The optimal momentum is ((√κ−1)/(√κ+1))².
  const double kappa = std::sqrt(std::max(ratio / kLeastRatio, 1.0)), best = (kappa - 1.0) / (kappa + 1.0);
  carry_on_ = static_cast<float>(std::min(best * best, kMostCarriedOn));
  share_ =
      static_cast<float>(std::min(1.0, kBelowLimit * 2.0 * (1.0 + static_cast<double>(carry_on_)) / ratio));
  for (auto& axis : step_) axis = LazyArray<float>(lattice.size());
  const std::size_t rows = lattice.grid().rows();
  mark_ = LazyArray<std::uint8_t>(rows);
  for (Rows* list : {&moved_, &due_, &retry_}) list->row = LazyArray<RowId>(rows);
}

void BrickLoads::look_at_all_of(const BrickLoads& other) noexcept {
  if (!any()) return;
  for (RowId row = 0; row < other.mark_.size(); ++row) {
    if ((other.mark_[row] & kEver) != 0) look_at(row);
  }
}

// Rows that moved, their neighbour rows, and rows that the last round changed become due.
bool BrickLoads::begin_round() noexcept {
  if (moved_.count + retry_.count == 0) return false;
  due_.count = next_ = 0;
  worst_N_ = 0.0F;
  for (std::size_t n = 0; n < retry_.count; ++n) {
    mark_[retry_.row[n]] &= static_cast<std::uint8_t>(~kAgain);
    put(due_, retry_.row[n], kDue);
  }
  retry_.count = 0;
  const Grid& grid = lattice_.grid();
  for (std::size_t n = 0; n < moved_.count; ++n) {
    const RowId row = moved_.row[n];
    mark_[row] &= static_cast<std::uint8_t>(~kMoved);
    for (std::size_t around = 0; around < 9; ++around) {
      const RowId beside = row_around(grid, row, around);
      for (const RowId r : {beside - grid.row_x, beside, beside + grid.row_x}) {
        if ((mark_[r] & kDue) == 0 && lattice_.filled_in(r) != 0) put(due_, r, kDue);
      }
    }
  }
  moved_.count = 0;
  return due_.count > 0;
}

// Damps the iteration while it makes no progress. With many links at their limits it does not converge: other
// links come to their limits in each round, and the loads change with them. A tool that is held still would
// feel a force that wanders sideways. So step and momentum shrink after kPatience rounds without progress,
// until the error grows by the factor kElsewhere.
void BrickLoads::end_round() noexcept {
  left_N_ = worst_N_;
  if (left_N_ < kGain * least_left_N_) {
    least_left_N_ = left_N_;
    without_gain_ = 0;
  } else if (left_N_ > kElsewhere * least_left_N_) {
    least_left_N_ = left_N_;
    without_gain_ = 0;
    calm_ = 1.0F;
  } else if (++without_gain_ > kPatience) {
    calm_ *= kCalmer;
  }
}

bool BrickLoads::renew_row(RowId row, Displacement& state) noexcept {
  std::array<Lanes, 3> wanted;
  if (!loads_of(row, state, wanted)) return false;
  float worst = 0.0F;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float* known = state.bricks.load[axis].data() + static_cast<std::size_t>(row) * kRow;
    for (std::size_t i = 0; i < kRow; ++i) worst = std::max(worst, std::fabs(wanted[axis][i] - known[i]));
  }
  worst_N_ = std::max(worst_N_, worst);
  const bool on_its_way = (mark_[row] & kStepped) != 0;
  if (worst <= least_N_) {
    // Clears the momentum, so that the next renewal starts without it.
    for (std::size_t axis = 0; axis < 3 && on_its_way; ++axis)
      std::fill_n(step_[axis].data() + static_cast<std::size_t>(row) * kRow, kRow, 0.0F);
    mark_[row] &= static_cast<std::uint8_t>(~kStepped);
    return false;
  }
  const float share = calm_ * share_, carry_on = calm_ * carry_on_;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    float* known = state.bricks.load[axis].data() + static_cast<std::size_t>(row) * kRow;
    float* step = step_[axis].data() + static_cast<std::size_t>(row) * kRow;
    for (std::size_t i = 0; i < kRow; ++i) {
      step[i] = share * (wanted[axis][i] - known[i]) + carry_on * step[i];
      known[i] += step[i];
    }
  }
  mark_[row] |= kStepped;
  state.bricks.row[row] = 1;
  mark_[row] |= kChanged;
  if ((mark_[row] & kAgain) == 0) put(retry_, row, kAgain);
  return true;
}

bool BrickLoads::loads_of(RowId row, const Displacement& state, std::array<Lanes, 3>& out) const noexcept {
  if (kind_.empty()) return false;
  const Grid& grid = lattice_.grid();
  const std::uint8_t label = lattice_.inside(row);
  const Kind* inside = label == 0 ? nullptr : kind_[lattice_.material(row * kRow)].get();
  if (label != 0 && inside == nullptr) return false;
  std::array<Around, 3> around;
  NodeField field{{}, kStrideY, kStrideZ};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float* u = state.u[axis].data();
    for (std::size_t n = 0; n < 9; ++n) {
      const VoxelId first = row_around(grid, row, n) * kRow;
      float* to = around[axis].data() + n / 3 * kStrideZ + n % 3 * kStrideY;
      to[0] = u[grid.down(first, 0)];
      std::copy_n(u + first, kRow, to + 1);
      to[kRow + 1] = u[grid.up(first + kRow - 1, 0)];
      std::fill(to + kRow + 2, to + kStrideY, 0.0F);
    }
    field.u[axis] = around[axis].data();
  }
  if (inside != nullptr) {
    row_forces(inside->inside, field, kOwn, kRow, {out[0].data(), out[1].data(), out[2].data()});
  } else {
    mixed_loads(row, field, out);
  }
  return true;
}

void BrickLoads::mixed_loads(RowId row, const NodeField& field, std::array<Lanes, 3>& out) const noexcept {
  const Grid& grid = lattice_.grid();
  std::array<Materials, 9> material;
  for (std::size_t n = 0; n < 9; ++n) {
    const VoxelId first = row_around(grid, row, n) * kRow;
    material[n][0] = lattice_.material(grid.down(first, 0));
    for (VoxelId i = 0; i < kRow; ++i) material[n][i + 1] = lattice_.material(first + i);
    material[n][kRow + 1] = lattice_.material(grid.up(first + kRow - 1, 0));
  }
  // Softest material of the four cells between slices x and x + 1, by cell = (above in y) + 2·(above in z); 0
  // if a voxel of the cell is missing.
  const auto cells_at = [&](std::size_t x) {
    std::array<std::uint8_t, 4> softest{};
    for (std::size_t cell = 0; cell < 4; ++cell) {
      const std::size_t low = (cell & 1) + 3 * (cell >> 1);
      std::uint8_t found = material[low][x];
      for (const std::size_t n : {low, low + 1, low + 3, low + 4}) {
        for (const std::size_t at : {x, x + 1})
          found = found == 0 || material[n][at] == 0 ? std::uint8_t{0} : softer(found, material[n][at]);
      }
      softest[cell] = found;
    }
    return softest;
  };
  // Cells are recomputed only where materials change along the row.
  std::array<std::uint8_t, kRow + 1> changes{};  // [x]: does slice x + 1 differ from slice x?
  for (const Materials& m : material) {
    for (std::size_t x = 0; x < changes.size(); ++x) changes[x] |= static_cast<std::uint8_t>(m[x] ^ m[x + 1]);
  }
  // Runs of nodes within one material use the vector kernel row_forces().
  const Kind* one = nullptr;
  std::size_t since = 0;
  const auto end_run = [&](std::size_t i) {
    if (one != nullptr)
      row_forces(one->inside, field, kOwn + since, i - since,
                 {out[0].data() + since, out[1].data() + since, out[2].data() + since});
    one = nullptr;
  };
  std::array<std::uint8_t, 4> before = cells_at(0);
  for (std::size_t i = 0; i < kRow; ++i) {
    const std::array<std::uint8_t, 4> after =
        changes[i] == 0 && changes[i + 1] == 0 ? before : cells_at(i + 1);
    const std::uint8_t first = before[0];
    const auto same = [first](std::uint8_t m) { return m == first; };
    const bool all_one =
        std::all_of(before.begin(), before.end(), same) && std::all_of(after.begin(), after.end(), same);
    const Kind* here = all_one && first != 0 ? kind_[first].get() : nullptr;
    if (here != one || here == nullptr) {
      end_run(i);
      one = here;
      since = i;
    }
    const std::array<std::uint8_t, 4> cells_before = std::exchange(before, after);
    if (here != nullptr) continue;
    std::array<const BrickFloats*, 8> bricks{};
    bool any = false;
    for (std::size_t octant = 0; octant < 8; ++octant) {
      const std::uint8_t m = ((octant & 1) != 0 ? after : cells_before)[octant >> 1];
      if (m == 0 || kind_[m] == nullptr) continue;
      bricks[octant] = &kind_[m]->brick;
      any = true;
    }
    const std::array<float, 3> load = any ? node_force(bricks, field, kOwn + i) : std::array<float, 3>{};
    for (std::size_t axis = 0; axis < 3; ++axis) out[axis][i] = load[axis];
  }
  end_run(kRow);
}

std::size_t BrickLoads::memory_bytes() const {
  return mark_.resident_bytes() + moved_.row.resident_bytes() + due_.row.resident_bytes() +
         retry_.row.resident_bytes() + 3 * step_[0].resident_bytes() + kind_.size() * sizeof(Kind);
}

}  // namespace voxel
