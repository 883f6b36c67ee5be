// SPDX-License-Identifier: GPL-3.0-or-later
// The error of a session's force against its equilibrium, at sampled ticks with something soft in contact.
//
// A session is run twice. The first run keeps a ForceCourse; choose_error_samples() picks the ticks. The
// second run, equal to the last bit, stops at each of them and asks for the equilibrium.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

#include "hybrid/world/world_state.h"

namespace hybrid {

// One tick of the first run.
struct CourseTick {
  glm::dvec3 force_N{0.0};   // of the soft objects
  double speed_m_per_s = 0;  // of the device
  bool soft = false;         // something soft is in contact
};
using ForceCourse = std::vector<CourseTick>;

struct ErrorSample {
  std::uint64_t tick = 0;
  bool moving = false;   // the device moves faster than kStill_m_per_s
  double still_s = 0.0;  // time since the device last moved; 0 while it moves
};

// Speed of the device below which it is held still: a tenth of a millimetre in 0.1 s.
inline constexpr double kStill_m_per_s = 1e-3;

// At most `count` ticks of `course`, in rising order, each with something soft in contact. Half of them while
// the device moves, if it does: the fastest changes of the force, and evenly spread ones. The others at
// delays of 10 ms, 30 ms, 0.1 s … after the device stopped, the largest forces first. The largest force and
// the fastest change are always among them.
std::vector<ErrorSample> choose_error_samples(const ForceCourse& course, std::size_t count, double dt_s);

// Errors of one kind of samples.
struct ErrorRange {
  int samples = 0;
  double max_N = 0.0, rms_N = 0.0;
  double max_jnd = 0.0, worst_t_s = 0.0;  // greatest error in JND, and when
};

struct ForceError {
  ErrorRange all, moving, still;
  double p99_N = 0.0, p99_jnd = 0.0;
  int wanted = 0;     // ticks that were chosen; 0: nothing soft was in contact
  int unsettled = 0;  // of these, ticks whose equilibrium did not come to rest; they count in no figure
  std::string not_measured;  // why there is no sample, in words; empty if there is one
  // Time after the device stopped from which every still sample is within 1 JND; empty: no such time is
  // known.
  std::optional<double> within_after_s;
};

class ForceErrorSampler {
 public:
  // `floor_N`: of the JND.
  ForceErrorSampler(std::vector<ErrorSample> samples, double floor_N)
      : samples_(std::move(samples)), floor_N_(floor_N) {}

  // Number of ticks to run until the last sample was taken.
  [[nodiscard]] std::uint64_t ticks() const { return samples_.empty() ? 0 : samples_.back().tick + 1; }
  [[nodiscard]] bool wants(std::uint64_t tick) const {
    return next_ < samples_.size() && samples_[next_].tick == tick;
  }
  // Compares `force_N`, the coupling's in this tick, with the equilibrium of `state`. Takes seconds.
  void take(const World& world, const WorldState& state, const glm::dvec3& force_N, double t_s);
  // Progress in words.
  [[nodiscard]] std::string progress() const;
  [[nodiscard]] ForceError result() const;

 private:
  struct Taken {
    ErrorSample sample;
    double t_s, error_N, jnd;
  };

  std::vector<ErrorSample> samples_;
  double floor_N_;
  std::size_t next_ = 0;
  int unsettled_ = 0;
  std::vector<Taken> taken_;
};

// The error in one sentence: 'felt as at rest', or how wrong while the tool moves, and for how long after.
std::string in_words(const ForceError& error);

}  // namespace hybrid
