// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/renderer.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <optional>

#include "hybrid/view/gl/gl_objects.h"
#include "hybrid/view/gl/shading.h"
#include "hybrid/view/gl/unit_shapes.h"
#include "hybrid/view/palette.h"
#include "hybrid/view/rigid_layer.h"
#include "hybrid/view/scene_meshes.h"
#include "hybrid/view/tool_and_arrow.h"
#include "polygon/mesh/is_finite.h"

namespace hybrid {
namespace {

constexpr double kDepthApart = 5e-4;  // share of the view's height: about half a pixel

constexpr float kRampOverGrey = 0.6F;    // share of the ramp where it lies over grey values
constexpr float kSlicedOpacity = 0.22F;  // of the surface around slices

constexpr std::size_t kViews = 2;  // views in a frame: the scene, and the inset

}  // namespace

struct Renderer::State {
  ShadingPrograms programs;
  GLuint program = 0;               // the program in use
  glm::mat4 clip{1.0F};             // clip_from_scene of the program in use
  glm::mat4 seen{1.0F};             // as `clip`, of the part of the view that is drawn
  glm::vec3 eye{0.0F};              // relative to origin_m
  glm::vec3 right{0.0F}, up{0.0F};  // axes of the camera
  float nearer = 0.0F;              // as in the shader
  float apart = 0.0F;               // kDepthApart in the present view (m)
  std::optional<SceneMeshes> meshes;
  GlMesh ball, cylinder, cone, disc;
  GlCover cover;
  std::array<RigidLayer, kViews> layers;
  std::size_t view_number = 0;  // of the next view in this frame
  GlOverlay overlay;
  ViewSettings view;
  RenderTargets targets;
  int width = 0, height = 0, wanted_samples = 1;
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
    uniform("own_until", palette::kOwnUntil);
    uniform("ramp_from", palette::kRampFrom);
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
  // The rectangle in samples of the scene's textures, y up from the bottom.
  [[nodiscard]] PixelRect samples_of(const PixelRect& where) const {
    const int n = targets.samples;
    return {where.x * n, (height - where.y - where.height) * n, where.width * n, where.height * n};
  }
  [[nodiscard]] ObjectLook look_of(std::size_t object) const {
    ObjectLook look = view.look_of(object);
    if (meshes->all()[object].soft && view.sliced() && look.opacity >= 1.0F) look.opacity = kSlicedOpacity;
    return look;
  }
  [[nodiscard]] bool is_opaque(std::size_t object, bool soft) const {
    const ObjectLook look = look_of(object);
    return meshes->all()[object].soft == soft && look.visible && look.opacity >= 1.0F;
  }
  void copy_depth(const PixelRect& where) const;
  void draw_rigid(Shading shading);
  void draw_soft();
  void draw_object(const SceneMesh& object, float alpha, const ValueRange& values = {}) const;
  void draw_tissue(const SceneMesh& object, float alpha);
  void draw_section(const GlSection& section);
  [[nodiscard]] bool is_outside(const SceneMesh& object, float margin) const;  // is the eye?
  void draw_rigid_layer(RigidLayer& rigid, const PixelRect& pixels);
  void copy_rigid_layer(const RigidLayer& rigid, const PixelRect& pixels, const glm::dmat4& clip_from_scene);
  void draw_behind_disc(const glm::mat4& disc, const PixelRect& pixels);
  void draw_translucent();
  void draw_tool(const DrawnScene& scene, const glm::dvec3& at) const;
  void draw_arrow(const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera) const;
};

// Copies the scene's depth of a part of the frame to shown_depth.
void Renderer::State::copy_depth(const PixelRect& where) const {
  const PixelRect r = samples_of(where);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, targets.scene_frame);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, targets.shown_frame);
  glBlitFramebuffer(r.x, r.y, r.x + r.width, r.y + r.height, r.x, r.y, r.x + r.width, r.y + r.height,
                    GL_DEPTH_BUFFER_BIT, GL_NEAREST);
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
  const float most_own = palette::kOwnUntil * static_cast<float>(scale.end);
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
  if (clip_plane) glEnable(GL_CLIP_DISTANCE1);
  if (cut) glEnable(GL_CLIP_DISTANCE0);
  // A closed object that is whole shows no back of a triangle to an eye outside it.
  const bool backs_hidden =
      object.closed && !clip_plane && !cut && is_outside(object, object.most_moved_m + apart);
  if (backs_hidden) glEnable(GL_CULL_FACE);
  object.mesh.draw_seen(seen * object.placed, apart, values);
  if (backs_hidden) glDisable(GL_CULL_FACE);
  glDisable(GL_CLIP_DISTANCE0);
  glDisable(GL_CLIP_DISTANCE1);
  // Some drivers clip even when clipping is switched off. This plane keeps tool and arrow whole.
  uniform("clip_plane", kKeepAll);
}

