// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/simulated/simulated.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>

#include "device/loop/clock.h"
#include "device/simulated/tool_mechanics.h"

namespace device {
namespace {

// Velocity as a driver estimates it: the change of the encoders over the last `span_s`, divided by the time.
// A shorter span has more noise (encoder step / span), a longer one more lag (half the span).
class VelocityEstimate {
 public:
  // The span is shortened by one nanosecond, so that eight ticks of 1 kHz count as 8 ms despite rounding.
  explicit VelocityEstimate(double span_s) : span_s_(span_s - 1e-9) {}
  void start(const glm::dvec3& position_m) noexcept { samples_[0] = {0.0, position_m}; }

  void add(double dt_s, const glm::dvec3& position_m) noexcept {
    const double now_s = samples_[newest_ % kSize].t_s + dt_s;
    samples_[++newest_ % kSize] = {now_s, position_m};
    if (newest_ - oldest_ >= kSize) oldest_ = newest_ - kSize + 1;
    while (oldest_ + 1 < newest_ && samples_[(oldest_ + 1) % kSize].t_s <= now_s - span_s_) ++oldest_;
    // Times are shifted back to 0. Only differences are used, and large times would lose digits.
    if (now_s <= kRewind_s) return;
    for (std::size_t i = oldest_; i <= newest_; ++i) samples_[i % kSize].t_s -= now_s;
  }

  [[nodiscard]] glm::dvec3 value() const noexcept {
    const Sample& first = samples_[oldest_ % kSize];
    const Sample& last = samples_[newest_ % kSize];
    const double span_s = last.t_s - first.t_s;
    return span_s > 0.0 ? (last.position_m - first.position_m) / span_s : glm::dvec3(0.0);
  }

 private:
  static constexpr std::size_t kSize = 512;   // enough for 8 ms at up to 64 kHz
  static constexpr double kRewind_s = 100.0;  // later times are shifted back
  struct Sample {
    double t_s = 0.0;
    glm::dvec3 position_m{0.0};
  };
  double span_s_;
  std::array<Sample, kSize> samples_{};
  std::size_t oldest_ = 0, newest_ = 0;
};

// Follows the path exactly, whatever the force.
class IdealDevice final : public HapticDevice {
 public:
  explicit IdealDevice(std::shared_ptr<const Path> path) : path_(std::move(path)) {}

  [[nodiscard]] std::unique_ptr<HapticDevice> copy() const override {
    return std::make_unique<IdealDevice>(*this);
  }
  bool go_back_to(const HapticDevice& kept) override {
    const auto* const same = dynamic_cast<const IdealDevice*>(&kept);
    if (same != nullptr) *this = *same;
    return same != nullptr;
  }

  DeviceState read() noexcept override {
    constexpr double kHalf_s = 0.1e-3;  // half step of the central difference
    DeviceState state;
    const double now_s = clock_.now_s();
    state.position_m = path_->position(now_s);
    state.velocity_m_per_s =
        (path_->position(now_s + kHalf_s) - path_->position(now_s - kHalf_s)) / (2.0 * kHalf_s);
    return state;
  }
  void write(const glm::dvec3& /*force_N*/, double dt_s) noexcept override {
    if (dt_s > 0.0 && std::isfinite(dt_s)) clock_.add(dt_s);
  }
  void delay(double extra_s) noexcept override { write(glm::dvec3(0.0), extra_s); }
  [[nodiscard]] DeviceLimits limits() const noexcept override { return device_limits(DeviceModel::ideal); }
  [[nodiscard]] std::string_view name() const noexcept override { return device_name(DeviceModel::ideal); }

 private:
  std::shared_ptr<const Path> path_;
  Clock clock_;
};

class SimulatedDevice final : public HapticDevice {
 public:
  SimulatedDevice(const SimulatedDeviceOptions& options, std::shared_ptr<const Path> path)
      : options_(options),
        path_(std::move(path)),
        mechanics_({.mass_kg = options.mechanism.apparent_mass_kg + options.hand.mass_kg,
                    .viscous_N_s_per_m = options.mechanism.viscous_N_s_per_m,
                    .coulomb_N = options.mechanism.limits.friction_N,
                    .hand_damping_N_s_per_m = options.hand.damping_N_s_per_m,
                    .hand_stiffness_N_per_m = options.hand.stiffness_N_per_m}),
        velocity_(options.velocity_span_s) {
    tool_.position_m = target(0.0);
    velocity_.start(encoder_position());
  }

