// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/session/felt_materials.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <limits>

namespace hybrid {

FeltMaterials::FeltMaterials(const Scene& scene, const World& world) {
  for (std::size_t o = 0; o < world.soft.size(); ++o) {
    materials_.push_back(materials_of_labels(scene.soft[o], world.soft[o]));
    std::vector<FeltMaterial>& felt = felt_.emplace_back();
    for (const std::string& name : materials_.back().names) felt.push_back({.name = name});
  }
}

std::uint8_t FeltMaterials::add(const World& world, const WorldState& state, std::size_t o,
                                double force_N) noexcept {
  const voxel::SoftObject& object = *state.soft[o];
  if (!(force_N > 0.0) || object.touched().empty()) return kNone;
  std::uint8_t material = 0;
  if (felt_[o].size() > 1) {
    const glm::dvec3 tool = world.soft[o].to_body(state.proxy_m);
    double nearest = std::numeric_limits<double>::max();
    for (const voxel::VoxelId v : object.touched()) {
      const glm::dvec3 away = object.position(v) - tool;
      const double square = glm::dot(away, away);
      if (square >= nearest) continue;
      nearest = square;
      material = materials_[o].of_label[object.lattice().label(v)];
    }
  }
  FeltMaterial& felt = felt_[o][material];
  ++felt.contact_ticks;
  felt.max_force_N = std::max(felt.max_force_N, force_N);
  return material;
}

}  // namespace hybrid
