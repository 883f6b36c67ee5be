// SPDX-License-Identifier: GPL-3.0-or-later
// Loads that pass through links at their limits. Dependents are voxels that such links tie to a pressed
// voxel. They move with the pressed voxel when it withdraws, and their loads are part of the force on the
// tool.
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

// Voxels that is_immovable() searches, at most.
constexpr std::size_t kMaxSearched = 500;

// Largest number of dependents of voxels that obstacles or pairs press.
constexpr std::size_t kMaxDependents = 3000;
// Replaces kAtLimit at voxels that a body or another soft object presses. It is wider, because dependents lag
// a little whenever these voxels or the tool withdraw, and would be lost for a tick. A voxel that is gathered
// although it is no dependent does no harm: at rest its load is 0.
constexpr float kAtLimitBesideOthers = 0.02F;
// Difference u(w) − u(v) of two neighbours along d, and its limits. w may be on either side of v.
struct LinkState {
  float difference, low, high;
};
LinkState link_state(const Lattice& lattice, const LazyArray<float>& u, VoxelId v, VoxelId w, int d, bool up,
                     int axis) {
  const auto b = lattice.bounds(up ? v : w, d, axis);
  return {u[w] - u[v], up ? b[0] : -b[1], up ? b[1] : -b[0]};
}
// Calls `visit(w, d, up)` for the neighbours w of v.
template <class Visit>
void for_neighbours(const Lattice& lattice, VoxelId v, const Visit& visit) {
  for (int d = 0; d < 3; ++d) {
    for (const bool up : {false, true}) {
      const VoxelId w = up ? lattice.up(v, d) : lattice.down(v, d);
      if (lattice.filled(w)) visit(w, d, up);
    }
  }
}
// Calls `visit(w, pushed_up, pushed_down)` for each neighbour w whose link to v is at a limit on `axis`. The
// lower limit pushes w up, the upper limit pushes w down; the link may be at both. Neighbours with known(w)
// are skipped. These are five of six in tissue that is at its limits throughout.
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
      if (may_be_at_limit(lattice, state, v, axis, share)) return true;
    }
  }
  return false;
}
// Adds up loads from the last of `dependents` back to number `first`. A dependent adds its load to its
// source. If the source is one of the first `first`, carries(source, load) is called to add it. If the link
// cannot carry the load in that direction, drops(i) is called instead.
template <class Dependents, class Drops, class Carries>
void add_from_far_end(Dependents& dependents, std::size_t first, const Drops& drops, const Carries& carries) {
  for (std::size_t i = dependents.size(); i-- > first;) {
    const auto& h = dependents[i];
    if (!((h.up && h.load < 0.0) || (h.down && h.load > 0.0))) {
      drops(i);
    } else if (h.from < first) {
      carries(h.from, h.load);
    } else {
      dependents[h.from].load += h.load;
    }
  }
}

}  // namespace

// Moves dependents along with pressed voxels that withdraw. Dependents are felt only while their links are at
// a limit, and the background may need many ticks to move them.
void SoftObject::move_followers() noexcept {
  limit_sources_.clear();
  for (const Touch& t : touches_) {
    if (t.pressed && !lattice_->anchored(t.v) && t.block == 0) limit_sources_.push_back(t.v);
  }
  if (!limit_sources_.empty())
    limit_followers_.move(relaxation_, state_, limit_sources_, static_cast<float>(kDirtyMotion));
}

// Force on a voxel by its links and by other soft objects (N).
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

void SoftObject::gather(VoxelId v, std::uint32_t touch) noexcept {
  gathered_mark_[v] = 1;
  gathered_index_[v] = touch;
  gathered_.push_back({v, touch});
}

// Returns the sum of the loads of all dependents (N), and adds their stiffness. A dependent pulls a pressed
// voxel back through links at their limits. The displacement of such a link does not show the size of the
// pull. So the dependents' own loads are summed. Without them the force would saturate as soon as the chain
// is at its limits.
glm::dvec3 SoftObject::gather_load(glm::dmat3& stiffness) noexcept {
  glm::dvec3 force(0.0);
  gathered_.clear();
  limit_sources_.clear();
  for (std::size_t i = 0; i < touches_.size(); ++i) {
    if (!touches_[i].pressed || lattice_->anchored(touches_[i].v)) continue;
    gather(touches_[i].v, static_cast<std::uint32_t>(i));
    limit_sources_.push_back(touches_[i].v);
  }
  for (int axis = 0; axis < 3; ++axis) {
    limit_reactions_.gather(relaxation_.couplings(), state_, limit_sources_, axis);
    // Dependents move with the mean motion of the pressed voxels that have dependents.
    glm::dvec3 way(0.0);
    int tight = 0;
    for (const Gathered& c : gathered_) {
      Touch& t = touches_[c.touch];
      if (!limit_reactions_.at_limit(t.v)) continue;
      t.at_limit = true;
      way += t.normal[axis] * t.normal;
      ++tight;
    }
    if (tight > 0) way /= tight;
    const LimitReactions::Dependents dependents = limit_reactions_.dependents(relaxation_.couplings());
    force[axis] = dependents.force_N;
    stiffness += dependents.stiffness_N_per_m * glm::outerProduct(way, way);
    add_stiffness_of_touches(axis, way, stiffness);
  }
  clear_gathered();
  return force;
}

