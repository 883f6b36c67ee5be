// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/scene_meshes.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "hybrid/view/gl/rigid_layer.h"
#include "hybrid/view/palette.h"
#include "hybrid/view/tool_and_arrow.h"
#include "polygon/mesh/is_finite.h"

namespace hybrid {
namespace {

// Without a graphics card, meshes of more triangles are lit at their vertices. In a window such triangles are
// a few pixels large.
constexpr std::size_t kLitByVertex = 10'000;

// [part] the largest of its vertices' values.
std::vector<PartMove> most_of_parts(const SceneMesh& mesh, const std::vector<PartMove>& of_vertex) {
  std::vector<PartMove> moves;
  moves.reserve(mesh.mesh.parts.size());
  for (const MeshPart& part : mesh.mesh.parts) {
    PartMove& most = moves.emplace_back();
    for (std::size_t n = part.first; n < part.first + part.count; ++n) {
      const PartMove& by = of_vertex[mesh.moving.indices[n]];
      most.moved_m = std::max(most.moved_m, by.moved_m);
      most.recoloured = std::max(most.recoloured, by.recoloured);
    }
  }
  return moves;
}

}  // namespace

std::optional<SectionPlane> choose_cut(const DrawnScene& scene, const Snapshot& snapshot,
                                       const Camera& camera, std::size_t object) {
  const bool touched = object < snapshot.feel.size() && snapshot.feel[object].contact;
  const bool known = object < snapshot.inside.size() && snapshot.inside[object].used;
  if (!touched || !known || !scene.objects[object].hides_material()) return {};
  if (!polygon::is_finite(snapshot.proxy_m)) return {};
  const double force = glm::length(snapshot.force_N);
  const glm::dvec3 along =
      force > 0.0 && std::isfinite(force) ? snapshot.force_N / force : glm::dvec3(0.0, 0.0, 1.0);
  const glm::dvec3 toward = camera.toward_eye();
  const glm::dvec3 across = toward - glm::dot(toward, along) * along;
  // If the camera looks along the force, it sees every plane along the force edge-on.
  if (!(glm::length(across) > 0.1)) return {};
  return SectionPlane{snapshot.proxy_m, glm::normalize(across)};
}

void GlSection::upload(const Section& section, const DrawMesh& moved, const SectionImage& image_of_section) {
  mesh.upload(moved, true);
  mesh.upload_places(section.in_image);
  image = make_image(image_of_section.width, image_of_section.height, image_of_section.pixels);
}

void GlSection::release() {
  if (mesh.count > 0) mesh.release();
  delete_image(image);
  *this = {};
}

SceneMeshes::SceneMeshes(const DrawnScene& scene, const glm::dvec3& origin_m, bool light_vertices)
    : origin_m_(origin_m), light_vertices_(light_vertices), meshes_(scene.objects.size()) {
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const DrawnObject& object = scene.objects[i];
    SceneMesh& own = meshes_[i];
    own.soft = object.soft;
    own.colour = palette::of_object(scene, i);
    own.bounds = bounds_of(object.surface);
    DrawMesh mesh =
        own.soft ? make_moving_mesh(object.surface, origin_m_) : make_draw_mesh(object.surface, origin_m_);
    own.lit_by_vertex = light_vertices && mesh.indices.size() / 3 > kLitByVertex;
    own.closed = is_closed_outwards(object.surface);
    std::vector<MeshPart> parts = divide_mesh(mesh);
    own.mesh.upload(mesh, own.soft);
    own.mesh.parts = std::move(parts);
    const std::vector<VertexColour> colours = palette::of_vertices(scene, i);
    if (own.soft && colours.size() == mesh.vertices.size() && !colours.empty())
      own.mesh.upload_colours(colours);
    if (own.soft) own.moving = std::move(mesh);
  }
}

void SceneMeshes::move_surface(SceneMesh& mesh, const std::vector<glm::dvec3>& at_rest,
                               const std::vector<glm::vec3>& moved_m, const TissueView& tissue,
                               std::size_t object) {
  if (moved_m.size() != at_rest.size() || at_rest.size() != mesh.moving.vertices.size()) return;
  const bool moved = mesh.moved_m != moved_m;
  const std::uint64_t number = tissue.values_number(object);
  if (!moved && number == mesh.values_number) return;
  // Up to this value tissue has its own colour.
  const float own = tissue.scale().start().own_until * static_cast<float>(tissue.scale().end);
  std::vector<PartMove> by(moved_m.size());  // [vertex]
  for (std::size_t v = 0; v < by.size(); ++v) {
    const bool first = mesh.moved_m.size() != moved_m.size();
    const float length = glm::length(first ? moved_m[v] : moved_m[v] - mesh.moved_m[v]);
    by[v] = {.moved_m = std::isfinite(length) ? length : 0.0F,
             .recoloured = std::max(mesh.moving.vertices[v].value, own)};
  }
  mesh.moved_m = moved_m;
  mesh.values_number = number;
  mesh.most_moved_m = move_vertices(mesh.moving, at_rest, moved_m, origin_m_);
  const std::vector<float>& values = tissue.values(object);
  for (std::size_t v = 0; v < values.size(); ++v) mesh.moving.vertices[v].value = values[v];
  for (std::size_t v = 0; v < by.size(); ++v)
    by[v].recoloured = std::abs(std::max(mesh.moving.vertices[v].value, own) - by[v].recoloured);
  mesh.moves = most_of_parts(mesh, by);
  update_parts(mesh.moving, mesh.mesh.parts);
  mesh.mesh.stream(mesh.moving);
}

