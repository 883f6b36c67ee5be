// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/live_surface.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

namespace hybrid {
namespace {

// Vertices that the patch surrounds go along with its points near them, by the inverse of their distance.
void lay_patch(const polygon::TriangleMesh& surface, const SoftPatch& patch, std::vector<glm::vec3>& moved) {
  glm::vec3 low = patch.at_rest_m.front(), high = low;
  for (const glm::vec3& at : patch.at_rest_m) {
    low = glm::min(low, at);
    high = glm::max(high, at);
  }
  // A patch of n points over an area: about so far apart.
  const glm::vec3 size = high - low;
  const float apart = std::max({size.x, size.y, size.z}) /
                      std::sqrt(static_cast<float>(std::max<std::size_t>(patch.at_rest_m.size(), 1)));
  const float reach = 1.5F * apart;
  for (std::size_t v = 0; v < moved.size(); ++v) {
    const glm::vec3 at(surface.vertices[v]);
    if (glm::any(glm::lessThan(at, low - reach)) || glm::any(glm::greaterThan(at, high + reach))) continue;
    glm::vec3 sum(0.0F);
    float weights = 0.0F;
    for (std::size_t p = 0; p < patch.at_rest_m.size(); ++p) {
      const float distance = glm::distance(at, patch.at_rest_m[p]);
      if (distance > reach) continue;
      const float weight = 1.0F / std::max(distance * distance, 1e-4F * reach * reach);
      sum += weight * patch.moved_m[p];
      weights += weight;
    }
    if (weights > 0.0F) moved[v] = sum / weights;
  }
}

}  // namespace

void show_live(const DrawnScene& scene, const Snapshot& snapshot, const RelaxationThread::Moved& surfaces,
               Snapshot& shown) {
  shown = snapshot;
  for (std::size_t o = 0; o < std::min(surfaces.size(), shown.soft_moved_m.size()); ++o) {
    if (surfaces[o].empty()) continue;
    shown.soft_moved_m[o] = surfaces[o];
    if (o < shown.patches.size() && !shown.patches[o].at_rest_m.empty())
      lay_patch(scene.objects[o].surface, shown.patches[o], shown.soft_moved_m[o]);
  }
}

}  // namespace hybrid
