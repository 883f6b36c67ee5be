// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/frame_painter.h"

#include <algorithm>

namespace hybrid {

FramePainter::FramePainter(const DrawnScene& scene, Samples samples, int height)
    : scene_(scene), renderer_(scene, samples), overlay_(height) {
  renderer_.set_font(overlay_.font());
}

void FramePainter::paint(const Snapshot& snapshot, const Camera& camera, const FrameOptions& options) {
  renderer_.begin(scene_, snapshot, options.width, options.height);
  OverlayContent content;
  content.width = options.width;
  content.height = options.height;
  content.camera = camera;
  content.displacement_scale_m = renderer_.displacement_scale_m();
  content.history = options.history;
  content.help = options.help;
  content.paused = options.paused;

  renderer_.draw(scene_, snapshot, camera, {0, 0, options.width, options.height});
  // A tool smaller than a twelfth of the view is too small to judge without the inset.
  const bool small = 2.0 * scene_.tool_radius_m < camera.view_height_m() / 12.0;
  const Camera near = frame_contact(scene_, snapshot, camera);
  if (options.inset && small && scene_.tool_radius_m > 0.0 && near.distance_m < 0.7 * camera.distance_m) {
    const int side = static_cast<int>(0.36 * std::min(options.width, options.height));
    const int margin = options.height / 50;
    const int help = options.help.empty() ? 0 : options.height / 30;
    OverlayContent::Inset inset{
        near, {options.width - side - margin, options.height - side - margin - help, side, side}};
    if (side > 60) {
      renderer_.draw(scene_, snapshot, inset.camera, inset.where);
      content.inset = inset;
    }
  }
  renderer_.finish(overlay_.build(scene_, snapshot, content));
}

}  // namespace hybrid
