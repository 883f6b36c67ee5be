// SPDX-License-Identifier: GPL-3.0-or-later
// Loads that pass through links at their limits: dependents of pressed voxels follow them, are felt through
// them, and hold them.
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "voxel/lattice/near_limit.h"
#include "voxel/lattice/voxel_links.h"
#include "voxel/object/soft_object.h"
#include "voxel/relaxation/admm_region.h"

namespace voxel {
namespace {

// Voxels that is_immovable() searches.
constexpr std::size_t kMaxLimitLoads = 500;

// Dependents of voxels that obstacles or pairs press.
constexpr std::size_t kMostHanging = 3000;
// As kAtLimit, at voxels that a body or another soft object presses. Dependents lag a little whenever these
// voxels or the tool withdraw, and would be lost for a tick. At rest a voxel that is no dependent is balanced
// and adds nothing.
constexpr float kAtLimitBesideOthers = 0.02F;
// u(w) − u(v) of neighbours along d, and its limits, whichever way the link points.
struct LinkState {
  float difference, low, high;
};
LinkState link_state(const Lattice& lattice, const LazyArray<float>& u, VoxelId v, VoxelId w, int d, bool up,
                     int axis) {
  const auto b = lattice.bounds(up ? v : w, d, axis);
  return {u[w] - u[v], up ? b[0] : -b[1], up ? b[1] : -b[0]};
}
// `visit(w, d, up)` for the neighbours w of v.
template <class Visit>
void for_neighbours(const Lattice& lattice, VoxelId v, const Visit& visit) {
  for (int d = 0; d < 3; ++d) {
    for (const bool up : {false, true}) {
      const VoxelId w = up ? lattice.up(v, d) : lattice.down(v, d);
      if (lattice.filled(w)) visit(w, d, up);
    }
  }
}
// `visit(w, pushed_up, pushed_down)` for each neighbour w whose link to v is at a limit on `axis`: at the
// lower limit, which pushes w up, at the upper one, which pushes w down, or at both. Neighbours with known(w)
// are skipped; in tissue that is at its limits throughout these are five of six.
template <class Known, class Visit>
void for_tight_neighbours(const Lattice& lattice, const LazyArray<float>& u, VoxelId v, int axis,
                          const Known& known, const Visit& visit, float share = kAtLimit) {
  for_neighbours(lattice, v, [&](VoxelId w, int d, bool up) {
    if (known(w)) return;
    const float tight = share * static_cast<float>(lattice.spacing_m()[d]);
    const LinkState link = link_state(lattice, u, v, w, d, up, axis);
    const bool pushed_up = link.difference <= link.low + tight,
               pushed_down = link.difference >= link.high - tight;
    if (pushed_up || pushed_down) visit(w, pushed_up, pushed_down);
  });
}
bool any_may_be_tight(const Lattice& lattice, const Displacement& state, std::span<const VoxelId> voxels,
                      float share) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const VoxelId v : voxels) {
      if (may_be_tight(lattice, state, v, axis, share)) return true;
    }
  }
  return false;
}
// Adds up loads from the last of `hanging` to number `first`. Each adds its load to its source: carries(i,
// load) if the source is among the first `first`. drops(i) if the link cannot carry the load in that
// direction.
template <class Hanging, class Drops, class Carries>
void add_from_far_end(Hanging& hanging, std::size_t first, const Drops& drops, const Carries& carries) {
  for (std::size_t i = hanging.size(); i-- > first;) {
    const auto& h = hanging[i];
    if (!((h.up && h.load < 0.0) || (h.down && h.load > 0.0))) {
      drops(i);
    } else if (h.from < first) {
      carries(h.from, h.load);
    } else {
      hanging[h.from].load += h.load;
    }
  }
}

}  // namespace

// Dependents follow pressed voxels that withdraw. They are felt only while their links are at a limit, and
// the background may need many ticks to reach them.
void SoftObject::move_followers() noexcept {
  roots_.clear();
  for (const Touch& t : touches_) {
    if (t.pressed && !lattice_->anchored(t.v) && t.part == 0) roots_.push_back(t.v);
  }
  if (!roots_.empty()) limit_followers_.draw(relaxation_, state_, roots_, static_cast<float>(kDirtyMotion));
}

