// SPDX-License-Identifier: GPL-3.0-or-later
// The thesis's Figure 22: an object is pushed and let go, and relaxed round after round.
#pragma once

#include <string>
#include <vector>

namespace hybrid::bench {

struct SettlingCurve {
  std::string name;
  std::vector<double>
      displacement;  // [round, from 0]; distance of the pushed voxel from rest, as a share of the push
};
struct SettlingObject {
  std::string name;
  std::vector<SettlingCurve> curves;  // thesis's relaxation undamped; thesis's remedy; ours
};

// Pushes one voxel and lets it go, in each of two objects. Each is relaxed for `rounds` rounds (cycles).
std::vector<SettlingObject> measure_settling(int rounds);

}  // namespace hybrid::bench
