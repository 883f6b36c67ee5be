// SPDX-License-Identifier: GPL-3.0-or-later
// The colours of pictures, window and legend. One table serves all three, so that they agree. Objects differ
// in hue and in lightness, so that colour-blind readers can tell them apart (after Okabe & Ito 2008).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

#include "hybrid/snapshot/snapshot.h"

namespace hybrid::palette {

// sRGB, 0 to 1.
inline constexpr glm::vec3 background{0.945F, 0.953F, 0.962F};
inline constexpr glm::vec3 tool{0.13F, 0.17F, 0.24F};
inline constexpr glm::vec3 device{0.10F, 0.45F, 0.85F};
inline constexpr glm::vec3 force{0.03F, 0.38F, 0.93F};
// The displacement scale runs from the object's own colour over these two.
inline constexpr glm::vec3 moved_half{1.00F, 0.84F, 0.25F};
inline constexpr glm::vec3 moved_most{0.78F, 0.08F, 0.16F};

inline constexpr std::array<glm::vec3, 4> rigid{
    {{0.89F, 0.84F, 0.72F}, {0.78F, 0.77F, 0.74F}, {0.80F, 0.71F, 0.55F}, {0.66F, 0.68F, 0.72F}}};
inline constexpr std::array<glm::vec3, 6> soft{{{0.86F, 0.58F, 0.62F},
                                                {0.30F, 0.66F, 0.62F},
                                                {0.58F, 0.53F, 0.82F},
                                                {0.52F, 0.72F, 0.36F},
                                                {0.36F, 0.62F, 0.85F},
                                                {0.75F, 0.48F, 0.72F}}};

// Colours of the materials of one object. A search in Oklab maximised the least distance between any two, for
// normal vision and for vision without the first or the second cone type (Machado et al. 2009), and the
// distance to the colours above. Each differs from every other in hue or in lightness. The first colours are
// furthest from each other.
inline constexpr std::array<glm::vec3, 10> material{{{0.86F, 0.57F, 0.57F},
                                                     {0.54F, 0.71F, 0.96F},
                                                     {0.74F, 0.90F, 0.56F},
                                                     {0.54F, 0.28F, 0.53F},
                                                     {0.36F, 0.56F, 0.62F},
                                                     {0.98F, 0.79F, 0.94F},
                                                     {0.45F, 0.37F, 0.33F},
                                                     {0.68F, 0.52F, 0.80F},
                                                     {0.61F, 0.62F, 0.37F},
                                                     {0.20F, 0.38F, 0.68F}}};
// All materials beyond these share one neutral colour, so that no colour stands for two materials.
inline constexpr glm::vec3 other_material{0.50F, 0.50F, 0.50F};

// Colour of object `index`: the n-th rigid (or soft) object has the n-th colour of its kind.
inline glm::vec3 of_object(const DrawnScene& scene, std::size_t index) {
  std::size_t rank = 0;
  const bool is_soft = scene.objects[index].soft;
  for (std::size_t i = 0; i < index; ++i) rank += scene.objects[i].soft == is_soft ? 1U : 0U;
  return is_soft ? soft[rank % soft.size()] : rigid[rank % rigid.size()];
}

// Colours that are available to materials: those unlike the colours of soft objects with a single material.
inline std::vector<glm::vec3> free_for_materials(const DrawnScene& scene) {
  constexpr float alike = 0.25F;
  std::vector<glm::vec3> free(material.begin(), material.end());
  std::size_t rank = 0;
  for (const DrawnObject& object : scene.objects) {
    if (!object.soft) continue;
    const glm::vec3 own = soft[rank++ % soft.size()];
    if (!object.materials.empty()) continue;
    std::erase_if(free, [&](const glm::vec3& c) { return glm::distance(c, own) < alike; });
    if (rank >= soft.size()) break;  // later ones repeat the same colours
  }
  return free;
}

// Colours of an object's materials, in their order; the object's own colour if it has none. A material has
// one colour in the whole scene: colours are assigned by name, object after object.
inline std::vector<glm::vec3> of_materials(const DrawnScene& scene, std::size_t index) {
  if (scene.objects[index].materials.empty()) return {of_object(scene, index)};
  const std::vector<glm::vec3> free = free_for_materials(scene);
  std::vector<std::string> dealt;
  std::vector<glm::vec3> colours;
  for (std::size_t i = 0; i <= index; ++i) {
    for (const std::string& name : scene.objects[i].materials) {
      const auto rank = static_cast<std::size_t>(std::ranges::find(dealt, name) - dealt.begin());
      if (rank == dealt.size()) dealt.push_back(name);
      if (i == index) colours.push_back(rank < free.size() ? free[rank] : other_material);
    }
  }
  return colours;
}

// Colour of a point that moved by `share` (0 to 1) of the scale's end, on an object of colour `own`. The
// renderer's shader computes the same formula.
inline glm::vec3 of_displacement(const glm::vec3& own, float share) {
  const float t = share < 0.0F ? 0.0F : (share > 1.0F ? 1.0F : share);
  return t < 0.5F ? glm::mix(own, moved_half, t * 2.0F) : glm::mix(moved_half, moved_most, t * 2.0F - 1.0F);
}

}  // namespace hybrid::palette
