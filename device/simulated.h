// SPDX-License-Identifier: GPL-3.0-or-later
// A simulated PHANToM held by a simulated hand, so that the loop is closed and stability is real.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

#include "device/haptic_device.h"
#include "device/path.h"

namespace device {

enum class DeviceModel : std::uint8_t {
  ideal,        // follows the path exactly, any force: to test models, not loops
  premium_1_5,  // 8.5 N, 3.5 N/mm, 0.03 mm, 75 g, 0.04 N
  touch,        // 3.3 N, 0.055 mm, 45 g, 0.26 N
};

struct HandModel {  // mass-damper-spring about the moving target; Hajian & Howe give 3.5–8.7 g, 4–7.4 N·s/m,
                    // 255–1255 N/m
  double mass_kg = 0.006;
  double damping_N_s_per_m = 5.0;
  double stiffness_N_per_m = 600.0;
};

// Apparent mass, viscous and Coulomb friction, encoder quantisation, force saturation. The mechanics are
// integrated in fixed substeps of 0.02 ms, implicitly; Coulomb friction may stop but never reverse a motion.
// The tool starts at rest at the path's first position. Throws std::invalid_argument: no path, a hand's
// figure below 0 or not finite.
std::unique_ptr<HapticDevice> make_simulated_device(DeviceModel model, const HandModel& hand,
                                                    std::shared_ptr<const Path> path);

// The ideal device has no limit: force and stiffness are infinite, resolution and friction 0.
[[nodiscard]] DeviceLimits device_limits(DeviceModel model) noexcept;
[[nodiscard]] std::string_view device_name(DeviceModel model) noexcept;

}  // namespace device
