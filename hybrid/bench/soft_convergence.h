// SPDX-License-Identifier: GPL-3.0-or-later
// The thesis's Figure 22: an object that was pushed and let go, round after round of relaxation.
#pragma once

#include <string>
#include <vector>

namespace hybrid::bench {

struct SettlingCurve {
  std::string name;
  std::vector<double> displacement;  // [round, from 0] of the pushed voxel from rest, as a share of the push
};
struct SettlingObject {
  std::string name;
  std::vector<SettlingCurve> curves;  // the thesis's relaxation undamped, its remedy, and ours
};

// One voxel pushed and let go, in two objects, so many rounds (cycles) each.
std::vector<SettlingObject> measure_settling(int rounds);

}  // namespace hybrid::bench
