// SPDX-License-Identifier: GPL-3.0-or-later
// A composed scene as text that a person can edit.
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

// Settings for these parts. With tissue the tool's radius is at least two spacings of its lattice: a contact
// four voxels wide is felt within a few percent. Otherwise the radius follows from the size of the objects.
SceneSettings default_settings(const SceneParts& parts);

std::string scene_text(const SceneParts& parts, const SceneSettings& settings, const PressPath& path);

// A scene with one rigid primitive and one block of tissue, as a start without data.
std::string starter_scene();

}  // namespace hybrid
