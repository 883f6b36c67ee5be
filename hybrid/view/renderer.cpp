// SPDX-License-Identifier: GPL-3.0-or-later
#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "hybrid/view/gl/unit_shapes.h"
#include "hybrid/view/renderer_state.h"
#include "polygon/mesh/is_finite.h"

namespace hybrid {
namespace {

constexpr double kDepthApart = 5e-4;  // share of the view's height: about half a pixel

}  // namespace

// Copies the scene's depth of the part that is drawn to shown_depth.
void Renderer::State::copy_depth(const RenderedView& to) const {
  glBindFramebuffer(GL_READ_FRAMEBUFFER, to.targets.scene.frame);
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, to.targets.shown_frame);
  const int right_end = part.x + part.width, top = part.y + part.height;
  glBlitFramebuffer(part.x, part.y, right_end, top, part.x, part.y, right_end, top, GL_DEPTH_BUFFER_BIT,
                    GL_NEAREST);
}

// All that follows is drawn into this part of the view (samples, y up).
void Renderer::State::draw_part(const PixelRect& of_view) {
  part = of_view;
  seen = whole_from_part(part, pixels) * clip;
  glScissor(part.x, part.y, part.width, part.height);
}

void Renderer::State::draw_rigid_layer(RigidLayer& rigid) {
  LayerKey key{.clip = clip, .clip_plane = clip_equation(view.clip, bounds, origin_m).value_or(kKeepAll)};
  for (std::size_t i = 0; i < meshes->all().size(); ++i) {
    if (is_opaque_rigid(i)) key.drawn.emplace_back(i, meshes->all()[i].placed);
  }
  const bool fresh = rigid.layer.set_size(pixels.width, pixels.height);
  if (!fresh && key == rigid.key) return;
  rigid.key = std::move(key);
  glBindFramebuffer(GL_FRAMEBUFFER, rigid.layer.frame);
  glDisable(GL_SCISSOR_TEST);
  glClear(GL_DEPTH_BUFFER_BIT);
  seen = clip;
  draw_rigid(Shading::layer);
  glEnable(GL_SCISSOR_TEST);
}

void Renderer::State::copy_rigid_layer(const RenderedView& from) {
  if (from.layer.key.drawn.empty()) return;
  use(Shading::cover);
  // The layer was drawn nearer to the eye by `apart`.
  uniform("further", depth_further(glm::dmat4(clip), 2.0 * static_cast<double>(apart)));
  uniform("layer_colour", 1);
  uniform("layer_depth", 2);
  glActiveTexture(GL_TEXTURE1);
  glBindTexture(GL_TEXTURE_2D, from.layer.layer.colour);
  glActiveTexture(GL_TEXTURE2);
  glBindTexture(GL_TEXTURE_2D, from.layer.layer.depth);
  bind_image(from.targets.shown_depth);
  cover.draw();
}

// The layer has only the nearest rigid surface. Beside the tool this surface is drawn thin, so that rigid
// surfaces behind it are visible. So within the disc all rigid surfaces are drawn, one by one.
void Renderer::State::draw_behind_disc(const RenderedView& to, const glm::mat4& placed_disc) {
  const Ball around{glm::vec3(placed_disc[3]), glm::length(glm::vec3(placed_disc[0]))};
  const PixelRect whole = part, behind = common(covered_by(around, projection()), whole);
  if (behind.empty()) return;
  draw_part(behind);  // parts of meshes beside the rectangle are left out
  bind_image(to.targets.shown_depth);
  draw_rigid(Shading::unhiding);
  draw_part(whole);
}

