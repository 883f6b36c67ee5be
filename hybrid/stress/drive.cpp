// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/stress/drive.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>
#include <random>

#include "hybrid/base/flush_to_zero.h"
#include "hybrid/session/session.h"
#include "hybrid/session/tick_invariants.h"
#include "hybrid/stress/scenes.h"

namespace hybrid {
namespace {

// Number of jumps in a run, number of stays above and below the block, and ticks of each stay.
constexpr int kJumps = 300, kThroughs = 30, kTicksThere = 5;
constexpr double kFar = 1000.0;  // units; a metre if a unit is a millimetre
// Ticks of the way out, and ticks for which tissue must then stay at rest. kMostRest: greatest number of
// ticks until the end of that time.
constexpr int kTicksOut = 100, kMostRest = 4000;
constexpr std::uint64_t kLookEvery = 16;  // ticks between two measurements of the largest displacement
constexpr double kAfterPath_s = 0.1;      // ticks go on for this time after the path has ended
// Ticks between two stalls, and between two positions that are no numbers.
constexpr int kStallEvery = 40, kNoNumberEvery = 7;
// Durations of stalled ticks, taken in turns.
constexpr std::array<double, 5> kStalls_s{1e-3, 3e-3, 10e-3, 30e-3, 100e-3};

class Drive {
 public:
  Drive(const Scene& scene, BuiltScene& built, const glm::dvec3& middle_m, double unit_m)
      : scene_(scene), world_(*built.world), state_(*built.state), middle_m_(middle_m), unit_m_(unit_m) {}

  DriveResult go(Motion motion) {
    set_flush_to_zero();
    if (motion == Motion::jumps) {
      jump();
    } else if (motion == Motion::through) {
      go_through();
    } else {
      follow(motion);
    }
    leave();
    finish();
    return std::move(result_);
  }

 private:
  void begin(const glm::dvec3& device_m) {
    begin_session(scene_, world_, state_, device_m);
    watch_.emplace(world_, state_);
  }
  TickResult tick(const glm::dvec3& device_m, double dt_s) {
    const TickResult felt = haptic_tick(world_, state_, {.position_m = device_m}, dt_s);
    watch_->check_tick(state_, felt, dt_s);
    if (felt.contacts != 0) ++result_.contact_ticks;
    if (watch_->ticks() % kLookEvery == 0)
      result_.most_moved_m = std::max(result_.most_moved_m, largest_displacement_m(state_));
    return felt;
  }
  glm::dvec3 place(double x, double y, double z) const { return middle_m_ + unit_m_ * glm::dvec3(x, y, z); }

  // Plays the hand on its path and the device that it holds.
  void follow(Motion motion) {
    const auto path = scene_path(scene_);
    const auto device = scene_device(scene_, path);
    begin(device->read().position_m);
    const double tick_s = 1.0 / scene_.rate_hz;
    double time_s = 0.0;
    for (std::uint64_t n = 1; time_s < path->duration_s() + kAfterPath_s; ++n) {
      const bool stalls = motion == Motion::stalls && n % kStallEvery == 0;
      const double dt_s = stalls ? kStalls_s[n / kStallEvery % kStalls_s.size()] : tick_s;
      glm::dvec3 at = device->read().position_m;
      if (motion == Motion::not_numbers && n % kNoNumberEvery == 0) at = no_position(n / kNoNumberEvery);
      const TickResult felt = tick(at, dt_s);
      device->write(felt.force_N, dt_s);
      result_.force_N.push_back(felt.force_N);
      time_s += dt_s;
    }
  }

  void jump() {
    begin(place(0.0, 0.0, kFreeHeight));
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> anywhere(-kFar, kFar), within(-kFreeHeight, kFreeHeight);
    for (int n = 0; n < kJumps; ++n) {
      auto& range = n % 3 == 0 ? within : anywhere;
      const double x = range(random), y = range(random), z = range(random);
      result_.force_N.push_back(tick(place(x, y, z), 1.0 / scene_.rate_hz).force_N);
    }
  }

  void go_through() {
    constexpr double kX = -9.0, kY = -9.0;  // a place on the block, beside the ball
    begin(place(kX, kY, kFreeHeight));
    result_.lowest_m = std::numeric_limits<double>::max();
    for (int n = 0; n < kThroughs * kTicksThere; ++n) {
      const bool below = n / kTicksThere % 2 == 0;
      const TickResult felt =
          tick(place(kX, kY, below ? kFreeHeight - kFar : kFreeHeight), 1.0 / scene_.rate_hz);
      result_.lowest_m = std::min(result_.lowest_m, felt.proxy_m.z - middle_m_.z);
      result_.force_N.push_back(felt.force_N);
    }
  }

