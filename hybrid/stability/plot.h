// SPDX-License-Identifier: GPL-3.0-or-later
// Z-width: the stiffness up to which a virtual wall is stable and passive. Theory is drawn as lines,
// measurements as dots.
#pragma once

#include <string>
#include <vector>

#include "hybrid/plot/svg_figure.h"

namespace hybrid {

struct BoundaryCurve {
  std::string name;                       // for example "no delay"
  std::vector<double> x, theory_N_per_m;  // x rises
  std::vector<double> measured_x, measured_N_per_m;
};
struct BoundaryPanel {
  std::string title;
  std::vector<BoundaryCurve> curves;  // curves with the same index have the same colour in all panels
};
struct BoundaryGroup {
  std::string x_label;  // with its unit
  std::vector<BoundaryPanel> panels;
};

Figure stability_figure(const std::vector<BoundaryGroup>& groups, const std::string& title,
                        const std::vector<std::string>& notes);

}  // namespace hybrid
