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

constexpr double kDrawnPoint = 0.004;           // smallest drawn radius of a tool (unit: the scene's extent)
constexpr std::size_t kMostInside = 1U << 24U;  // most cells of an object whose inside is kept for a cut

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

// Adds the materials voxel by voxel, if the surface hides one of them. `shown`: numbers of the visible
// materials.
void add_inside(DrawnObject& drawn, const SoftBody& body, const voxel::Lattice& lattice,
                const MaterialsOfLabels& materials, const std::vector<std::uint8_t>& shown) {
  const std::array<int, 3> dims = lattice.grid().dims;
  const std::size_t cells = static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]) *
                            static_cast<std::size_t>(dims[2]);
  if (shown.empty() || cells > kMostInside) return;
  DrawnInside inside{.dims = dims,
                     .to_scene = glm::mat3_cast(body.pose.rotation),
                     .origin_m = body.pose.origin,
                     .spacing_m = lattice.spacing_m()};
  std::array<std::uint8_t, 256> rank{};  // 0: none yet, else 1 + index into inside.materials
  const auto rank_of = [&](std::uint8_t material) {
    if (rank[material] == 0) {
      inside.materials.push_back(materials.names[material]);
      rank[material] = static_cast<std::uint8_t>(inside.materials.size());
    }
    return rank[material];
  };
  for (const std::uint8_t material : shown) rank_of(material);
  inside.of_voxel.reserve(cells);
  for (int k = 0; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i) {
        const voxel::VoxelId v = lattice.at(i, j, k);
        inside.of_voxel.push_back(lattice.filled(v) ? rank_of(materials.of_label[lattice.label(v)])
                                                    : std::uint8_t{0});
      }
    }
  }
  if (inside.materials.size() > shown.size()) drawn.inside = std::move(inside);
}

void add_materials(DrawnObject& drawn, const SoftDescription& description, const SoftBody& body,
                   const voxel::Lattice& lattice) {
  const MaterialsOfLabels materials = materials_of_labels(description, body);
  const auto only = [&](const std::string& name) { drawn.material = name == kUnnamed ? "" : name; };
  if (materials.names.size() < 2) {
    if (!materials.names.empty()) only(materials.names.front());
    return;
  }
  std::vector<std::uint8_t> of_vertex;
  of_vertex.reserve(body.drawn.vertices.size());
  for (const glm::dvec3& v : body.drawn.vertices)
    of_vertex.push_back(material_beneath(lattice, materials, v));
  const std::vector<double> area = area_of_materials(body.drawn, of_vertex, materials.names.size());
  std::vector<std::uint8_t> order;
  for (std::size_t m = 0; m < area.size(); ++m) {
    if (area[m] > 0.0) order.push_back(static_cast<std::uint8_t>(m));
  }
  std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return area[a] > area[b]; });
  add_inside(drawn, body, lattice, materials, order);
  if (order.size() < 2) {
    if (!order.empty()) only(materials.names[order.front()]);
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

}  // namespace

std::optional<std::size_t> DrawnInside::material_at(const glm::dvec3& at_rest_m) const noexcept {
  const glm::dvec3 point = glm::round(((at_rest_m - origin_m) * to_scene) / spacing_m);  // v · R is Rᵀ v
  std::size_t cell = 0;
  for (std::size_t d = 3; d-- > 0;) {
    const double at = point[static_cast<glm::length_t>(d)];
    if (!(at >= 0.0) || !(at < dims[d])) return {};
    cell = cell * static_cast<std::size_t>(dims[d]) + static_cast<std::size_t>(at);
  }
  if (cell >= of_voxel.size() || of_voxel[cell] == 0) return {};
  return of_voxel[cell] - std::size_t{1};
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
    add_materials(object, scene.soft[o], body, built.state->soft[o]->lattice());
    for (glm::dvec3& v : object.surface.vertices) v = body.to_scene(v);
  }
  return drawn;
}

}  // namespace hybrid
