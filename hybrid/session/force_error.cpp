// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/session/force_error.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>

#include "device/loop/stop_signal.h"
#include "hybrid/base/flush_to_zero.h"
#include "hybrid/feel/just_noticeable.h"
#include "hybrid/reference/rest_watch.h"
#include "hybrid/tick/tick.h"
#include "hybrid/tick/tissue/async_relaxation.h"

namespace hybrid {
namespace {

// The reference runs slowly from kBefore_s before a contact until kUntilStill_s after the device stopped. In
// the slow run tissue rests by then.
constexpr double kBefore_s = 0.02, kUntilStill_s = 0.5;
constexpr std::size_t kReportEvery = 64;  // ticks

// Ticks since the device last moved; 0 while it moves.
std::vector<std::size_t> ticks_still(const ForceCourse& course, double dt_s) {
  std::vector<std::size_t> still(course.size(), 0);
  for (std::size_t t = 1; t < course.size(); ++t) {
    const double speed = glm::distance(course[t].device_m, course[t - 1].device_m) / dt_s;
    still[t] = speed > kStill_m_per_s ? 0 : still[t - 1] + 1;
  }
  return still;
}

// Number of ticks without motion after which ticks are no longer played slowly.
std::size_t until_still(double dt_s) {
  return static_cast<std::size_t>(std::lround(kUntilStill_s / dt_s));
}

// Ticks to play slowly.
std::vector<bool> slow_ticks(const ForceCourse& course, const std::vector<std::size_t>& still, double dt_s) {
  const auto before = static_cast<std::size_t>(std::lround(kBefore_s / dt_s));
  const std::size_t until = until_still(dt_s);
  std::vector<bool> slow(course.size(), false);
  std::size_t to_contact = before + 1;
  for (std::size_t t = course.size(); t-- > 0;) {
    to_contact = course[t].soft ? 0 : to_contact + 1;
    slow[t] = to_contact <= before && still[t] <= until;
  }
  return slow;
}

double percentile(std::vector<double>& values, double share) {
  std::sort(values.begin(), values.end());
  const auto i = static_cast<std::size_t>(share * static_cast<double>(values.size()));
  return values[std::min(i, values.size() - 1)];
}

// Bodies that move may move the tissue while the device is still, so nothing counts as at rest then.
bool may_rest(const World& world) {
  return std::none_of(world.rigid.begin(), world.rigid.end(),
                      [](const RigidObject& object) { return object.motion.moves(); });
}

// Collects the errors of compared ticks.
class Errors {
 public:
  // `still_s`: time since the device stopped; 0 while it moves.
  void add(double error_N, double jnd, double t_s, double still_s) {
    for (ErrorRange* range : {&error_.all, still_s > 0.0 ? &error_.still : &error_.moving}) {
      if (range->samples == 0 || jnd > range->max_jnd) {
        range->max_jnd = jnd;
        range->worst_t_s = t_s;
      }
      ++range->samples;
      range->max_N = std::max(range->max_N, error_N);
      range->rms_N += error_N * error_N;  // sum of squares until result() takes the root
    }
    errors_N_.push_back(error_N);
    jnds_.push_back(jnd);
    if (still_s <= 0.0) return;
    longest_s_ = std::max(longest_s_, still_s);
    if (jnd > 1.0) beyond_s_ = std::max(beyond_s_, still_s);
  }

  [[nodiscard]] ForceError result(double dt_s) {
    if (error_.all.samples == 0) return std::move(error_);
    for (ErrorRange* range : {&error_.all, &error_.moving, &error_.still})
      range->rms_N = range->samples > 0 ? std::sqrt(range->rms_N / range->samples) : 0.0;
    error_.p99_N = percentile(errors_N_, 0.99);
    error_.p99_jnd = percentile(jnds_, 0.99);
    if (longest_s_ > beyond_s_) error_.within_after_s = beyond_s_ > 0.0 ? beyond_s_ + dt_s : 0.0;
    return std::move(error_);
  }

