// SPDX-License-Identifier: GPL-3.0-or-later
// What a contact has been given, and so may give back: the passivity observer of Hannaford & Ryu (IEEE Trans.
// Robotics & Automation 18, 2002) for tissue whose force is not the slope of an energy to the last per cent.
//
// Where forces are found level by level a path aside costs no force though the tissue is 1 % stiffer there,
// and a tool that comes in at one place and leaves by another would be given that for nothing. What a contact
// is known to hold is at least a third of its force times its depth (a cone within chain limits, E ~ depth³;
// half of it where nothing is at its limit). When what it was given falls below that, its force on the way
// out is a share of what it would be, four fifths at least, and that is not felt as a step: what is gained
// over the last half of the way out is at most what a hundredth of the whole was. Where force is found late,
// in tissue that is stiffer than the tool's coupling, work is counted wrongly; so the share is bounded below,
// and comes back while the tool stands. (Bounded by nothing, such tissue was not felt at all.)
#pragma once

#include <glm/vec3.hpp>

namespace voxel {

class ContactEnergy {
 public:
  // A contact begins: what it holds then was given.
  void begin() noexcept { *this = {}; }
  // Once a tick: the tool went by `way_m` and the tissue's force on it, were nothing taken away, is now
  // force_N, `depth_m` deep.
  void account(const glm::dvec3& way_m, const glm::dvec3& force_N, double depth_m) noexcept;
  // Of the force, 0.8 to 1.
  [[nodiscard]] double share() const { return share_; }

 private:
  bool begun_ = false;
  double given_J_ = 0.0, share_ = 1.0;
  glm::dvec3 felt_N_{0.0};
};

}  // namespace voxel
