// SPDX-License-Identifier: GPL-3.0-or-later
// What the extremes suite crosses: the cases that are driven, and the scenes that must be refused.
#pragma once

#include <string>
#include <vector>

#include "hybrid/stress/drive.h"
#include "hybrid/stress/scenes.h"

namespace hybrid {

struct DriveCase {
  SceneSetting scene;
  Motion motion = Motion::path;
  std::string setting;   // in words
  SceneSetting like{};   // for `same`: the scene that it must feel like,
  double same_N = -1.0;  // within this; negative: it is not asked
};

// Every axis to its ends, and the axes that matter to a loop (stiffness, dt, motion) crossed with one
// another. `quick`: the ends, each with one motion.
std::vector<DriveCase> drive_cases(bool quick);

// A scene of which one line is wrong.
struct RefusedCase {
  SceneKind kind = SceneKind::rigid;
  std::string setting;
  std::string scene;  // the whole text
};
std::vector<RefusedCase> refused_cases();

}  // namespace hybrid