 private:
  ForceError error_;
  std::vector<double> errors_N_, jnds_;
  // The longest time still, and the longest time still at which the error was beyond 1 JND.
  double longest_s_ = 0.0, beyond_s_ = 0.0;
};

// Replaces nested patches that are in use by wider ones, once for each object.
void widen(WorldState& state, std::vector<bool>& wide) {
  for (std::size_t o = 0; o < state.soft.size(); ++o) {
    if (wide[o] || state.soft[o]->patches_in_use() == nullptr) continue;
    state.soft[o]->widen_patches();
    wide[o] = true;
  }
}

bool uses_patches(const WorldState& state) {
  return std::any_of(state.soft.begin(), state.soft.end(),
                     [](const auto& object) { return object->uses_patches(); });
}

}  // namespace

SlowRunOptions slow_run_options(Reference reference) {
  SlowRunOptions options;
  if (reference == Reference::full) return options;
  options.slower = kQuickSlower;
  options.slower_still = kSlower;
  options.wide_patches = false;
  options.stops_at_rest = true;
  return options;
}

ForceError compare_with_slow_run(const World& world, WorldState& state, const ForceCourse& course,
                                 const SlowRunOptions& options) {
  const auto contact = static_cast<std::size_t>(
      std::count_if(course.begin(), course.end(), [](const CourseTick& tick) { return tick.soft; }));
  ForceError none;
  none.not_measured = "nothing soft was touched";
  if (contact == 0) return none;
  const ScopedFlushToZero flushed;
  if (options.async_relaxation) start_async_relaxation(state, Arrival::counted);
  std::vector<bool> wide(state.soft.size(), false);
  const std::vector<std::size_t> still = ticks_still(course, options.dt_s);
  const std::vector<bool> slow = slow_ticks(course, still, options.dt_s);
  Errors errors;
  RestWatch rest(options.floor_N);
  const bool stops_at_rest = options.stops_at_rest && may_rest(world);
  std::size_t seen = 0;
  glm::dvec3 from = state.device_m;
  for (std::size_t t = 0; t < course.size() && seen < contact; ++t) {
    if (device::stop_signal() != 0) {
      none.not_measured = "stopped by a signal";
      return none;
    }
    if (options.progress && t % kReportEvery == 0)
      options.progress(fmt::format("the same path {} times slower, as the reference: {:.0f} %",
                                   options.slower,
                                   100.0 * static_cast<double>(t) / static_cast<double>(course.size())));
    const CourseTick& tick = course[t];
    if (still[t] == 0) rest.begin_anew();
    const int factor = still[t] > 0 && options.slower_still > 0 ? options.slower_still : options.slower;
    const int parts = slow[t] && !rest.at_rest() ? factor : 1;
    TickResult felt;
    for (int n = 1; n <= parts; ++n) {
      const device::DeviceState at{
          .position_m =
              n < parts ? glm::mix(from, tick.device_m, n / static_cast<double>(parts)) : tick.device_m};
      felt = haptic_tick(world, state, at, options.dt_s / parts);
    }
    if (options.wide_patches) widen(state, wide);
    from = tick.device_m;
    const glm::dvec3 reference = felt.coupling_N;
    if (stops_at_rest && still[t] > 0) rest.see(reference);
    if (!tick.soft) continue;
    ++seen;
    errors.add(glm::distance(tick.force_N, reference), jnd_of(tick.force_N, reference, options.floor_N),
               static_cast<double>(t) * options.dt_s, static_cast<double>(still[t]) * options.dt_s);
  }
  ForceError error = errors.result(options.dt_s);
  error.slower = options.slower;
  error.wide_patches = options.wide_patches && uses_patches(state);
  error.usual_patches = !options.wide_patches && uses_patches(state);
  return error;
}

std::string reference_words(const ForceError& error) {
  return fmt::format("the same path {} times slower{}", error.slower,
                     error.wide_patches    ? ", on patches twice as wide"
                     : error.usual_patches ? ", on the same patches"
                                           : "");
}

std::string in_words(const ForceError& error) {
  if (error.all.samples == 0) return "not measured: " + error.not_measured;
  if (error.all.max_jnd <= 1.0) return "felt as at rest, within 1 JND";
  std::string text;
  if (error.moving.samples > 0)
    text = fmt::format("up to {:.1f} JND while the tool moves", error.moving.max_jnd);
  if (error.still.samples == 0) return text;
  if (!text.empty()) text += ", ";
  if (error.still.max_jnd <= 1.0) return text + "within 1 JND as soon as it is still";
  text += fmt::format("up to {:.1f} JND when it is still", error.still.max_jnd);
  if (error.within_after_s)
    return text + fmt::format(", within 1 JND from {:.2g} s on", *error.within_after_s);
  return text + ", as long as it was held";
}

}  // namespace hybrid
