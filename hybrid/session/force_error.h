// SPDX-License-Identifier: GPL-3.0-or-later
// The error of the tissue's force in a session. The reference is the same session with the device at the same
// places, played several times slower. So tissue has several times the time to come to rest. The two forces
// are compared in ticks in which something soft is in contact.
#pragma once

#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "hybrid/world/world_state.h"

namespace hybrid {

// Slow-down factors of the two references while the device moves. If a lag is inversely proportional to the
// factor, or to its root, the quick reference finds 0.89 or 0.81 of the error that the full one finds.
inline constexpr int kQuickSlower = 5, kSlower = 10;
// Below this speed the device counts as still: a tenth of a millimetre in 0.1 s.
inline constexpr double kStill_m_per_s = 1e-3;

// How carefully the reference is played.
enum class Reference : std::uint8_t {
  // kQuickSlower times slower while the device moves, and kSlower times while it is still, until the
  // reference comes to rest. The comparison takes about twice as long as the session.
  quick,
  // kSlower times slower, with nested patches twice as wide. The comparison takes 4 to 60 times as long as
  // the session.
  full,
};

// One tick of a session.
struct CourseTick {
  glm::dvec3 device_m{0.0};
  glm::dvec3 force_N{0.0};  // of the coupling between device and proxy
  bool soft = false;        // something soft is in contact
  bool at_rest = true;      // of a reference: false between the poses at which it came to rest
};
using ForceCourse = std::vector<CourseTick>;

// Errors of one kind of ticks: all, moving or still.
struct ErrorRange {
  int samples = 0;  // ticks that were compared
  double max_N = 0.0, rms_N = 0.0;
  double max_jnd = 0.0, worst_t_s = 0.0;  // greatest error in JND, and when
};

struct ForceError {
  ErrorRange all, moving, still;  // moving: the device is faster than kStill_m_per_s
  double p99_N = 0.0, p99_jnd = 0.0;
  int slower = kSlower;        // slow-down factor of the reference while the device moved
  bool wide_patches = false;   // nested patches of the reference were wider; false if there were none
  bool usual_patches = false;  // the reference had nested patches like the session's
  std::string not_measured;    // why no tick was compared, in words; empty if any tick was
  // Time after the stop of the device from which every still tick is within 1 JND. Empty if there is none.
  std::optional<double> within_after_s;
};

struct SlowRunOptions {
  double dt_s = 1e-3;
  double floor_N = 0.04;  // lower bound of the JND (N)
  bool async_relaxation = false;
  std::function<void(const std::string&)> progress;  // may be empty
  int slower = kSlower;                              // slow-down factor; at least 1
  int slower_still = 0;                              // the same while the device is still; 0: `slower`
  // Nested patches are twice as wide, so that the error at their ends is a part of the result.
  bool wide_patches = true;
  // The reference is played as fast as the session while the device is still and the force is at rest
  // (rest_watch.h).
  bool stops_at_rest = false;
};

// The options of a reference.
[[nodiscard]] SlowRunOptions slow_run_options(Reference reference);

// Plays `course` slowly from `state`, and compares every tick in which something soft is in contact. The slow
// run passes all of them, so the worst instant cannot be missed. `state` must be a session that has just
// begun at the device's first position.
ForceError compare_with_slow_run(const World& world, WorldState& state, const ForceCourse& course,
                                 const SlowRunOptions& options);

// The reference in words: "the same path 5 times slower". If it had nested patches, ", on patches twice as
// wide" or ", on the same patches" follows.
std::string reference_words(const ForceError& error);

// The error in one sentence: 'felt as at rest', or the error while the tool moves and for how long it lasts
// afterwards.
std::string in_words(const ForceError& error);

}  // namespace hybrid
