// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/frame_painter.h"

#include "hybrid/view/layout.h"

namespace hybrid {

FramePainter::FramePainter(const DrawnScene& scene, Samples samples, int height)
    : scene_(scene), renderer_(scene, samples), overlay_(height) {
  renderer_.set_font(overlay_.font());
}

void FramePainter::paint(const Snapshot& snapshot, const Camera& camera, const FrameOptions& options) {
  renderer_.set_view(options.view);
  renderer_.begin(scene_, snapshot, options.width, options.height);
  OverlayContent content;
  content.layout =
      frame_layout(options.width, options.height, !options.help.empty(), options.panel != nullptr);
  content.width = options.width;
  content.height = options.height;
  content.camera = camera;
  content.displacement_scale_m = renderer_.displacement_scale_m();
  content.panel = options.panel;
  content.dark = options.view.dark;
  content.help = options.help;
  content.notice = options.notice;
  content.paused = options.paused;

  const FrameLayout& layout = content.layout;
  renderer_.draw(scene_, snapshot, camera, layout.scene);
  const Camera near = frame_contact(scene_, snapshot, camera);
  if (options.inset && layout.inset.width > 0 && scene_.tool_radius_m > 0.0) {
    const double nearer = times_nearer(near, layout.inset, camera, layout.scene);
    if (nearer >= kLeastNearer) {
      renderer_.draw(scene_, snapshot, near, layout.inset);
      content.inset = OverlayContent::Inset{near, nearer};
    }
  }
  renderer_.finish(overlay_.build(scene_, snapshot, content));
}

}  // namespace hybrid
