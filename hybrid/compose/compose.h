// SPDX-License-Identifier: GPL-3.0-or-later
// `hybrid compose`: from a segmented volume, from meshes and volumes, or from nothing, to a folder with a
// scene that runs.
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
  std::vector<std::filesystem::path> inputs;  // meshes, volumes, DICOM folders; none: a starter scene
  std::filesystem::path labels, names;        // a segmentation and what its labels are called
  std::vector<std::string> rigid,
      soft;                        // names, patterns or numbers of labels; empty: by the table of tissues
  std::vector<std::string> place;  // NAME=x,y,z[,rx,ry,rz] (mm, degrees)
  std::optional<std::array<double, 2>> range;  // intensities that are tissue, of volumes without labels
  std::optional<double> spacing_m;             // of tissue
  std::filesystem::path out;
  bool force = false;
};

struct Composed {
  std::filesystem::path scene{};
  std::vector<ComposedPart> rows{};
  std::vector<std::string> notes{};
  std::vector<std::string> places{};  // where objects lie, and whose boxes overlap, in words
  PressPath path{};
  double path_s = 0.0;
  double tool_radius_m = 0.0;
};

// Writes the folder. The scene is built before it is kept, so what is left behind loads. Throws ComposeError,
// polygon::MeshError, voxel::VolumeError and SceneError in words; then nothing is left behind.
Composed compose(const ComposeOptions& options, const Progress& progress = {});

}  // namespace hybrid
