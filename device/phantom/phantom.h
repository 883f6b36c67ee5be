// SPDX-License-Identifier: GPL-3.0-or-later
// A real PHANToM (Premium, Omni, Desktop, Touch) through the driver's own library.
//
// The driver's servo callback is the servo thread. Read, tick and force happen in one frame of it, so the
// force answers the position of the same frame. A separate thread for the tick would add one tick of delay,
// which costs stiffness, and a second clock.
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
  // Without a tick for this long the driver counts as dead.
  double silence_s = 1.0;
  std::int64_t (*clock_ns)() noexcept = nullptr;  // CLOCK_MONOTONIC by default; tests supply their own
};

class PhantomDevice : public HapticDevice, public ServoDriver {
 public:
  [[nodiscard]] virtual const PhantomInfo& info() const noexcept = 0;
  // Sets where the workspace lies in the scene. Not during serve().
  virtual void place(const WorkspaceFit& fit) noexcept = 0;
  // Takes the present pose as that of calibration (encoder reset). Returns whether the device is calibrated
  // now.
  virtual bool calibrate() = 0;
};

// Throws DeviceError with the remedy. limits(): forces as the driver reports them; stiffness, resolution and
// friction as commonly quoted for the model, 0 if it is unknown.
//   read()  outside of serve() schedules a read on the driver's thread and waits for its next tick;
//   write() outside of serve() does nothing: the motors are off.
// serve() refuses a device that is not calibrated (DeviceError). During serve() the force is zero in the same
// tick after any error of the driver, a late tick, a position that is not finite, a lost calibration or an
// open safety switch. If the driver reports after the fact, the force is zero in the next tick.
std::unique_ptr<PhantomDevice> open_phantom(const PhantomOptions& options = {});

}  // namespace device