void SceneMeshes::move_materials(SceneMesh& mesh, const DrawnScene& scene, std::size_t object,
                                 const std::vector<MaterialSurface>& surfaces) const {
  for (std::size_t s = surfaces.size(); s < mesh.materials.size(); ++s) mesh.materials[s].mesh.release();
  mesh.materials.resize(surfaces.size());
  for (std::size_t s = 0; s < surfaces.size(); ++s) {
    const MaterialSurface& surface = surfaces[s];
    SceneMesh& own = mesh.materials[s];
    if (own.shape_number != surface.shape_number) {
      if (own.mesh.count > 0) own.mesh.release();
      own = {};
      own.soft = own.closed = true;
      own.material = scene.objects[object].inside.materials[surface.material];
      own.colour = palette::of_inside(scene, object)[surface.material];
      own.bounds = bounds_of({.vertices = surface.at_rest_m, .triangles = {}});
      own.moving = surface.mesh;
      own.lit_by_vertex = light_vertices_ && own.moving.indices.size() / 3 > kLitByVertex;
      std::vector<MeshPart> parts = divide_mesh(own.moving);
      own.mesh.upload(own.moving, true);
      own.mesh.parts = std::move(parts);
    } else if (own.moved_number == surface.moved_number) {
      continue;
    }
    own.moving.vertices = surface.mesh.vertices;
    own.most_moved_m = surface.most_moved_m;
    update_parts(own.moving, own.mesh.parts);
    own.mesh.stream(own.moving);
    own.shape_number = surface.shape_number;
    own.moved_number = surface.moved_number;
  }
}

void SceneMeshes::move(const DrawnScene& scene, const Snapshot& snapshot, const TissueView& tissue) {
  for (std::size_t i = 0; i < meshes_.size(); ++i) {
    SceneMesh& mesh = meshes_[i];
    mesh.moves.clear();
    mesh.placed = place_rigid(snapshot.place_of(i), origin_m_);
    if (!mesh.soft || i >= scene.objects.size()) continue;
    if (i < snapshot.soft_moved_m.size())
      move_surface(mesh, scene.objects[i].surface.vertices, snapshot.soft_moved_m[i], tissue, i);
    move_materials(mesh, scene, i, tissue.materials(i));
    const std::vector<TissueSlice>& slices = tissue.slices(i);
    for (std::size_t s = slices.size(); s < mesh.slices.size(); ++s) mesh.slices[s].release();
    mesh.slices.resize(slices.size());
    for (std::size_t s = 0; s < slices.size(); ++s) {
      GlSection& own = mesh.slices[s];
      const TissueSlice& slice = slices[s];
      if (own.shape_number != slice.shape_number) {
        own.release();
        own.upload(slice.section, slice.mesh, slice.image);
      } else {
        if (own.moved_number != slice.moved_number) own.mesh.stream(slice.mesh);
        if (own.image_number != slice.image_number)
          replace_image(own.image, slice.image.width, slice.image.height, slice.image.pixels);
      }
      own.shape_number = slice.shape_number;
      own.moved_number = slice.moved_number;
      own.image_number = slice.image_number;
    }
  }
}

void SceneMeshes::cut(const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera,
                      const ViewSettings& view) {
  for (std::size_t i = 0; i < meshes_.size(); ++i) {
    SceneMesh& mesh = meshes_[i];
    mesh.face.release();
    const auto cut = mesh.soft && view.look_of(i).visible && !view.sliced() && !view.separates_materials(i)
                         ? choose_cut(scene, snapshot, camera, i)
                         : std::nullopt;
    if (!cut) continue;
    const Section section = make_section(scene.objects[i], *cut);
    if (section.indices.empty()) continue;
    std::vector<glm::vec3> moved_m;
    for (const glm::dvec3& at : section.in_tissue) moved_m.push_back(snapshot.inside[i].at(at));
    mesh.face.upload(section, move_section(section, moved_m, {}, true, origin_m_),
                     paint_materials(section, palette::of_inside(scene, i)));
    mesh.kept = glm::vec4(glm::dvec4(-cut->normal, glm::dot(cut->normal, cut->point_m - origin_m_)));
  }
}

double SceneMeshes::radius_m(const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera,
                             const SceneBounds& bounds) const {
  const double least = 1.1 * bounds.radius_m;
  double radius = least;
  for (const glm::dvec3& at : {snapshot.proxy_m, snapshot.device_m, arrow_tip(scene, snapshot, camera)}) {
    if (polygon::is_finite(at))
      radius = std::max(radius, glm::length(at - bounds.centre_m) + 4.0 * scene.tool_radius_m);
  }
  for (std::size_t i = 0; i < meshes_.size(); ++i) {
    const RigidPlace place = snapshot.place_of(i);
    const glm::dvec3 at = place(meshes_[i].bounds.centre_m);
    if (place.moved && polygon::is_finite(at))
      radius = std::max(radius, glm::length(at - bounds.centre_m) + 1.1 * meshes_[i].bounds.radius_m);
  }
  return rounded_up(radius, least);
}

void SceneMeshes::release() {
  for (SceneMesh& mesh : meshes_) {
    mesh.mesh.release();
    mesh.face.release();
    for (SceneMesh& material : mesh.materials) material.mesh.release();
    for (GlSection& slice : mesh.slices) slice.release();
  }
}

}  // namespace hybrid