  [[nodiscard]] std::unique_ptr<HapticDevice> copy() const override {
    return std::make_unique<SimulatedDevice>(*this);
  }
  bool go_back_to(const HapticDevice& kept) override {
    const auto* const same = dynamic_cast<const SimulatedDevice*>(&kept);
    if (same != nullptr) *this = *same;
    return same != nullptr;
  }

  DeviceState read() noexcept override {
    DeviceState state;
    state.position_m = encoder_position();
    state.velocity_m_per_s = velocity_.value();
    return state;
  }

  void write(const glm::dvec3& force_N, double dt_s) noexcept override {
    if (!(dt_s > 0.0) || !std::isfinite(dt_s)) return;
    const auto slots = static_cast<std::size_t>(options_.delay_ticks) + 1;
    delayed_forces_[written_ % slots] = force_N;
    ++written_;
    drive_motors(delayed_forces_[written_ % slots], dt_s);  // the oldest force
    since_write_s_ = 0.0;
    elapse(dt_s);
  }

  void delay(double extra_s) noexcept override {
    if (extra_s > 0.0 && std::isfinite(extra_s)) elapse(extra_s);
  }

  [[nodiscard]] DeviceLimits limits() const noexcept override { return options_.mechanism.limits; }
  [[nodiscard]] std::string_view name() const noexcept override { return options_.mechanism.name; }

 private:
  // Target of the hand: path plus tremor.
  [[nodiscard]] glm::dvec3 target(double t_s) const noexcept {
    const HandTremor& tremor = options_.tremor;
    if (tremor.amplitude_m <= 0.0) return path_->position(t_s);
    constexpr double kTurn = 2.0 * std::numbers::pi;
    const double phase = kTurn * tremor.frequency_hz * t_s;
    const glm::dvec3 circle(std::sin(phase), std::sin(phase + kTurn / 3.0),
                            std::sin(phase + 2.0 * kTurn / 3.0));  // radius sqrt(3/2)
    return path_->position(t_s) + tremor.amplitude_m / std::sqrt(1.5) * circle;
  }

  // Sets the motors' force, within saturation and slew rate. A force that is not finite counts as 0.
  void drive_motors(const glm::dvec3& force_N, double dt_s) noexcept {
    const double most_N = options_.mechanism.limits.max_force_N;
    const double strength = glm::length(force_N);
    glm::dvec3 wanted(0.0);
    if (std::isfinite(strength)) wanted = strength > most_N ? force_N * (most_N / strength) : force_N;
    const glm::dvec3 step = wanted - motor_N_;
    const double longest = options_.mechanism.motor_slew_N_per_s * dt_s, length = glm::length(step);
    motor_N_ = length > longest ? motor_N_ + step * (longest / length) : wanted;
  }

  // Advances by dt_s. The motors' force acts until the watchdog switches the motors off.
  void elapse(double dt_s) noexcept {
    const double watchdog_s = options_.watchdog_s.value_or(std::numeric_limits<double>::infinity());
    const double driven_s = std::clamp(watchdog_s - since_write_s_, 0.0, dt_s);
    const glm::dvec3 from = target(clock_.now_s());
    clock_.add(dt_s);
    const glm::dvec3 to = target(clock_.now_s());
    const glm::dvec3 between = driven_s < dt_s ? from + (to - from) * (driven_s / dt_s) : to;
    mechanics_.advance(tool_, from, between, motor_N_, driven_s);
    if (driven_s < dt_s) {
      motor_N_ = glm::dvec3(0.0);
      mechanics_.advance(tool_, between, to, motor_N_, dt_s - driven_s);
    }
    since_write_s_ += dt_s;
    velocity_.add(dt_s, encoder_position());
  }

  [[nodiscard]] glm::dvec3 encoder_position() const noexcept {
    const double step_m = options_.mechanism.limits.resolution_m;
    return step_m > 0.0 ? glm::round(tool_.position_m / step_m) * step_m : tool_.position_m;
  }

