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
constexpr double kComesBack = 0.02;  // fraction of the missing energy that is forgiven in a tick at rest

}  // namespace

void ContactEnergy::account(const glm::dvec3& way_m, const glm::dvec3& force_N, double depth_m) noexcept {
  const double force = glm::length(force_N), held_J = kHeld * force * std::max(depth_m, 0.0);
  if (!begun_ || force < kNoContact_N) {
    given_J_ = held_J;
    begun_ = true;
  } else {
    const double pressed_J = -0.5 * glm::dot(last_N_ + force_N, way_m);
    given_J_ += pressed_J > 0.0 ? pressed_J : share_ * pressed_J;
    if (std::abs(pressed_J) < kStands * held_J) {
      // Tissue that relaxes under a tool at rest takes no energy from the tool.
      given_J_ = std::max(given_J_, share_ * kLetGo * held_J);
      given_J_ += kComesBack * std::max(kLetGo * held_J - given_J_, 0.0);
    }
    given_J_ = std::max(given_J_, kLeast * kLetGo * held_J);
  }
  share_ = held_J > 0.0 ? std::min(given_J_ / (kLetGo * held_J), 1.0) : 1.0;
  last_N_ = force_N;
}

}  // namespace voxel