// Stiffness of the links of pressed voxels; their dependents move by `way` per unit of the tool's motion.
void SoftObject::add_stiffness_of_touches(int axis, const glm::dvec3& way, glm::dmat3& stiffness) noexcept {
  for (const Gathered& c : gathered_) {
    const glm::dvec3 q = touches_[c.touch].normal[axis] * touches_[c.touch].normal;
    const VoxelSprings springs = relaxation_.couplings().springs_of(c.v);
    double to_others = 0.0;  // stiffness of links to voxels that do not move along
    for (int d = 0; d < 3; ++d) {
      for (const bool up : {false, true}) {
        const Spring& spring = (up ? springs.up : springs.down)[static_cast<std::size_t>(d)];
        const double stiff = static_cast<double>(spring.on(axis, d));
        if (stiff == 0.0) continue;
        const VoxelId w = up ? lattice_->up(c.v, d) : lattice_->down(c.v, d);
        if (gathered_mark_[w] != 0) {
          const Touch& beside = touches_[gathered_index_[w]];
          const glm::dvec3 r = q - beside.normal[axis] * beside.normal;
          stiffness += 0.5 * stiff * glm::outerProduct(r, r);  // visited from both its ends
        } else if (limit_reactions_.gathered(w)) {
          stiffness += stiff * glm::outerProduct(q - way, q - way);
        } else {
          to_others += stiff;
        }
      }
    }
    stiffness += to_others * glm::outerProduct(q, q);
  }
}

// Replaces gather_load() for an object that other soft objects press. The loads of these objects enter at the
// far end of the chain and pass through voxels whose own links pull the other way. So all dependents are
// searched first, and loads are added up from the far end.
void SoftObject::gather_load_with_pairs(int axis) noexcept {
  gathered_.clear();
  const auto& u = state_.u[static_cast<std::size_t>(axis)];
  for (std::size_t i = 0; i < touches_.size(); ++i) {
    if (touches_[i].pressed && !lattice_->anchored(touches_[i].v))
      gather(touches_[i].v, static_cast<std::uint32_t>(i));
  }
  const std::size_t pressed = gathered_.size();
  dependents_.assign(pressed, Dependent{});
  for (std::size_t head = 0; head < gathered_.size() && gathered_.size() < kMaxGathered; ++head) {
    const Gathered c = gathered_[head];
    const auto known = [&](VoxelId w) { return gathered_mark_[w] != 0 && touches_[c.touch].at_limit; };
    for_tight_neighbours(
        *lattice_, u, c.v, axis, known,
        [&](VoxelId w, bool pushed_up, bool pushed_down) {
          if (lattice_->anchored(w)) return;
          touches_[c.touch].at_limit = true;
          if (gathered_mark_[w] != 0) return;
          gather(w, c.touch);
          dependents_.push_back({static_cast<std::uint32_t>(head), pushed_up, pushed_down, load_on(w, axis)});
        },
        kAtLimitBesideOthers);
  }
  add_from_far_end(
      dependents_, pressed, [&](std::size_t i) { gathered_mark_[gathered_[i].v] = 0; },
      [&](std::size_t i, double load) { touches_[gathered_[i].touch].load[axis] += load; });
}

// Like gather_load_with_pairs(), but for voxels that a rigid surface or a pair presses.
void SoftObject::add_dependents(int axis, std::span<const VoxelId> pressed,
                                std::span<ContactLoad> loads) noexcept {
  const auto& u = state_.u[static_cast<std::size_t>(axis)];
  for (std::size_t i = 0; i < pressed.size(); ++i) {
    if (!lattice_->anchored(pressed[i])) gather(pressed[i], static_cast<std::uint32_t>(i));
  }
  const std::size_t first = gathered_.size();
  dependents_.assign(first, Dependent{});
  const auto walk = [&](std::size_t head, VoxelId w, bool pushed_up, bool pushed_down) {
    if (lattice_->anchored(w)) return;
    const std::uint32_t touch = gathered_[head].touch;
    loads[touch].at_limit = true;
    if (gathered_mark_[w] != 0 || gathered_.size() >= first + kMaxDependents) return;
    gather(w, touch);
    dependents_.push_back({static_cast<std::uint32_t>(head), pushed_up, pushed_down, load_on(w, axis)});
  };
  for (std::size_t head = 0; head < gathered_.size(); ++head) {
    const std::uint32_t touch = gathered_[head].touch;
    const auto known = [&](VoxelId w) { return gathered_mark_[w] != 0 && loads[touch].at_limit; };
    for_tight_neighbours(
        *lattice_, u, gathered_[head].v, axis, known,
        [&](VoxelId w, bool up, bool down) { walk(head, w, up, down); }, kAtLimitBesideOthers);
  }
  add_from_far_end(
      dependents_, first, [&](std::size_t i) { gathered_mark_[gathered_[i].v] = 0; },
      [&](std::size_t i, double load) { loads[gathered_[i].touch].force_N[axis] += load; });
}