// Force of its links and of other soft objects on a voxel (N).
glm::dvec3 SoftObject::load_on(VoxelId v) noexcept {
  const glm::dvec3 links = link_force(relaxation_.couplings(), state_, v);
  if (state_.role[v] != Displacement::held) return links;
  return links + pair_load(lattice_->surface_number(v));
}

double SoftObject::load_on(VoxelId v, int axis) noexcept {
  const double links = link_force(relaxation_.couplings(), state_, v, axis);
  if (state_.role[v] != Displacement::held) return links;
  return links + pair_load(lattice_->surface_number(v))[axis];
}

void SoftObject::carry(VoxelId v, std::uint32_t touch) noexcept {
  carried_mark_[v] = 1;
  carried_index_[v] = touch;
  carried_.push_back({v, touch});
}

// A dependent that pulls a pressed voxel back is felt through it: its load is the multiplier of the chain's
// limit. Without it the force would saturate as soon as the chain is at its limits.
glm::dvec3 SoftObject::gather_load(glm::dmat3& stiffness) noexcept {
  glm::dvec3 force(0.0);
  carried_.clear();
  roots_.clear();
  for (std::size_t i = 0; i < touches_.size(); ++i) {
    if (!touches_[i].pressed || lattice_->anchored(touches_[i].v)) continue;
    carry(touches_[i].v, static_cast<std::uint32_t>(i));
    roots_.push_back(touches_[i].v);
  }
  for (int axis = 0; axis < 3; ++axis) {
    limit_reactions_.gather(relaxation_.couplings(), state_, roots_, axis);
    // Dependents move along with the mean motion of the pressed voxels that have any.
    glm::dvec3 way(0.0);
    int tight = 0;
    for (const Carried& c : carried_) {
      Touch& t = touches_[c.touch];
      if (!limit_reactions_.tight(t.v)) continue;
      t.tight = true;
      way += t.normal[axis] * t.normal;
      ++tight;
    }
    if (tight > 0) way /= tight;
    const LimitReactions::Hanging hanging = limit_reactions_.hanging(relaxation_.couplings());
    force[axis] = hanging.force_N;
    stiffness += hanging.stiffness_N_per_m * glm::outerProduct(way, way);
    add_stiffness_of_touches(axis, way, stiffness);
  }
  let_go_of_carried();
  return force;
}

// Stiffness of the links of pressed voxels; their dependents move by `way` per unit of the tool's motion.
void SoftObject::add_stiffness_of_touches(int axis, const glm::dvec3& way, glm::dmat3& stiffness) noexcept {
  for (const Carried& c : carried_) {
    const glm::dvec3 q = touches_[c.touch].normal[axis] * touches_[c.touch].normal;
    const VoxelSprings springs = relaxation_.couplings().springs_of(c.v);
    double to_others = 0.0;  // voxels that do not move along
    for (int d = 0; d < 3; ++d) {
      for (const bool up : {false, true}) {
        const Spring& spring = (up ? springs.up : springs.down)[static_cast<std::size_t>(d)];
        const double stiff = static_cast<double>(spring.on(axis, d));
        if (stiff == 0.0) continue;
        const VoxelId w = up ? lattice_->up(c.v, d) : lattice_->down(c.v, d);
        if (carried_mark_[w] != 0) {
          const Touch& beside = touches_[carried_index_[w]];
          const glm::dvec3 r = q - beside.normal[axis] * beside.normal;
          stiffness += 0.5 * stiff * glm::outerProduct(r, r);  // visited from both its ends
        } else if (limit_reactions_.carried(w)) {
          stiffness += stiff * glm::outerProduct(q - way, q - way);
        } else {
          to_others += stiff;
        }
      }
    }
    stiffness += to_others * glm::outerProduct(q, q);
  }
}

