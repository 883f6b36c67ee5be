// SPDX-License-Identifier: GPL-3.0-or-later
// A composed scene as the text that a person goes on to edit.
#pragma once

#include <string>

#include "hybrid/compose/parts_from_labels.h"
#include "hybrid/compose/plan_presses.h"

namespace hybrid {

struct SceneSettings {
  std::string title;
  double tool_radius_m = 2e-3;
  double coupling_N_per_m = 800.0;
};

// By the tissue's lattice where there is one: a contact of four voxels across is felt within a few percent.
// Else by the size of what is touched.
SceneSettings default_settings(const SceneParts& parts);

std::string scene_text(const SceneParts& parts, const SceneSettings& settings, const PressPath& path);

// One rigid primitive and one block of tissue: to begin from where there is no data.
std::string starter_scene();

}  // namespace hybrid
