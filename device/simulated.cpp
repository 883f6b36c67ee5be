// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/simulated.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "device/tool_mechanics.h"

namespace device {
namespace {

struct Figures {
  std::string_view name;
  DeviceLimits limits;
  double apparent_mass_kg;
};

// device/README.md gives the source of each figure.
const Figures& figures(DeviceModel model) noexcept {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  static constexpr Figures kIdeal{"ideal device (simulated)", {kNone, kNone, 0.0, 0.0}, 0.0};
  static constexpr Figures kPremium{"PHANToM Premium 1.5 (simulated)", {8.5, 3500.0, 0.03e-3, 0.04}, 0.075};
  static constexpr Figures kTouch{"PHANToM Touch (simulated)", {3.3, 1020.0, 0.055e-3, 0.26}, 0.045};
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

// Of the mechanism alone. No maker states it; it is small beside a hand's 4 to 7 N·s/m.
constexpr double kViscous_N_s_per_m = 0.005;

// Velocity as a driver makes it: the encoders' way over the last `kSpan_s`, divided by its time. Between two
// encoder steps there is nothing to see, so a shorter span is noisier (step / span) and a longer one is later
// (half the span).
class VelocityEstimate {
 public:
  void start(const glm::dvec3& position_m) noexcept { samples_[0] = {0.0, position_m}; }

  void add(double dt_s, const glm::dvec3& position_m) noexcept {
    const double now_s = samples_[newest_ % kSize].t_s + dt_s;
    samples_[++newest_ % kSize] = {now_s, position_m};
    if (newest_ - oldest_ >= kSize) oldest_ = newest_ - kSize + 1;
    while (oldest_ + 1 < newest_ && samples_[(oldest_ + 1) % kSize].t_s <= now_s - kSpan_s) ++oldest_;
  }

  [[nodiscard]] glm::dvec3 value() const noexcept {
    const Sample& first = samples_[oldest_ % kSize];
    const Sample& last = samples_[newest_ % kSize];
    const double span_s = last.t_s - first.t_s;
    return span_s > 0.0 ? (last.position_m - first.position_m) / span_s : glm::dvec3(0.0);
  }

 private:
  static constexpr double kSpan_s = 8e-3 - 1e-9;  // eight ticks of 1 kHz, whatever way their sum rounds
  static constexpr std::size_t kSize = 512;       // enough for that span up to 64 kHz
  struct Sample {
    double t_s = 0.0;
    glm::dvec3 position_m{0.0};
  };
  std::array<Sample, kSize> samples_{};
  std::size_t oldest_ = 0, newest_ = 0;
};

// Exactly where the path is, whatever the force.
class IdealDevice final : public HapticDevice {
 public:
  explicit IdealDevice(std::shared_ptr<const Path> path) : path_(std::move(path)) {}

  DeviceState read() noexcept override {
    constexpr double kHalf_s = 0.1e-3;  // of the central difference: a tenth of the usual tick
    DeviceState state;
    state.position_m = path_->position(t_s_);
    state.velocity_m_per_s =
        (path_->position(t_s_ + kHalf_s) - path_->position(t_s_ - kHalf_s)) / (2.0 * kHalf_s);
    return state;
  }
  void write(const glm::dvec3& /*force_N*/, double dt_s) noexcept override {
    if (dt_s > 0.0 && std::isfinite(dt_s)) t_s_ += dt_s;
  }
  [[nodiscard]] DeviceLimits limits() const noexcept override { return device_limits(DeviceModel::ideal); }
  [[nodiscard]] std::string_view name() const noexcept override { return device_name(DeviceModel::ideal); }

 private:
  std::shared_ptr<const Path> path_;
  double t_s_ = 0.0;
};

class SimulatedDevice final : public HapticDevice {
 public:
  SimulatedDevice(DeviceModel model, const HandModel& hand, std::shared_ptr<const Path> path)
      : model_(model), limits_(device_limits(model)), path_(std::move(path)) {
    mechanics_.mass_kg = figures(model).apparent_mass_kg + hand.mass_kg;
    mechanics_.viscous_N_s_per_m = kViscous_N_s_per_m;
    mechanics_.coulomb_N = limits_.friction_N;
    mechanics_.hand_damping_N_s_per_m = hand.damping_N_s_per_m;
    mechanics_.hand_stiffness_N_per_m = hand.stiffness_N_per_m;
    tool_.position_m = path_->position(0.0);
    velocity_.start(encoder_position());
  }

  DeviceState read() noexcept override {
    DeviceState state;
    state.position_m = encoder_position();
    state.velocity_m_per_s = velocity_.value();
    return state;
  }

  void write(const glm::dvec3& force_N, double dt_s) noexcept override {
    if (!(dt_s > 0.0) || !std::isfinite(dt_s)) return;
    advance(mechanics_, tool_, path_->position(t_s_), path_->position(t_s_ + dt_s), motor_force(force_N),
            dt_s);
    t_s_ += dt_s;
    velocity_.add(dt_s, encoder_position());
  }

  [[nodiscard]] DeviceLimits limits() const noexcept override { return limits_; }
  [[nodiscard]] std::string_view name() const noexcept override { return device_name(model_); }

 private:
  // The motors' amplifiers saturate; what is not a number they do not play at all.
  [[nodiscard]] glm::dvec3 motor_force(const glm::dvec3& force_N) const noexcept {
    const double strength = glm::length(force_N);
    if (!std::isfinite(strength)) return glm::dvec3(0.0);
    return strength > limits_.max_force_N ? force_N * (limits_.max_force_N / strength) : force_N;
  }

  [[nodiscard]] glm::dvec3 encoder_position() const noexcept {
    return glm::round(tool_.position_m / limits_.resolution_m) * limits_.resolution_m;
  }

  DeviceModel model_;
  DeviceLimits limits_;
  std::shared_ptr<const Path> path_;
  ToolMechanics mechanics_;
  ToolMotion tool_;  // where the tool truly is
  VelocityEstimate velocity_;
  double t_s_ = 0.0;
};

void require_at_least_zero(double value, std::string_view what) {
  if (value >= 0.0 && std::isfinite(value)) return;
  throw std::invalid_argument("hand: " + std::string(what) + " is " + std::to_string(value) +
                              "; it must be a number not below 0");
}

}  // namespace

std::unique_ptr<HapticDevice> make_simulated_device(DeviceModel model, const HandModel& hand,
                                                    std::shared_ptr<const Path> path) {
  if (path == nullptr) throw std::invalid_argument("a simulated device needs a path for its hand to follow");
  require_at_least_zero(hand.mass_kg, "mass_kg");
  require_at_least_zero(hand.damping_N_s_per_m, "damping_N_s_per_m");
  require_at_least_zero(hand.stiffness_N_per_m, "stiffness_N_per_m");
  if (model == DeviceModel::ideal) return std::make_unique<IdealDevice>(std::move(path));
  return std::make_unique<SimulatedDevice>(model, hand, std::move(path));
}

DeviceLimits device_limits(DeviceModel model) noexcept {
  return figures(model).limits;
}

std::string_view device_name(DeviceModel model) noexcept {
  return figures(model).name;
}

}  // namespace device
