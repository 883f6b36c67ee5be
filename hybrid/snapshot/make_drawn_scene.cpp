// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/snapshot/make_drawn_scene.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <span>

#include "hybrid/snapshot/drawn_relief.h"
#include "hybrid/snapshot/materials_of_labels.h"

namespace hybrid {
namespace {

constexpr double kDrawnPoint = 0.004;  // smallest drawn radius of a tool (unit: the scene's extent)

// The material of most voxels around a vertex. A vertex lies within one cube between eight voxel centres, of
// which at least one is filled. Ties go to the material that was named first.
std::uint8_t material_beneath(const voxel::Lattice& lattice, const MaterialsOfLabels& materials,
                              const glm::dvec3& vertex_m) {
  std::array<int, 3> cell{};
  for (std::size_t a = 0; a < 3; ++a) {
    const auto axis = static_cast<glm::length_t>(a);
    const double at = std::floor(vertex_m[axis] / lattice.spacing_m()[axis]);
    cell[a] = static_cast<int>(std::clamp(at, -1.0, lattice.grid().dims[a] - 1.0));
  }
  std::array<std::uint8_t, 8> seen{};
  std::size_t count = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const voxel::VoxelId v =
        lattice.at(cell[0] + (corner & 1), cell[1] + ((corner >> 1) & 1), cell[2] + (corner >> 2));
    if (lattice.filled(v)) seen[count++] = materials.of_label[lattice.label(v)];
  }
  std::sort(seen.begin(), seen.begin() + static_cast<std::ptrdiff_t>(count));
  std::uint8_t best = 0;
  std::size_t most = 0;
  for (std::size_t i = 0, run = 0; i < count; ++i) {
    run = i > 0 && seen[i] == seen[i - 1] ? run + 1 : 1;
    if (run <= most) continue;
    most = run;
    best = seen[i];
  }
  return best;
}

// Surface area of each material (m²); a triangle is divided among its corners.
std::vector<double> area_of_materials(const polygon::TriangleMesh& mesh,
                                      std::span<const std::uint8_t> vertex_material, std::size_t count) {
  std::vector<double> area(count, 0.0);
  for (const polygon::TriangleIndices& t : mesh.triangles) {
    const glm::dvec3& a = mesh.vertices[t[0]];
    const double twice = glm::length(glm::cross(mesh.vertices[t[1]] - a, mesh.vertices[t[2]] - a));
    for (const std::uint32_t v : t) area[vertex_material[v]] += twice / 6.0;
  }
  return area;
}

// Describes the voxels of a soft object. `shown`: numbers of the visible materials.
void add_inside(DrawnObject& drawn, const SoftBody& body,
                const std::shared_ptr<const voxel::Lattice>& lattice, const MaterialsOfLabels& materials,
                const std::vector<std::uint8_t>& shown) {
  DrawnInside& inside = drawn.inside;
  inside.lattice = lattice;
  inside.to_scene = glm::mat3_cast(body.pose.rotation);
  inside.origin_m = body.pose.origin;
  std::array<bool, 256> used{};
  for (voxel::RowId row = 0; row < lattice->size() / voxel::kRow; ++row) {
    for (int lane = 0; lane < voxel::kRow; ++lane) used[lattice->labels(row)[lane]] = true;
  }
  std::array<std::optional<std::uint8_t>, 256> rank{};  // [material] index into inside.materials
  const auto rank_of = [&](std::uint8_t material) {
    if (!rank[material]) {
      rank[material] = static_cast<std::uint8_t>(inside.materials.size());
      inside.materials.push_back(materials.names[material]);
    }
    return *rank[material];
  };
  for (const std::uint8_t material : shown) rank_of(material);
  for (std::size_t label = 1; label < 256; ++label) {
    if (used[label]) inside.of_label[label] = rank_of(materials.of_label[label]);
  }
}

void add_materials(DrawnObject& drawn, const SoftDescription& description, const SoftBody& body,
                   const std::shared_ptr<const voxel::Lattice>& lattice) {
  const MaterialsOfLabels materials = materials_of_labels(description, body);
  std::vector<std::uint8_t> of_vertex(body.drawn.vertices.size(), 0), order;
  if (materials.names.size() > 1) {
    for (std::size_t v = 0; v < of_vertex.size(); ++v)
      of_vertex[v] = material_beneath(*lattice, materials, body.drawn.vertices[v]);
    const std::vector<double> area = area_of_materials(body.drawn, of_vertex, materials.names.size());
    for (std::size_t m = 0; m < area.size(); ++m) {
      if (area[m] > 0.0) order.push_back(static_cast<std::uint8_t>(m));
    }
    std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return area[a] > area[b]; });
  } else if (!materials.names.empty()) {
    order.push_back(0);
  }
  add_inside(drawn, body, lattice, materials, order);
  if (order.size() < 2) {
    const std::string name = order.empty() ? "" : materials.names[order.front()];
    drawn.material = name == kUnnamed ? "" : name;
    return;
  }
  std::array<std::uint8_t, 256> rank{};
  for (std::size_t r = 0; r < order.size(); ++r) {
    rank[order[r]] = static_cast<std::uint8_t>(r);
    drawn.materials.push_back(materials.names[order[r]]);
  }
  for (std::uint8_t& m : of_vertex) m = rank[m];
  drawn.vertex_material = std::move(of_vertex);
}

