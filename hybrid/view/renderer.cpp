// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/renderer.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <limits>
#include <span>
#include <stdexcept>

#include "hybrid/view/gl_objects.h"
#include "hybrid/view/palette.h"
#include "hybrid/view/section.h"
#include "hybrid/view/shading.h"
#include "hybrid/view/tool_and_arrow.h"
#include "hybrid/view/unit_shapes.h"
#include "polygon/mesh/is_finite.h"

namespace hybrid {
namespace {

constexpr glm::vec4 kKeepAll{0.0F, 0.0F, 0.0F, 1.0F};  // a plane that clips nothing

struct Object {
  GlMesh mesh;
  DrawMesh moving;                 // used by soft objects only
  std::vector<glm::vec3> moved_m;  // displacements that are uploaded; of soft objects only
  float most_moved_m = 0.0F;
  bool soft = false;
  bool lit_by_vertex = false;
  bool closed = false;  // as is_closed_outwards() says
  glm::vec3 colour{1.0F};
  SceneBounds bounds;        // at rest
  glm::mat4 placed{1.0F};    // from the uploaded pose to the present one
  GlMesh face;               // face of a cut in the present view; empty: no cut
  glm::vec4 kept{kKeepAll};  // plane of the cut: the part on its positive side is drawn
};

// Without a graphics card, meshes of more triangles are lit at their vertices. In a window such triangles are
// a few pixels large.
constexpr std::size_t kLitByVertex = 10'000;
constexpr double kDepthApart = 5e-4;  // share of the view's height: about half a pixel

}  // namespace

struct Renderer::State {
  ShadingPrograms programs;
  GLuint program = 0;               // the program in use
  glm::mat4 clip{1.0F};             // clip_from_scene of the program in use
  glm::vec3 eye{0.0F};              // relative to origin_m
  glm::vec3 right{0.0F}, up{0.0F};  // axes of the camera
  float nearer = 0.0F;              // as in the shader
  float apart = 0.0F;               // kDepthApart in the present view (m)
  std::vector<Object> objects;
  GlMesh ball, cylinder, cone, disc;
  GlOverlay overlay;
  ViewSettings view;
  RenderTargets targets;
  int width = 0, height = 0, factor = 1, wanted_factor = 1;
  SceneBounds bounds;        // at rest
  glm::dvec3 origin_m{0.0};  // uploaded positions are floats relative to this point
  double most_moved_m = 0.0;

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
    uniform("coloured_vertices", 0);
    uniform("clip_plane", kKeepAll);
    uniform("kept", kKeepAll);
    if (shading != Shading::tissue) return;
    uniform("moved_ramp", palette::moved);
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
  void cut_objects(const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera);
  // The rectangle in samples of the scene's textures, y up from the bottom.
  [[nodiscard]] PixelRect samples_of(const PixelRect& where) const {
    return {where.x * factor, (height - where.y - where.height) * factor, where.width * factor,
            where.height * factor};
  }
  void copy_depth(const PixelRect& where) const;
  void draw_objects(bool soft, Shading shading);
  void draw_object(const Object& object, float alpha) const;
  [[nodiscard]] bool is_outside(const Object& object, float margin) const;  // is the eye?
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

// Draws the opaque objects that are soft, or those that are rigid.
void Renderer::State::draw_objects(bool soft, Shading shading) {
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const ObjectLook look = view.look_of(i);
    if (objects[i].soft != soft || !look.visible || look.opacity < 1.0F) continue;
    use(shading, objects[i].lit_by_vertex);
    draw_object(objects[i], 1.0F);
  }
}

bool Renderer::State::is_outside(const Object& object, float margin) const {
  const glm::vec3 centre(object.placed * glm::vec4(glm::vec3(object.bounds.centre_m - origin_m), 1.0F));
  return glm::distance(eye, centre) > static_cast<float>(object.bounds.radius_m) + margin;
}

void Renderer::State::draw_object(const Object& object, float alpha) const {
  if (object.mesh.count == 0) return;
  uniform("alpha", alpha);
  uniform("shine", object.soft ? 0.10F : 0.05F);
  place(object.placed);
  uniform("own_colour", object.colour);
  uniform("coloured_vertices", object.mesh.colours != 0 ? 1 : 0);
  uniform("moved_scale", object.soft ? static_cast<float>(most_moved_m) : 0.0F);
  uniform("kept", object.kept);
  const auto clip_plane = clip_equation(view.clip, bounds, origin_m);
  uniform("clip_plane", clip_plane.value_or(kKeepAll));
  if (clip_plane) glEnable(GL_CLIP_DISTANCE1);
  if (object.face.count > 0) glEnable(GL_CLIP_DISTANCE0);
  // A closed object that is whole shows no back of a triangle to an eye outside it.
  const float margin = object.most_moved_m + apart;
  const bool backs_hidden =
      object.closed && !clip_plane && object.face.count == 0 && is_outside(object, margin);
  if (backs_hidden) glEnable(GL_CULL_FACE);
  object.mesh.draw_seen(clip * object.placed, margin);
  if (backs_hidden) glDisable(GL_CULL_FACE);
  glDisable(GL_CLIP_DISTANCE0);
  if (object.face.count > 0) {
    // The face lies in the cut's plane, so rounding could clip it. Use a plane that keeps all.
    uniform("kept", kKeepAll);
    uniform("coloured_vertices", 1);
    uniform("moved_scale", 0.0F);
    object.face.draw();
  }
  glDisable(GL_CLIP_DISTANCE1);
  // Some drivers clip even when clipping is switched off. This plane keeps tool and arrow whole.
  uniform("clip_plane", kKeepAll);
}

// Of translucent objects only the nearest surface is blended, which a depth-only pass finds first.
void Renderer::State::draw_translucent() {
  const auto draw_all = [this](bool depth_only) {
    for (std::size_t i = 0; i < objects.size(); ++i) {
      const ObjectLook look = view.look_of(i);
      if (!look.visible || look.opacity >= 1.0F || look.opacity <= 0.0F) continue;
      use(depth_only        ? Shading::depth
          : objects[i].soft ? Shading::tissue
                            : Shading::plain,
          objects[i].lit_by_vertex);
      draw_object(objects[i], look.opacity);
    }
  };
  glDepthMask(GL_TRUE);
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  draw_all(true);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  draw_all(false);
}

void Renderer::State::cut_objects(const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera) {
  for (std::size_t i = 0; i < objects.size(); ++i) {
    Object& object = objects[i];
    if (object.face.count > 0) object.face.release();
    const auto cut =
        object.soft && view.look_of(i).visible ? choose_cut(scene, snapshot, camera, i) : std::nullopt;
    if (!cut) continue;
    const SectionMesh section = make_section(scene, snapshot, i, *cut, origin_m);
    if (section.mesh.indices.empty()) continue;
    object.face.upload(section.mesh, GL_STATIC_DRAW);
    object.face.upload_colours(section.colours);
    const glm::dvec3 away = -cut->toward_eye;
    object.kept = glm::vec4(glm::dvec4(away, -glm::dot(away, cut->point_m - origin_m)));
  }
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
  s.wanted_factor = draws_in_software() && samples == Samples::fast ? 1 : 2;
  s.programs.create();
  s.bounds = bounds_of(scene);
  s.origin_m = s.bounds.centre_m;
  s.objects.resize(scene.objects.size());
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    Object& object = s.objects[i];
    object.soft = scene.objects[i].soft;
    object.colour = palette::of_object(scene, i);
    object.bounds = bounds_of(scene.objects[i].surface);
    DrawMesh mesh = object.soft ? make_moving_mesh(scene.objects[i].surface, s.origin_m)
                                : make_draw_mesh(scene.objects[i].surface, s.origin_m);
    object.lit_by_vertex = s.wanted_factor == 1 && mesh.indices.size() / 3 > kLitByVertex;
    object.closed = is_closed_outwards(scene.objects[i].surface);
    std::vector<MeshPart> parts = divide_mesh(mesh);
    object.mesh.upload(mesh, object.soft ? GL_STREAM_DRAW : GL_STATIC_DRAW);
    object.mesh.parts = std::move(parts);
    const std::vector<VertexColour> colours = colours_of_vertices(scene, i);
    if (object.soft && colours.size() == mesh.vertices.size() && !colours.empty())
      object.mesh.upload_colours(colours);
    if (object.soft) object.moving = std::move(mesh);
  }
  s.ball.upload(make_unit_ball(), GL_STATIC_DRAW);
  s.cylinder.upload(make_unit_cylinder(), GL_STATIC_DRAW);
  s.cone.upload(make_unit_cone(), GL_STATIC_DRAW);
  s.disc.upload(make_unit_disc(), GL_STATIC_DRAW);

