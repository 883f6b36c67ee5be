// SPDX-License-Identifier: GPL-3.0-or-later
// A simulated PHANToM held by a simulated hand. The loop is closed, so instabilities appear as they would on
// a device.
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
  ideal,        // follows the path exactly under any force; for tests of models, not of loops
  premium_1_5,  // 8.5 N, 3.5 N/mm, 0.03 mm, 75 g, 0.04 N
  touch,        // 3.3 N, 0.055 mm, 45 g, 0.26 N
};

// Data of a mechanism. A linear mechanism, for comparison with theory, has an infinite max_force_N, and a
// resolution_m and friction_N of 0.
struct Mechanism {
  std::string_view name;
  DeviceLimits limits;
  double apparent_mass_kg = 0.0;
  double viscous_N_s_per_m = 0.0;  // of the mechanism, relative to the ground
  // Slew rate of the motors' force. No maker states one.
  double motor_slew_N_per_s = std::numeric_limits<double>::infinity();
};
// The ideal device has infinite force and stiffness; mass, resolution and friction are 0.
[[nodiscard]] const Mechanism& mechanism(DeviceModel model) noexcept;

// A hand: a mass on a damper and a spring about the moving target. Ranges measured by Hajian & Howe (1997):
// 3.5–8.7 g, 4–7.4 N·s/m, 255–1255 N/m.
struct HandModel {
  double mass_kg = 0.006;
  double damping_N_s_per_m = 5.0;
  double stiffness_N_per_m = 600.0;
};
enum class Grip : std::uint8_t { loose, medium, firm };
// The ends of the ranges of Hajian & Howe (loose, firm), or the default (medium).
[[nodiscard]] HandModel hand_of(Grip grip) noexcept;

// Physiological tremor has a frequency of 8 to 12 Hz. A resting fingertip shakes by about 0.1 mm.
struct HandTremor {
  double amplitude_m = 0.0;  // radius of the target's circle, in the plane normal to (1, 1, 1)
  double frequency_hz = 10.0;
};

struct SimulatedDeviceOptions {
  Mechanism mechanism = device::mechanism(DeviceModel::premium_1_5);
  HandModel hand{};
  HandTremor tremor{};
  // Whole ticks (writes) between a written force and the motors, at most kMaxDelayTicks. To simulate a delay
  // of the measurement, add it here: after the first ticks both delays have the same effect on a loop.
  int delay_ticks = 0;
  // The motors switch off if no write has come for this long. Empty: no watchdog.
  std::optional<double> watchdog_s{};
  double velocity_span_s = 8e-3;  // the driver's velocity is a mean over this time
};
inline constexpr int kMaxDelayTicks = 64;

// Makes a device with the mechanics of tool_mechanics.h. The tool starts at rest at the path's first
// position. Throws std::invalid_argument if there is no path, neither mechanism nor hand has a mass, a delay
// is out of range, or a value is below 0 or not finite (max_force_N, max_stiffness_N_per_m,
// motor_slew_N_per_s and workspace_m may be infinite).
std::unique_ptr<HapticDevice> make_simulated_device(const SimulatedDeviceOptions& options,
                                                    std::shared_ptr<const Path> path);
// Makes a simulated device with the values of a model. The ideal device follows its path, whatever the force
// and the hand.
std::unique_ptr<HapticDevice> make_simulated_device(DeviceModel model, const HandModel& hand,
                                                    std::shared_ptr<const Path> path);

[[nodiscard]] DeviceLimits device_limits(DeviceModel model) noexcept;
[[nodiscard]] std::string_view device_name(DeviceModel model) noexcept;

}  // namespace device