  SimulatedDeviceOptions options_;
  std::shared_ptr<const Path> path_;
  ToolIntegrator mechanics_;
  ToolMotion tool_;  // the true position
  VelocityEstimate velocity_;
  // Written forces that have not reached the motors yet.
  std::array<glm::dvec3, kMaxDelayTicks + 1> delayed_forces_{};
  std::size_t written_ = 0;
  glm::dvec3 motor_N_{0.0};
  double since_write_s_ = 0.0;
  Clock clock_;
};

void require_at_least_zero(double value, std::string_view what, bool may_be_infinite = false) {
  if (value >= 0.0 && (may_be_infinite || std::isfinite(value))) return;
  throw std::invalid_argument(std::string(what) + " is " + std::to_string(value) +
                              "; it must be a number not below 0");
}

void require_sense(const HandModel& hand) {
  require_at_least_zero(hand.mass_kg, "the hand's mass_kg");
  require_at_least_zero(hand.damping_N_s_per_m, "the hand's damping_N_s_per_m");
  require_at_least_zero(hand.stiffness_N_per_m, "the hand's stiffness_N_per_m");
}

void require_path(const std::shared_ptr<const Path>& path) {
  if (path == nullptr) throw std::invalid_argument("a simulated device needs a path for its hand to follow");
}

}  // namespace

std::unique_ptr<HapticDevice> make_simulated_device(const SimulatedDeviceOptions& options,
                                                    std::shared_ptr<const Path> path) {
  require_path(path);
  require_sense(options.hand);
  const Mechanism& own = options.mechanism;
  require_at_least_zero(own.apparent_mass_kg, "the mechanism's apparent_mass_kg");
  require_at_least_zero(own.viscous_N_s_per_m, "the mechanism's viscous_N_s_per_m");
  require_at_least_zero(own.limits.friction_N, "the mechanism's friction_N");
  require_at_least_zero(own.limits.resolution_m, "the mechanism's resolution_m");
  require_at_least_zero(own.limits.max_force_N, "the mechanism's max_force_N", true);
  require_at_least_zero(own.motor_slew_N_per_s, "the mechanism's motor_slew_N_per_s", true);
  require_at_least_zero(options.tremor.amplitude_m, "the tremor's amplitude_m");
  require_at_least_zero(options.tremor.frequency_hz, "the tremor's frequency_hz");
  require_at_least_zero(options.velocity_span_s, "velocity_span_s");
  if (options.watchdog_s) require_at_least_zero(*options.watchdog_s, "watchdog_s");
  if (options.delay_ticks < 0 || options.delay_ticks > kMaxDelayTicks) {
    throw std::invalid_argument("delay_ticks is " + std::to_string(options.delay_ticks) +
                                "; it must be 0 to " + std::to_string(kMaxDelayTicks));
  }
  if (!(own.apparent_mass_kg + options.hand.mass_kg > 0.0)) {
    throw std::invalid_argument(
        "neither mechanism nor hand has a mass; give one of them some, or use the ideal device");
  }
  return std::make_unique<SimulatedDevice>(options, std::move(path));
}

std::unique_ptr<HapticDevice> make_simulated_device(DeviceModel model, const HandModel& hand,
                                                    std::shared_ptr<const Path> path) {
  if (model != DeviceModel::ideal) {
    SimulatedDeviceOptions options;
    options.mechanism = mechanism(model);
    options.hand = hand;
    return make_simulated_device(options, std::move(path));
  }
  require_path(path);
  require_sense(hand);
  return std::make_unique<IdealDevice>(std::move(path));
}

// device/DECISIONS.md ("simulated: figures of the devices") gives the source of each value.
const Mechanism& mechanism(DeviceModel model) noexcept {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  // No maker states it. The value is small compared with a hand's 4 to 7 N·s/m.
  constexpr double kViscous_N_s_per_m = 0.005;
  static constexpr Mechanism kIdeal{"ideal device (simulated)", {kNone, kNone, 0.0, 0.0}, 0.0, 0.0};
  static constexpr Mechanism kPremium{"PHANToM Premium 1.5 (simulated)",
                                      {8.5, 3500.0, 0.03e-3, 0.04, {0.381, 0.267, 0.191}},
                                      0.075,
                                      kViscous_N_s_per_m};
  static constexpr Mechanism kTouch{"PHANToM Touch (simulated)",
                                    {3.3, 1020.0, 0.055e-3, 0.26, {0.160, 0.120, 0.070}},
                                    0.045,
                                    kViscous_N_s_per_m};
  switch (model) {
    case DeviceModel::ideal:
      return kIdeal;
    case DeviceModel::premium_1_5:
      return kPremium;
    case DeviceModel::touch:
      return kTouch;
  }
  return kIdeal;
}

HandModel hand_of(Grip grip) noexcept {
  switch (grip) {
    case Grip::loose:
      return {.mass_kg = 0.0035, .damping_N_s_per_m = 4.0, .stiffness_N_per_m = 255.0};
    case Grip::medium:
      return {};
    case Grip::firm:
      return {.mass_kg = 0.0087, .damping_N_s_per_m = 7.4, .stiffness_N_per_m = 1255.0};
  }
  return {};
}

DeviceLimits device_limits(DeviceModel model) noexcept {
  return mechanism(model).limits;
}

std::string_view device_name(DeviceModel model) noexcept {
  return mechanism(model).name;
}

}  // namespace device
