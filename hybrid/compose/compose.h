// SPDX-License-Identifier: GPL-3.0-or-later
// `hybrid compose`: writes a folder with a scene that runs. Sources: a segmented volume, meshes and volumes,
// or nothing (a starter scene).
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "hybrid/compose/parts_from_labels.h"
#include "hybrid/compose/plan_presses.h"

namespace hybrid {

struct ComposeOptions {
  std::vector<std::filesystem::path> inputs;  // meshes, volumes, DICOM folders; empty: a starter scene
  std::filesystem::path labels, names;        // a segmentation, and the table of its labels' names
  // Names, patterns or numbers of labels. Empty: the table of tissues decides.
  std::vector<std::string> rigid, soft;
  std::vector<std::string> place;              // NAME=x,y,z[,rx,ry,rz] (mm, degrees)
  std::optional<std::array<double, 2>> range;  // intensities that are tissue, in volumes without labels
  std::optional<double> spacing_m;             // spacing of tissue
  std::filesystem::path out;
  bool force = false;
};

struct Composed {
  std::filesystem::path scene{};
  std::vector<ComposedPart> rows{};
  std::vector<std::string> notes{};
  std::vector<std::string> places{};  // positions of objects and overlaps of their boxes, in words
  PressPath path{};
  double path_s = 0.0;
  double tool_radius_m = 0.0;
};

// Writes the folder. The scene is loaded before the folder is kept, so that a scene that does not load is not
// left behind. Throws ComposeError, polygon::MeshError, voxel::VolumeError and SceneError in words. Then
// nothing is left behind.
Composed compose(const ComposeOptions& options, const Progress& progress = {});

}  // namespace hybrid
