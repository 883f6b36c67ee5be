// SPDX-License-Identifier: GPL-3.0-or-later
// The state of a renderer, and the steps by which it draws one view. renderer.cpp has the order of the steps,
// renderer_objects.cpp draws the objects.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "hybrid/view/gl/gl_objects.h"
#include "hybrid/view/gl/rigid_layer.h"
#include "hybrid/view/gl/shading.h"
#include "hybrid/view/palette.h"
#include "hybrid/view/renderer.h"
#include "hybrid/view/scene_meshes.h"
#include "hybrid/view/tool_and_arrow.h"
#include "hybrid/view/view_changes.h"

namespace hybrid {

// One view of a frame.
struct RenderedView {
  ViewTargets targets;
  RigidLayer layer;
  ShownView shown;
  PixelRect where{};  // in the frame (pixels, y up); empty: not shown

  void release() {
    targets.release();
    layer.layer.release();
  }
};

inline constexpr std::size_t kMostViews = 2;  // in a frame: the scene, and the inset

struct Renderer::State {
  ShadingPrograms programs;
  GLuint program = 0;               // the program in use
  glm::mat4 clip{1.0F};             // clip_from_scene of the program in use
  glm::mat4 seen{1.0F};             // as `clip`, of the part of the view that is drawn
  PixelRect pixels, part;           // the view, and the part of it that is drawn (samples, y up)
  glm::vec3 eye{0.0F};              // relative to origin_m
  glm::vec3 right{0.0F}, up{0.0F};  // axes of the camera
  float nearer = 0.0F;              // as in the shader
  float apart = 0.0F;               // kDepthApart in the present view (m)
  std::optional<SceneMeshes> meshes;
  GlMesh ball, cylinder, cone, disc;
  GlCover cover;
  std::array<RenderedView, kMostViews> views;
  std::size_t view_number = 0;  // of the next view in this frame
  GlOverlay overlay;
  OverlayMesh shown_overlay;  // of the last frame
  ViewSettings view;
  FrameTarget frame;
  bool changed = true;  // does the frame differ from the last one?
  int samples = 1, wanted_samples = 1;
  SceneBounds bounds;        // at rest
  glm::dvec3 origin_m{0.0};  // uploaded positions are floats relative to this point
  ColourScale scale;

  // Uses a program, in the present view. Uniforms that a program does not have are ignored.
  void use(Shading shading, bool by_vertex = false) {
    program = programs.of(shading, by_vertex);
    glUseProgram(program);
    uniform("clip_from_scene", clip);
    uniform("eye", eye);
    uniform("light_right", right);
    uniform("light_up", up);
    uniform("apart", apart);
    uniform("nearer", nearer);
    uniform("shown_depth", 0);
    uniform("slice_image", 0);
    uniform("coloured_vertices", 0);
    uniform("clip_plane", kKeepAll);
    uniform("kept", kKeepAll);
    if (shading != Shading::tissue && shading != Shading::slice) return;
    uniform("moved_ramp", palette::moved);
    uniform("ramp_share", 1.0F);
    uniform("own_until", scale.start().own_until);
    uniform("ramp_from", scale.start().ramp_from);
  }
  template <class Value>
  void uniform(const char* name, const Value& value) const {
    set_uniform(program, name, value);
  }
  void place(const glm::mat4& scene_from_mesh) const {
    // The inverse transpose keeps normals perpendicular under non-uniform scale.
    const glm::mat3 normal = glm::transpose(glm::inverse(glm::mat3(scene_from_mesh)));
    uniform("scene_from_mesh", scene_from_mesh);
    uniform("normal_from_mesh", normal);
  }
  [[nodiscard]] bool is_opaque_rigid(std::size_t object) const {
    return !meshes->all()[object].soft && view.look_of(object).is_opaque();
  }
  // The surfaces to draw: of objects, or of the materials of an object.
  struct Shown {
    const SceneMesh* mesh;
    Look look;
  };
  [[nodiscard]] std::vector<Shown> shown_surfaces() const;
  void copy_depth(const RenderedView& to) const;
  void draw_part(const PixelRect& of_view);
  void draw_view(const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera, RenderedView& to);
  void draw_rigid(Shading shading);
  void draw_soft();
  void draw_object(const SceneMesh& object, float alpha, const ValueRange& values = {}) const;
  void draw_triangles(const SceneMesh& object, float margin, const ValueRange& values) const;
  void draw_tissue(const SceneMesh& object, float alpha);
  void draw_wires();
  void draw_section(const GlSection& section);
  [[nodiscard]] Projection projection() const { return {clip, right, up, glm::cross(right, up), pixels}; }
  [[nodiscard]] ShownTool shown_tool(const DrawnScene& scene, const Snapshot& snapshot,
                                     const Camera& camera) const;
  [[nodiscard]] bool is_outside(const SceneMesh& object, float margin) const;  // is the eye outside?
  void draw_rigid_layer(RigidLayer& rigid);
  void copy_rigid_layer(const RenderedView& from);
  void draw_behind_disc(const RenderedView& to, const glm::mat4& placed_disc);
  void draw_translucent();
  void draw_tool(const DrawnScene& scene, const glm::dvec3& at) const;
  void draw_arrow(const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera) const;
};

}  // namespace hybrid