ShownTool Renderer::State::shown_tool(const DrawnScene& scene, const Snapshot& snapshot,
                                      const Camera& camera) const {
  ShownTool tool{.proxy_m = snapshot.proxy_m, .device_m = snapshot.device_m, .force_N = snapshot.force_N};
  const Projection at = projection();
  const auto add = [&](const glm::dvec3& centre_m, double radius_m) {
    if (polygon::is_finite(centre_m))
      tool.covers =
          united(tool.covers, covered_by({glm::vec3(centre_m - origin_m), static_cast<float>(radius_m)}, at));
  };
  add(snapshot.proxy_m, tool_reach_m(scene));
  add(snapshot.device_m, tool_reach_m(scene));
  add(snapshot.proxy_m, arrow_thickness_m(camera));
  add(arrow_tip(scene, snapshot, camera), arrow_thickness_m(camera));
  const glm::mat4 placed_disc = place_tool_disc(scene, snapshot.proxy_m, camera, origin_m);
  add(origin_m + glm::dvec3(placed_disc[3]), glm::length(glm::dvec3(placed_disc[0])));
  return tool;
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
  check_gl("uploading the scene");
}

// The context is owned by the picture or the window. When it ends, it frees every OpenGL object that is left.
Renderer::~Renderer() = default;

void Renderer::release() {
  State& s = *state_;
  s.meshes->release();
  for (GlMesh* mesh : {&s.ball, &s.cylinder, &s.cone, &s.disc}) mesh->release();
  for (RenderedView& view : s.views) view.release();
  s.cover.release();
  s.overlay.release();
  s.frame.release();
  s.programs.release();
}

void Renderer::set_font(const FontAtlas& atlas) {
  state_->overlay.set_font(atlas);
  state_->changed = true;
}

void Renderer::set_view(const ViewSettings& view) {
  state_->view = view;
}

void Renderer::begin(const DrawnScene& scene, const Snapshot& snapshot, const TissueView& tissue, int width,
                     int height) {
  State& s = *state_;
  s.view_number = 0;
  s.samples = samples_for(width, height, s.wanted_samples);
  s.changed = s.frame.set_size(width, height) || s.changed;
  s.scale = tissue.scale();
  s.meshes->move(scene, snapshot, tissue);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  const glm::vec3& background = s.view.dark ? palette::dark_background : palette::background;
  glClearColor(background.r, background.g, background.b, 1.0F);
}

void Renderer::draw(const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera,
                    const PixelRect& where) {
  State& s = *state_;
  if (where.empty() || s.view_number == kMostViews) return;
  RenderedView& view = s.views[s.view_number++];
  const PixelRect place{where.x, s.frame.height - where.y - where.height, where.width, where.height};
  s.changed = s.changed || place != view.where;
  view.where = place;
  s.pixels = {0, 0, where.width * s.samples, where.height * s.samples};
  if (view.targets.set_size(s.pixels.width, s.pixels.height)) view.shown.forget();
  s.clip = glm::mat4(camera.clip_from_scene(static_cast<double>(where.width) / where.height, s.origin_m,
                                            s.bounds.centre_m,
                                            s.meshes->radius_m(scene, snapshot, camera, s.bounds)));
  s.meshes->cut(scene, snapshot, camera, s.view);
  s.eye = glm::vec3(camera.eye_m() - s.origin_m);
  // Where surfaces coincide, rounding would choose between them pixel by pixel. So rigid surfaces are drawn
  // nearer to the eye by this length. A rigid surface counts as hiding tissue only if it is nearer than the
  // tissue by more than this length.
  s.apart = static_cast<float>(kDepthApart * camera.view_height_m());
  s.right = glm::vec3(camera.right());
  s.up = glm::vec3(camera.up());
  const PixelRect part = view.shown.next(view_key(*s.meshes, s.clip, s.view, s.scale),
                                         s.shown_tool(scene, snapshot, camera), *s.meshes, s.projection());
  if (part.empty()) return;
  s.changed = true;
  s.part = part;
  s.draw_view(scene, snapshot, camera, view);
}

