// SPDX-License-Identifier: GPL-3.0-or-later
// The contact of a soft object within a tick: pressed voxels leave the tool, and contact cycles relax their
// neighbourhood. A contact cycle is one multigrid cycle on boxes around the pressed voxels
// (Relaxation::relax_contact). Its cost is counted work, never measured time. A cycle around a large patch
// may be split over several ticks.
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

// Fraction of the spacing. A contact nearer to equilibrium than this is left to the background.
constexpr double kSettled = 2e-3;
// Factor by which a contact cycle reduces the contact's distance from equilibrium.
constexpr double kContraction = 0.5;
// Contact cycles a tick, at most.
constexpr int kMostCycles = 2;
// Distance of the contact from equilibrium (unit: spacing). Beyond it, a second contact cycle runs in a tick.
// A cycle that is split over ticks is an exception: a second cycle would gain little and exceed the time of a
// tick.
constexpr double kJump = 0.1;
// Counted work (Float8 prolonged) that a tick may spend on split cycles under asynchronous relaxation. A
// cycle that is not finished continues in the next tick. If a cycle ends and at least kLeastWork is left of
// the tick's work, the next cycle begins.
constexpr std::size_t kContactWork = 4400, kLeastWork = 1000;
// Counted work that a tick may spend on contact cycles and on rows of results that it applies.
constexpr std::size_t kTickWork = 4900;
// A whole cycle evicts the contact from the caches, and so does a long pause of the tool. Until the contact's
// memory is read again, all work takes up to twice as long. So for kColdTicks ticks only kColdWork is
// allowed.
constexpr int kColdTicks = 5;
constexpr std::size_t kColdWork = 2500;
// Rows of coarse cells. If at least this many are to be dropped, a separate tick drops them.
constexpr std::size_t kDropsApart = 100;
constexpr double kDeep = 0.05;  // fraction of the voxel radius; a smaller depth at the start of a tick is an
                                // error of the solver and is corrected

}  // namespace

bool SoftObject::push_out(const ToolInBody& tool) noexcept {
  if (grid_) return push_out_on_grid(tool);
  sources_.clear();
  moves_.clear();
  anchors_pull_ = false;
  bool any = false;
  for (Touch& t : touches_) {
    const glm::dvec3 p = position(t);
    if (!t.pressed && clear_of(tool, p)) continue;
    const Gap g = gap(tool, p);
    t.normal = g.normal;
    if (g.distance >= 0.0) continue;
    any = true;
    t.pressed = true;
    if (lattice_->anchored(t.v) || t.block != 0) continue;
    const glm::dvec3 before = state_.at(t.v);
    state_.set(t.v, before - g.distance * g.normal);
    sources_.push_back(t.v);
    moves_.emplace_back(state_.at(t.v) - before);
  }
  if (!block_seen_.empty()) push_blocks_out(tool);
  if (!sources_.empty()) settle_chain();
  return any;
}

bool SoftObject::any_pressed() const noexcept {
  return std::any_of(touches_.begin(), touches_.end(), [](const Touch& t) { return t.pressed; });
}

bool SoftObject::contact_is_still() const noexcept {
  return any_pressed() && relaxation_.has_large_patch() && unsettled_m_ < kJump * lattice_->min_spacing_m();
}

// Should a contact cycle begin, or continue?
bool SoftObject::cycle_due() const noexcept {
  if (relaxation_.under_way()) return cycles_since_touch_ == 0 && !(skips_cycle_ && any_pressed());
  const double to_go = unsettled_m_ / lattice_->min_spacing_m();
  // A contact that is nearly at rest is left to the background relaxation, which relaxes the whole object. A
  // contact cycle could not bring it to rest, because it keeps the surroundings of its box fixed.
  if (to_go < kSettled || cycles_since_touch_ == kMostCycles) return false;
  const bool apart = relaxation_.left_to_shadow(), in_parts = apart && split_cycle_;
  if (to_go >= kJump && !in_parts && !skips_cycle_) return true;
  // Under asynchronous relaxation a second cycle in a tick runs only after a jump, or if a split cycle left
  // enough work.
  if (cycles_since_touch_ > 0)
    return apart ? in_parts && left_of(kContactWork) >= shared(kLeastWork) : !split_cycle_;
  // Tissue that was just released gets a cycle even if this tick skips cycles: pressed_last_ lists it in this
  // tick only.
  return !skips_cycle_ || !any_pressed();
}

