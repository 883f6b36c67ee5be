// SPDX-License-Identifier: GPL-3.0-or-later
// Values of a scene that were changed since the session began. World keeps the scene's values. The tick uses
// the edited value where there is one. Edits (edits.h) are made between ticks.
#pragma once

#include <optional>
#include <vector>

#include "hybrid/feel/surface_feel.h"

namespace hybrid {

struct EditedValues {
  std::optional<double> coupling_N_per_m, max_force_N;  // empty: as in World
  std::vector<std::optional<SurfaceFeel>> feel;         // [rigid] empty: as in World
  // [soft] Factor on Young's modulus of tissue, as the tool feels it. Reactions are multiplied by it. This is
  // exact: the lattice is linear and its limits are geometric, so at a given displacement all forces are
  // proportional to Young's modulus.
  std::vector<double> tissue_factor;
};

}  // namespace hybrid
