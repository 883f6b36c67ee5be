// SPDX-License-Identifier: GPL-3.0-or-later
// Z-width: up to which stiffness a virtual wall is stable and passive, theory as lines and what was measured
// as dots.
#pragma once

#include <string>
#include <vector>

#include "hybrid/plot/svg_figure.h"

namespace hybrid {

struct BoundaryCurve {
  std::string name;                       // "no delay"
  std::vector<double> x, theory_N_per_m;  // rising x
  std::vector<double> measured_x, measured_N_per_m;
};
struct BoundaryPanel {
  std::string title;
  std::vector<BoundaryCurve> curves;  // the same place in each panel has the same colour
};
struct BoundaryGroup {
  std::string x_label;  // with its unit
  std::vector<BoundaryPanel> panels;
};

Figure stability_figure(const std::vector<BoundaryGroup>& groups, const std::string& title,
                        const std::vector<std::string>& notes);

}  // namespace hybrid
