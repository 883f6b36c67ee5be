// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/palette.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <map>
#include <optional>

#include "hybrid/scene/tissue_table.h"

namespace hybrid::palette {
namespace {

constexpr float kAlike = 0.25F;  // colours at a smaller distance look alike at a glance

// The customary colour of a known tissue. Results are kept, because every frame asks for the same names.
std::optional<glm::vec3> customary(const std::string& name) {
  thread_local std::map<std::string, std::optional<glm::vec3>> known;
  const auto [at, fresh] = known.try_emplace(name);
  if (fresh && !name.empty()) {
    if (const Tissue* const tissue = find_tissue(name)) at->second = tissue->colour;
  }
  return at->second;
}

std::optional<glm::vec3> customary(const DrawnObject& object) {
  const auto by_name = customary(object.name);
  return by_name ? by_name : customary(object.material);
}

// Colours for materials without a customary one. They differ from the colours that the scene already has.
std::vector<glm::vec3> free_for_materials(const DrawnScene& scene) {
  std::vector<glm::vec3> free(material.begin(), material.end());
  const auto take = [&](const glm::vec3& own) {
    std::erase_if(free, [&](const glm::vec3& c) { return glm::distance(c, own) < kAlike; });
  };
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const DrawnObject& object = scene.objects[i];
    if (!object.soft) continue;
    if (object.materials.empty() && free.size() > kLeastFree) take(of_object(scene, i));
    for (const std::string& name : object.materials) {
      if (const auto known = customary(name); known && free.size() > kLeastFree) take(*known);
    }
  }
  return free;
}

}  // namespace

glm::vec3 of_object(const DrawnScene& scene, std::size_t index) {
  const DrawnObject& object = scene.objects[index];
  if (const auto known = customary(object)) return *known;
  std::size_t rank = 0;
  for (std::size_t i = 0; i < index; ++i)
    rank += scene.objects[i].soft == object.soft && !customary(scene.objects[i]) ? 1U : 0U;
  return object.soft ? soft[rank % soft.size()] : rigid[rank % rigid.size()];
}

std::vector<glm::vec3> of_materials(const DrawnScene& scene, std::size_t index) {
  if (scene.objects[index].materials.empty()) return {of_object(scene, index)};
  const std::vector<glm::vec3> free = free_for_materials(scene);
  std::vector<std::string> dealt;
  std::vector<glm::vec3> colours;
  for (std::size_t i = 0; i <= index; ++i) {
    for (const std::string& name : scene.objects[i].materials) {
      const auto known = customary(name);
      const auto rank = static_cast<std::size_t>(std::ranges::find(dealt, name) - dealt.begin());
      if (!known && rank == dealt.size()) dealt.push_back(name);
      if (i == index) colours.push_back(known ? *known : rank < free.size() ? free[rank] : other_material);
    }
  }
  return colours;
}

std::vector<glm::vec3> of_inside(const DrawnScene& scene, std::size_t index) {
  const DrawnObject& object = scene.objects[index];
  const std::vector<glm::vec3> visible = of_materials(scene, index);
  const std::vector<glm::vec3> free = free_for_materials(scene);
  // Hidden materials without a customary colour; they get the free colours from the end.
  std::size_t hidden = 0;
  std::vector<glm::vec3> colours;
  for (const std::string& name : object.inside.materials) {
    const auto at =
        static_cast<std::size_t>(std::ranges::find(object.materials, name) - object.materials.begin());
    if (at < object.materials.size()) {
      colours.push_back(visible[at]);
    } else if (object.materials.empty() && name == object.inside.materials.front()) {
      colours.push_back(visible.front());
    } else if (const auto known = customary(name)) {
      colours.push_back(*known);
    } else {
      colours.push_back(free[free.size() - 1 - hidden++ % free.size()]);
    }
  }
  return colours;
}

std::vector<VertexColour> of_vertices(const DrawnScene& scene, std::size_t index) {
  const DrawnObject& object = scene.objects[index];
  if (object.materials.empty()) return {};
  std::vector<VertexColour> of_material, of_vertex;
  for (const glm::vec3& c : of_materials(scene, index)) of_material.push_back(bytes_of(c));
  of_vertex.reserve(object.vertex_material.size());
  for (const std::uint8_t m : object.vertex_material)
    of_vertex.push_back(of_material[std::min<std::size_t>(m, of_material.size() - 1)]);
  return of_vertex;
}

double scale_end(double moved_m) {
  const double power = std::pow(10.0, std::floor(std::log10(moved_m)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (step * power >= moved_m * (1.0 - 1e-6)) return step * power;
  }
  return 10.0 * power;
}

glm::vec3 of_displacement(const glm::vec3& own, float share, const RampStart& start) {
  const float t = std::clamp(share, 0.0F, 1.0F);
  const float at = t * static_cast<float>(moved.size() - 1);
  const std::size_t low = std::min(static_cast<std::size_t>(at), moved.size() - 2);
  const glm::vec3 ramp = glm::mix(moved[low], moved[low + 1], at - static_cast<float>(low));
  return glm::mix(own, ramp, glm::smoothstep(start.own_until, start.ramp_from, t));
}

}  // namespace hybrid::palette