  s.overlay.create();
  s.targets.create();
  check_gl("uploading the scene");
}

// The context is owned by the picture or the window. When it ends, it frees every OpenGL object that is left.
Renderer::~Renderer() = default;

void Renderer::release() {
  State& s = *state_;
  for (Object& object : s.objects) {
    object.mesh.release();
    object.face.release();
  }
  for (GlMesh* mesh : {&s.ball, &s.cylinder, &s.cone, &s.disc}) mesh->release();
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

void Renderer::begin(const DrawnScene& scene, const Snapshot& snapshot, int width, int height) {
  State& s = *state_;
  s.width = width, s.height = height;
  s.factor = s.targets.set_size(width, height, s.wanted_factor);
  for (std::size_t i = 0; i < s.objects.size(); ++i) {
    Object& object = s.objects[i];
    object.placed = place_rigid(snapshot.place_of(i), s.origin_m);
    if (!object.soft || i >= snapshot.soft_moved_m.size() || i >= scene.objects.size()) continue;
    const auto& rest = scene.objects[i].surface.vertices;
    if (snapshot.soft_moved_m[i].size() != rest.size() || rest.size() != object.moving.vertices.size())
      continue;
    if (object.moved_m == snapshot.soft_moved_m[i]) continue;
    object.moved_m = snapshot.soft_moved_m[i];
    object.most_moved_m = move_vertices(object.moving, rest, object.moved_m, s.origin_m);
    object.mesh.stream(object.moving);
    // Displacements below a thousandth of the tool's radius do not start a scale, so that rounding does not
    // show as a pattern.
    const double least = 1e-3 * scene.tool_radius_m;
    if (object.most_moved_m > std::max(s.most_moved_m, least))
      s.most_moved_m = palette::scale_end(object.most_moved_m);
  }
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
  double radius = 1.1 * s.bounds.radius_m;
  for (const glm::dvec3& at : {snapshot.proxy_m, snapshot.device_m, arrow_tip(scene, snapshot, camera)}) {
    if (polygon::is_finite(at))
      radius = std::max(radius, glm::length(at - s.bounds.centre_m) + 4.0 * scene.tool_radius_m);
  }
  for (std::size_t i = 0; i < s.objects.size(); ++i) {
    const RigidPlace place = snapshot.place_of(i);
    const glm::dvec3 at = place(s.objects[i].bounds.centre_m);
    if (place.moved && polygon::is_finite(at))
      radius = std::max(radius, glm::length(at - s.bounds.centre_m) + 1.1 * s.objects[i].bounds.radius_m);
  }
  s.clip = glm::mat4(camera.clip_from_scene(static_cast<double>(where.width) / where.height, s.origin_m,
                                            s.bounds.centre_m, radius));
  s.cut_objects(scene, snapshot, camera);
  s.eye = glm::vec3(camera.eye_m() - s.origin_m);
  // Where surfaces coincide, rounding would choose between them pixel by pixel. So rigid surfaces are drawn
  // nearer to the eye by this length. A rigid surface counts as hiding tissue only if it is nearer than the
  // tissue by more than this length.
  s.apart = static_cast<float>(kDepthApart * camera.view_height_m());
  s.right = glm::vec3(camera.right());
  s.up = glm::vec3(camera.up());
  s.nearer = 0.0F;
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, 0);
  const PixelRect pixels = s.samples_of(where);
  glViewport(pixels.x, pixels.y, pixels.width, pixels.height);
  glScissor(pixels.x, pixels.y, pixels.width, pixels.height);
  glEnable(GL_SCISSOR_TEST);
  glEnable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  glDepthFunc(GL_LEQUAL);
  glDepthMask(GL_TRUE);

  glBindFramebuffer(GL_FRAMEBUFFER, s.targets.scene_frame);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  s.draw_objects(true, Shading::tissue);

  // The depth of all that must not be hidden: soft objects, the arrow, and a disc a little larger than the
  // tool. Copying the soft objects' depth costs less than drawing them again.
  s.copy_depth(where);
  glBindFramebuffer(GL_FRAMEBUFFER, s.targets.shown_frame);
  if (tool_known) {
    s.use(Shading::depth);
    s.place(place_tool_disc(scene, snapshot.proxy_m, camera, s.origin_m));
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
  glBindTexture(GL_TEXTURE_2D, s.targets.shown_depth);
  s.nearer = s.apart;
  s.draw_objects(false, Shading::unhiding);
  s.nearer = 0.0F;

  glEnable(GL_BLEND);
  glEnable(GL_CULL_FACE);  // otherwise closed transparent shapes would be blended twice
  glDepthMask(GL_FALSE);
  if (tool_known) {
    glDepthFunc(GL_GREATER);
    draw_felt(0.28F);
    const bool device_is_off = glm::length(snapshot.device_m - snapshot.proxy_m) > 0.03 * scene.tool_radius_m;
    if (device_is_off && polygon::is_finite(snapshot.device_m)) {
      glDepthFunc(GL_ALWAYS);  // draw always: the device point lies inside an object
      s.use(Shading::glass);
      s.uniform("own_colour", palette::device);
      s.uniform("shine", 0.1F);
      s.draw_tool(scene, snapshot.device_m);
    }
    glDepthFunc(GL_LEQUAL);
  }
  glDisable(GL_CULL_FACE);
  // Rigid surfaces in front of soft objects and of the tool: only the nearest surface is blended. A
  // depth-only pass finds that surface.
  glDepthMask(GL_TRUE);
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  s.nearer = s.apart;
  s.draw_objects(false, Shading::hiding_depth);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  glDepthFunc(GL_EQUAL);  // draws rigid surfaces that hide nothing once more, in the same colour
  s.draw_objects(false, Shading::hiding);
  glDepthFunc(GL_LEQUAL);
  s.nearer = 0.0F;
  s.draw_translucent();
  glDisable(GL_BLEND);
  glDisable(GL_SCISSOR_TEST);
}

void Renderer::finish(const OverlayMesh& overlay) {
  State& s = *state_;
  glBindFramebuffer(GL_READ_FRAMEBUFFER, s.targets.scene_frame);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, s.targets.final_frame);
  glBlitFramebuffer(0, 0, s.width * s.factor, s.height * s.factor, 0, 0, s.width, s.height,
                    GL_COLOR_BUFFER_BIT, s.factor == 1 ? GL_NEAREST : GL_LINEAR);
  glBindFramebuffer(GL_FRAMEBUFFER, s.targets.final_frame);
  s.overlay.draw(overlay, s.width, s.height);
  check_gl("drawing the scene");
}

void Renderer::present(int width, int height) {
  glBindFramebuffer(GL_READ_FRAMEBUFFER, state_->targets.final_frame);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
  glBlitFramebuffer(0, 0, state_->width, state_->height, 0, 0, width, height, GL_COLOR_BUFFER_BIT,
                    GL_NEAREST);
  check_gl("showing a frame");
}

std::vector<std::uint8_t> Renderer::read_rgb() {
  const State& s = *state_;
  const auto row = static_cast<std::size_t>(s.width) * 3;
  std::vector<std::uint8_t> up(row * static_cast<std::size_t>(s.height));
  std::vector<std::uint8_t> down(up.size());
  glBindFramebuffer(GL_FRAMEBUFFER, s.targets.final_frame);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, s.width, s.height, GL_RGB, GL_UNSIGNED_BYTE, up.data());
  check_gl("reading a frame");
  for (std::size_t y = 0; y < static_cast<std::size_t>(s.height); ++y) {
    std::copy_n(up.end() - static_cast<std::ptrdiff_t>((y + 1) * row), row,
                down.begin() + static_cast<std::ptrdiff_t>(y * row));
  }
  return down;
}

double Renderer::displacement_scale_m() const {
  return state_->most_moved_m;
}

}  // namespace hybrid
