// SPDX-License-Identifier: GPL-3.0-or-later
// Measures stability and buzz: a hand presses, a knock follows, and the motion of the tool is recorded.
#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "hybrid/base/find_threshold.h"
#include "hybrid/stability/pressed_loop.h"

namespace hybrid {
namespace {

// Range of the search for the largest stable stiffness of a wall.
constexpr double kSoftestWall_N_per_m = 20.0, kStiffestWall_N_per_m = 1e7;
constexpr double kSoftestBuzz_N_per_m = 100.0;  // softest wall in the search for buzz
constexpr double kDeepest_m = 2e-3;  // greatest depth of a press; so the force on a soft wall is smaller
constexpr double kPressing_s = 0.3;  // time in which the hand presses
constexpr double kSettling_s = 0.2;  // time in which the loop settles after the press
// Periods of an undamped oscillation in a block, over which the envelope is measured.
constexpr double kBlockPeriods = 40.0;
constexpr double kMostBlock_s = 1.0;  // greatest length of a block

}  // namespace

namespace {

// Presses from the surface to a depth, along a cosine. It has no kink, so it excites hardly any oscillation.
class SmoothPress final : public device::Path {
 public:
  SmoothPress(const PressedScene& scene, double depth_m)
      : from_m_(scene.at_depth(0.0)), to_m_(scene.at_depth(depth_m)) {}
  [[nodiscard]] glm::dvec3 position(double t_s) const noexcept override {
    const double share = std::clamp(t_s / kPressing_s, 0.0, 1.0);
    return from_m_ + (to_m_ - from_m_) * (0.5 - 0.5 * std::cos(std::numbers::pi * share));
  }
  [[nodiscard]] double duration_s() const noexcept override { return kPressing_s; }
  [[nodiscard]] const std::vector<std::string>& notes() const noexcept override { return notes_; }

