// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/renderer.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/geometric.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <limits>
#include <span>
#include <stdexcept>

#include "hybrid/view/gl_objects.h"
#include "hybrid/view/palette.h"
#include "hybrid/view/renderer_shaders.h"
#include "hybrid/view/section.h"
#include "hybrid/view/tool_and_arrow.h"
#include "hybrid/view/unit_shapes.h"
#include "polygon/mesh/is_finite.h"

namespace hybrid {
namespace {

struct Object {
  GlMesh mesh;
  DrawMesh moving;  // used by soft objects only
  bool soft = false;
  glm::vec3 colour{1.0F};
  SceneBounds bounds;                      // at rest
  glm::mat4 placed{1.0F};                  // from the uploaded pose to the present one
  GlMesh face;                             // face of a cut in the present view; empty: no cut
  glm::vec4 kept{0.0F, 0.0F, 0.0F, 1.0F};  // plane of the cut: the part on its positive side is drawn
};

constexpr int most_pixels = 8192;
constexpr double kDepthApart = 5e-4;  // share of the view's height: about half a pixel

}  // namespace

struct Renderer::State {
  GLuint mesh_program = 0, depth_program = 0;
  GLuint program = 0;  // the program in use: mesh_program or depth_program
  std::vector<Object> objects;
  GlMesh ball, cylinder, cone, disc;
  GlOverlay overlay;
  ViewSettings view;
  GLuint scene_frame = 0, scene_colour = 0, scene_depth = 0;
  GLuint shown_frame = 0, shown_depth = 0;
  GLuint final_frame = 0, final_colour = 0;
  int width = 0, height = 0, factor = 1, wanted_factor = 1, built_width = 0, built_height = 0;
  SceneBounds bounds;        // at rest
  glm::dvec3 origin_m{0.0};  // uploaded positions are floats relative to this point
  double most_moved_m = 0.0;

  void use(GLuint which, const glm::mat4& clip) {
    program = which;
    glUseProgram(program);
    glUniformMatrix4fv(glGetUniformLocation(program, "clip_from_scene"), 1, GL_FALSE, glm::value_ptr(clip));
    uniform("shown_depth", 0);
  }
  void uniform(const char* name, float value) const {
    glUniform1f(glGetUniformLocation(program, name), value);
  }
  void uniform(const char* name, int value) const { glUniform1i(glGetUniformLocation(program, name), value); }
  void uniform(const char* name, const glm::vec3& value) const {
    glUniform3fv(glGetUniformLocation(program, name), 1, glm::value_ptr(value));
  }
  void uniform(const char* name, const glm::vec4& value) const {
    glUniform4fv(glGetUniformLocation(program, name), 1, glm::value_ptr(value));
  }
  void uniform(const char* name, std::span<const glm::vec3> values) const {
    glUniform3fv(glGetUniformLocation(program, name), static_cast<GLsizei>(values.size()),
                 glm::value_ptr(values.front()));
  }
  void place(const glm::mat4& scene_from_mesh) const {
    // The inverse transpose keeps normals perpendicular under non-uniform scale.
    const glm::mat3 normal = glm::transpose(glm::inverse(glm::mat3(scene_from_mesh)));
    glUniformMatrix4fv(glGetUniformLocation(program, "scene_from_mesh"), 1, GL_FALSE,
                       glm::value_ptr(scene_from_mesh));
    glUniformMatrix3fv(glGetUniformLocation(program, "normal_from_mesh"), 1, GL_FALSE,
                       glm::value_ptr(normal));
  }
  void build_targets();
  void cut_objects(const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera);
  void draw_objects(bool soft, int pass) const;
  void draw_object(const Object& object, float alpha) const;
  void draw_translucent(const glm::mat4& clip);
  void draw_tool(const DrawnScene& scene, const glm::dvec3& at) const;
  void draw_arrow(const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera) const;
};

void Renderer::State::build_targets() {
  const int w = width * factor;
  const int h = height * factor;
  if (w == built_width && h == built_height) return;
  const GLuint old[] = {scene_colour, scene_depth, shown_depth, final_colour};
  glDeleteTextures(4, old);
  scene_colour = make_texture_target(GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE, w, h);
  scene_depth = make_texture_target(GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, GL_FLOAT, w, h);
  shown_depth = make_texture_target(GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, GL_FLOAT, w, h);
  final_colour = make_texture_target(GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE, width, height);
  attach_targets(scene_frame, scene_colour, scene_depth);
  attach_targets(shown_frame, 0, shown_depth);
  attach_targets(final_frame, final_colour, 0);
  built_width = w;
  built_height = h;
}

// Draws the opaque objects that are soft, or those that are rigid.
void Renderer::State::draw_objects(bool soft, int pass) const {
  uniform("pass", pass);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const ObjectLook look = view.look_of(i);
    if (objects[i].soft == soft && look.visible && look.opacity >= 1.0F) draw_object(objects[i], 1.0F);
  }
  uniform("moved_scale", 0.0F);
  uniform("coloured_vertices", 0);
  uniform("pass", 0);
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
  const auto clip = clip_equation(view.clip, bounds, origin_m);
  uniform("clip_plane", clip.value_or(glm::vec4(0.0F, 0.0F, 0.0F, 1.0F)));
  if (clip) glEnable(GL_CLIP_DISTANCE1);
  if (object.face.count > 0) glEnable(GL_CLIP_DISTANCE0);
  object.mesh.draw();
  glDisable(GL_CLIP_DISTANCE0);
  if (object.face.count > 0) {
    // The face lies in the cut's plane, so rounding could clip it. Use a plane that keeps all.
    uniform("kept", glm::vec4(0.0F, 0.0F, 0.0F, 1.0F));
    uniform("coloured_vertices", 1);
    uniform("moved_scale", 0.0F);
    object.face.draw();
  }
  glDisable(GL_CLIP_DISTANCE1);
  // Some drivers clip even when clipping is switched off. This plane keeps tool and arrow whole.
  uniform("clip_plane", glm::vec4(0.0F, 0.0F, 0.0F, 1.0F));
}

