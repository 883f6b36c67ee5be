// SPDX-License-Identifier: GPL-3.0-or-later
// Multipliers of the region, kept from call to call and handed to the coarse levels as loads.
#include "voxel/relaxation/admm_region.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace voxel {

namespace {

// A voxel loses its multipliers when more than this many calls of relax() and skip() in turn did not use
// them.
constexpr std::uint32_t kRemembered = 8;
// Largest extra depth that a voxel may gain in its half-space (unit: spacing).
constexpr double kDeeper = 1e-3;

}  // namespace

// Fraction of the motion from `from` to `found` that minimises the energy, at most 1. It is limited by the
// voxels' depth in their half-spaces.
double AdmmRegion::share() const noexcept {
  double most = 1.0, slope = 0.0, curvature = 0.0;
  for (std::size_t i = 0; i < members_.size(); ++i) {
    const Member& m = members_[i];
    for (std::size_t axis = 0; axis < 3 && m.moves; ++axis)
      slope -= m.load_N[axis] * (m.found[axis] - m.from[axis]);
    for (std::size_t d = 0; d < 3; ++d) {
      if (m.up[d] == kNone) continue;
      const Link& l = links_[3 * i + d];  // its stiffness is 0 if neither end moves
      const Member& n = members_[m.up[d]];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double is = n.from[axis] - m.from[axis], more = n.found[axis] - m.found[axis] - is;
        slope += l.stiff_N_per_m[axis] * is * more;
        curvature += l.stiff_N_per_m[axis] * more * more;
      }
    }
    if (!m.outside || !m.moves) continue;
    const double was = depth_in_obstacle(m.plane, {m.from[0], m.from[1], m.from[2]}),
                 is = depth_in_obstacle(m.plane, {m.found[0], m.found[1], m.found[2]}),
                 room = std::max(0.0, -was) + kDeeper * spacing_m_;
    if (is > was && most * (is - was) > room) most = room / (is - was);
  }
  return slope < 0.0 && curvature > 0.0 ? std::min(most, -slope / curvature) : 0.0;
}

void AdmmRegion::forget(Multigrid& multigrid, VoxelId v) noexcept {
  multigrid.set_limit_load(v, glm::vec3(0.0F));
  const auto forget_of = [v](LazyArray<float>& of_axis) {
    if (of_axis[v] != 0.0F) of_axis[v] = 0.0F;  // writing a zero would allocate an untouched page
  };
  for (auto& of_axis : beyond_) forget_of(of_axis);
  for (auto& of_axis : pressed_) forget_of(of_axis);
  asked_[v] = 0;
}

void AdmmRegion::forget(Multigrid& multigrid) noexcept {
  for (const Member& m : members_) number_[m.v] = 0;
  members_.clear();
  on_body_.clear();
  for (const VoxelId v : known_) forget(multigrid, v);
  known_.clear();
  at_limits_ = false;
}

void AdmmRegion::skip(Multigrid& multigrid) noexcept {
  if (known_.empty()) return;
  ++calls_;
  std::size_t kept = 0;
  for (const VoxelId v : known_) {
    if (calls_ - asked_[v] > kRemembered) {
      forget(multigrid, v);
    } else {
      known_[kept++] = v;
    }
  }
  known_.resize(kept);
}

void AdmmRegion::keep_multipliers(Multigrid& multigrid) noexcept {
  for (std::size_t i = 0; i < members_.size(); ++i) {
    const Member& m = members_[i];
    if (asked_[m.v] == 0) {
      if (known_.size() == known_.capacity()) continue;
      known_.push_back(m.v);
    }
    asked_[m.v] = calls_ + 1;  // skip() below will increment calls_ to this number
    glm::vec3 pull(0.0F);
    for_links(i, [&](const Link& l, const Member&, bool up) {
      for (std::size_t axis = 0; axis < 3 && m.moves; ++axis) {
        const auto force = static_cast<float>(kOfLink * l.stiff_N_per_m[axis] * l.beyond[axis]);
        pull[static_cast<int>(axis)] += up ? force : -force;
      }
    });
    multigrid.set_limit_load(m.v, pull);
    const auto keep = [&](LazyArray<float>& of_axis, double value) {
      const auto is = static_cast<float>(value);
      if (of_axis[m.v] != is) of_axis[m.v] = is;
    };
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (std::size_t d = 0; d < 3; ++d) {
        if (m.moves || (m.up[d] != kNone && members_[m.up[d]].moves))
          keep(beyond_[3 * axis + d], links_[3 * i + d].beyond[axis]);
      }
      if (m.moves) keep(pressed_[axis], m.outside ? m.pressed[axis] * m.hold_N_per_m : 0.0);
    }
  }
  skip(multigrid);
}

}  // namespace voxel
