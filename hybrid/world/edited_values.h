// SPDX-License-Identifier: GPL-3.0-or-later
// Values of a scene that were changed since the session began. World keeps those of the scene; the tick takes
// the edited one where there is one. Edits (edits.h) set them between ticks.
#pragma once

#include <optional>
#include <vector>

#include "hybrid/feel/surface_feel.h"

namespace hybrid {

struct EditedValues {
  std::optional<double> coupling_N_per_m, max_force_N;  // empty: as in World
  std::vector<std::optional<SurfaceFeel>> feel;         // [rigid] empty: as in World
  // [soft] Factor on the stiffness of tissue towards the tool. The lattice is linear, and its limits are
  // geometric: at one displacement all its forces are proportional to Young's modulus.
  std::vector<double> tissue_factor;
};

}  // namespace hybrid