// The face of a cut lies in the cut's plane, so rounding could clip it: it keeps all. Slices obey the view's
// clip plane.
void Renderer::State::draw_section(const GlSection& section) {
  use(Shading::slice);
  uniform("ramp_share", view.grey ? kRampOverGrey : 1.0F);
  bind_image(section.image);
  place(glm::mat4(1.0F));
  uniform("moved_scale", static_cast<float>(scale.end));
  const auto clip_plane = clip_equation(view.clip, bounds, origin_m);
  uniform("clip_plane", clip_plane.value_or(kKeepAll));
  if (clip_plane) glEnable(GL_CLIP_DISTANCE1);
  section.mesh.draw();
  glDisable(GL_CLIP_DISTANCE1);
}

void Renderer::State::draw_rigid_layer(RigidLayer& rigid, const PixelRect& pixels) {
  LayerKey key{.clip = clip, .clip_plane = clip_equation(view.clip, bounds, origin_m).value_or(kKeepAll)};
  for (std::size_t i = 0; i < meshes->all().size(); ++i) {
    if (is_opaque(i, false)) key.drawn.emplace_back(i, meshes->all()[i].placed);
  }
  const bool fresh = rigid.layer.set_size(pixels.width, pixels.height);
  if (!fresh && key == rigid.key) return;
  rigid.key = std::move(key);
  glBindFramebuffer(GL_FRAMEBUFFER, rigid.layer.frame);
  glViewport(0, 0, pixels.width, pixels.height);
  glDisable(GL_SCISSOR_TEST);
  glClear(GL_DEPTH_BUFFER_BIT);
  draw_rigid(Shading::layer);
  glEnable(GL_SCISSOR_TEST);
  glViewport(pixels.x, pixels.y, pixels.width, pixels.height);
}

void Renderer::State::copy_rigid_layer(const RigidLayer& rigid, const PixelRect& pixels,
                                       const glm::dmat4& clip_from_scene) {
  if (rigid.key.drawn.empty()) return;
  use(Shading::cover);
  // The layer was drawn nearer to the eye by `apart`.
  uniform("further", depth_further(clip_from_scene, 2.0 * static_cast<double>(apart)));
  uniform("corner", glm::ivec2(pixels.x, pixels.y));
  uniform("layer_colour", 1);
  uniform("layer_depth", 2);
  glActiveTexture(GL_TEXTURE1);
  glBindTexture(GL_TEXTURE_2D, rigid.layer.colour);
  glActiveTexture(GL_TEXTURE2);
  glBindTexture(GL_TEXTURE_2D, rigid.layer.depth);
  bind_image(targets.shown_depth);
  cover.draw();
}

