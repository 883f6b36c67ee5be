// SPDX-License-Identifier: GPL-3.0-or-later
#include "voxel/object/contact_energy_observer.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace voxel {
namespace {

constexpr double kHeld = 1.0 / 3.0;  // fraction of force times depth: least energy that a contact stores
constexpr double kLetGo = 0.97;  // fraction of the stored energy; if less was given, the force is scaled down
constexpr double kLeast = 0.8;   // lower bound of the share, because work may be counted wrongly
constexpr double kStands = 1e-5;     // fraction of the stored energy; with less work in a tick the tool rests
constexpr double kComesBack = 0.02;  // fraction of 1 − share that is restored in a tick at rest
constexpr double kRegained = 0.1;    // fraction of the stored energy: work that restores half of 1 − share

}  // namespace

void ContactEnergy::account(const glm::dvec3& way_m, const glm::dvec3& force_N, double depth_m) noexcept {
  const double force = glm::length(force_N), held_J = kHeld * force * std::max(depth_m, 0.0);
  if (!begun_ || force == 0.0) {
    given_J_ = held_J;
    share_ = 1.0;
    begun_ = true;
  } else {
    given_J_ -= 0.5 * glm::dot(felt_N_ + share_ * force_N, way_m);
    const double pressed_J = -glm::dot(force_N, way_m);
    if (std::abs(pressed_J) < kStands * held_J) {
      share_ += kComesBack * (1.0 - share_);
    } else if (pressed_J > 0.0) {
      share_ += (1.0 - share_) * pressed_J / (kRegained * held_J + pressed_J);
    } else if (given_J_ < kLetGo * held_J) {
      share_ = std::min(share_, std::max(given_J_ / (kLetGo * held_J), kLeast));
    }
  }
  felt_N_ = share_ * force_N;
}

}  // namespace voxel