// The scan that a scene names, or the file of an object whose labels are ranges of grey values.
std::optional<DrawnScan> scan_of(const SoftDescription& description) {
  const auto* const volume = std::get_if<VolumeSource>(&description.source);
  if (volume == nullptr) return {};
  const bool ranges = std::ranges::any_of(
      volume->rules, [](const voxel::LabelRule& rule) { return rule.lower < rule.upper; });
  if (!volume->scan && !ranges) return {};
  return DrawnScan{.file = volume->scan.value_or(volume->file),
                   .unit_m = volume->scan ? std::nullopt : volume->unit_m,
                   .to_scene = glm::mat3_cast(description.pose.rotation),
                   .origin_m = description.pose.position_m};
}

}  // namespace

glm::dvec3 DrawnInside::to_voxels(const glm::dvec3& at_rest_m) const noexcept {
  return ((at_rest_m - origin_m) * to_scene) / lattice->spacing_m();  // v · R is Rᵀ v
}

glm::dvec3 DrawnInside::from_voxels(const glm::dvec3& voxels) const noexcept {
  return origin_m + to_scene * (voxels * lattice->spacing_m());
}

std::optional<std::size_t> DrawnInside::material_at(const glm::dvec3& at_rest_m) const noexcept {
  if (lattice == nullptr) return {};
  const glm::dvec3 point = glm::round(to_voxels(at_rest_m));
  std::array<int, 3> cell{};
  for (std::size_t d = 0; d < 3; ++d) {
    const double at = point[static_cast<glm::length_t>(d)];
    if (!(at >= 0.0) || !(at < lattice->grid().dims[d])) return {};
    cell[d] = static_cast<int>(at);
  }
  const voxel::VoxelId v = lattice->at(cell[0], cell[1], cell[2]);
  if (!lattice->filled(v)) return {};
  return of_label[lattice->label(v)];
}

DrawnScene drawn_scene(const Scene& scene, const BuiltScene& built, const std::string& title) {
  const World& world = *built.world;
  DrawnScene drawn{.title = title,
                   .objects = {},
                   .tool_is_punch = world.tool.shape == Tool::Shape::punch,
                   .tool_radius_m = std::max(world.tool.radius_m, kDrawnPoint * world.extent_m),
                   .max_force_N = world.limits.max_force_N,
                   .editable = editable_values(world, *built.state)};
  for (const RigidObject& object : world.rigid) {
    const auto& texture = object.feel.texture;
    drawn.objects.push_back(
        {object.name, false,
         texture ? with_relief(*object.drawn, *texture, object.feel.texture_share) : *object.drawn});
    for (glm::dvec3& v : drawn.objects.back().surface.vertices) v = object.to_scene(v);
  }
  for (std::size_t o = 0; o < world.soft.size(); ++o) {
    const SoftBody& body = world.soft[o];
    drawn.objects.push_back({body.name, true, body.drawn});
    DrawnObject& object = drawn.objects.back();
    add_materials(object, scene.soft[o], body, built.state->soft[o]->shared_lattice());
    object.scan = scan_of(scene.soft[o]);
    for (glm::dvec3& v : object.surface.vertices) v = body.to_scene(v);
  }
  return drawn;
}

}  // namespace hybrid