void SoftObject::relax_near(const ToolInBody& tool, int cycles) noexcept {
  if (grid_) {
    for (int n = 0; n < cycles; ++n) relax_on_grid(tool);
    return;
  }
  tool_ = tool;
  for (int n = 0; n < cycles; ++n) {
    for (Touch& t : touches_) relax_touch(tool, t);
    if (!block_seen_.empty()) relax_blocks(tool);
    set_touch_roles();
    if (!cycle_due()) break;
    const bool again = ++cycles_since_touch_ > 1;
    if (!relaxation_.under_way()) unsettled_m_ *= kContraction;
    // Touches are in the order of their ids, so those of one row are adjacent.
    for (std::size_t i = 0; i < touches_.size(); ++i) {
      const RowId row = touches_[i].v / kRow;
      if (i == 0 || touches_[i - 1].v / kRow != row) relaxation_.mark_dirty(row);
    }
    const std::size_t pressed = list_held();
    if (pressed > 0 && pressed_last_.empty()) cold_ticks_ = kColdTicks;
    if (pressed > 0)
      pressed_last_.assign(held_voxels_.begin(), held_voxels_.begin() + static_cast<std::ptrdiff_t>(pressed));
    const std::size_t left = left_of(kContactWork);
    if (relaxation_.under_way()) {
      contact_work_ += relaxation_.continue_contact(state_, obstacle_view(), held_voxels_, left);
      split_cycle_ = true;
      continue;
    }
    // One cycle here lets tissue that the tool just released follow the tool. The shadow alone would let
    // tissue lag behind a quick stroke, and the contact would be lost.
    if (pressed_last_.empty()) continue;
    const bool in_parts = relaxation_.left_to_shadow() && pressed > 0;
    contact_work_ += relaxation_.relax_contact(state_, obstacle_view(), held_voxels_, pressed_last_, again,
                                               in_parts ? left : Relaxation::kUnlimited);
    split_cycle_ = relaxation_.has_large_patch();
  }
  // At the end all touched voxels are projected out of the tool once more, because the reaction is measured
  // in that state. Pressed voxels are projected first: a dependent counts only if its link to a pressed voxel
  // is at its limit when the reaction is measured.
  for (const bool pressed : {true, false}) {
    for (Touch& t : touches_) {
      if (t.pressed == pressed) relax_touch(tool, t);
    }
  }
  if (!block_seen_.empty()) relax_blocks(tool);
  set_touch_roles();
  if (!any_pressed()) pressed_last_.clear();
  move_followers();
}

// The solver of contacts between soft objects projects the voxels of a pair while all other voxels stay. If
// chains are at their limits in both objects, this lifts the tool, and the tool comes back in the next tick.
// Contact cycles around these voxels end this oscillation. Results of the shadow come too rarely to end it.
void SoftObject::relax_near_pairs() noexcept {
  if (touches_.empty()) {  // touch() was not called
    contact_work_ = 0;
    split_cycle_ = false;
  }
  if (pair_dependents_.empty() || any_pressed() || !relaxation_.left_to_shadow()) return;
  const bool goes_on = relaxation_.under_way();
  if (std::exchange(skip_requested_, false)) return;
  const std::size_t left = left_of(kContactWork);
  for (const VoxelId v : pair_sources_) relaxation_.mark_dirty(v / kRow);
  list_held();
  contact_work_ +=
      goes_on ? relaxation_.continue_contact(state_, obstacle_view(), held_voxels_, left)
              : relaxation_.relax_contact(state_, obstacle_view(), held_voxels_, pair_sources_, false, left);
  split_cycle_ = relaxation_.has_large_patch();
}

void SoftObject::follow(const glm::dvec3& delta) noexcept {
  if (grid_) return;  // patches follow in the next cycle
  sources_.clear();
  moves_.clear();
  for (const Touch& t : touches_) {
    if (!t.pressed || lattice_->anchored(t.v) || t.block != 0) continue;
    const glm::dvec3 before = state_.at(t.v);
    state_.set(t.v, before + glm::dot(delta, t.normal) * t.normal);
    sources_.push_back(t.v);
    moves_.emplace_back(state_.at(t.v) - before);
  }
  if (!block_seen_.empty()) follow_blocks(delta);
  if (!sources_.empty()) settle_chain();
}