// As gather_load(), for an object that other soft objects press. Their loads enter at the far end of the
// chain and pass through voxels whose own links pull the other way. So all dependents are searched first, and
// loads are added up from the far end.
void SoftObject::gather_load_with_pairs(int axis) noexcept {
  carried_.clear();
  const auto& u = state_.u[static_cast<std::size_t>(axis)];
  for (std::size_t i = 0; i < touches_.size(); ++i) {
    if (touches_[i].pressed && !lattice_->anchored(touches_[i].v))
      carry(touches_[i].v, static_cast<std::uint32_t>(i));
  }
  const std::size_t pressed = carried_.size();
  hanging_.assign(pressed, Hanging{});
  for (std::size_t head = 0; head < carried_.size() && carried_.size() < kMaxCarried; ++head) {
    const Carried c = carried_[head];
    const auto known = [&](VoxelId w) { return carried_mark_[w] != 0 && touches_[c.touch].tight; };
    for_tight_neighbours(
        *lattice_, u, c.v, axis, known,
        [&](VoxelId w, bool pushed_up, bool pushed_down) {
          if (lattice_->anchored(w)) return;
          touches_[c.touch].tight = true;
          if (carried_mark_[w] != 0) return;
          carry(w, c.touch);
          hanging_.push_back({static_cast<std::uint32_t>(head), pushed_up, pushed_down, load_on(w, axis)});
        },
        kAtLimitBesideOthers);
  }
  add_from_far_end(
      hanging_, pressed, [&](std::size_t i) { carried_mark_[carried_[i].v] = 0; },
      [&](std::size_t i, double load) { touches_[carried_[i].touch].load[axis] += load; });
}

// As gather_load_with_pairs(), for voxels that a rigid surface or a pair presses.
void SoftObject::add_hanging(int axis, std::span<const VoxelId> pressed, std::span<HeldLoad> loads) noexcept {
  const auto& u = state_.u[static_cast<std::size_t>(axis)];
  for (std::size_t i = 0; i < pressed.size(); ++i) {
    if (!lattice_->anchored(pressed[i])) carry(pressed[i], static_cast<std::uint32_t>(i));
  }
  const std::size_t first = carried_.size();
  hanging_.assign(first, Hanging{});
  const auto walk = [&](std::size_t head, VoxelId w, bool pushed_up, bool pushed_down) {
    if (lattice_->anchored(w)) return;
    const std::uint32_t touch = carried_[head].touch;
    loads[touch].tight = true;
    if (carried_mark_[w] != 0 || carried_.size() >= first + kMostHanging) return;
    carry(w, touch);
    hanging_.push_back({static_cast<std::uint32_t>(head), pushed_up, pushed_down, load_on(w, axis)});
  };
  for (std::size_t head = 0; head < carried_.size(); ++head) {
    const std::uint32_t touch = carried_[head].touch;
    const auto known = [&](VoxelId w) { return carried_mark_[w] != 0 && loads[touch].tight; };
    for_tight_neighbours(
        *lattice_, u, carried_[head].v, axis, known,
        [&](VoxelId w, bool up, bool down) { walk(head, w, up, down); }, kAtLimitBesideOthers);
  }
  add_from_far_end(
      hanging_, first, [&](std::size_t i) { carried_mark_[carried_[i].v] = 0; },
      [&](std::size_t i, double load) { loads[carried_[i].touch].force_N[axis] += load; });
}

// Adds the stiffness of each source with its dependents, all other voxels fixed.
void SoftObject::add_stiffness(int axis, std::span<HeldLoad> loads) noexcept {
  for (const Carried& c : carried_) {
    if (carried_mark_[c.v] == 0) continue;
    const VoxelSprings springs = relaxation_.couplings().springs_of(c.v);
    for (int d = 0; d < 3; ++d) {
      for (const bool up : {false, true}) {
        const VoxelId w = up ? lattice_->up(c.v, d) : lattice_->down(c.v, d);
        if (carried_mark_[w] != 0 && carried_index_[w] == c.touch) continue;
        const Spring& spring = (up ? springs.up : springs.down)[static_cast<std::size_t>(d)];
        loads[c.touch].stiffness_N_per_m[axis] += static_cast<double>(spring.on(axis, d));
      }
    }
  }
}