// The layer has only the nearest rigid surface. Beside the tool this surface is drawn thin, so that rigid
// surfaces behind it are visible. So within the disc all rigid surfaces are drawn, one by one.
void Renderer::State::draw_behind_disc(const glm::mat4& placed_disc, const PixelRect& pixels) {
  const auto part = part_with_disc(clip, placed_disc, pixels);
  if (!part) return;
  glScissor(part->pixels.x, part->pixels.y, part->pixels.width, part->pixels.height);
  seen = part->whole_from_clip * clip;  // parts of meshes beside the rectangle are left out
  bind_image(targets.shown_depth);
  draw_rigid(Shading::unhiding);
  seen = clip;
  glScissor(pixels.x, pixels.y, pixels.width, pixels.height);
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
  glDepthMask(GL_TRUE);
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  draw_all(true);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
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

Renderer::Renderer(const DrawnScene& scene, Samples samples) : state_(std::make_unique<State>()) {
  State& s = *state_;
  require_gl();
  s.wanted_samples = draws_in_software() && samples == Samples::fast ? 1 : 2;
  s.programs.create();
  s.bounds = bounds_of(scene);
  s.origin_m = s.bounds.centre_m;
  s.meshes.emplace(scene, s.origin_m, s.wanted_samples == 1);
  s.ball.upload(make_unit_ball());
  s.cylinder.upload(make_unit_cylinder());
  s.cone.upload(make_unit_cone());
  s.disc.upload(make_unit_disc());
  s.cover.create();
  s.overlay.create();
  s.targets.create();
  check_gl("uploading the scene");
}

// The context is owned by the picture or the window. When it ends, it frees every OpenGL object that is left.
Renderer::~Renderer() = default;

void Renderer::release() {
  State& s = *state_;
  s.meshes->release();
  for (GlMesh* mesh : {&s.ball, &s.cylinder, &s.cone, &s.disc}) mesh->release();
  for (RigidLayer& layer : s.layers) layer.layer.release();
  s.cover.release();
  s.overlay.release();
  s.targets.release();
  s.programs.release();
}

void Renderer::set_font(const FontAtlas& atlas) {
  state_->overlay.set_font(atlas);
}

void Renderer::set_view(const ViewSettings& view) {
  state_->view = view;
}

void Renderer::begin(const DrawnScene& scene, const Snapshot& snapshot, const TissueView& tissue, int width,
                     int height) {
  State& s = *state_;
  s.width = width, s.height = height;
  s.view_number = 0;
  s.targets.set_size(width, height, s.wanted_samples);
  s.scale = tissue.scale();
  s.meshes->move(scene, snapshot, tissue);
  glBindFramebuffer(GL_FRAMEBUFFER, s.targets.scene_frame);
  glDisable(GL_SCISSOR_TEST);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  const glm::vec3& background = s.view.dark ? palette::dark_background : palette::background;
  glClearColor(background.r, background.g, background.b, 1.0F);
  glClear(GL_COLOR_BUFFER_BIT);
}

void Renderer::draw(const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera,
                    const PixelRect& where) {
  State& s = *state_;
  if (where.width < 1 || where.height < 1) return;
  const bool tool_known = polygon::is_finite(snapshot.proxy_m) && scene.tool_radius_m > 0.0;
  const glm::dmat4 clip_from_scene =
      camera.clip_from_scene(static_cast<double>(where.width) / where.height, s.origin_m, s.bounds.centre_m,
                             s.meshes->radius_m(scene, snapshot, camera, s.bounds));
  s.clip = s.seen = glm::mat4(clip_from_scene);
  s.meshes->cut(scene, snapshot, camera, s.view);
  s.eye = glm::vec3(camera.eye_m() - s.origin_m);
  // Where surfaces coincide, rounding would choose between them pixel by pixel. So rigid surfaces are drawn
  // nearer to the eye by this length. A rigid surface counts as hiding tissue only if it is nearer than the
  // tissue by more than this length.
  s.apart = static_cast<float>(kDepthApart * camera.view_height_m());
  s.right = glm::vec3(camera.right());
  s.up = glm::vec3(camera.up());
  bind_image(0);
  const PixelRect pixels = s.samples_of(where);
  glViewport(pixels.x, pixels.y, pixels.width, pixels.height);
  glScissor(pixels.x, pixels.y, pixels.width, pixels.height);
  glEnable(GL_SCISSOR_TEST);
  glEnable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  glDepthFunc(GL_LEQUAL);
  glDepthMask(GL_TRUE);
  RigidLayer& rigid = s.layers[std::min(s.view_number, kViews - 1)];
  s.draw_rigid_layer(rigid, pixels);

  glBindFramebuffer(GL_FRAMEBUFFER, s.targets.scene_frame);
  // The first view lies on the background that begin() has drawn.
  glClear(s.view_number++ == 0 ? GL_DEPTH_BUFFER_BIT : GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  s.draw_soft();

  // The depth of all that must not be hidden: soft objects, the arrow, and a disc in front of the tool
  // (place_tool_disc()). Copying the soft objects' depth costs less than drawing them again.
  s.copy_depth(where);
  glBindFramebuffer(GL_FRAMEBUFFER, s.targets.shown_frame);
  const glm::mat4 disc = place_tool_disc(scene, snapshot.proxy_m, camera, s.origin_m);
  if (tool_known) {
    s.use(Shading::depth);
    s.place(disc);
    s.disc.draw();
    s.draw_arrow(scene, snapshot, camera);
  }
  glBindFramebuffer(GL_FRAMEBUFFER, s.targets.scene_frame);
  const auto draw_felt = [&](float alpha) {
    s.use(Shading::plain);
    s.uniform("alpha", alpha);
    s.uniform("shine", 0.45F);
    s.uniform("own_colour", s.view.dark ? palette::dark_tool : palette::tool);
    s.draw_tool(scene, snapshot.proxy_m);
    s.uniform("shine", 0.1F);
    s.uniform("own_colour", palette::force);
    s.draw_arrow(scene, snapshot, camera);
  };
  if (tool_known) draw_felt(1.0F);
  if (tool_known) s.draw_behind_disc(disc, pixels);

  glEnable(GL_BLEND);
  glEnable(GL_CULL_FACE);  // otherwise closed transparent shapes would be blended twice
  if (tool_known) {
    glDepthMask(GL_FALSE);
    glDepthFunc(GL_GREATER);
    draw_felt(0.28F);
    glDepthFunc(GL_LEQUAL);
    glDepthMask(GL_TRUE);
  }
  s.copy_rigid_layer(rigid, pixels, clip_from_scene);
  const bool device_is_off = glm::length(snapshot.device_m - snapshot.proxy_m) > 0.03 * scene.tool_radius_m;
  if (tool_known && device_is_off && polygon::is_finite(snapshot.device_m)) {
    glDepthFunc(GL_ALWAYS);  // draw always: the device point lies inside an object
    glDepthMask(GL_FALSE);
    s.use(Shading::glass);
    s.uniform("own_colour", palette::device);
    s.uniform("shine", 0.1F);
    s.draw_tool(scene, snapshot.device_m);
    glDepthFunc(GL_LEQUAL);
    glDepthMask(GL_TRUE);
  }
  glDisable(GL_CULL_FACE);
  s.draw_translucent();
  glDisable(GL_BLEND);
  glDisable(GL_SCISSOR_TEST);
}

void Renderer::finish(const OverlayMesh& overlay) {
  State& s = *state_;
  if (s.targets.frame() != s.targets.scene_frame) {
    glBindFramebuffer(GL_READ_FRAMEBUFFER, s.targets.scene_frame);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, s.targets.final_frame);
    glBlitFramebuffer(0, 0, s.width * s.targets.samples, s.height * s.targets.samples, 0, 0, s.width,
                      s.height, GL_COLOR_BUFFER_BIT, GL_LINEAR);
  }
  glBindFramebuffer(GL_FRAMEBUFFER, s.targets.frame());
  s.overlay.draw(overlay, s.width, s.height);
  check_gl("drawing the scene");
}

void Renderer::present(int width, int height) {
  show_frame(state_->targets.frame(), state_->width, state_->height, width, height);
}

std::vector<std::uint8_t> Renderer::read_rgb() {
  return read_frame(state_->targets.frame(), state_->width, state_->height);
}

}  // namespace hybrid
