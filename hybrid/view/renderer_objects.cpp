// SPDX-License-Identifier: GPL-3.0-or-later
#include <glm/geometric.hpp>

#include "hybrid/view/renderer_state.h"

namespace hybrid {
namespace {

constexpr float kRampOverGrey = 0.6F;    // share of the ramp where it lies over grey values
constexpr float kSlicedOpacity = 0.22F;  // of the surface around slices

}  // namespace

ObjectLook Renderer::State::look_of(std::size_t object) const {
  ObjectLook look = view.look_of(object);
  if (meshes->all()[object].soft && view.sliced() && look.opacity >= 1.0F) look.opacity = kSlicedOpacity;
  return look;
}

// Draws the opaque rigid objects.
void Renderer::State::draw_rigid(Shading shading) {
  nearer = apart;
  for (std::size_t i = 0; i < meshes->all().size(); ++i) {
    if (!is_opaque(i, false)) continue;
    use(shading, meshes->all()[i].lit_by_vertex);
    draw_object(meshes->all()[i], 1.0F);
  }
  nearer = 0.0F;
}

// Draws the opaque soft objects, and all slices.
void Renderer::State::draw_soft() {
  for (std::size_t i = 0; i < meshes->all().size(); ++i) {
    if (is_opaque(i, true)) draw_tissue(meshes->all()[i], 1.0F);
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
  const bool cut = object.face.mesh.count > 0;
  uniform("kept", cut ? object.kept : kKeepAll);
  const auto clip_plane = clip_equation(view.clip, bounds, origin_m);
  uniform("clip_plane", clip_plane.value_or(kKeepAll));
  clip_by_planes(cut, clip_plane.has_value());
  // A closed object that is whole shows no back of a triangle to an eye outside it.
  const bool backs_hidden =
      object.closed && !clip_plane && !cut && is_outside(object, object.most_moved_m + apart);
  hide_backs(backs_hidden);
  object.mesh.draw_seen(seen * object.placed, apart, values);
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

// Of translucent objects only the nearest surface is blended, which a depth-only pass finds first.
void Renderer::State::draw_translucent() {
  const auto draw_all = [this](bool depth_only) {
    for (std::size_t i = 0; i < meshes->all().size(); ++i) {
      const SceneMesh& object = meshes->all()[i];
      const ObjectLook look = look_of(i);
      if (!look.visible || look.opacity >= 1.0F || look.opacity <= 0.0F) continue;
      if (object.soft && !depth_only) {
        draw_tissue(object, look.opacity);
        continue;
      }
      use(depth_only ? Shading::depth : Shading::plain, object.lit_by_vertex);
      draw_object(object, look.opacity);
    }
  };
  write_colours(false);
  draw_all(true);
  write_colours(true);
  draw_all(false);
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