void SoftObject::load_held(std::span<const VoxelId> held, std::size_t pressed,
                           std::span<HeldLoad> loads) noexcept {
  for (std::size_t i = 0; i < held.size(); ++i) {
    loads[i] = {.force_N = load_on(held[i]), .stiffness_N_per_m = glm::dvec3(0.0)};
    if (i >= pressed) loads[i].stiffness_N_per_m = 1.0 / compliance(held[i]);
  }
  for (int axis = 0; axis < 3; ++axis) {
    carried_.clear();
    add_hanging(axis, held.first(pressed), loads);
    add_stiffness(axis, loads);
    for (std::size_t i = pressed; i < held.size(); ++i) {
      if (carried_mark_[held[i]] != 0) loads[i].force_N[axis] = 0.0;
    }
    let_go_of_carried();
  }
  const bool tight = std::any_of(loads.begin(), loads.begin() + static_cast<std::ptrdiff_t>(pressed),
                                 [](const HeldLoad& l) { return l.tight; });
  // An object that sleeps keeps its multipliers: others would wake what rests on it.
  const bool balanced =
      asleep() ? tight && relaxation_.limited().found()
               : relaxation_.relax_limited(state_, obstacle_view(), held.first(tight ? pressed : 0));
  if (!balanced) return;
  for (std::size_t i = 0; i < held.size(); ++i) {
    loads[i].balanced = true;
    loads[i].pressed_N = relaxation_.limited().pressed_N(held[i]);
  }
}

void SoftObject::relax_held(std::span<const VoxelId> pressed) noexcept {
  if (asleep() || !relaxation_.left_to_another()) return;
  const bool tight = any_may_be_tight(*lattice_, state_, pressed, kAtLimitBesideOthers);
  relaxation_.relax_limited(state_, obstacle_view(), pressed.first(tight ? pressed.size() : 0));
}

void SoftObject::forget_hanging_on_pairs() noexcept {
  for (const VoxelId v : pair_roots_) hanging_entry_[lattice_->surface_number(v)] = 0;
  pair_roots_.clear();
  hanging_on_pairs_.clear();
}

void SoftObject::find_hanging_on_pairs() noexcept {
  forget_hanging_on_pairs();
  for (const VoxelId v : held_voxels_) {
    if (pair_roots_.size() == pair_roots_.capacity()) break;
    if (!lattice_->anchored(v) && pair_load(lattice_->surface_number(v)) != glm::dvec3(0.0))
      pair_roots_.push_back(v);
  }
  if (!any_may_be_tight(*lattice_, state_, pair_roots_, kAtLimitBesideOthers)) {
    pair_roots_.clear();
    return;
  }
  std::sort(pair_roots_.begin(), pair_roots_.end(), [&](VoxelId v, VoxelId w) {
    const glm::dvec3 of_v = pair_load(lattice_->surface_number(v)),
                     of_w = pair_load(lattice_->surface_number(w));
    const double first = glm::dot(of_v, of_v), second = glm::dot(of_w, of_w);
    return first != second ? first > second : v < w;
  });
  hanging_on_pairs_.assign(pair_roots_.size(), HeldLoad{});
  for (std::size_t i = 0; i < pair_roots_.size(); ++i)
    hanging_entry_[lattice_->surface_number(pair_roots_[i])] = static_cast<std::uint32_t>(i + 1);
  for (int axis = 0; axis < 3; ++axis) {
    carried_.clear();
    add_hanging(axis, pair_roots_, hanging_on_pairs_);
    if (std::any_of(hanging_on_pairs_.begin(), hanging_on_pairs_.end(),
                    [](const HeldLoad& h) { return h.tight; })) {
      add_stiffness(axis, hanging_on_pairs_);
      hand_on(axis);
    }
    let_go_of_carried();
  }
  if (std::none_of(hanging_on_pairs_.begin(), hanging_on_pairs_.end(),
                   [](const HeldLoad& h) { return h.tight; }))
    forget_hanging_on_pairs();
}

// If a link at its limit carries a source's load, the multiplier is assigned to the voxel at its other end,
// provided that pairs press that voxel harder. Beside the hardest contact pairs often press less than links
// pull, and these loads would be lost.
void SoftObject::hand_on(int axis) noexcept {
  const auto& u = state_.u[static_cast<std::size_t>(axis)];
  for (std::size_t i = pair_roots_.size(); i-- > 1;) {
    const VoxelId v = pair_roots_[i];
    if (!hanging_on_pairs_[i].tight) continue;
    const double load = load_on(v, axis) + hanging_on_pairs_[i].force_N[axis];
    std::size_t to = i;
    for_tight_neighbours(
        *lattice_, u, v, axis, [](VoxelId) { return false; },
        [&](VoxelId w, bool pushed_up, bool pushed_down) {
          if (!((pushed_up && load > 0.0) || (pushed_down && load < 0.0))) return;
          const std::uint32_t s = lattice_->surface_number(w);
          if (s == kNoSurface || hanging_entry_[s] == 0) return;
          to = std::min<std::size_t>(to, hanging_entry_[s] - 1U);
        },
        kAtLimitBesideOthers);
    if (to == i) continue;
    hanging_on_pairs_[to].force_N[axis] += load;
    hanging_on_pairs_[to].stiffness_N_per_m[axis] += hanging_on_pairs_[i].stiffness_N_per_m[axis];
  }
}

