// SPDX-License-Identifier: GPL-3.0-or-later
// The material of a soft object that the tool feels: the material of the touched voxel nearest to the tool.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "hybrid/snapshot/materials_of_labels.h"
#include "hybrid/world/world_state.h"

namespace hybrid {

struct FeltMaterial {
  std::string name;
  std::uint64_t contact_ticks = 0;
  double max_force_N = 0.0;  // largest force of the object while this material was under the tool
};

class FeltMaterials {
 public:
  static constexpr std::uint8_t kNone = 255;

  FeltMaterials(const Scene& scene, const World& world);

  // Call after a tick. Counts the material of soft object `o` that is under the tool, and returns its index
  // in of(o). Returns kNone if the object is not felt. Allocates nothing.
  std::uint8_t add(const World& world, const WorldState& state, std::size_t o, double force_N) noexcept;
  // All materials of the object, felt or not.
  [[nodiscard]] const std::vector<FeltMaterial>& of(std::size_t o) const { return felt_[o]; }

 private:
  std::vector<MaterialsOfLabels> materials_;     // [soft object]
  std::vector<std::vector<FeltMaterial>> felt_;  // [soft object][material]
};

}  // namespace hybrid
