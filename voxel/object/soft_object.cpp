// SPDX-License-Identifier: GPL-3.0-or-later
// Construction and copy of a soft object, its touched voxels and their roles, and the chain that follows
// them.
#include "voxel/object/soft_object.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "voxel/composite/grid.h"
#include "voxel/lattice/voxel_links.h"

namespace voxel {
namespace {

// Counted work of one row that a wave of the chain visits. A tick has up to eight waves. They count as work,
// as contact cycles do.
constexpr std::size_t kWorkOfVisit = 4;

}  // namespace

SoftObject::SoftObject(std::shared_ptr<const Lattice> lattice, Tables tables)
    : lattice_(std::move(lattice)),
      state_(*lattice_),
      chain_(*lattice_),
      relaxation_(*lattice_),
      pair_claims_(lattice_->surface().size()),
      pair_load_(lattice_->surface().size()),
      pair_entry_(lattice_->surface().size()),
      limit_reactions_(*lattice_),
      limit_followers_(*lattice_, kMaxTouched),
      gathered_mark_(lattice_->size()),
      gathered_index_(lattice_->size()) {
  const auto surface = lattice_->surface();
  touches_.reserve(kMaxTouched);
  pressed_last_.reserve(kMaxTouched);
  touched_before_.reserve(kMaxTouched);
  touched_voxels_.reserve(kMaxTouched);
  touched_numbers_.reserve(kMaxTouched);
  sources_.reserve(surface.size());
  moves_.reserve(surface.size());
  claimed_voxels_.reserve(surface.size());
  held_voxels_.reserve(surface.size() + kMaxTouched);
  pair_sources_.reserve(kMaxTouched);
  pair_dependents_.reserve(kMaxTouched);
  limit_sources_.reserve(kMaxTouched);
  gathered_.reserve(kMaxGathered + kMaxTouched);
  dependents_.reserve(kMaxGathered + kMaxTouched);
  if (lattice_->block_count() > 0) {
    block_bounds_.reserve(2 * kMaxTouched);
    bound_touch_.reserve(kMaxTouched);
    block_seen_.resize(lattice_->block_count());
  }
  if (tables == Tables::whole && lattice_->voxel_count() < kPreparedWhole) {
    state_.populate(relaxation_.couplings().rows_in_use());
    pair_claims_.populate();
    chain_.prepare_all();
    relaxation_.prepare_all();
  }
}

SoftObject::~SoftObject() = default;

void SoftObject::set_own_work_share(double share) noexcept {
  own_work_share_ = share;
  set_work_share(1.0);
}

std::unique_ptr<SoftObject> SoftObject::copy(Tables tables) const {
  auto result = std::make_unique<SoftObject>(lattice_, tables);
  result->state_ = state_;
  if (!obstacles_.empty()) result->reserve_obstacles();
  result->obstacles_ = obstacles_;
  result->moving_obstacles_ = moving_obstacles_;
  result->pair_claims_ = pair_claims_;
  result->pair_load_.copy_from(pair_load_);
  for (const VoxelId v : claimed_voxels_) result->claimed_voxels_.push_back(v);
  for (const Touch& t : touches_) result->touches_.push_back(t);
  result->touched_voxels_.assign(touched_voxels_.begin(), touched_voxels_.end());
  result->touched_numbers_.assign(touched_numbers_.begin(), touched_numbers_.end());
  result->moved_ever_ = moved_ever_;
  result->set_own_work_share(own_work_share_);
  result->relaxation_.copy_from(relaxation_);
  if (grid_) {
    result->grid_ = std::make_unique<CompositeGrid>(*grid_);
    result->grid_->reserve_like(*grid_);
    if (!obstacles_.empty()) result->grid_->watch_obstacles(result->obstacles_);
    result->near_on_grid_.reserve(near_on_grid_.capacity());
    result->touches_on_grid_.reserve(kMaxTouched);
    result->near_on_grid_.assign(near_on_grid_.begin(), near_on_grid_.end());
    result->on_grid_ = on_grid_;
    result->centre_ = centre_;
    result->dent_m_ = dent_m_;
    result->grid_force_N_ = grid_force_N_;
    result->grid_tool_m_ = grid_tool_m_;
    result->contact_energy_ = contact_energy_;
    result->nearest_m_ = nearest_m_;
    result->grid_ticks_ = grid_ticks_;
    result->axis_waits_ = axis_waits_;
  }
  if (relaxation_.left_to_shadow()) result->relaxation_.renew_coarse(result->state_, result->obstacle_view());
  return result;
}

double SoftObject::reach(double tool_radius) const {
  // At rest half a cell's diagonal would be enough, but pressed voxels move apart. With 1.5 spacings or more
  // the tool does not slip between voxels. This holds for tools of a hundredth of a spacing, three spacings
  // deep.
  return std::max(tool_radius + voxel_radius(), 1.5 * lattice_->max_spacing_m());
}

SoftObject::Gap SoftObject::gap(const ToolInBody& tool, const glm::dvec3& position) const noexcept {
  const glm::dvec3 d = position - tool.centre;
  if (tool.shape == ToolInBody::Shape::punch) {
    const double along = glm::dot(d, tool.axis);
    const double across2 = glm::dot(d, d) - along * along;
    // The face presses tissue in front of it, not behind it.
    const bool under = across2 <= tool.radius * tool.radius && along > -4.0 * lattice_->max_spacing_m();
    return {under ? along - voxel_radius() : std::numeric_limits<double>::max(), tool.axis};
  }
  const double distance = glm::length(d);
  // If the tool's centre is exactly on the voxel, any direction serves, for example `axis`.
  const glm::dvec3 normal = distance > 0.0 ? d / distance : tool.axis;
  return {distance - reach(tool.radius), normal};
}

bool SoftObject::surely_clear_of(const ToolInBody& tool, const glm::dvec3& position) const noexcept {
  constexpr double kSurely = 1.0 + 1e-9;  // much more than rounding
  const glm::dvec3 d = position - tool.centre;
  const double away = kSurely * reach(tool.radius);
  return tool.shape == ToolInBody::Shape::ball && glm::dot(d, d) > away * away;
}

bool SoftObject::clear_of(const ToolInBody& tool, const glm::dvec3& position) const noexcept {
  return surely_clear_of(tool, position) || gap(tool, position).distance >= 0.0;
}

void SoftObject::touch(std::span<const VoxelId> near) noexcept {
  if (grid_) return touch_on_grid(near);
  cycles_since_touch_ = 0;
  if (near.empty()) relaxation_.end_contact();
  if (cold_ticks_ > 0) --cold_ticks_;
  skips_cycle_ = std::exchange(skip_requested_, false);
  contact_work_ = 0;
  split_cycle_ = false;
  if (near.empty()) pressed_last_.clear();
  std::size_t pressed = 0;
  touched_before_.clear();
  for (const Touch& t : touches_) {
    if (!t.pressed) continue;
    gathered_mark_[t.v] = 1;
    gathered_index_[t.v] = static_cast<std::uint32_t>(touched_before_.size());
    touched_before_.push_back(t);
    ++pressed;
  }
  for (const Touch& t : touches_) state_.set_role(t.v, resting_role_at(t.surface));
  // Tissue that the tool leaves springs back, however long it was at rest.
  for (const Touch& t : touches_) {
    if (t.pressed) relaxation_.mark_dirty(t.v / kRow);
  }
  touches_.clear();
  for (const VoxelId v : near) {
    if (touches_.size() == kMaxTouched) break;
    const bool kept = gathered_mark_[v] != 0;
    if (kept) --pressed;
    touches_.push_back({v, lattice_->surface_number(v), kept, lattice_->rest(v)});
    touches_.back().block = lattice_->block(v);
    if (!kept) continue;
    const Touch& before = touched_before_[gathered_index_[v]];
    touches_.back().normal = before.normal;
    touches_.back().frozen_motion = before.frozen_motion;
  }
  for (const VoxelId v : touched_voxels_) gathered_mark_[v] = 0;
  touched_voxels_.clear();
  touched_numbers_.clear();
  for (const Touch& t : touches_) {
    touched_voxels_.push_back(t.v);
    touched_numbers_.push_back(t.surface);
  }
  if (pressed > 0) relaxation_.wake();
  set_touch_roles();
}

Displacement::Role SoftObject::resting_role(VoxelId v) const noexcept {
  if (claimed_voxels_.empty() && obstacles_.empty()) return Displacement::free;
  return resting_role_at(lattice_->surface_number(v));
}

Displacement::Role SoftObject::resting_role_at(std::uint32_t surface) const noexcept {
  if (claimed_voxels_.empty() && obstacles_.empty()) return Displacement::free;
  if (pair_claims_[surface] != 0) return Displacement::held;
  return obstacles_.empty() || obstacles_[surface].normal == glm::vec3(0.0F) ? Displacement::free
                                                                             : Displacement::obstacle;
}

// Only pressed voxels are excluded from background relaxation. A touched voxel without load has to move with
// its neighbours: if it were held, coarse corrections would shear it, more in each cycle.
void SoftObject::set_touch_roles() noexcept {
  for (const Touch& t : touches_) {
    const Displacement::Role resting = resting_role_at(t.surface);
    if (!t.pressed || lattice_->anchored(t.v)) {
      state_.set_role(t.v, t.pressed ? Displacement::held : resting);
      continue;
    }
    // A voxel that the tool and something else press belongs to the contact solver alone.
    state_.set_role(t.v, resting == Displacement::free ? Displacement::pressed : Displacement::held);
    state_.tool_normal[t.surface] = glm::vec3(t.normal);
  }
}

void SoftObject::settle_chain() noexcept {
  moved_ever_ = true;
  float most = 0.0F;
  for (const glm::vec3& move : moves_) most = std::max(most, glm::dot(move, move));
  unrelaxed_m_ += std::sqrt(static_cast<double>(most));
  unsettled_m_ += std::sqrt(static_cast<double>(most));
  if (unrelaxed_m_ > kDirtyMotion * lattice_->min_spacing_m()) {
    unrelaxed_m_ = 0.0;
    relaxation_.wake();
  }
  chain_.settle(state_, sources_, moves_, obstacles_);
  anchors_pull_ = anchors_pull_ || chain_.pulled_anchors();
  contact_work_ += kWorkOfVisit * static_cast<std::size_t>(chain_.work());
  for (const RowId row : chain_.moved_rows()) relaxation_.mark_dirty(row);
  for (const RowId row : chain_.moved_rows()) note_moved(row);
}

void SoftObject::note_moved(RowId row) noexcept {
  if (obstacles_.empty() || moved_rows_.size() == moved_rows_.capacity() || row_moved_[row] != 0) return;
  row_moved_[row] = 1;
  moved_rows_.push_back(row);
}

void SoftObject::forget_moved_rows() noexcept {
  for (const RowId row : moved_rows_) row_moved_[row] = 0;
  moved_rows_.clear();
}

glm::dvec3 SoftObject::displacement_at(const glm::dvec3& rest_point) const noexcept {
  if (on_grid_) {
    const glm::dvec3 at = rest_point / lattice_->spacing_m();
    return grid_->at_point({at.x, at.y, at.z});
  }
  return moved_ever_ ? voxel::displacement_at(*lattice_, state_, rest_point) : glm::dvec3(0.0);
}

}  // namespace voxel