// Adds the stiffness of each source with its dependents, all other voxels fixed.
void SoftObject::add_stiffness(int axis, std::span<ContactLoad> loads) noexcept {
  for (const Gathered& c : gathered_) {
    if (gathered_mark_[c.v] == 0) continue;
    const VoxelSprings springs = relaxation_.couplings().springs_of(c.v);
    for (int d = 0; d < 3; ++d) {
      for (const bool up : {false, true}) {
        const VoxelId w = up ? lattice_->up(c.v, d) : lattice_->down(c.v, d);
        if (gathered_mark_[w] != 0 && gathered_index_[w] == c.touch) continue;
        const Spring& spring = (up ? springs.up : springs.down)[static_cast<std::size_t>(d)];
        loads[c.touch].stiffness_N_per_m[axis] += static_cast<double>(spring.on(axis, d));
      }
    }
  }
}

void SoftObject::contact_loads(std::span<const VoxelId> held, std::size_t pressed,
                               std::span<ContactLoad> loads) noexcept {
  for (std::size_t i = 0; i < held.size(); ++i) {
    loads[i] = {.force_N = load_on(held[i]), .stiffness_N_per_m = glm::dvec3(0.0)};
    if (i >= pressed) loads[i].stiffness_N_per_m = 1.0 / compliance(held[i]);
  }
  for (int axis = 0; axis < 3; ++axis) {
    gathered_.clear();
    add_dependents(axis, held.first(pressed), loads);
    add_stiffness(axis, loads);
    for (std::size_t i = pressed; i < held.size(); ++i) {
      if (gathered_mark_[held[i]] != 0) loads[i].force_N[axis] = 0.0;
    }
    clear_gathered();
  }
  const bool tight = std::any_of(loads.begin(), loads.begin() + static_cast<std::ptrdiff_t>(pressed),
                                 [](const ContactLoad& l) { return l.at_limit; });
  // An object that sleeps keeps its multipliers: new ones would wake the bodies that rest on it.
  const bool has_multipliers =
      asleep() ? tight && relaxation_.region().at_limits()
               : relaxation_.relax_region(state_, obstacle_view(), held.first(tight ? pressed : 0));
  if (!has_multipliers) return;
  for (std::size_t i = 0; i < held.size(); ++i) {
    loads[i].has_multipliers = true;
    loads[i].pressed_N = relaxation_.region().pressed_N(held[i]);
  }
}

void SoftObject::relax_at_obstacles(std::span<const VoxelId> pressed) noexcept {
  if (asleep() || !relaxation_.left_to_shadow()) return;
  const bool tight = any_may_be_tight(*lattice_, state_, pressed, kAtLimitBesideOthers);
  relaxation_.relax_region(state_, obstacle_view(), pressed.first(tight ? pressed.size() : 0));
}

void SoftObject::forget_pair_dependents() noexcept {
  for (const VoxelId v : pair_sources_) pair_entry_[lattice_->surface_number(v)] = 0;
  pair_sources_.clear();
  pair_dependents_.clear();
}

