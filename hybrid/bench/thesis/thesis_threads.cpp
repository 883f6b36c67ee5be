// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/bench/thesis/thesis_threads.h"

#include <ctime>
#include <optional>

#include "hybrid/session/session.h"
#include "hybrid/snapshot/make_drawn_scene.h"
#include "hybrid/view/layout.h"
#include "hybrid/view/picture.h"

namespace hybrid::bench {
namespace {

// Processor time of the whole process, because a software renderer has threads of its own.
double process_time_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// Draws the frames of a session.
class FrameDrawer {
 public:
  explicit FrameDrawer(const DrawnScene& drawn) : drawn_(drawn) {}
  void draw(const Snapshot& snapshot) noexcept {
    if (!why_not_.empty()) return;
    try {
      if (!maker_) {  // the first frame also compiles the shaders, which is not counted
        const double aspect = frame_layout(options_.width, options_.height, false).aspect();
        options_.camera = frame_scene(drawn_, snapshot, aspect, drawn_.path_m);
        maker_.emplace(drawn_, options_.height);
        (void)maker_->draw(snapshot, options_);
      }
      const double start = process_time_s();
      (void)maker_->draw(snapshot, options_);
      seconds_ += process_time_s() - start;
    } catch (const std::exception& error) {
      why_not_ = error.what();
    }
  }
  [[nodiscard]] std::optional<double> seconds() const {
    return why_not_.empty() ? std::optional(seconds_) : std::nullopt;
  }
  [[nodiscard]] const std::string& why_not() const { return why_not_; }

 private:
  const DrawnScene& drawn_;
  PictureOptions options_;
  std::optional<PictureMaker> maker_;
  double seconds_ = 0.0;
  std::string why_not_;
};

struct Times {
  std::optional<double> graphics, relaxation, haptics;  // ms for each second of the session
};

Times play(const Scene& scene, double seconds, std::string& no_graphics) {
  BuiltScene built = build_scene(scene);
  const DrawnScene drawn = drawn_scene(scene, built, scene.title);
  FrameDrawer drawer(drawn);
  SessionOptions options;
  options.seconds = seconds;
  options.keep_rows = options.keep_recording = false;
  options.async_relaxation = true;
  options.on_frame = [&drawer](const Snapshot& snapshot) { drawer.draw(snapshot); };
  const SessionResult result = run_session(scene, built, options);
  no_graphics = drawer.why_not();
  const auto per_second = [&](double s) {
    return 1e3 * s / (static_cast<double>(result.ticks) * result.dt_s);
  };
  const auto drawn_s = drawer.seconds();
  return {drawn_s ? std::optional(per_second(*drawn_s)) : std::nullopt, per_second(result.relaxation_s),
          per_second(result.servo_s)};
}

}  // namespace

std::vector<ThreadShare> thread_shares(const Scene& scene, double seconds, std::string& no_graphics) {
  Scene voxel_by_voxel = scene;
  for (SoftDescription& soft : voxel_by_voxel.soft) soft.patches = false;
  const Times own = play(scene, seconds, no_graphics), other = play(voxel_by_voxel, seconds, no_graphics);
  return {{"windows", 3.0, {}, {}},
          {"graphics", 14.0, own.graphics, other.graphics},
          {"relaxation", 79.0, own.relaxation, other.relaxation},
          {"haptics", 4.0, own.haptics, other.haptics}};
}

}  // namespace hybrid::bench
