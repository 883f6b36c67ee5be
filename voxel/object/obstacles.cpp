// SPDX-License-Identifier: GPL-3.0-or-later
// Rigid surfaces and other soft objects at a soft object: obstacles, claimed voxels, and moves of the pair
// solver.
#include <algorithm>
#include <glm/geometric.hpp>
#include <limits>

#include "voxel/composite/grid.h"
#include "voxel/lattice/voxel_links.h"
#include "voxel/object/soft_object.h"

namespace voxel {

void SoftObject::set_obstacle(std::size_t surface_number, const Obstacle& obstacle) noexcept {
  const VoxelId v = lattice_->surface()[surface_number];
  Obstacle& o = obstacles_[surface_number];
  moving_obstacles_ = moving_obstacles_ + (obstacle.moving ? 1 : 0) - (o.moving ? 1 : 0);
  o = obstacle;
  if (grid_ && obstacle.normal != glm::vec3(0.0F))
    grid_->add_obstacle(static_cast<std::uint32_t>(surface_number));
  if (!obstacle_changed_.empty() && obstacle_changed_[surface_number] == 0) {
    obstacle_changed_[surface_number] = 1;
    changed_obstacles_.push_back(static_cast<std::uint32_t>(surface_number));
  }
  const std::uint8_t role = state_.role[v];
  if ((Displacement::stands(role) && !Displacement::in_block(role)) || lattice_->anchored(v)) return;
  state_.set_role(v, resting_role(v));
}

void SoftObject::leave_obstacles(std::span<const std::uint32_t> surface_numbers) noexcept {
  sources_.clear();
  moves_.clear();
  for (const std::uint32_t s : surface_numbers) {
    const VoxelId v = lattice_->surface()[s];
    const Obstacle& o = obstacles_[s];
    const glm::dvec3 n(o.normal), before = state_.at(v);
    const double depth = static_cast<double>(o.bound) - glm::dot(n, before);
    if (!(depth > 0.0) || lattice_->anchored(v)) continue;
    state_.set(v, before + depth * n);
    sources_.push_back(v);
    moves_.emplace_back(state_.at(v) - before);
  }
  if (!sources_.empty()) settle_chain();
}

void SoftObject::mark_dirty(std::size_t surface_number) noexcept {
  relaxation_.mark_dirty(lattice_->surface()[surface_number] / kRow);
  relaxation_.wake();
}

void SoftObject::reserve_obstacles() {
  obstacles_.resize(lattice_->surface().size());
  moved_rows_.reserve(kMostMovedRows);
  row_moved_ = LazyArray<std::uint8_t>(lattice_->grid().rows());
  if (grid_) grid_->watch_obstacles(obstacles_);
}

void SoftObject::prepare_beside_bodies() {
  beside_bodies_ = true;
  if (lattice_->voxel_count() < kPreparedWhole) relaxation_.prepare_beside_bodies();
}

void SoftObject::claim(VoxelId v) noexcept {
  const std::uint32_t s = lattice_->surface_number(v);
  if (pair_claims_[s] == std::numeric_limits<std::uint16_t>::max() || pair_claims_[s]++ != 0) return;
  claimed_voxels_.push_back(v);
  state_.set_role(v, Displacement::held);
}

void SoftObject::release(VoxelId v) noexcept {
  const std::uint32_t s = lattice_->surface_number(v);
  if (pair_claims_[s] == 0 || --pair_claims_[s] != 0) return;
  pair_load_[s] = glm::vec3(0.0F);
  const auto found = std::find(claimed_voxels_.begin(), claimed_voxels_.end(), v);
  *found = claimed_voxels_.back();
  claimed_voxels_.pop_back();
  relaxation_.mark_dirty(v / kRow);
  relaxation_.wake();
  state_.set_role(v, resting_role(v));
  set_touch_roles();
}

glm::dvec3 SoftObject::unconstrained_minimum(VoxelId v) noexcept {
  return voxel::unconstrained_minimum(relaxation_.couplings(), state_, v);
}

glm::dvec3 SoftObject::compliance(VoxelId v) noexcept {
  return link_compliance(relaxation_.couplings(), v);
}

void SoftObject::move(VoxelId v, const glm::dvec3& displacement) noexcept {
  if (lattice_->anchored(v)) return;
  moved_ever_ = true;
  const glm::dvec3 before = state_.at(v);
  state_.set(v, clamp_to_links(*lattice_, state_, v, displacement));
  relaxation_.multigrid().log().note(0, v / kRow);
  if (glm::distance(before, state_.at(v)) <= kDirtyMotion * lattice_->min_spacing_m()) return;
  relaxation_.wake();
  relaxation_.mark_dirty(v / kRow);
}

void SoftObject::drag(VoxelId v, const glm::dvec3& by) noexcept {
  if (lattice_->anchored(v)) return;
  if (!dragging_) {
    sources_.clear();
    moves_.clear();
    dragging_ = true;
  }
  if (gathered_mark_[v] == 0) {
    gathered_mark_[v] = 1;
    sources_.push_back(v);
    moves_.emplace_back(state_.at(v));
  }
  state_.set(v, state_.at(v) + by);
}

void SoftObject::settle_dragged() noexcept {
  if (!dragging_) return;
  dragging_ = false;
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    gathered_mark_[sources_[i]] = 0;
    moves_[i] = glm::vec3(state_.at(sources_[i])) - moves_[i];
  }
  settle_chain();
}

}  // namespace voxel