  void leave() {
    const auto see = [this](const glm::dvec3& device_m) { return tick(device_m, 1e-3); };
    const glm::dvec3 away = lead_out(world_, state_, middle_m_, kReach * unit_m_, see);
    // Goes on for a few ticks after tissue has come to rest, to see that it stays at rest.
    TickResult felt;
    for (int n = 0, rested = 0; n < kMostRest && rested < kTicksOut; ++n) {
      felt = tick(away, 1e-3);
      rested = all_asleep(state_) ? rested + 1 : 0;
    }
    result_.unbalanced_N = glm::length(felt.force_N);
  }

  void finish() {
    watch_->check_state(state_);
    result_.ticks = watch_->ticks();
    result_.not_finite = watch_->not_finite();
    result_.hash = hash_state(watch_->hash(), state_);
    result_.most_N = watch_->most_N();
    result_.over_force_N = watch_->over_force_N();
    result_.over_slew_N = watch_->over_slew_N();
    result_.excess_J = watch_->excess_J();
    result_.tolerance_J = watch_->tolerance_J();
    result_.moved_J = watch_->moved_J();
    result_.given_J = watch_->given_J();
    result_.allowed_J = watch_->allowed_J();
    result_.most_given_J = watch_->most_given_J();
    result_.worst_tick_J = watch_->worst_tick_J();
    result_.inside_m = watch_->inside_m();
    result_.slowest_us = watch_->slowest_us();
    result_.left_moved_m = largest_displacement_m(state_);
    result_.asleep = all_asleep(state_);
    result_.faults = state_.faults;
  }

  const Scene& scene_;
  const World& world_;
  WorldState& state_;
  std::optional<TickInvariants> watch_;
  glm::dvec3 middle_m_;
  double unit_m_;
  DriveResult result_;
};

}  // namespace

std::string_view name_of(Motion motion) {
  switch (motion) {
    case Motion::path:
      return "hand on a path";
    case Motion::stalls:
      return "stalled ticks of 1 to 100 ms";
    case Motion::not_numbers:
      return "NaN, infinite and absurd positions";
    case Motion::jumps:
      return "jumps of a metre a tick";
    case Motion::through:
      return "a metre down through the block, and back";
  }
  return "";
}

glm::dvec3 no_position(std::uint64_t number) noexcept {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN(),
                   kInf = std::numeric_limits<double>::infinity(),
                   kTiny = std::numeric_limits<double>::denorm_min();
  constexpr std::array<double, 7> kValues{kNan, kInf, -kInf, 1e300, -1e300, 1e30, kTiny};
  glm::dvec3 p(0.0);
  for (int d = 0; d < 3; ++d) p[d] = kValues[(number / (d == 0 ? 1 : d == 1 ? 3 : 5)) % kValues.size()];
  return p;
}

double largest_displacement_m(const WorldState& state) {
  float most = 0.0F;
  for (const auto& object : state.soft) {
    if (object->patches_in_use() != nullptr) {  // then patches hold the displacements, and state() is at rest
      for (const voxel::VoxelId v : object->lattice().surface()) {
        const glm::vec3 u = glm::abs(glm::vec3(object->displacement(v)));
        most = std::max({most, u.x, u.y, u.z});
      }
      continue;
    }
    for (const auto& axis : object->state().u) {
      for (const float u : axis) most = std::max(most, std::abs(u));
    }
  }
  return static_cast<double>(most);
}

bool all_asleep(const WorldState& state) {
  return std::all_of(state.soft.begin(), state.soft.end(),
                     [](const auto& object) { return object->asleep(); });
}

glm::dvec3 lead_out(const World& world, WorldState& state, const glm::dvec3& middle_m, double reach_m,
                    const std::function<TickResult(const glm::dvec3&)>& tick) {
  const glm::dvec3 radial = state.proxy_m - middle_m;
  const double distance = glm::length(radial);
  const std::array<glm::dvec3, 7> ways{distance > 0.0 ? radial / distance : glm::dvec3(0.0, 0.0, 1.0),
                                       glm::dvec3(0.0, 0.0, 1.0),
                                       glm::dvec3(1.0, 0.0, 0.0),
                                       glm::dvec3(-1.0, 0.0, 0.0),
                                       glm::dvec3(0.0, 1.0, 0.0),
                                       glm::dvec3(0.0, -1.0, 0.0),
                                       glm::dvec3(0.0, 0.0, -1.0)};
  glm::dvec3 away = state.proxy_m;
  for (const glm::dvec3& way : ways) {
    const glm::dvec3 from = state.proxy_m;
    away = from + 2.0 * reach_m * way;
    for (int n = 0; n <= kTicksOut; ++n) tick(from + (away - from) * (n / double{kTicksOut}));
    for (int n = 0; n < kTicksOut; ++n) tick(away);
    if (glm::length(state.proxy_m - away) <= 4.0 * world.rounding_m) break;
  }
  return away;
}

DriveResult drive(const Scene& scene, BuiltScene& built, Motion motion, const glm::dvec3& middle_m,
                  double unit_m) {
  return Drive(scene, built, middle_m, unit_m).go(motion);
}

}  // namespace hybrid