// Of translucent objects only the nearest surface is blended. A depth-only pass finds this surface first, so
// the order of the triangles does not matter.
void Renderer::State::draw_translucent(const glm::mat4& clip) {
  const auto draw_all = [this] {
    uniform("nearer", 0.0F);
    for (std::size_t i = 0; i < objects.size(); ++i) {
      const ObjectLook look = view.look_of(i);
      if (look.visible && look.opacity < 1.0F && look.opacity > 0.0F) draw_object(objects[i], look.opacity);
    }
    uniform("moved_scale", 0.0F);
    uniform("coloured_vertices", 0);
  };
  glDepthMask(GL_TRUE);
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  use(depth_program, clip);
  draw_all();
  use(mesh_program, clip);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  draw_all();
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
  s.mesh_program = link_program(shaders::mesh_vertex, shaders::mesh_fragment);
  s.depth_program = link_program(shaders::mesh_vertex, shaders::depth_fragment);
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
    object.mesh.upload(mesh, object.soft ? GL_STREAM_DRAW : GL_STATIC_DRAW);
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
  glGenFramebuffers(1, &s.scene_frame);
  glGenFramebuffers(1, &s.shown_frame);
  glGenFramebuffers(1, &s.final_frame);
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
  const std::array textures{s.scene_colour, s.scene_depth, s.shown_depth, s.final_colour};
  glDeleteTextures(textures.size(), textures.data());
  const std::array frames{s.scene_frame, s.shown_frame, s.final_frame};
  glDeleteFramebuffers(frames.size(), frames.data());
  for (const GLuint used : {s.mesh_program, s.depth_program}) glDeleteProgram(used);
}

void Renderer::set_font(const FontAtlas& atlas) {
  state_->overlay.set_font(atlas);
}

void Renderer::set_view(const ViewSettings& view) {
  state_->view = view;
}

