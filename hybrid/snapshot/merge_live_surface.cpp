// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/snapshot/merge_live_surface.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>
#include <span>

namespace hybrid {
namespace {

// Points within the patch follow the tick's points near them, weighted by the inverse square of their
// distance.
void lay_patch(std::span<const glm::dvec3> at_rest_m, const SoftPatch& patch, std::vector<glm::vec3>& moved) {
  glm::vec3 low = patch.at_rest_m.front(), high = low;
  for (const glm::vec3& at : patch.at_rest_m) {
    low = glm::min(low, at);
    high = glm::max(high, at);
  }
  // Mean distance between the points, if they are spread evenly over a square of the patch's largest size.
  const glm::vec3 size = high - low;
  const float apart = std::max({size.x, size.y, size.z}) /
                      std::sqrt(static_cast<float>(std::max<std::size_t>(patch.at_rest_m.size(), 1)));
  const float reach = 1.5F * apart;
  for (std::size_t v = 0; v < moved.size(); ++v) {
    const glm::vec3 at(at_rest_m[v]);
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

// Interpolates between the nodes of the finest box that contains the point.
glm::vec3 SoftDent::at(const glm::dvec3& at_rest_m) const noexcept {
  const glm::dvec3 point = ((at_rest_m - origin_m) * to_scene) / spacing_m;  // v · R is Rᵀ v
  for (std::size_t n = 0; n < count; ++n) {
    const Box& box = boxes[n];
    std::array<std::size_t, 3> node{};
    std::array<double, 3> part{};
    bool inside = true;
    for (std::size_t d = 0; d < 3; ++d) {
      const double steps = (point[static_cast<int>(d)] - box.first[d]) / box.step, last = box.count[d] - 1.0;
      inside = inside && (!box.open_low[d] || steps >= 0.0) && (!box.open_high[d] || steps <= last);
      const double at = std::clamp(steps, 0.0, last),
                   low = std::clamp(std::floor(at), 0.0, std::max(0.0, last - 1.0));
      node[d] = static_cast<std::size_t>(low);
      part[d] = at - low;
    }
    if (!inside && n + 1 < count) continue;
    glm::dvec3 sum(0.0);
    for (unsigned corner = 0; corner < 8; ++corner) {
      double weight = 1.0;
      std::size_t from = 0;
      for (std::size_t d = 0; d < 3; ++d) {
        const bool high = (corner >> d & 1U) != 0;
        weight *= high ? part[d] : 1.0 - part[d];
        from += (node[d] + (high ? 1U : 0U)) * (d == 0 ? 1 : d == 1 ? box.stride : box.plane);
      }
      if (weight == 0.0) continue;
      for (std::size_t a = 0; a < 3; ++a)
        sum[static_cast<int>(a)] += weight * static_cast<double>(box.moved_m[a][from]);
    }
    return glm::vec3(to_scene * sum);
  }
  return glm::vec3(0.0F);
}

void merge_live_surface(const DrawnScene& scene, const Snapshot& snapshot, const RelaxedTissue& relaxed,
                        const AskedPoints* asked, Snapshot& shown) {
  shown = snapshot;
  const auto lay_dent = [](const SoftDent& dent, std::span<const glm::dvec3> at_rest_m,
                           std::vector<glm::vec3>& moved) {
    moved.assign(at_rest_m.size(), glm::vec3(0.0F));
    if (dent.count == 0) return;
    for (std::size_t v = 0; v < at_rest_m.size(); ++v) moved[v] = dent.at(at_rest_m[v]);
  };
  const auto has = [](const MovedSurfaces& moved, std::size_t o, std::size_t points) {
    return o < moved.size() && points > 0 && moved[o].size() == points;
  };
  const bool answered_in_tick = asked != nullptr && shown.asked.number == asked->number;
  if (!answered_in_tick) shown.asked.moved_m.clear();
  shown.asked.number = asked != nullptr ? asked->number : 0;
  shown.asked.moved_m.resize(scene.objects.size());
  for (std::size_t o = 0; o < std::min(shown.soft_moved_m.size(), scene.objects.size()); ++o) {
    const bool dented = o < shown.dents.size() && shown.dents[o].used;
    const auto& at_rest = scene.objects[o].surface.vertices;
    if (dented) lay_dent(shown.dents[o], at_rest, shown.soft_moved_m[o]);
    if (has(relaxed.surfaces, o, at_rest.size())) {
      shown.soft_moved_m[o] = relaxed.surfaces[o];
      if (o < shown.patches.size() && !shown.patches[o].at_rest_m.empty())
        lay_patch(at_rest, shown.patches[o], shown.soft_moved_m[o]);
    }
    if (asked == nullptr || o >= asked->at_rest_m.size()) continue;
    const std::vector<glm::dvec3>& points = asked->at_rest_m[o];
    if (dented) lay_dent(shown.dents[o], points, shown.asked.moved_m[o]);
    // All displacements come from one state, even if it is some ticks old. Strain is computed from their
    // differences.
    if (relaxed.asked.number == asked->number && has(relaxed.asked.moved_m, o, points.size()))
      shown.asked.moved_m[o] = relaxed.asked.moved_m[o];
  }
}

}  // namespace hybrid
