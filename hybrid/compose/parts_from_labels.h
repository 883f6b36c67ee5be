// SPDX-License-Identifier: GPL-3.0-or-later
// Parts of a composed scene before it is written: surfaces of bones, tissue, meshes.
#pragma once

#include <array>
#include <glm/vec3.hpp>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "hybrid/build/build_world.h"
#include "hybrid/compose/label_names.h"
#include "hybrid/compose/write_folder.h"
#include "hybrid/scene/tissue_table.h"
#include "voxel/volume/label_volume.h"

namespace hybrid {

// The place of an object as the user gave it, in the units of a scene.
struct Placement {
  glm::dvec3 position_mm{0.0}, rotation_deg{0.0};
};

struct RigidPart {
  std::string name{}, file{};  // file: name within the folder
  std::string unit{};          // length unit of the file: "m", "mm"
  std::string family{};        // parts of one family are pressed once, for example "rib"
  std::string comment{};
  bool repair = false;
  Placement placement{};
};

struct SoftPart {
  std::string name{}, file{};
  std::filesystem::path scan{};              // with the grey values; empty: not known
  std::map<int, const Tissue*> materials{};  // key: label in the file
  std::map<int, std::string> label_names{};  // the same keys
  std::set<int> anchor_labels{};
  bool anchor_bottom = false;
  double rigid_within_mm = 0.0;  // voxels this near to a rigid object are held by it; 0: none
  std::string comment{};
  Placement placement{};
  voxel::LabelVolume volume{};  // as it is in the file
};

// A row of the table that lists each part of the scene and its source.
struct ComposedPart {
  std::string name{};
  bool rigid = false;
  std::size_t voxels = 0, triangles = 0;
  glm::dvec3 size_m{0.0};
  double young_Pa = 0.0, poisson = 0.0;  // only of a soft part
  std::string source{};                  // source of the stiffness, or kind of the surface
};

struct SceneParts {
  std::vector<RigidPart> rigid{};
  std::vector<SoftPart> soft{};
  std::vector<ComposedPart> rows{};
  std::vector<std::string> notes{};
  bool of_a_body = false;  // true: a volume gives the directions x (left), y (back) and z (head) of a body
};

// Reads labels from a file. They are resampled to `spacing_m` if it is given. Throws voxel::VolumeError.
voxel::LabelVolume read_labels(const std::filesystem::path& file, std::optional<double> spacing_m,
                               std::vector<std::string>& notes);

// The labels that become rigid and soft. Other labels are left out.
struct Split {
  std::set<int> rigid{}, soft{};
};
// Splits by the words of --rigid and --soft. Without words the table of tissues decides. The word "none"
// stands for an empty list. Throws ComposeError.
Split split_labels(const LabelNames& names, const std::set<int>& present,
                   const std::vector<std::string>& rigid, const std::vector<std::string>& soft);

// Writes a PLY file for each rigid label and one volume for the soft labels. `fine` has the file's own
// spacing, `tissue` that of the lattice. They may be the same volume.
void add_segmentation(const voxel::LabelVolume& fine, const voxel::LabelVolume& tissue,
                      const LabelNames& names, const Split& split, ComposeFolder& folder, SceneParts& parts,
                      const Progress& progress);

// Adds the tissue of a volume without labels: intensities within `range`, or from Otsu's threshold on.
void add_intensities(const std::filesystem::path& file, const std::string& name, const Placement& placement,
                     std::optional<std::array<double, 2>> range, std::optional<double> spacing_m,
                     ComposeFolder& folder, SceneParts& parts, const Progress& progress);

// Copies and adds a mesh file (unit: mm).
void add_mesh(const std::filesystem::path& file, const std::string& name, const Placement& placement,
              ComposeFolder& folder, SceneParts& parts, const Progress& progress);

// Spacing, equal along all axes, for a volume with too many voxels of tissue or with thick slices. `filled`:
// number of voxels of tissue. With this spacing the tissue answers readily and is felt where it is drawn.
// Empty: the spacing of the volume is good. `why`: gets the reason.
std::optional<double> ready_spacing_m(const voxel::LabelVolume& volume, std::size_t filled, std::string& why);

// The labels that have voxels, with the number of their voxels.
std::map<int, std::size_t> label_counts(const voxel::LabelVolume& volume);

}  // namespace hybrid
