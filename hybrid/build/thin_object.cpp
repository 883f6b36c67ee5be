// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/build/thin_object.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "voxel/volume/interior_coarsening.h"

namespace hybrid {
namespace {

// Labels of the volume whose material is at least as stiff as the threshold.
std::vector<std::uint8_t> stiff_labels(const voxel::LabelVolume& volume, const voxel::LatticeOptions& options,
                                       double above_Pa) {
  std::array<bool, 256> used{};
  for (const std::uint8_t label : volume.labels) used[label] = true;
  std::vector<std::uint8_t> labels;
  for (std::size_t label = 1; label < 256; ++label) {
    if (used[label] && options.materials[label].young_Pa >= above_Pa)
      labels.push_back(static_cast<std::uint8_t>(label));
  }
  if (labels.empty()) {
    throw std::invalid_argument(
        fmt::format("thinning: no material of the object has a Young's modulus of {:.3g} Pa or more; lower "
                    "'above', or name labels",
                    above_Pa));
  }
  return labels;
}

}  // namespace

void thin_object(const Scene& scene, const SoftDescription& description, voxel::LabelVolume& volume,
                 voxel::LatticeOptions& options, SoftBody& body, std::vector<BuildNote>& notes) {
  const Thinning& thinning = *description.thinning;
  voxel::ThinningOptions how{.labels = thinning.labels,
                             .every = thinning.every,
                             .shell = thinning.shell,
                             .tool_radius_m = scene.tool.radius_m};
  voxel::Thinned thinned;
  try {
    if (how.labels.empty()) how.labels = stiff_labels(volume, options, thinning.above_Pa);
    for (const std::uint8_t label : how.labels)
      how.stretch_max = std::max(how.stretch_max, options.materials[label].stretch_max);
    thinned = voxel::thin_labels(std::move(volume), how);
  } catch (const std::invalid_argument& error) {
    throw SceneError(scene.file, thinning.place, fmt::format("\"{}\": {}", description.name, error.what()));
  }
  volume = std::move(thinned.volume);
  for (std::size_t label = 1; label < 256; ++label) {
    const std::uint8_t strut = thinned.strut_label[label];
    if (strut == 0) continue;
    options.materials[label].bricks = false;  // struts are longer links, never bricks
    options.materials[strut] = options.materials[label];
    options.materials[strut].young_Pa *= static_cast<double>(thinning.every) * thinning.every;
    auto& anchors = options.anchor_labels;
    if (std::find(anchors.begin(), anchors.end(), label) != anchors.end()) anchors.push_back(strut);
    body.struts.push_back({strut, static_cast<std::uint8_t>(label)});
  }
  body.thinned = thinned.removed;
  notes.push_back(
      {description.name, polygon::Severity::info,
       fmt::format("thinning left out {} of {} stiff voxels ({:.0f} %)", thinned.removed, thinned.stiff,
                   100.0 * static_cast<double>(thinned.removed) / static_cast<double>(thinned.stiff))});
}

}  // namespace hybrid
