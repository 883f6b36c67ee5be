// SPDX-License-Identifier: GPL-3.0-or-later
// Contact of the tool with rigid blocks (components without slack). A block is one body of three unknowns. It
// is pressed if any of its voxels is pressed. It presses back with the sum of all loads on it. Block numbers
// in Lattice begin with 1, those in RigidBlocks with 0.
#include <algorithm>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "voxel/lattice/near_limit.h"
#include "voxel/object/soft_object.h"

namespace voxel {
namespace {

// Replaces kAtLimit for links of dependents, which lag a little as the tool withdraws.
constexpr double kAtLimitLagging = 1e-3;

}  // namespace

// Calls `visit(block)` for each block with a touched voxel, in the order of the touches. Numbers begin with
// 1.
template <class Visit>
void SoftObject::for_touched_blocks(const Visit& visit) noexcept {
  for (const Touch& t : touches_) {
    if (t.block == 0 || block_seen_[t.block - 1U] != 0) continue;
    block_seen_[t.block - 1U] = 1;
    visit(t.block);
  }
  for (const Touch& t : touches_) {
    if (t.block != 0) block_seen_[t.block - 1U] = 0;
  }
}

// Sets the bounds of the tool on a block, linearised at each of its touched voxels that is no further away
// than `within_m`.
void SoftObject::bound_block(const ToolInBody& tool, std::uint16_t block, double within_m) noexcept {
  block_bounds_.clear();
  bound_touch_.clear();
  for (std::size_t i = 0; i < touches_.size(); ++i) {
    if (touches_[i].block != block) continue;
    const Gap g = gap(tool, position(touches_[i]));
    if (g.distance > within_m) continue;
    block_bounds_.push_back({g.normal, g.distance, false, 0.0});
    bound_touch_.push_back(static_cast<std::uint32_t>(i));
  }
}

// Moves blocks out of the tool by the shortest way. One voxel of a block is the source of the chain's wave.
void SoftObject::push_blocks_out(const ToolInBody& tool) noexcept {
  for_touched_blocks([&](std::uint16_t block) {
    bound_block(tool, block, voxel_radius());
    const auto in = std::find_if(block_bounds_.begin(), block_bounds_.end(),
                                 [](const BlockBound& b) { return b.room_m < 0.0; });
    if (in == block_bounds_.end()) return;
    const VoxelId v = touches_[bound_touch_[static_cast<std::size_t>(in - block_bounds_.begin())]].v;
    const glm::dvec3 before = state_.at(v);
    state_.set(v, before + move_within(glm::dvec3(0.0), glm::dvec3(1.0), block_bounds_));
    sources_.push_back(v);
    moves_.emplace_back(state_.at(v) - before);
  });
}

void SoftObject::follow_blocks(const glm::dvec3& delta) noexcept {
  for_touched_blocks([&](std::uint16_t block) {
    HeldDirections pressed;
    const Touch* first = nullptr;
    for (const Touch& t : touches_) {
      if (t.block != block || !t.pressed) continue;
      pressed.add(t.normal);
      if (first == nullptr) first = &t;
    }
    if (first == nullptr) return;
    const glm::dvec3 before = state_.at(first->v);
    state_.set(first->v, before + delta - pressed.free_component(delta));
    sources_.push_back(first->v);
    moves_.emplace_back(state_.at(first->v) - before);
  });
}

// Moves each block to the least energy of its border's springs, outside of the tool and within its limits.
// Bounds with a force are active contacts.
void SoftObject::relax_blocks(const ToolInBody& tool) noexcept {
  Multigrid& grid = relaxation_.multigrid();
  for_touched_blocks([&](std::uint16_t block) {
    const std::size_t p = block - 1U;
    // The force includes that of the block's dependents: through links at their limits they press the block
    // on the tool, too.
    const Multigrid::AdmissibleInterval room = grid.interval_of_block(p, state_);
    const glm::dvec3 force = grid.block_force(p, state_) + dependents_of_block(p, room),
                     stiffness = grid.blocks().on(0, p).stiffness;
    bound_block(tool, block, lattice_->max_spacing_m());
    Multigrid::add_bounds(room, block_bounds_);
    bool was = false, is = false;
    glm::dvec3 way = move_within(force, stiffness, block_bounds_);
    for (Touch& t : touches_) {
      if (t.block != block) continue;
      was = was || t.pressed;
      t.pressed = false;
    }
    for (std::size_t i = 0; i < bound_touch_.size(); ++i) {
      Touch& t = touches_[bound_touch_[i]];
      t.pressed = block_bounds_[i].force_N > 0.0;
      t.normal = block_bounds_[i].normal;
      is = is || t.pressed;
    }
    // While the shadow relaxes the object, only motion since the submission is relaxed here.
    if (relaxation_.shadow_busy())
      way = move_within(force + grid.residual_of_block(p), stiffness, block_bounds_);
    const glm::dvec3 went = grid.move_block(p, way, state_, obstacle_view(), Multigrid::Tool::caller_handles);
    const double far = glm::length(went);
    if (was != is) unsettled_m_ += far;
    unrelaxed_m_ += far;
    if (unrelaxed_m_ <= kDirtyMotion * lattice_->min_spacing_m()) return;
    unrelaxed_m_ = 0.0;
    relaxation_.wake();
  });
}

bool SoftObject::any_pressed(std::uint16_t block) const noexcept {
  return std::any_of(touches_.begin(), touches_.end(),
                     [block](const Touch& t) { return t.block == block && t.pressed; });
}

// Load of a block's dependents (N); `room`: its admissible interval.
glm::dvec3 SoftObject::dependents_of_block(std::size_t block,
                                           const Multigrid::AdmissibleInterval& room) noexcept {
  const Multigrid& grid = relaxation_.multigrid();
  const double tight = static_cast<double>(kAtLimit) * lattice_->min_spacing_m();
  glm::dvec3 force(0.0);
  for (int axis = 0; axis < 3; ++axis) {
    const auto& of_axis = room[static_cast<std::size_t>(axis)];
    if (of_axis[0] < -tight && of_axis[1] > tight) continue;
    limit_reactions_.gather_on_block(relaxation_.couplings(), state_, grid, block, axis);
    force[axis] = limit_reactions_.dependents(relaxation_.couplings()).force_N;
  }
  return force;
}

// Like gather_load_with_pairs(), but treats each block as one voxel that is loaded as a whole. The load of a
// single voxel of a block does not show the direction in which the block passes load on. For example, tissue
// at its limits between the tool and an inclusion is pulled down, and still carries the inclusion's load
// upwards.
void SoftObject::gather_load_with_blocks(int axis) noexcept {
  const Multigrid& grid = relaxation_.multigrid();
  const auto& u = state_.u[static_cast<std::size_t>(axis)];
  const auto tight = static_cast<float>(kAtLimitLagging * lattice_->min_spacing_m());
  // The first voxel of a block stands for the block.
  const auto whole = [&](VoxelId v) {
    const std::uint16_t block = lattice_->block(v);
    return block == 0 ? v : grid.blocks().first(block - 1U);
  };
  gathered_.clear();
  for (std::size_t i = 0; i < touches_.size(); ++i) {
    if (!touches_[i].pressed || lattice_->anchored(touches_[i].v)) continue;
    const VoxelId v = whole(touches_[i].v);
    if (gathered_mark_[v] == 0) gather(v, static_cast<std::uint32_t>(i));
  }
  const std::size_t pressed = gathered_.size();
  dependents_.assign(pressed, Dependent{});
  const auto look_at = [&](std::size_t head, VoxelId from, VoxelId to, int d, bool up) {
    if (!lattice_->filled(to) || lattice_->anchored(to)) return;
    const auto b = lattice_->bounds(up ? from : to, d, axis);
    const float is = u[to] - u[from], low = up ? b[0] : -b[1], high = up ? b[1] : -b[0];
    const bool pushed_up = is <= low + tight, pushed_down = is >= high - tight;
    if (!pushed_up && !pushed_down) return;
    const std::uint32_t touch = gathered_[head].touch;
    touches_[touch].at_limit = true;
    const VoxelId v = whole(to);
    if (gathered_mark_[v] != 0 || gathered_.size() >= kMaxGathered) return;
    gather(v, touch);
    const std::uint16_t block = lattice_->block(v);
    const double load = block != 0 ? grid.block_force(block - 1U, state_)[axis] : load_on(v, axis);
    dependents_.push_back({static_cast<std::uint32_t>(head), pushed_up, pushed_down, load});
  };
  for (std::size_t head = 0; head < gathered_.size(); ++head) {
    const VoxelId v = gathered_[head].v;
    const std::uint16_t block = lattice_->block(v);
    if (block != 0) {
      for (const RigidBlocks::Link& l : grid.blocks().on(0, block - 1U).border)
        look_at(head, l.cell, l.beside, l.d, l.up);
      continue;
    }
    for (int n = 0; n < 6; ++n) {
      const bool up = n % 2 != 0;
      look_at(head, v, up ? lattice_->up(v, n / 2) : lattice_->down(v, n / 2), n / 2, up);
    }
  }
  // A voxel that pulls away from its source may rest on another gathered voxel. Then its load counts, too.
  // The sum does not depend on the link through which the load passes.
  const auto rests = [&](std::size_t i) {
    const VoxelId v = gathered_[i].v, by = gathered_[dependents_[i].from].v;
    for (int n = 0; n < 6 && lattice_->block(v) == 0; ++n) {
      const bool up = n % 2 != 0;
      const VoxelId w = up ? lattice_->up(v, n / 2) : lattice_->down(v, n / 2);
      if (!lattice_->filled(w) || whole(w) == by || gathered_mark_[whole(w)] == 0) continue;
      const auto b = lattice_->bounds(up ? v : w, n / 2, axis);
      const float is = u[v] - u[w], low = up ? -b[1] : b[0], high = up ? -b[0] : b[1];
      if (dependents_[i].load < 0.0 ? is <= low + tight : is >= high - tight) return true;
    }
    return false;
  };
  for (std::size_t i = dependents_.size(); i-- > pressed;) {
    const Dependent& h = dependents_[i];
    if (!((h.up && h.load < 0.0) || (h.down && h.load > 0.0)) && !rests(i)) {
      gathered_mark_[gathered_[i].v] = 0;
    } else if (h.from < pressed) {
      touches_[gathered_[h.from].touch].load[axis] += h.load;
    } else {
      dependents_[h.from].load += h.load;
    }
  }
}

void SoftObject::add_reaction_of_blocks(const ToolInBody& tool, Reaction& reaction) noexcept {
  const Multigrid& grid = relaxation_.multigrid();
  for_touched_blocks([&](std::uint16_t block) {
    const std::size_t p = block - 1U;
    if (!any_pressed(block)) return;
    bound_block(tool, block, lattice_->max_spacing_m());
    const glm::dvec3 stiffness = grid.blocks().on(0, p).stiffness;
    glm::dvec3 force = grid.block_force(p, state_);
    for (const Touch& t : touches_) {
      if (t.block == block && t.pressed) force += t.load;
    }
    move_within(force, stiffness, block_bounds_);
    HeldDirections held;
    for (const BlockBound& b : block_bounds_) {
      if (!(b.force_N > 0.0)) continue;
      reaction.force_N -= b.force_N * b.normal;
      ++reaction.pressed;
      held.add(b.normal);
    }
    // The block follows the tool in the pressed directions.
    glm::dmat3 along(0.0), springs(0.0);
    for (std::size_t n = 0; n < held.count; ++n) along += glm::outerProduct(held.of[n], held.of[n]);
    for (int axis = 0; axis < 3; ++axis) springs[axis][axis] = stiffness[axis];
    reaction.stiffness_N_per_m += along * springs * along;
  });
}

}  // namespace voxel
