// SPDX-License-Identifier: GPL-3.0-or-later
// A real PHANToM (Premium, Omni, Desktop, Touch) through the driver's own library.
//
// The driver's thread, which calls a servo callback, is the servo thread. The callback reads the position,
// computes the tick and sets the force in one frame of the driver, so the force belongs to the position of
// the same frame. A separate thread for the tick would add a second clock and one tick of delay, which lowers
// the stable stiffness.
#pragma once

#include <cstdint>
#include <memory>

#include "device/loop/force_gate.h"
#include "device/loop/haptic_device.h"
#include "device/loop/servo_loop.h"
#include "device/loop/workspace_fit.h"
#include "device/phantom/hd_connection.h"

namespace device {

struct PhantomOptions {
  HdOpenOptions open;
  ForceGateOptions gate;
  // If the driver calls no tick for this long, the device counts as lost.
  double silence_s = 1.0;
  std::int64_t (*clock_ns)() noexcept = nullptr;  // null: CLOCK_MONOTONIC; tests supply their own clock
};

class PhantomDevice : public HapticDevice, public ServoDriver {
 public:
  [[nodiscard]] virtual const PhantomInfo& info() const noexcept = 0;
  // Sets the place of the workspace in the scene. Must not be called during serve().
  virtual void place(const WorkspaceFit& fit) noexcept = 0;
  // Takes the present pose as the pose of calibration (encoder reset). Returns whether the device is
  // calibrated now.
  virtual bool calibrate() = 0;
};

// Opens a device. Throws DeviceError with the remedy.
//   - limits() has the force that the driver reports. Stiffness, resolution and friction are commonly quoted
//     figures of the model; 0 for an unknown model.
//   - read() outside of serve() schedules a read on the driver's thread and waits for that thread's next
//     tick.
//   - write() outside of serve() does nothing: the motors are off.
//   - serve() refuses a device that is not calibrated (DeviceError). The force is zero in the tick of a
//     driver error, a late tick, a position that is not finite, a lost calibration or an open safety switch.
//     If the driver reports an error only after a tick, the force is zero in the next tick.
std::unique_ptr<PhantomDevice> open_phantom(const PhantomOptions& options = {});

}  // namespace device
