// SPDX-License-Identifier: GPL-3.0-or-later
// A simulated PHANToM held by a simulated hand, so that the loop is closed and stability is real.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string_view>

#include "device/loop/haptic_device.h"
#include "device/paths/path.h"

namespace device {

enum class DeviceModel : std::uint8_t {
  ideal,        // follows the path exactly, any force: to test models, not loops
  premium_1_5,  // 8.5 N, 3.5 N/mm, 0.03 mm, 75 g, 0.04 N
  touch,        // 3.3 N, 0.055 mm, 45 g, 0.26 N
};

// What a mechanism is, as data. A linear one (for loops that theory answers) has an infinite max_force_N,
// and resolution_m and friction_N 0.
struct Mechanism {
  std::string_view name;
  DeviceLimits limits;
  double apparent_mass_kg = 0.0;
  double viscous_N_s_per_m = 0.0;  // of the mechanism, against the ground
  // How fast the amplifiers change the motors' force; no maker states it.
  double motor_slew_N_per_s = std::numeric_limits<double>::infinity();
};
// The ideal device has no limit: force and stiffness are infinite, mass, resolution and friction 0.
[[nodiscard]] const Mechanism& mechanism(DeviceModel model) noexcept;

struct HandModel {  // mass-damper-spring about the moving target; Hajian & Howe give 3.5–8.7 g, 4–7.4 N·s/m,
                    // 255–1255 N/m
  double mass_kg = 0.006;
  double damping_N_s_per_m = 5.0;
  double stiffness_N_per_m = 600.0;
};
enum class Grip : std::uint8_t { loose, medium, firm };
// The ends of those ranges, and the default between them.
[[nodiscard]] HandModel hand_of(Grip grip) noexcept;

// Physiological tremor is 8 to 12 Hz; at rest a fingertip shakes by some 0.1 mm.
struct HandTremor {
  double amplitude_m = 0.0;  // the target runs round a circle of this radius, in the plane across (1, 1, 1)
  double frequency_hz = 10.0;
};

struct SimulatedDeviceOptions {
  Mechanism mechanism = device::mechanism(DeviceModel::premium_1_5);
  HandModel hand{};
  HandTremor tremor{};
  // Whole ticks (writes) between a written force and the motors, at most kMaxDelayTicks. A delay of the
  // measurement would sit between encoders and read(); a loop cannot tell the two apart but for the first
  // ticks, so it is added here too.
  int delay_ticks = 0;
  // The motors let go when no write has come for this long. Empty: none.
  std::optional<double> watchdog_s{};
  double velocity_span_s = 8e-3;  // over which the driver's velocity is a mean
};
inline constexpr int kMaxDelayTicks = 64;

// The mechanics are those of tool_mechanics.h. The tool starts at rest at the path's first position. Throws
// std::invalid_argument in words: no path, no mass at all, a figure below 0 or not finite (max_force_N,
// max_stiffness_N_per_m, motor_slew_N_per_s and workspace_m may be infinite), a delay out of range.
std::unique_ptr<HapticDevice> make_simulated_device(const SimulatedDeviceOptions& options,
                                                    std::shared_ptr<const Path> path);
// The same with the figures of a model; `ideal` is where its path is, whatever the force and the hand.
std::unique_ptr<HapticDevice> make_simulated_device(DeviceModel model, const HandModel& hand,
                                                    std::shared_ptr<const Path> path);

[[nodiscard]] DeviceLimits device_limits(DeviceModel model) noexcept;
[[nodiscard]] std::string_view device_name(DeviceModel model) noexcept;

}  // namespace device