void SoftObject::find_pair_dependents() noexcept {
  forget_pair_dependents();
  for (const VoxelId v : claimed_voxels_) {
    if (pair_sources_.size() == pair_sources_.capacity()) break;
    if (!lattice_->anchored(v) && pair_load(lattice_->surface_number(v)) != glm::dvec3(0.0))
      pair_sources_.push_back(v);
  }
  if (!any_may_be_tight(*lattice_, state_, pair_sources_, kAtLimitBesideOthers)) {
    pair_sources_.clear();
    return;
  }
  std::sort(pair_sources_.begin(), pair_sources_.end(), [&](VoxelId v, VoxelId w) {
    const glm::dvec3 of_v = pair_load(lattice_->surface_number(v)),
                     of_w = pair_load(lattice_->surface_number(w));
    const double first = glm::dot(of_v, of_v), second = glm::dot(of_w, of_w);
    return first != second ? first > second : v < w;
  });
  pair_dependents_.assign(pair_sources_.size(), ContactLoad{});
  for (std::size_t i = 0; i < pair_sources_.size(); ++i)
    pair_entry_[lattice_->surface_number(pair_sources_[i])] = static_cast<std::uint32_t>(i + 1);
  for (int axis = 0; axis < 3; ++axis) {
    gathered_.clear();
    add_dependents(axis, pair_sources_, pair_dependents_);
    if (std::any_of(pair_dependents_.begin(), pair_dependents_.end(),
                    [](const ContactLoad& h) { return h.at_limit; })) {
      add_stiffness(axis, pair_dependents_);
      reassign_multiplier(axis);
    }
    clear_gathered();
  }
  if (std::none_of(pair_dependents_.begin(), pair_dependents_.end(),
                   [](const ContactLoad& h) { return h.at_limit; }))
    forget_pair_dependents();
}

// pair_sources_ are the voxels that pairs press, the hardest pressed first. If a link at its limit carries
// the load of one source to a source that is pressed harder, the load is added to that one. Near the hardest
// contact, pairs often press a voxel less than its links pull it. Without this step the load of such a voxel
// would be lost.
void SoftObject::reassign_multiplier(int axis) noexcept {
  const auto& u = state_.u[static_cast<std::size_t>(axis)];
  for (std::size_t i = pair_sources_.size(); i-- > 1;) {
    const VoxelId v = pair_sources_[i];
    if (!pair_dependents_[i].at_limit) continue;
    const double load = load_on(v, axis) + pair_dependents_[i].force_N[axis];
    std::size_t to = i;
    for_tight_neighbours(
        *lattice_, u, v, axis, [](VoxelId) { return false; },
        [&](VoxelId w, bool pushed_up, bool pushed_down) {
          if (!((pushed_up && load > 0.0) || (pushed_down && load < 0.0))) return;
          const std::uint32_t s = lattice_->surface_number(w);
          if (s == kNoSurface || pair_entry_[s] == 0) return;
          to = std::min<std::size_t>(to, pair_entry_[s] - 1U);
        },
        kAtLimitBesideOthers);
    if (to == i) continue;
    pair_dependents_[to].force_N[axis] += load;
    pair_dependents_[to].stiffness_N_per_m[axis] += pair_dependents_[i].stiffness_N_per_m[axis];
  }
}

// Resets all marks to 0. Marks with the number of the search would not need a reset. But a 32-bit number
// would wrap after four days of contact, and then every voxel ever gathered would count as gathered.
void SoftObject::clear_gathered() noexcept {
  for (const Gathered& c : gathered_) gathered_mark_[c.v] = 0;
  gathered_.clear();
}

void SoftObject::add_stiffness(int axis, glm::dmat3& stiffness) noexcept {
  // A gathered voxel moves by q = n_a·n per unit of tool motion, where n is the normal of its touch. A link
  // then stores ½ k (q_v·δ − q_w·δ)².
  const auto along = [&](VoxelId v) {
    if (gathered_mark_[v] == 0) return glm::dvec3(0.0);
    const glm::dvec3& n = touches_[gathered_index_[v]].normal;
    return n[axis] * n;
  };
  for (const Gathered& c : gathered_) {
    if (gathered_mark_[c.v] == 0) continue;
    const glm::dvec3 q = along(c.v);
    // Most voxels depend on the same touch as all their neighbours. Then none of their links is stretched.
    unsigned stretched = 0;
    for (int n = 0; n < 6; ++n) {
      const VoxelId w = n % 2 != 0 ? lattice_->up(c.v, n / 2) : lattice_->down(c.v, n / 2);
      if (gathered_mark_[w] == 0 || gathered_index_[w] != gathered_index_[c.v]) stretched |= 1U << n;
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
            gathered_mark_[w] != 0 ? 0.5 : 1.0;  // an inner link is visited from both its ends
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
  gathered_.clear();
  gathered_mark_[v] = 1;
  gathered_.push_back({v, 0});
  bool held = rests(v);
  for (std::size_t head = 0; head < gathered_.size() && gathered_.size() < kMaxSearched && !held; ++head) {
    const VoxelId c = gathered_[head].v;
    const auto known = [&](VoxelId w) { return held || gathered_mark_[w] != 0; };
    for_tight_neighbours(*lattice_, u, c, axis, known, [&](VoxelId w, bool pushed_up, bool pushed_down) {
      if (held || !(upwards ? pushed_up : pushed_down)) return;
      held = rests(w);
      gathered_mark_[w] = 1;
      gathered_.push_back({w, 0});
    });
  }
  clear_gathered();
  return held;
}

}  // namespace voxel
