// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <functional>
#include <glm/geometric.hpp>

#include "hybrid/view/renderer_state.h"

namespace hybrid {
namespace {

constexpr float kRampOverGrey = 0.6F;    // share of the ramp where it lies over grey values
constexpr float kSlicedOpacity = 0.22F;  // of the surface around slices
constexpr float kWireOpacity = 0.4F;     // of edges on an opaque surface

}  // namespace

std::vector<Renderer::State::Shown> Renderer::State::shown_surfaces() const {
  std::vector<Shown> shown;
  const auto add = [&](const SceneMesh& mesh, Look look) {
    if (mesh.soft && view.sliced() && look.is_opaque()) look.opacity = kSlicedOpacity;
    if (look.shows()) shown.push_back({&mesh, look});
  };
  for (std::size_t i = 0; i < meshes->all().size(); ++i) {
    const SceneMesh& object = meshes->all()[i];
    const Look whole = view.look_of(i);
    if (!view.separates_materials(i)) add(object, whole);
    for (const SceneMesh& material : object.materials) {
      const Look own = view.material_look_of(i, material.material);
      add(material, {whole.visible && own.visible, whole.opacity * own.opacity});
    }
  }
  return shown;
}

// Draws the opaque rigid objects.
void Renderer::State::draw_rigid(Shading shading) {
  nearer = apart;
  for (std::size_t i = 0; i < meshes->all().size(); ++i) {
    if (!is_opaque_rigid(i)) continue;
    use(shading, meshes->all()[i].lit_by_vertex);
    draw_object(meshes->all()[i], 1.0F);
  }
  nearer = 0.0F;
}

// Draws the opaque soft objects, and all slices.
void Renderer::State::draw_soft() {
  for (const Shown& shown : shown_surfaces()) {
    if (shown.mesh->soft && shown.look.is_opaque()) draw_tissue(*shown.mesh, 1.0F);
  }
  for (std::size_t i = 0; i < meshes->all().size(); ++i) {
    if (!view.look_of(i).visible) continue;
    for (const GlSection& slice : meshes->all()[i].slices) draw_section(slice);
  }
}

// Most tissue has its own colour, for which a cheaper program is enough.
void Renderer::State::draw_tissue(const SceneMesh& object, float alpha) {
  const float most_own = scale.start().own_until * static_cast<float>(scale.end);
  use(Shading::plain, object.lit_by_vertex);
  draw_object(object, alpha, scale.end > 0.0 ? ValueRange{.up_to = most_own} : ValueRange{});
  if (scale.end > 0.0) {
    use(Shading::tissue, object.lit_by_vertex);
    draw_object(object, alpha, {.above = most_own});
  }
  if (object.face.mesh.count > 0) draw_section(object.face);
}

bool Renderer::State::is_outside(const SceneMesh& object, float margin) const {
  const glm::vec3 centre(object.placed * glm::vec4(glm::vec3(object.bounds.centre_m - origin_m), 1.0F));
  return glm::distance(eye, centre) > static_cast<float>(object.bounds.radius_m) + margin;
}

void Renderer::State::draw_object(const SceneMesh& object, float alpha, const ValueRange& values) const {
  if (object.mesh.count == 0) return;
  uniform("alpha", alpha);
  uniform("shine", object.soft ? 0.10F : 0.05F);
  place(object.placed);
  uniform("own_colour", object.colour);
  uniform("coloured_vertices", object.mesh.colours != 0 ? 1 : 0);
  uniform("moved_scale", object.soft ? static_cast<float>(scale.end) : 0.0F);
  draw_triangles(object, apart, values);
}

// In the program in use. `margin`: as of draw_seen().
void Renderer::State::draw_triangles(const SceneMesh& object, float margin, const ValueRange& values) const {
  const bool cut = object.face.mesh.count > 0;
  uniform("kept", cut ? object.kept : kKeepAll);
  const auto clip_plane = clip_equation(view.clip, bounds, origin_m);
  uniform("clip_plane", clip_plane.value_or(kKeepAll));
  clip_by_planes(cut, clip_plane.has_value());
  // A closed object that is whole shows no back of a triangle to an eye outside it.
  const bool backs_hidden =
      object.closed && !clip_plane && !cut && is_outside(object, object.most_moved_m + margin);
  hide_backs(backs_hidden);
  object.mesh.draw_seen(seen * object.placed, margin, values);
  hide_backs(false);
  clip_by_planes(false, false);
  // Some drivers clip even when clipping is switched off. This plane keeps tool and arrow whole.
  uniform("clip_plane", kKeepAll);
}

// The face of a cut lies in the cut's plane, where rounding could clip it. So no plane clips it. The view's
// clip plane clips slices.
void Renderer::State::draw_section(const GlSection& section) {
  use(Shading::slice);
  uniform("ramp_share", view.grey ? kRampOverGrey : 1.0F);
  bind_image(section.image);
  place(glm::mat4(1.0F));
  uniform("moved_scale", static_cast<float>(scale.end));
  const auto clip_plane = clip_equation(view.clip, bounds, origin_m);
  uniform("clip_plane", clip_plane.value_or(kKeepAll));
  clip_by_planes(false, clip_plane.has_value());
  section.mesh.draw();
  clip_by_planes(false, false);
}

// Of a translucent surface only the nearest part is blended, which a depth-only pass finds first. Surfaces
// are blended from far to near, by their nearest points: one that encloses another comes after it.
void Renderer::State::draw_translucent() {
  std::vector<Shown> all = shown_surfaces();
  std::erase_if(all, [](const Shown& shown) { return shown.look.is_opaque(); });
  const auto nearest = [this](const Shown& shown) {
    const SceneMesh& mesh = *shown.mesh;
    const glm::vec3 centre(mesh.placed * glm::vec4(glm::vec3(mesh.bounds.centre_m - origin_m), 1.0F));
    return glm::distance(eye, centre) - static_cast<float>(mesh.bounds.radius_m);
  };
  std::ranges::stable_sort(all, std::ranges::greater{}, nearest);
  for (const Shown& shown : all) {
    const SceneMesh& mesh = *shown.mesh;
    write_colours(false);
    use(Shading::depth, mesh.lit_by_vertex);
    draw_object(mesh, 1.0F);
    write_colours(true);
    if (mesh.soft) {
      draw_tissue(mesh, shown.look.opacity);
    } else {
      use(Shading::plain, mesh.lit_by_vertex);
      draw_object(mesh, shown.look.opacity);
    }
  }
}

// Edges are drawn nearer to the eye than surfaces, of which rigid ones are nearer than tissue.
void Renderer::State::draw_wires() {
  if (!view.wires) return;
  draw_edges_only(true);
  for (const Shown& shown : shown_surfaces()) {
    if (shown.mesh->mesh.count == 0) continue;
    nearer = shown.mesh->soft ? apart : 2.0F * apart;
    use(Shading::plain, true);
    uniform("alpha", kWireOpacity * shown.look.opacity);
    uniform("shine", 0.0F);
    uniform("own_colour", view.dark ? palette::dark_wire : palette::wire);
    place(shown.mesh->placed);
    draw_triangles(*shown.mesh, nearer, {});
  }
  nearer = 0.0F;
  draw_edges_only(false);
}

void Renderer::State::draw_tool(const DrawnScene& scene, const glm::dvec3& at) const {
  place(place_tool(scene, at, origin_m));
  (scene.tool_is_punch ? cylinder : ball).draw();
}

void Renderer::State::draw_arrow(const DrawnScene& scene, const Snapshot& snapshot,
                                 const Camera& camera) const {
  const ArrowPlacement arrow = place_arrow(scene, snapshot, camera, origin_m);
  if (!arrow.visible) return;
  place(arrow.shaft);
  cylinder.draw();
  place(arrow.head);
  cone.draw();
}

}  // namespace hybrid
