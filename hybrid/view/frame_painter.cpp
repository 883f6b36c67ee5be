// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/frame_painter.h"

#include "hybrid/view/layout.h"

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace hybrid {
namespace {

// A driver without a graphics card allocates megabytes in every draw call and frees them again. By default
// the C library gives such blocks back to the system, which then has to clear their pages for the next frame.
void keep_freed_memory() {
#ifdef __GLIBC__
  constexpr int kLargestKept = 32 << 20;  // bytes of a block; the C library accepts no more
  constexpr int kMostKept = 256 << 20;    // bytes of freed memory that the C library keeps
  mallopt(M_MMAP_THRESHOLD, kLargestKept);
  mallopt(M_TRIM_THRESHOLD, kMostKept);
#endif
}

}  // namespace

FramePainter::FramePainter(const DrawnScene& scene, Samples samples, int height)
    : scene_(scene),
      tissue_(scene, bounds_of(scene).centre_m),
      renderer_(scene, samples),
      box_(soft_box(scene)) {
  choose_fonts(height);
  if (samples == Samples::fast && draws_in_software()) keep_freed_memory();
}

// The text follows the size of the frame. New fonts need a new overlay.
void FramePainter::choose_fonts(int height) {
  if (text_height(height) == em_) return;
  em_ = text_height(height);
  overlay_.emplace(height);
  renderer_.set_font(overlay_->font());
}

bool FramePainter::paint(const Snapshot& snapshot, const Camera& camera, const FrameOptions& options) {
  choose_fonts(options.height);
  renderer_.set_view(options.view);
  tissue_.set(options.view);
  tissue_.take(snapshot);
  renderer_.begin(scene_, snapshot, tissue_, options.width, options.height);
  OverlayContent content;
  content.layout = frame_layout(options.width, options.height, !options.help.empty(),
                                options.panel != nullptr, !box_.empty);
  content.width = options.width;
  content.height = options.height;
  content.camera = camera;
  content.scale = tissue_.scale();
  content.slices = slice_frames(box_, options.view);
  content.names_materials =
      options.view.colour == TissueColour::material || (options.view.sliced() && !options.view.grey);
  content.panel = options.panel;
  content.dark = options.view.dark;
  content.help = options.help;
  content.notice = options.notice;
  if (const std::string words = tissue_.in_words(); !words.empty())
    content.notice += (content.notice.empty() ? "" : "\n") + words;
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
  return renderer_.finish(overlay_->build(scene_, snapshot, content));
}

}  // namespace hybrid
