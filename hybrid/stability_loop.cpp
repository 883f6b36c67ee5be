// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/stability_loop.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "hybrid/rigid_sweep.h"
#include "hybrid/session.h"

namespace hybrid {
namespace {

constexpr double kSoftest_N_per_m = 20.0, kStiffest_N_per_m = 1e7;
constexpr double kDeepest_m = 2e-3;      // a soft wall is pressed less hard
constexpr double kPressing_s = 0.3;      // that the hand takes to press
constexpr double kSettling_s = 0.2;      // that the loop is given after that
constexpr double kNoHand_N_per_m = 1.0;  // presses where the hand has no spring
constexpr double kBlockPeriods = 40.0;   // of an undamped oscillation, over which the envelope is measured,
constexpr double kMostBlock_s = 1.0;     // and no longer than this

// The path as the hand would walk it, with the tool exactly there: where is something felt first?
struct FirstTouch {
  glm::dvec3 free_m{0.0}, touch_m{0.0}, normal{0.0};
};

FirstTouch find_touch(const Scene& scene, BuiltScene& built) {
  const std::shared_ptr<const device::Path> path = scene_path(scene);
  begin_session(scene, *built.world, *built.state, path->position(0.0));
  const double dt = 1.0 / scene.rate_hz;
  FirstTouch first;
  first.free_m = path->position(0.0);
  for (double t = 0.0; t <= path->duration_s() + dt; t += dt) {
    const glm::dvec3 device = path->position(t);
    const TickResult felt = haptic_tick(*built.world, *built.state, {.position_m = device}, dt);
    const glm::dvec3 out = felt.proxy_m - device;
    if (felt.contacts == 0 || !(glm::length(out) > 0.0)) {
      first.free_m = device;
      continue;
    }
    first.touch_m = felt.proxy_m;
    first.normal = glm::normalize(out);
    return first;
  }
  throw SceneError(scene.file, scene.path_place,
                   "the path touches nothing, and stability is measured where it first does; lead it into an "
                   "object");
}

bool stands_still(const World& world) {
  return world.soft.empty() && std::all_of(world.rigid.begin(), world.rigid.end(), [](const RigidObject& o) {
           return o.motion.kind() == RigidMotion::Kind::fixed;
         });
}

}  // namespace

device::Mechanism LoopSetting::linear_mechanism() {
  device::Mechanism linear = device::mechanism(device::DeviceModel::premium_1_5);
  linear.name = "linear mechanism (simulated)";
  linear.limits.max_force_N = std::numeric_limits<double>::infinity();
  linear.limits.resolution_m = linear.limits.friction_N = 0.0;
  return linear;
}

device::SampledLoop bare_loop(const LoopSetting& setting) {
  return {.mass_kg = setting.mechanism.apparent_mass_kg,
          .damping_N_s_per_m = setting.mechanism.viscous_N_s_per_m,
          .wall_damping_N_s_per_m = setting.wall_damping_N_s_per_m,
          .period_s = setting.period_s(),
          .delay_ticks = setting.delay_ticks};
}

device::SampledLoop held_loop(const LoopSetting& setting) {
  device::SampledLoop loop = bare_loop(setting);
  loop.mass_kg += setting.hand.mass_kg;
  loop.damping_N_s_per_m += setting.hand.damping_N_s_per_m;
  loop.hand_stiffness_N_per_m =
      setting.hand.stiffness_N_per_m > 0.0 ? setting.hand.stiffness_N_per_m : kNoHand_N_per_m;
  return loop;
}

PressedScene::PressedScene(const Scene& scene, const Progress& progress)
    : built_(build_scene(scene, progress)), world_(*built_.world) {
  flush_denormals();
  const std::unique_ptr<WorldState> rest = copy_state(world_, *built_.state);
  const FirstTouch first = find_touch(scene, built_);
  touch_m_ = first.touch_m;
  normal_ = first.normal;
  free_m_ = first.free_m;
  built_.state.reset();
  begin_ = copy_state(world_, *rest);
  begin_session(scene, world_, *begin_, free_m_);
  begin_->limit.elapsed_s = world_.limits.soft_start_s;  // switched on a while ago
  state_ = copy_state(world_, *begin_);
  press_N_ = std::min(press_N_, 0.4 * world_.limits.max_force_N);
}

double PressedScene::depth_of(const glm::dvec3& point_m) const {
  return glm::dot(touch_m_ - point_m, normal_);
}

void PressedScene::restart(const LoopSetting& setting, double stiffness_N_per_m) {
  world_.tool.stiffness_N_per_m = stiffness_N_per_m;
  world_.encoder_m = setting.encoder_m();
  world_.damping_account = setting.damping_account;
  for (RigidObject& object : world_.rigid) object.feel.damping_N_s_per_m = setting.wall_damping_N_s_per_m;
  if (stands_still(world_)) {
    static_cast<CarriedState&>(*state_) = static_cast<const CarriedState&>(*begin_);
  } else {
    state_ = copy_state(world_, *begin_);
  }
}

// ---- stability --------------------------------------------------------------------------------------------

namespace {

// Presses from the surface to a depth, along a cosine: without a kink there is hardly anything to ring.
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
  // Read as it truly is, and rounded on the way to the tick: the tool's own motion is what a hand feels.
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
  const double creeping_s = 5.0 * loop.damping_N_s_per_m / stiffness_;  // where damping outweighs the wall
  const int ticks =
      static_cast<int>(std::lround((kPressing_s + std::max(kSettling_s, creeping_s)) * setting_.rate_hz));
  for (int n = 0; n < ticks; ++n) step();
}

void HeldLoop::knock(double amplitude_m) {
  // N·s, of an undamped oscillator
  const double impulse = amplitude_m * std::sqrt(stiffness_ * held_loop(setting_).mass_kg);
  step(std::min(impulse / setting_.period_s(), scene_.press_N()));
}

double envelope_growth(PressedScene& scene, const LoopSetting& setting, double stiffness_N_per_m) {
  constexpr int kBlocks = 3;              // the first is left out: fast modes die in it
  constexpr double kKnock = 0.02;         // of the depth
  constexpr double kOutOfRange = 0.5;     // of the depth: from here contact may be lost
  constexpr double kNothingLeft = 1e-14;  // of the power of the knock: rounding comes near
  const double endless = std::numeric_limits<double>::infinity();
  HeldLoop loop(scene, setting, stiffness_N_per_m, press_for(scene, stiffness_N_per_m));
  const double rest = loop.rest_depth_m();
  loop.settle();
  loop.knock(kKnock * rest);
  const double period_s = 2.0 * std::numbers::pi * std::sqrt(held_loop(setting).mass_kg / stiffness_N_per_m);
  const double block_s = std::min(kBlockPeriods * period_s, kMostBlock_s);
  const int ticks = static_cast<int>(std::lround(block_s * setting.rate_hz));
  double before = loop.step(), last = loop.step();
  std::array<double, kBlocks> power{};
  for (double& p : power) {
    for (int n = 0; n < ticks; ++n) {
      const double depth = loop.step();
      if (std::fabs(depth - rest) > kOutOfRange * rest) return endless;
      // The second difference knows neither the rest depth nor a slow drift towards it; Hann's window makes
      // the power nearly independent of where in a period the block begins.
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

// Whether the tool comes to rest after a knock, wherever within an encoder step it is pressed to.
bool comes_to_rest(PressedScene& scene, const LoopSetting& setting, double stiffness) {
  constexpr int kPresses = 8;
  constexpr double kRestShare = 0.02;  // of an encoder step, or of the knock: what still moves is at rest
  constexpr double kWait_s = 1.0, kLook_s = 0.25;
  const double encoder = setting.encoder_m(), press = press_for(scene, stiffness);
  const int presses = encoder > 0.0 ? kPresses : 1;
  for (int n = 0; n < presses; ++n) {
    HeldLoop loop(scene, setting, stiffness, press + stiffness * encoder * n / kPresses);
    loop.settle();
    const double knock = std::max(2.0 * encoder, 0.05 * loop.rest_depth_m());
    loop.knock(knock);
    for (int k = 0; k < kWait_s * setting.rate_hz; ++k) loop.step();
    double least = loop.step(), most = least;
    for (int k = 0; k < kLook_s * setting.rate_hz; ++k) {
      const double depth = loop.step();
      least = std::min(least, depth);
      most = std::max(most, depth);
    }
    if (most - least > kRestShare * (encoder > 0.0 ? encoder : knock)) return false;
  }
  return true;
}

}  // namespace

double measured_stable_stiffness(PressedScene& scene, const LoopSetting& setting) {
  const bool linear = setting.linear();
  const auto stable = [&](double stiffness) {
    return linear ? envelope_growth(scene, setting, stiffness) < 0.0
                  : comes_to_rest(scene, setting, stiffness);
  };
  double low = kSoftest_N_per_m, high = 2.0 * low;
  if (!stable(low)) return 0.0;
  while (high < kStiffest_N_per_m && stable(high)) {
    low = high;
    high *= 2.0;
  }
  if (high >= kStiffest_N_per_m) return high;
  while (high - low > (linear ? 1e-3 : 5e-3) * high) {
    const double middle = 0.5 * (low + high);
    (stable(middle) ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace hybrid