void Renderer::State::draw_view(const DrawnScene& scene, const Snapshot& snapshot, const Camera& camera,
                                RenderedView& to) {
  const bool tool_known = polygon::is_finite(snapshot.proxy_m) && scene.tool_radius_m > 0.0;
  bind_image(0);
  glViewport(0, 0, pixels.width, pixels.height);
  glEnable(GL_SCISSOR_TEST);
  glEnable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  glDepthFunc(GL_LEQUAL);
  glDepthMask(GL_TRUE);
  draw_rigid_layer(to.layer);
  draw_part(part);

  glBindFramebuffer(GL_FRAMEBUFFER, to.targets.scene.frame);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  draw_soft();

  // The depth of all that must not be hidden: soft objects, the arrow, and a disc in front of the tool
  // (place_tool_disc()). Copying the soft objects' depth costs less than drawing them again.
  copy_depth(to);
  glBindFramebuffer(GL_FRAMEBUFFER, to.targets.shown_frame);
  const glm::mat4 placed_disc = place_tool_disc(scene, snapshot.proxy_m, camera, origin_m);
  if (tool_known) {
    use(Shading::depth);
    place(placed_disc);
    disc.draw();
    draw_arrow(scene, snapshot, camera);
  }
  glBindFramebuffer(GL_FRAMEBUFFER, to.targets.scene.frame);
  const auto draw_felt = [&](float alpha) {
    use(Shading::plain);
    uniform("alpha", alpha);
    uniform("shine", 0.45F);
    uniform("own_colour", view.dark ? palette::dark_tool : palette::tool);
    draw_tool(scene, snapshot.proxy_m);
    uniform("shine", 0.1F);
    uniform("own_colour", palette::force);
    draw_arrow(scene, snapshot, camera);
  };
  if (tool_known) draw_felt(1.0F);
  if (tool_known) draw_behind_disc(to, placed_disc);

  glEnable(GL_BLEND);
  glEnable(GL_CULL_FACE);  // otherwise closed transparent shapes would be blended twice
  if (tool_known) {
    glDepthMask(GL_FALSE);
    glDepthFunc(GL_GREATER);
    draw_felt(0.28F);
    glDepthFunc(GL_LEQUAL);
    glDepthMask(GL_TRUE);
  }
  copy_rigid_layer(to);
  const bool device_is_off = glm::length(snapshot.device_m - snapshot.proxy_m) > 0.03 * scene.tool_radius_m;
  if (tool_known && device_is_off && polygon::is_finite(snapshot.device_m)) {
    glDepthFunc(GL_ALWAYS);  // draw always: the device point lies inside an object
    glDepthMask(GL_FALSE);
    use(Shading::glass);
    uniform("own_colour", palette::device);
    uniform("shine", 0.1F);
    draw_tool(scene, snapshot.device_m);
    glDepthFunc(GL_LEQUAL);
    glDepthMask(GL_TRUE);
  }
  glDisable(GL_CULL_FACE);
  draw_translucent();
  draw_wires();
  glDisable(GL_BLEND);
  glDisable(GL_SCISSOR_TEST);
}

bool Renderer::finish(const OverlayMesh& overlay) {
  State& s = *state_;
  for (std::size_t n = s.view_number; n < kMostViews; ++n) {
    s.changed = s.changed || !s.views[n].where.empty();
    s.views[n].where = {};
    s.views[n].shown.forget();
  }
  if (!std::exchange(s.changed, false) && overlay == s.shown_overlay) return false;
  glBindFramebuffer(GL_FRAMEBUFFER, s.frame.frame);
  glDisable(GL_SCISSOR_TEST);
  glClear(GL_COLOR_BUFFER_BIT);
  for (std::size_t n = 0; n < s.view_number; ++n) copy_view(s.views[n].targets, s.frame, s.views[n].where);
  glBindFramebuffer(GL_FRAMEBUFFER, s.frame.frame);
  s.overlay.draw(overlay, s.frame.width, s.frame.height);
  s.shown_overlay = overlay;
  check_gl("drawing the scene");
  return true;
}

void Renderer::present(int width, int height) {
  show_frame(state_->frame.frame, state_->frame.width, state_->frame.height, width, height);
}

std::vector<std::uint8_t> Renderer::read_rgb() {
  return read_frame(state_->frame.frame, state_->frame.width, state_->frame.height);
}

}  // namespace hybrid
