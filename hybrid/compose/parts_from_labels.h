// SPDX-License-Identifier: GPL-3.0-or-later
// What a composed scene is made of, before it is written down: surfaces of bones, tissue, meshes.
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

// Where a person puts an object, as a scene says it.
struct Placement {
  glm::dvec3 position_mm{0.0}, rotation_deg{0.0};
};

struct RigidPart {
  std::string name{}, file{};  // file: in the folder
  std::string unit{};          // of the file: "m", "mm"
  std::string family{};        // what presses take as one: "rib"
  std::string comment{};
  bool repair = false;
  Placement placement{};
};

struct SoftPart {
  std::string name{}, file{};
  std::map<int, const Tissue*> materials{};  // label in the file to tissue
  std::map<int, std::string> label_names{};  // of the same labels
  std::set<int> anchor_labels{};
  bool anchor_bottom = false;
  double rigid_within_mm = 0.0;  // 0: not held by what is rigid
  std::string comment{};
  Placement placement{};
  voxel::LabelVolume volume{};  // as in the file
};

// A row of the table that says what became what.
struct ComposedPart {
  std::string name{};
  bool rigid = false;
  std::size_t voxels = 0, triangles = 0;
  glm::dvec3 size_m{0.0};
  double young_Pa = 0.0, poisson = 0.0;  // soft
  std::string source{};                  // of the stiffness, or of the surface
};

struct SceneParts {
  std::vector<RigidPart> rigid{};
  std::vector<SoftPart> soft{};
  std::vector<ComposedPart> rows{};
  std::vector<std::string> notes{};
  bool of_a_body = false;  // a volume says where x (left), y (back) and z (head) are
};

// Labels out of a file, resampled to `spacing_m` where that is given. Throws voxel::VolumeError.
voxel::LabelVolume read_labels(const std::filesystem::path& file, std::optional<double> spacing_m,
                               std::vector<std::string>& notes);

// Which labels become what, and what is left out.
struct Split {
  std::set<int> rigid{}, soft{};
};
// By the words of --rigid and --soft; where there are none, by the table of tissues. "none" is the empty
// list. Throws ComposeError.
Split split_labels(const LabelNames& names, const std::set<int>& present,
                   const std::vector<std::string>& rigid, const std::vector<std::string>& soft);

// Writes a PLY for each rigid label and one volume of the soft ones. `fine` is read at the file's own
// spacing, `tissue` at that of the lattice; often the same.
void add_segmentation(const voxel::LabelVolume& fine, const voxel::LabelVolume& tissue,
                      const LabelNames& names, const Split& split, ComposeFolder& folder, SceneParts& parts,
                      const Progress& progress);

// The tissue of an unsegmented volume: intensities within `range`, or above Otsu's threshold.
void add_intensities(const std::filesystem::path& file, const std::string& name, const Placement& placement,
                     std::optional<std::array<double, 2>> range, std::optional<double> spacing_m,
                     ComposeFolder& folder, SceneParts& parts, const Progress& progress);

// A mesh file (unit: mm), copied.
void add_mesh(const std::filesystem::path& file, const std::string& name, const Placement& placement,
              ComposeFolder& folder, SceneParts& parts, const Progress& progress);

// The spacing along all axes at which so many voxels of tissue answer readily and are felt where they are
// drawn; empty: the one they have. `why` says the reason.
std::optional<double> ready_spacing_m(const voxel::LabelVolume& volume, std::size_t filled, std::string& why);

// Labels that have voxels.
std::map<int, std::size_t> label_counts(const voxel::LabelVolume& volume);

}  // namespace hybrid
