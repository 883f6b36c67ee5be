// SPDX-License-Identifier: GPL-3.0-or-later
// Observes the energy that a contact was given and may give back: the passivity observer of Hannaford & Ryu
// (IEEE Trans. Robotics & Automation 18, 2002), for tissue whose force is only approximately the gradient of
// an energy.
//
// On nested patches a sideways motion may meet no force although it leads to tissue that is 1 % stiffer. A
// tool that enters at the softer place and leaves at the stiffer one would then gain energy.
//
// A contact stores at least a third of force times depth. (It stores a third if active chain limits give the
// dent the shape of a cone, where E ~ depth³, and half without active limits.) If the contact was given less,
// the force is scaled by share(), the ratio of the two energies, which is at least 0.8. The lower bound is
// needed because work is counted wrongly where tissue is stiffer than the tool's coupling. The share is the
// same for a tool that goes in and one that goes out. A share that changes with the direction makes the tool
// move to and fro. The share returns to 1 while the tool presses on or rests. A new contact begins with 1.
#pragma once

#include <glm/vec3.hpp>

namespace voxel {

class ContactEnergy {
 public:
  static constexpr double kNoContact_N = 1e-5;  // a smaller force ends a contact
  // Call it when a contact begins. At the next account() the contact counts as given exactly the energy that
  // it then stores, a third of force times depth. From then on work of the tool is added.
  void begin() noexcept { *this = {}; }
  // Once a tick: the tool moved by `way_m`; force_N is the tissue's force on it before scaling, at depth
  // `depth_m`.
  void account(const glm::dvec3& way_m, const glm::dvec3& force_N, double depth_m) noexcept;
  // Factor for the force, 0.8 to 1.
  [[nodiscard]] double share() const { return share_; }

 private:
  bool begun_ = false;
  double given_J_ = 0.0, share_ = 1.0;
  glm::dvec3 last_N_{0.0};
};

}  // namespace voxel