 private:
  glm::dvec3 from_m_, to_m_;
  std::vector<std::string> notes_;
};

device::SimulatedDeviceOptions options_of(const LoopSetting& setting) {
  device::SimulatedDeviceOptions options;
  options.mechanism = setting.mechanism;
  // The device reads the true position, and step() rounds it for the tick. The hand feels the true motion.
  options.mechanism.limits.resolution_m = 0.0;
  options.hand = setting.hand;
  options.hand.stiffness_N_per_m = held_loop(setting).hand_stiffness_N_per_m;
  options.delay_ticks = setting.delay_ticks;
  return options;
}

double press_for(const PressedScene& scene, double stiffness) {
  return std::min(scene.press_N(), kDeepest_m * stiffness);
}

}  // namespace

HeldLoop::HeldLoop(PressedScene& scene, const LoopSetting& setting, double stiffness_N_per_m, double press_N)
    : scene_(scene), setting_(setting), stiffness_(stiffness_N_per_m), rest_m_(press_N / stiffness_N_per_m) {
  scene.restart(setting, stiffness_N_per_m);
  const device::SimulatedDeviceOptions options = options_of(setting);
  device_ = device::make_simulated_device(
      options, std::make_shared<SmoothPress>(scene, rest_m_ + press_N / options.hand.stiffness_N_per_m));
}

double HeldLoop::step(double extra_N) {
  const double dt = setting_.period_s(), encoder = setting_.encoder_m();
  device::DeviceState seen = device_->read();
  const double depth = scene_.depth_of(seen.position_m);
  if (encoder > 0.0) seen.position_m = glm::round(seen.position_m / encoder) * encoder;
  device_->write(scene_.tick(seen, dt).force_N + extra_N * scene_.normal(), dt);
  return depth;
}

void HeldLoop::settle() {
  const device::SampledLoop loop = held_loop(setting_);
  // A loop in which damping outweighs the wall creeps to its rest.
  const double creeping_s = 5.0 * (loop.damping_N_s_per_m + loop.wall_damping_N_s_per_m) / stiffness_;
  const int ticks =
      static_cast<int>(std::lround((kPressing_s + std::max(kSettling_s, creeping_s)) * setting_.rate_hz));
  for (int n = 0; n < ticks; ++n) step();
}

void HeldLoop::knock(double amplitude_m) {
  // Impulse (N·s) that gives an undamped oscillator this amplitude.
  const double impulse = amplitude_m * std::sqrt(stiffness_ * held_loop(setting_).mass_kg);
  const double ticks = std::max(1.0, std::ceil(impulse / (scene_.press_N() * setting_.period_s())));
  for (int n = 0; n < static_cast<int>(ticks); ++n) step(impulse / (ticks * setting_.period_s()));
}

double envelope_growth(PressedScene& scene, const LoopSetting& setting, double stiffness_N_per_m) {
  constexpr int kBlocks = 3;              // the first block does not count: fast modes die out in it
  constexpr double kKnock = 0.02;         // amplitude of the knock, as a share of the depth
  constexpr double kMostShare = 0.5;      // share of the press; a greater damping force may be cut
  constexpr double kOutOfRange = 0.5;     // share of the depth; beyond it contact may be lost
  constexpr double kNothingLeft = 1e-14;  // share of the knock's power; less may be rounding
  const double endless = std::numeric_limits<double>::infinity();
  HeldLoop loop(scene, setting, stiffness_N_per_m, press_for(scene, stiffness_N_per_m));
  const double rest = loop.rest_depth_m();
  loop.settle();
  // Angular frequency without damping (rad/s).
  const double pace = std::sqrt(stiffness_N_per_m / held_loop(setting).mass_kg);
  const double wall_damping = setting.wall_damping_N_s_per_m;
  const double uncut = 0.1 * kMostShare * stiffness_N_per_m * rest / (pace * wall_damping + 1e-9);
  loop.knock(std::min(kKnock * rest, uncut));
  const double period_s = 2.0 * std::numbers::pi / pace;
  const double block_s = std::min(kBlockPeriods * period_s, kMostBlock_s);
  const int ticks = static_cast<int>(std::lround(block_s * setting.rate_hz));
  double before = loop.step(), last = loop.step();
  std::array<double, kBlocks> power{};
  for (double& p : power) {
    for (int n = 0; n < ticks; ++n) {
      const double depth = loop.step();
      if (std::fabs(depth - rest) > kOutOfRange * rest) return endless;
      const double damping_N = wall_damping * std::fabs(depth - last) * setting.rate_hz;
      if (damping_N > kMostShare * stiffness_N_per_m * rest) return endless;
      // The second difference does not contain the rest depth or a slow drift. Hann's window makes the power
      // nearly independent of the phase at which the block begins.
      const double bend = depth - 2.0 * last + before;
      const double window = std::sin(std::numbers::pi * (n + 0.5) / ticks);
      p += bend * bend * window * window * window * window;
      before = last;
      last = depth;
    }
  }
  if (power[kBlocks - 1] < kNothingLeft * power[0]) return -endless;
  return 0.5 * std::log(power[2] / power[1]) / block_s;
}

namespace {

// Knocks the tool, waits for at least a second, and records the tool's depth over the next half second.
void watch_knock(PressedScene& scene, const LoopSetting& setting, double stiffness, double press_N,
                 std::vector<double>& depth_m) {
  constexpr double kLook_s = 0.5;  // duration of the recorded motion
  // If the loop is mostly damping, the tool creeps back after a knock.
  const double wait_s = std::max(1.0, 12.0 * held_loop(setting).damping_N_s_per_m / stiffness);
  HeldLoop loop(scene, setting, stiffness, press_N);
  loop.settle();
  // The knock is as large as the depth, so that the tool passes all places where friction could hold it.
  loop.knock(loop.rest_depth_m());
  for (int k = 0; k < wait_s * setting.rate_hz; ++k) loop.step();
  depth_m.clear();
  for (int k = 0; k < kLook_s * setting.rate_hz; ++k) depth_m.push_back(loop.step());
}

// The forces with which a stiffness is tried (N). With an encoder, they hold the hand's target at several
// places between two encoder steps, because this place decides whether friction holds the tool.
std::vector<double> presses(const PressedScene& scene, const LoopSetting& setting, double stiffness) {
  const double press = press_for(scene, stiffness), step_N = stiffness * setting.encoder_m();
  if (!(step_N > 0.0)) return {press};
  const int count = scene.world().soft.empty() ? 6 : 2;  // tissue costs more, and it yields between the steps
  std::vector<double> all(static_cast<std::size_t>(count));
  for (int n = 0; n < count; ++n) all[static_cast<std::size_t>(n)] = press + step_N * n / count;
  return all;
}

bool comes_to_rest(PressedScene& scene, const LoopSetting& setting, double stiffness) {
  constexpr double kRest = 0.02;  // share of an encoder step, or of the depth; a smaller motion is rest
  std::vector<double> depth;
  const double still =
      kRest * (setting.encoder_m() > 0.0 ? setting.encoder_m() : press_for(scene, stiffness) / stiffness);
  for (const double press : presses(scene, setting, stiffness)) {
    watch_knock(scene, setting, stiffness, press, depth);
    const auto [least, most] = std::minmax_element(depth.begin(), depth.end());
    if (*most - *least > still) return false;
  }
  return true;
}

}  // namespace

std::optional<double> measured_stable_stiffness(PressedScene& scene, const LoopSetting& setting) {
  if (setting.linear()) {
    return find_threshold(kSoftestWall_N_per_m, kStiffestWall_N_per_m, 2.0, 1e-3,
                          [&](double stiffness) { return envelope_growth(scene, setting, stiffness) < 0.0; });
  }
  // If the press is hardly larger than friction, the tool has no definite rest position.
  const double softest = std::max(kSoftestWall_N_per_m, 10.0 * setting.friction_N() / kDeepest_m);
  return find_threshold(softest, kStiffestWall_N_per_m, 1.3, 5e-3,
                        [&](double stiffness) { return comes_to_rest(scene, setting, stiffness); });
}

Vibration pressed_vibration(PressedScene& scene, const LoopSetting& setting, double stiffness_N_per_m) {
  std::vector<double> depth;
  Vibration strongest;
  for (const double press : presses(scene, setting, stiffness_N_per_m)) {
    watch_knock(scene, setting, stiffness_N_per_m, press, depth);
    const Vibration now = strongest_vibration(depth, setting.rate_hz);
    if (now.felt > strongest.felt) strongest = now;
  }
  return strongest;
}

Buzz measured_buzz(PressedScene& scene, const LoopSetting& setting) {
  const bool soft = !scene.world().soft.empty();
  Buzz buzz;
  buzz.stiffest_N_per_m = soft ? 1e5 : 2e5;
  buzz.begins_N_per_m = find_threshold(kSoftestBuzz_N_per_m, buzz.stiffest_N_per_m, soft ? 1.6 : 1.15, 1e-2,
                                       [&](double stiffness) {
                                         const Vibration now = pressed_vibration(scene, setting, stiffness);
                                         if (now.felt > 1.0) buzz.vibration = now;
                                         return now.felt <= 1.0;
                                       });
  return buzz;
}

}  // namespace hybrid
