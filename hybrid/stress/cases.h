// SPDX-License-Identifier: GPL-3.0-or-later
// The cases of the extremes suite: scenes that are driven, and scenes that must be refused.
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
  SceneSetting like{};   // for oracle `same`: the scene that must give the same forces
  double same_N = -1.0;  // greatest difference of the forces; negative: not compared
};

// Takes every axis to its ends, and crosses the axes that matter to a loop (stiffness, dt, motion) with one
// another. `quick` leaves out the crossed loops, the large objects and the million coincident triangles.
std::vector<DriveCase> drive_cases(bool quick);

// A scene with one wrong line.
struct RefusedCase {
  SceneKind kind = SceneKind::rigid;
  std::string setting;
  std::string scene;  // the whole text of the scene
};
std::vector<RefusedCase> refused_cases();

}  // namespace hybrid
