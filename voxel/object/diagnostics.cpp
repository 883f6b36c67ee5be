// SPDX-License-Identifier: GPL-3.0-or-later
// Energy, anchor force, settling and memory of a soft object. For tests, references and reports, not for the
// tick.
#include <algorithm>
#include <bit>
#include <glm/geometric.hpp>

#include "voxel/composite/grid.h"
#include "voxel/lattice/near_limit.h"
#include "voxel/lattice/plasticity.h"
#include "voxel/lattice/voxel_links.h"
#include "voxel/object/soft_object.h"

namespace voxel {

double SoftObject::energy_J() const noexcept {
  if (on_grid_) return grid_->energy_J();
  double energy = 0.0;
  std::array<Lanes, 3> bricks;
  for (RowId row = 0; row < lattice_->grid().rows(); ++row) {
    if (lattice_->filled_in(row) == 0) continue;
    if (relaxation_.multigrid().bricks().loads_of(row, state_, bricks)) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float* u = state_.u[axis].data() + static_cast<std::size_t>(row) * kRow;
        for (std::size_t i = 0; i < kRow; ++i)
          energy -= 0.5 * static_cast<double>(bricks[axis][i]) * static_cast<double>(u[i]);
      }
    }
    for (VoxelId v = row * kRow; v < (row + 1) * kRow; ++v) {
      if (!lattice_->filled(v)) continue;
      for (int d = 0; d < 3; ++d) {
        const VoxelId w = lattice_->up(v, d);
        if (!lattice_->filled(w)) continue;
        const Spring spring = lattice_->spring(v, d);
        for (int axis = 0; axis < 3; ++axis) {
          const auto& u = state_.u[static_cast<std::size_t>(axis)];
          const double stretch = static_cast<double>(u[w]) - static_cast<double>(u[v]);
          energy += link_energy_J(static_cast<double>(spring.on(axis, d)), stretch,
                                  static_cast<double>(state_.plastic.offset_of(
                                      v, static_cast<std::size_t>(d), static_cast<std::size_t>(axis))),
                                  static_cast<double>(lattice_->yield_m(v, d)));
        }
      }
    }
  }
  return energy;
}

std::optional<glm::dvec3> SoftObject::carried_by_anchors_N() const noexcept {
  if (on_grid_) return std::nullopt;  // patches find this force by balance, so it would equal the felt one
  const float tight_m = kAtLimit * static_cast<float>(lattice_->min_spacing_m());
  glm::dvec3 carried(0.0);
  for (RowId row = 0; row < lattice_->grid().rows(); ++row) {
    for (std::uint32_t lanes = lattice_->anchored_lanes(row); lanes != 0; lanes &= lanes - 1) {
      const VoxelId v = row * kRow + static_cast<VoxelId>(std::countr_zero(lanes));
      for (int d = 0; d < 3; ++d) {
        for (const bool up : {false, true}) {
          const VoxelId w = up ? lattice_->up(v, d) : lattice_->down(v, d);
          if (!lattice_->filled(w) || lattice_->anchored(w)) continue;
          const VoxelId from = up ? v : w;
          const Spring spring = lattice_->spring(from, d);
          for (int axis = 0; axis < 3; ++axis) {
            const float u = state_.u[static_cast<std::size_t>(axis)][w], longer = up ? u : -u;
            const auto bounds = lattice_->bounds(from, d, axis);
            if (longer < bounds[0] + tight_m || longer > bounds[1] - tight_m) return std::nullopt;
            carried[axis] += static_cast<double>(spring.on(axis, d)) * static_cast<double>(u);
          }
        }
      }
    }
  }
  return carried;
}

bool SoftObject::settle(const ToolInBody& tool, double tolerance_N, int max_cycles) noexcept {
  for (int n = 0; n < max_cycles; ++n) {
    push_out(tool);
    relax_near(tool, 4);
    relaxation_.wake();
    relax_cycle();
    double worst = relaxation_.residual_N();
    for (const Touch& t : touches_) {
      if (lattice_->anchored(t.v) || t.block != 0) continue;
      glm::dvec3 left = link_force(relaxation_.couplings(), state_, t.v);
      if (t.pressed) left -= std::min(0.0, glm::dot(left, t.normal)) * t.normal;
      worst = std::max(worst, glm::length(left));
    }
    if (worst < tolerance_N) return true;
  }
  return false;
}

std::size_t SoftObject::memory_bytes() const {
  std::size_t state = state_.bricks.memory_bytes() + state_.role.resident_bytes() +
                      state_.row_standing.resident_bytes() + state_.row_obstacles.resident_bytes() +
                      state_.plastic.memory_bytes() + state_.tool_normal.resident_bytes();
  for (const auto& axis : state_.u) state += axis.resident_bytes();
  const std::size_t contact =
      resident_bytes(touches_) + resident_bytes(touched_before_) + resident_bytes(pressed_last_) +
      resident_bytes(touched_voxels_) + resident_bytes(touched_numbers_) + resident_bytes(claimed_voxels_) +
      resident_bytes(held_voxels_) + resident_bytes(sources_) + resident_bytes(moves_) +
      resident_bytes(limit_sources_) + resident_bytes(gathered_) + resident_bytes(dependents_) +
      gathered_mark_.resident_bytes() + gathered_index_.resident_bytes() + limit_reactions_.memory_bytes() +
      limit_followers_.memory_bytes();
  const std::size_t others = pair_claims_.resident_bytes() + pair_load_.resident_bytes() +
                             resident_bytes(pair_sources_) + resident_bytes(pair_dependents_) +
                             pair_entry_.resident_bytes() + resident_bytes(obstacles_) +
                             resident_bytes(moved_rows_) + row_moved_.resident_bytes() +
                             resident_bytes(changed_obstacles_) + resident_bytes(obstacle_changed_);
  return sizeof(*this) + lattice_->memory_bytes() + state + contact + others + chain_.memory_bytes() +
         relaxation_.memory_bytes() + (grid_ ? grid_->memory_bytes() : 0);
}

}  // namespace voxel