std::size_t SoftObject::give_way(const ToolInBody& tool, std::span<ToolBound> out) const noexcept {
  const bool flat = tool.shape == ToolInBody::Shape::punch;
  std::size_t count = 0;
  for (const Touch& t : touches_) {
    if (count == out.size()) break;
    if (on_grid_ && !t.pressed) continue;  // all voxels that remain in the tool are pressed
    const glm::dvec3 p = position(t);
    if (clear_of(tool, p)) continue;
    const Gap g = gap(tool, p);
    if (g.distance >= -kGiveWay * voxel_radius()) continue;
    if (t.beside_punch && -g.distance > kDeep * voxel_radius()) {
      const glm::dvec3 from = p - tool.centre, across = from - glm::dot(from, tool.axis) * tool.axis;
      const double distance = glm::length(across);
      if (distance > 0.0) {
        out[count++] = {-across / distance, tool.radius - glm::dot(across / distance, p), t.v};
        continue;
      }
    }
    const double away = flat ? voxel_radius() : reach(tool.radius);
    out[count++] = {-g.normal, glm::dot(-g.normal, p) + away - t.start_depth, t.v};
  }
  return count;
}

void SoftObject::record_depths(const ToolInBody& tool) noexcept {
  const bool flat = tool.shape == ToolInBody::Shape::punch;
  if (on_grid_ && !flat) return;  // after each cycle, no voxel that could leave the tool is in it
  for (Touch& t : touches_) {
    const glm::dvec3 from = position(t) - tool.centre;
    const double along = glm::dot(from, tool.axis), distance = glm::length(from);
    t.beside_punch = flat && distance * distance - along * along > tool.radius * tool.radius;
    const double depth = flat ? voxel_radius() - along : reach(tool.radius) - distance;
    t.start_depth = depth > kDeep * voxel_radius() ? depth : 0.0;
  }
}

std::size_t SoftObject::list_held() noexcept {
  held_voxels_.clear();
  for (const Touch& t : touches_) {
    if (t.pressed) held_voxels_.push_back(t.v);
  }
  const std::size_t pressed = held_voxels_.size();
  for (const VoxelId v : claimed_voxels_) held_voxels_.push_back(v);
  return pressed;
}

std::size_t SoftObject::shared(std::size_t work) const noexcept {
  return static_cast<std::size_t>(work_share_ * static_cast<double>(work));
}

std::size_t SoftObject::left_of(std::size_t work) const noexcept {
  const std::size_t all = shared(cold_ticks_ > 0 ? kColdWork : work);
  return all - std::min(all, contact_work_);
}

std::size_t SoftObject::work_left() const noexcept {
  return left_of(kTickWork);
}

std::uint64_t SoftObject::relax_background(std::uint64_t budget) noexcept {
  if (relaxation_.asleep()) return 0;
  list_held();
  return relaxation_.run(state_, obstacle_view(), held_voxels_, budget);
}

bool SoftObject::prepare_exchange() noexcept {
  if (relaxation_.rows_to_drop() < kDropsApart) return false;
  relaxation_.drop_coarse();
  return true;
}

// The motion that pressed voxels would still make is frozen, too: until the next submission they only follow
// the tool. If they slid while their neighbours move elsewhere, they would drift and never come to rest.
void SoftObject::assign_residual() noexcept {
  relaxation_.assign_residual(state_, obstacle_view());
  cold_ticks_ = kColdTicks;
  for (Touch& t : touches_) {
    t.frozen_motion = glm::dvec3(0.0);
    if (!t.pressed || lattice_->anchored(t.v) || t.block != 0) continue;
    Touch here = t;
    const glm::dvec3 place = project_voxel(tool_, links_of(relaxation_.couplings(), state_, t.v), here);
    if (here.pressed) t.frozen_motion = place - state_.at(t.v);
  }
}

void SoftObject::keep_frozen_residual(float part) noexcept {
  relaxation_.multigrid().keep_frozen_residual(part, state_);
  for (Touch& t : touches_) t.frozen_motion *= static_cast<double>(part);
}

void SoftObject::relax_cycle() noexcept {
  list_held();
  relaxation_.run_cycle(state_, obstacle_view(), held_voxels_);
}

}  // namespace voxel
