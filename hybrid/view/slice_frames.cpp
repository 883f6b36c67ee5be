// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/slice_frames.h"

#include <algorithm>
#include <glm/geometric.hpp>

namespace hybrid {
namespace {

constexpr double kMargin = 0.04;      // of an outline, as a share of the box's largest side
constexpr double kLeastPixels = 4.0;  // least length of the box along the axis, as it is seen

}  // namespace

std::vector<SliceFrame> slice_frames(const SoftBox& box, const ViewSettings& view) {
  std::vector<SliceFrame> frames;
  if (box.empty) return frames;
  const glm::dvec3 size = box.high_m - box.low_m;
  const double margin = kMargin * std::max({size.x, size.y, size.z});
  const glm::dvec3 low = box.low_m - margin, high = box.high_m + margin;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!view.slices[axis].on) continue;
    SliceFrame frame{.axis = axis};
    const auto d = static_cast<int>(axis), u = (d + 1) % 3, v = (d + 2) % 3;
    for (std::size_t n = 0; n < 4; ++n) {
      glm::dvec3& corner = frame.corners_m[n];
      corner[d] = box.place_m(axis, view.slices[axis].share);
      corner[u] = n == 1 || n == 2 ? high[u] : low[u];
      corner[v] = n >= 2 ? high[v] : low[v];
    }
    frames.push_back(frame);
  }
  return frames;
}

std::optional<std::size_t> slice_at(std::span<const SliceFrame> frames, const Camera& camera,
                                    const PixelRect& where, const glm::dvec2& pixel, float em) {
  for (const SliceFrame& frame : frames) {
    const auto handle = camera.pixel(frame.handle_m(), where.width, where.height);
    if (!handle) continue;
    const glm::dvec2 way = pixel - glm::dvec2(where.x, where.y) - *handle;
    if (glm::length(way) <= 1.3 * static_cast<double>(kSliceHandle * em)) return frame.axis;
  }
  return {};
}

double dragged_share(const SliceFrame& frame, const SoftBox& box, const Camera& camera,
                     const PixelRect& where, const glm::dvec2& motion) {
  const auto d = static_cast<int>(frame.axis);
  glm::dvec3 from = frame.handle_m(), to = from;
  from[d] = box.low_m[d];
  to[d] = box.high_m[d];
  const auto first = camera.pixel(from, where.width, where.height);
  const auto last = camera.pixel(to, where.width, where.height);
  if (!first || !last) return 0.0;
  const glm::dvec2 along = *last - *first;
  const double length = glm::length(along);
  return length > kLeastPixels ? glm::dot(motion, along) / (length * length) : 0.0;
}

}  // namespace hybrid
