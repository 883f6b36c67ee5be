// SPDX-License-Identifier: GPL-3.0-or-later
// The error of the tissue's force in a session. The reference is the same session with the device at the same
// places, played kSlower times slower. So tissue has kSlower times the time to come to rest. The two forces
// are compared in ticks in which something soft is in contact.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "hybrid/world/world_state.h"

namespace hybrid {

inline constexpr int kSlower = 10;  // factor on the duration of the slow run
// Below this speed the device counts as still: a tenth of a millimetre in 0.1 s.
inline constexpr double kStill_m_per_s = 1e-3;

// One tick of a session.
struct CourseTick {
  glm::dvec3 device_m{0.0};
  glm::dvec3 force_N{0.0};  // of the coupling between device and proxy
  bool soft = false;        // something soft is in contact
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
  std::string not_measured;  // why no tick was compared, in words; empty if any tick was
  // Time after the stop of the device from which every still tick is within 1 JND. Empty if there is none.
  std::optional<double> within_after_s;
};

struct SlowRunOptions {
  double dt_s = 1e-3;
  double floor_N = 0.04;  // lower bound of the JND (N)
  int most = 0;           // greatest number of compared ticks, evenly spread; set it to at least 1
  bool async_relaxation = false;
  std::function<void(const std::string&)> progress;  // may be empty
  int slower = kSlower;                              // slow-down factor; at least 1
  // Called for each tick that is played, compared or not, with its number and the slow run's force (N). The
  // run ends with the last tick in which something soft is in contact. May be empty.
  std::function<void(std::size_t, const glm::dvec3&)> felt{};
};

// Plays `course` slowly from `state`. `state` must be a session that has just begun at the device's first
// position.
ForceError compare_with_slow_run(const World& world, WorldState& state, const ForceCourse& course,
                                 const SlowRunOptions& options);

// The error in one sentence: 'felt as at rest', or the error while the tool moves and for how long it lasts
// afterwards.
std::string in_words(const ForceError& error);

}  // namespace hybrid
