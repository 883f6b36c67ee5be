// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/window/move_handles.h"

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace hybrid {
namespace {

constexpr double kLength_em = 6.0;    // of an arrow
constexpr double kReach_em = 0.9;     // distance of the pointer within which a handle is taken
constexpr double kLeastPixels = 6.0;  // least length in the view of an arrow that can be dragged

}  // namespace

MovedBox box_of(const DrawnObject& object) {
  if (object.surface.vertices.empty()) return {};
  MovedBox box{object.surface.vertices.front(), object.surface.vertices.front()};
  for (const glm::dvec3& v : object.surface.vertices) {
    box.low_m = glm::min(box.low_m, v);
    box.high_m = glm::max(box.high_m, v);
  }
  return box;
}

double MoveHandles::length_m(const Camera& camera, const PixelRect& where, float em) {
  return kLength_em * static_cast<double>(em) * camera.view_height_m() / std::max(where.height, 1);
}

std::array<std::optional<glm::dvec2>, 4> MoveHandles::pixels(const Camera& camera, const PixelRect& where,
                                                             float em) const {
  const glm::dvec3 middle = box.centre_m() + shift_m;
  std::array<std::optional<glm::dvec2>, 4> out;
  for (std::size_t n = 0; n < out.size(); ++n) {
    glm::dvec3 point = middle;
    if (n < kInView) point[static_cast<int>(n)] += length_m(camera, where, em);
    out[n] = camera.pixel(point, where.width, where.height);
    if (out[n]) *out[n] += glm::dvec2(where.x, where.y);
  }
  return out;
}

std::optional<std::size_t> MoveHandles::at(const Camera& camera, const PixelRect& where, float em,
                                           const glm::dvec2& pixel) const {
  const auto handles = pixels(camera, where, em);
  std::optional<std::size_t> nearest;
  double least = kReach_em * static_cast<double>(em);
  for (std::size_t n = 0; n < handles.size(); ++n) {
    if (!handles[n] || glm::distance(*handles[n], pixel) > least) continue;
    least = glm::distance(*handles[n], pixel);
    nearest = n;
  }
  return nearest;
}

void MoveHandles::drag(const Camera& camera, const PixelRect& where, float em, const glm::dvec2& motion) {
  if (!held) return;
  const auto handles = pixels(camera, where, em);
  const auto& middle = handles[kInView];
  const auto& tip = handles[*held];
  if (!middle || !tip) return;
  if (*held == kInView) {
    const double per_pixel = camera.view_height_m() / std::max(where.height, 1);
    shift_m += (camera.right() * motion.x - camera.up() * motion.y) * per_pixel;
    return;
  }
  const glm::dvec2 along = *tip - *middle;
  const double length = glm::length(along);
  if (length < kLeastPixels) return;
  shift_m[static_cast<int>(*held)] +=
      length_m(camera, where, em) * glm::dot(motion, along) / (length * length);
}

bool ObjectMover::is_built() const {
  return handles_ && !handles_->held && handles_->shift_m != glm::dvec3(0.0);
}

void ObjectMover::place(const ViewState& user, const DrawnScene& scene, bool building) {
  const std::uint32_t object = user.selected;
  const bool shown = user.moves && object < scene.objects.size() && scene.objects[object].choices.open;
  if (!shown) {
    handles_.reset();
  } else if (!handles_ || object_ != object) {
    handles_ = MoveHandles{.box = box_of(scene.objects[object])};
    object_ = object;
  }
  if (building) frames_left_ = 1;
  if (is_built() && !building && --frames_left_ < 0) handles_->shift_m = glm::dvec3(0.0);
}

bool ObjectMover::take(const Camera& camera, const PixelRect& where, float em, const glm::dvec2& pixel) {
  if (!handles_ || is_built()) return false;
  handles_->held = handles_->at(camera, where, em, pixel);
  return handles_->held.has_value();
}

void ObjectMover::drag(const Camera& camera, const PixelRect& where, float em, const glm::dvec2& motion) {
  if (handles_) handles_->drag(camera, where, em, motion);
}

std::optional<SceneChange> ObjectMover::let_go(const DrawnScene& scene) {
  if (!handles_) return {};
  handles_->held.reset();
  if (handles_->shift_m == glm::dvec3(0.0)) return {};
  frames_left_ = kFramesUntilBuilding;
  return SceneChange{SceneChange::Key::move, scene.objects[object_].name, handles_->shift_m};
}

}  // namespace hybrid
