// SPDX-License-Identifier: GPL-3.0-or-later
// The motions on which settings are compared: the scene's path, and the same path moved sideways. A coarse
// lattice may suit one path by luck. A path that is moved aside by half of the tool's radius meets other
// voxels, but for a hand it is the same touch.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "hybrid/scene/scene.h"
#include "hybrid/tune/play.h"

namespace hybrid {

struct SearchMotion {
  Motion motion;
  std::string words;  // empty: the scene's own path
  ForceCourse truth;
  std::uint64_t part_ticks = 1;  // length of the part that the first round plays
};

// Number of ticks in which something soft is felt.
std::size_t felt_ticks(const ForceCourse& course);
// The ticks up to this share of the contact.
std::uint64_t part_of(const ForceCourse& course, double share);

// A motion along the path of `own`, but `speed` times as fast, and moved to one side by half of the tool's
// radius. The path is moved along the axis of the scene in which the truth's mean force is least, in the
// direction `side` (1 or -1). The truth of the new motion is empty.
SearchMotion moved_motion(const SearchMotion& own, const Scene& scene, double side, double speed);
// Does the moved motion keep at least half of the contact?
bool stays_in_contact(const SearchMotion& moved, const SearchMotion& own, double speed);

}  // namespace hybrid