void Renderer::begin(const DrawnScene& scene, const Snapshot& snapshot, int width, int height) {
  State& s = *state_;
  if (width < 1 || height < 1 || width > most_pixels || height > most_pixels) {
    throw std::runtime_error("a picture of " + std::to_string(width) + " x " + std::to_string(height) +
                             " pixels cannot be drawn; each side must be from 1 to " +
                             std::to_string(most_pixels));
  }
  GLint most = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
  s.width = width;
  s.height = height;
  s.factor = s.wanted_factor;
  while (s.factor > 1 && std::max(width, height) * s.factor > std::min(most, most_pixels)) --s.factor;
  s.build_targets();
  for (std::size_t i = 0; i < s.objects.size(); ++i) {
    Object& object = s.objects[i];
    object.placed = place_rigid(snapshot.place_of(i), s.origin_m);
    if (!object.soft || i >= snapshot.soft_moved_m.size() || i >= scene.objects.size()) continue;
    const auto& rest = scene.objects[i].surface.vertices;
    if (snapshot.soft_moved_m[i].size() != rest.size() || rest.size() != object.moving.vertices.size())
      continue;
    const double moved = move_vertices(object.moving, rest, snapshot.soft_moved_m[i], s.origin_m);
    object.mesh.stream(object.moving);
    // Displacements below a thousandth of the tool's radius do not start a scale, so that rounding does not
    // show as a pattern.
    const double least = 1e-3 * scene.tool_radius_m;
    if (moved > std::max(s.most_moved_m, least)) s.most_moved_m = palette::scale_end(moved);
  }
  glBindFramebuffer(GL_FRAMEBUFFER, s.scene_frame);
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
  const glm::mat4 clip(camera.clip_from_scene(static_cast<double>(where.width) / where.height, s.origin_m,
                                              s.bounds.centre_m, radius));
  s.cut_objects(scene, snapshot, camera);
  const glm::vec3 eye(camera.eye_m() - s.origin_m);
  // Where surfaces coincide, rounding would choose between them pixel by pixel. So rigid surfaces are drawn
  // nearer to the eye by this length. A rigid surface counts as hiding tissue only if it is nearer than the
  // tissue by more than this length.
  const auto apart = static_cast<float>(kDepthApart * camera.view_height_m());
  s.use(s.mesh_program, clip);
  s.uniform("eye", eye);
  s.uniform("light_right", glm::vec3(camera.right()));
  s.uniform("light_up", glm::vec3(camera.up()));
  s.uniform("moved_ramp", palette::moved);
  s.uniform("own_until", palette::kOwnUntil);
  s.uniform("ramp_from", palette::kRampFrom);
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, 0);
  const int bottom = s.height - where.y - where.height;
  glViewport(where.x * s.factor, bottom * s.factor, where.width * s.factor, where.height * s.factor);
  glScissor(where.x * s.factor, bottom * s.factor, where.width * s.factor, where.height * s.factor);
  glEnable(GL_SCISSOR_TEST);
  glEnable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  glDepthFunc(GL_LEQUAL);
  glDepthMask(GL_TRUE);

  // Draws the depth of all that must not be hidden: soft objects, the arrow, and a disc a little larger than
  // the tool.
  s.use(s.depth_program, clip);
  s.uniform("eye", eye);
  glBindFramebuffer(GL_FRAMEBUFFER, s.shown_frame);
  glClear(GL_DEPTH_BUFFER_BIT);
  s.uniform("nearer", 2.0F * apart);
  s.draw_objects(true, 0);
  s.uniform("nearer", 0.0F);
  if (tool_known) {
    s.place(place_tool_disc(scene, snapshot.proxy_m, camera, s.origin_m));
    s.disc.draw();
    s.draw_arrow(scene, snapshot, camera);
  }

  s.use(s.mesh_program, clip);
  glBindFramebuffer(GL_FRAMEBUFFER, s.scene_frame);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  s.draw_objects(true, 0);
  const auto draw_felt = [&](float alpha) {
    s.uniform("alpha", alpha);
    s.uniform("shine", 0.45F);
    s.uniform("own_colour", s.view.dark ? palette::dark_tool : palette::tool);
    s.draw_tool(scene, snapshot.proxy_m);
    s.uniform("shine", 0.1F);
    s.uniform("own_colour", palette::force);
    s.draw_arrow(scene, snapshot, camera);
  };
  if (tool_known) draw_felt(1.0F);
  glBindTexture(GL_TEXTURE_2D, s.shown_depth);
  s.uniform("nearer", apart);
  s.draw_objects(false, 1);
  s.uniform("nearer", 0.0F);

  glEnable(GL_BLEND);
  glEnable(GL_CULL_FACE);  // otherwise closed transparent shapes would be blended twice
  glDepthMask(GL_FALSE);
  if (tool_known) {
    glDepthFunc(GL_GREATER);
    draw_felt(0.28F);
    glDepthFunc(GL_LEQUAL);
    const bool device_is_off = glm::length(snapshot.device_m - snapshot.proxy_m) > 0.03 * scene.tool_radius_m;
    if (device_is_off && polygon::is_finite(snapshot.device_m)) {
      glDepthFunc(GL_ALWAYS);  // draw always: the device point lies inside an object
      s.uniform("pass", 3);
      s.uniform("own_colour", palette::device);
      s.draw_tool(scene, snapshot.device_m);
      s.uniform("pass", 0);
      glDepthFunc(GL_LEQUAL);
    }
  }
  glDisable(GL_CULL_FACE);
  // Rigid surfaces in front of soft objects and of the tool: only the nearest surface is blended. A
  // depth-only pass finds that surface.
  glDepthMask(GL_TRUE);
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  s.use(s.depth_program, clip);
  s.uniform("nearer", apart);
  s.draw_objects(false, 2);
  s.use(s.mesh_program, clip);
  s.uniform("nearer", apart);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  s.draw_objects(false, 2);
  s.uniform("nearer", 0.0F);
  s.draw_translucent(clip);
  glDisable(GL_BLEND);
  glDisable(GL_SCISSOR_TEST);
}

void Renderer::finish(const OverlayMesh& overlay) {
  State& s = *state_;
  glBindFramebuffer(GL_READ_FRAMEBUFFER, s.scene_frame);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, s.final_frame);
  glBlitFramebuffer(0, 0, s.width * s.factor, s.height * s.factor, 0, 0, s.width, s.height,
                    GL_COLOR_BUFFER_BIT, s.factor == 1 ? GL_NEAREST : GL_LINEAR);
  glBindFramebuffer(GL_FRAMEBUFFER, s.final_frame);
  s.overlay.draw(overlay, s.width, s.height);
  check_gl("drawing the scene");
}

void Renderer::present(int width, int height) {
  glBindFramebuffer(GL_READ_FRAMEBUFFER, state_->final_frame);
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
  glBindFramebuffer(GL_FRAMEBUFFER, s.final_frame);
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
