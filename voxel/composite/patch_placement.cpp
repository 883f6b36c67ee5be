// SPDX-License-Identifier: GPL-3.0-or-later
// Placement of the patches of a CompositeGrid. Building a level costs a tenth of a tick's work or more. So
// levels are built one after another, one in a tick: before a contact while the tool approaches, and during a
// contact while the contact moves.
#include <algorithm>
#include <cstdlib>

#include "voxel/composite/grid.h"

namespace voxel {
namespace {

constexpr int kFollowDistance = 2;  // voxels that a contact moves before patches follow it
constexpr int kMaxOffCentre = 4;    // voxels from contact to middle of level 0; with more, all levels move

}  // namespace

bool CompositeGrid::in_place(std::size_t l) const noexcept {
  const Level& level = levels_[l];
  if (!level.is_built) return false;
  for (std::size_t d = 0; d < 3; ++d) {
    const NodeRange wanted = node_range(l, d, shifted(centre_)[d]);
    if (wanted.low != level.nodes[d].begin || wanted.count(level.step) != level.nodes[d].count) return false;
  }
  return true;
}

// Does the next coarser patch, where it is now, have unknowns all round this one?
bool CompositeGrid::nested(std::size_t l) const noexcept {
  const Level &fine = levels_[l], &coarse = levels_[l + 1];
  for (std::size_t d = 0; d < 3; ++d) {
    const AxisNodes &in = fine.nodes[d], &out = coarse.nodes[d];
    if (in.open_low && out.open_low && in.begin < out.begin + coarse.step) return false;
    if (in.open_high && out.open_high && fine.at(d, in.count - 1) > coarse.at(d, out.count - 1) - coarse.step)
      return false;
  }
  return true;
}

bool CompositeGrid::off_centre(const Index3& centre) const noexcept {
  const auto& nodes = levels_[0].nodes;
  const Index3 at = shifted(centre);
  for (std::size_t d = 0; d < 3; ++d) {
    const int low = at[d] - nodes[d].begin, high = levels_[0].at(d, nodes[d].count - 1) - at[d];
    if (nodes[d].open_low && low < half_width_ - kMaxOffCentre) return true;
    if (nodes[d].open_high && high < half_width_ - kMaxOffCentre) return true;
  }
  return false;
}

// Builds a level round centre_. Displacements are not kept.
void CompositeGrid::rebuild(std::size_t l) noexcept {
  Level& level = levels_[l];
  place_nodes(level, l, shifted(centre_));
  assemble(level);
  level.is_built = true;
  list_obstacle_nodes(l);
  if (l + 1 < levels_.size()) set_up_transfer(level, levels_[l + 1]);
  if (l > 0) set_up_transfer(levels_[l - 1], level);
}

void CompositeGrid::put_to_rest(Level& level) noexcept {
  for (auto* arrays : {&level.u, &level.at_bound}) {
    for (Floats& axis : *arrays) std::fill(axis.begin(), axis.end(), 0.0F);
  }
  for (Floats& strain : level.brick_strain) std::fill(strain.begin(), strain.end(), 0.0F);
  level.bounded = {};
  level.moved = false;
}

void CompositeGrid::recentre(const Index3& centre) noexcept {
  centre_ = centre;
  if (!material_.align_to(centre)) return;
  for (Level& level : levels_) level.is_built = false;
}

void CompositeGrid::prepare(const Index3& centre) noexcept {
  bool moves = false;
  for (std::size_t d = 0; d < 3; ++d) moves = moves || std::abs(centre[d] - centre_[d]) >= kFollowDistance;
  if (moves) recentre(centre);
  release_multipliers();
  for (Level& level : levels_) {
    if (!level.moved) continue;
    put_to_rest(level);
    break;
  }
  for (std::size_t l = levels_.size(); l-- > 0;) {
    if (in_place(l)) continue;
    rebuild(l);
    break;
  }
}

void CompositeGrid::begin(const Index3& centre) noexcept {
  bool ready = !off_centre(centre);
  for (std::size_t l = 0; l < levels_.size(); ++l)
    ready = ready && levels_[l].is_built && (l == covering_level_ || l + 1 == levels_.size() || nested(l));
  if (!ready) {
    recentre(centre);
    for (std::size_t l = levels_.size(); l-- > 0;) {
      if (!in_place(l)) rebuild(l);
    }
  }
  release_multipliers();
  for (Level& level : levels_) {
    if (level.moved) put_to_rest(level);
    level.moved = true;
  }
  pressing_force_N_ = glm::dvec3(0.0);
  pressed_level_ = {};
  pressed_.clear();
  obstacle_bounds_.clear();
  supporting_bounds_.clear();
  supports_ = {};
  std::fill(obstacle_loads_.begin(), obstacle_loads_.end(), ObstacleLoad{});
}

bool CompositeGrid::centre_on(const Index3& centre) noexcept {
  if (covering_level_ == 0) return false;
  bool moves = false;
  for (std::size_t d = 0; d < 3; ++d) moves = moves || std::abs(centre[d] - centre_[d]) >= kFollowDistance;
  if (moves) centre_ = centre;
  // Moves the coarsest level that is not in place, and the finer levels that would no longer be nested.
  const bool all = off_centre(centre);
  bool any = false, joins = false;
  for (std::size_t l = covering_level_; l-- > 0;) {
    const bool due = (!any || all || !nested(l)) && !in_place(l);
    if (due) move_patch(l);
    if (due || joins) set_up_transfer(levels_[l], levels_[l + 1]);
    any = any || due;
    joins = due;
  }
  return joins;
}

// Moves the patch of a level to centre_. Its new nodes are interpolated from the next coarser level.
void CompositeGrid::move_patch(std::size_t l) noexcept {
  patch_moved_ = true;
  Level& level = levels_[l];
  before_move_.nodes = level.nodes;  // does not allocate: allocate_for_moves() has made room
  before_move_.step = level.step;
  before_move_.stride = level.stride;
  before_move_.plane = level.plane;
  save_multipliers(level);
  place_nodes(level, l, shifted(centre_));
  const std::size_t floats = before_move_.first_row() + before_move_.floats() + kPad;
  for (std::size_t a = 0; a < 3; ++a) {
    std::copy_n(level.u[a].begin(), floats, before_move_.u[a].begin());
    std::copy_n(level.at_bound[a].begin(), floats, before_move_.at_bound[a].begin());
    std::fill(level.u[a].begin(), level.u[a].end(), 0.0F);
    std::fill(level.at_bound[a].begin(), level.at_bound[a].end(), 0.0F);
  }
  save_brick_strains(level, floats);
  const auto& nodes = level.nodes;
  Index3 by{};
  for (std::size_t d = 0; d < 3; ++d) by[d] = (nodes[d].begin - before_move_.nodes[d].begin) / level.step;
  for (int k = 0; k < nodes[2].count; ++k) {
    for (int j = 0; j < nodes[1].count; ++j) {
      for (int i = 0; i < nodes[0].count; ++i) {
        const Index3 was{i + by[0], j + by[1], k + by[2]};
        bool known = true;
        for (std::size_t d = 0; d < 3; ++d)
          known = known && was[d] >= 0 && was[d] < before_move_.nodes[d].count;
        const std::size_t to = level.node(i, j, k);
        if (known) {
          const std::size_t from = before_move_.node(was[0], was[1], was[2]);
          for (std::size_t a = 0; a < 3; ++a) {
            level.u[a][to] = before_move_.u[a][from];
            level.at_bound[a][to] = before_move_.at_bound[a][from];
          }
          continue;
        }
        const glm::dvec3 u = interpolate(
            levels_[l + 1], {static_cast<double>(level.at(0, i)), static_cast<double>(level.at(1, j)),
                             static_cast<double>(level.at(2, k))});
        for (std::size_t a = 0; a < 3; ++a) level.u[a][to] = static_cast<float>(u[static_cast<int>(a)]);
      }
    }
  }
  assemble(level);
  restore_multipliers(level, by);
  restore_brick_strains(l, by);
  list_obstacle_nodes(l);
}

}  // namespace voxel