// Marks are reset, not numbered by gathering: a 32-bit number would wrap after four days of contact, and
// every voxel ever gathered would count as gathered then.
void SoftObject::let_go_of_carried() noexcept {
  for (const Carried& c : carried_) carried_mark_[c.v] = 0;
  carried_.clear();
}

void SoftObject::add_stiffness(int axis, glm::dmat3& stiffness) noexcept {
  // A gathered voxel moves by q = n_a·n per unit of tool motion, n the normal of its touch. A link then
  // stores ½ k (q_v·δ − q_w·δ)².
  const auto along = [&](VoxelId v) {
    if (carried_mark_[v] == 0) return glm::dvec3(0.0);
    const glm::dvec3& n = touches_[carried_index_[v]].normal;
    return n[axis] * n;
  };
  for (const Carried& c : carried_) {
    if (carried_mark_[c.v] == 0) continue;
    const glm::dvec3 q = along(c.v);
    // Most voxels depend on the same touch as all their neighbours, and none of their links is stretched.
    unsigned stretched = 0;
    for (int n = 0; n < 6; ++n) {
      const VoxelId w = n % 2 != 0 ? lattice_->up(c.v, n / 2) : lattice_->down(c.v, n / 2);
      if (carried_mark_[w] == 0 || carried_index_[w] != carried_index_[c.v]) stretched |= 1U << n;
    }
    if (stretched == 0) continue;
    const VoxelSprings springs = relaxation_.couplings().springs_of(c.v);
    for (int d = 0; d < 3; ++d) {
      for (const bool up : {false, true}) {
        if ((stretched >> (2 * d + (up ? 1 : 0)) & 1U) == 0) continue;
        const VoxelId w = up ? lattice_->up(c.v, d) : lattice_->down(c.v, d);
        const Spring& spring = (up ? springs.up : springs.down)[static_cast<std::size_t>(d)];
        const double stiff = static_cast<double>(spring.on(axis, d));
        if (stiff == 0.0) continue;
        const glm::dvec3 r = q - along(w);
        const double share =
            carried_mark_[w] != 0 ? 0.5 : 1.0;  // an inner link is visited from both its ends
        stiffness += share * stiff * glm::outerProduct(r, r);
      }
    }
  }
}

bool SoftObject::is_immovable(VoxelId v, const glm::dvec3& direction) noexcept {
  if (grid_) return at_anchors_end(v, direction);
  const glm::dvec3 size = glm::abs(direction);
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const bool upwards = direction[axis] > 0.0;
  const auto& u = state_.u[static_cast<std::size_t>(axis)];
  const auto rests = [&](VoxelId w) {
    if (lattice_->anchored(w)) return true;
    if (!Displacement::at_obstacle(state_.role[w])) return false;
    const Obstacle& o = obstacles_[lattice_->surface_number(w)];
    const double room = glm::dot(glm::dvec3(o.normal), state_.at(w)) - static_cast<double>(o.bound);
    return room <= static_cast<double>(kAtLimit) * lattice_->min_spacing_m() &&
           (upwards ? o.normal[axis] < -0.5F : o.normal[axis] > 0.5F);
  };
  carried_.clear();
  carried_mark_[v] = 1;
  carried_.push_back({v, 0});
  bool held = rests(v);
  for (std::size_t head = 0; head < carried_.size() && carried_.size() < kMaxLimitLoads && !held; ++head) {
    const VoxelId c = carried_[head].v;
    const auto known = [&](VoxelId w) { return held || carried_mark_[w] != 0; };
    for_tight_neighbours(*lattice_, u, c, axis, known, [&](VoxelId w, bool pushed_up, bool pushed_down) {
      if (held || !(upwards ? pushed_up : pushed_down)) return;
      held = rests(w);
      carried_mark_[w] = 1;
      carried_.push_back({w, 0});
    });
  }
  let_go_of_carried();
  return held;
}

}  // namespace voxel
