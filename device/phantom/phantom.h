// SPDX-License-Identifier: GPL-3.0-or-later
// A real PHANToM (Premium, Omni, Desktop, Touch) through the driver's own library.
//
// The driver's servo callback is the servo thread: device read, tick and force happen in one frame of it, so
// that a force is never older than the position it answers. Handing the tick to a thread of our own was
// rejected: it adds one tick of delay, which costs stiffness, and a second clock.
#pragma once

#include <cstdint>
#include <memory>

#include "device/loop/force_gate.h"
#include "device/loop/haptic_device.h"
#include "device/phantom/hd_connection.h"
#include "device/loop/servo_loop.h"
#include "device/loop/workspace_fit.h"

namespace device {

struct PhantomOptions {
  HdOpenOptions open;
  ForceGateOptions gate;
  double silence_s = 1.0;                         // no tick for so long: the driver is taken for dead
  std::int64_t (*clock_ns)() noexcept = nullptr;  // CLOCK_MONOTONIC; tests bring their own
};

class PhantomDevice : public HapticDevice, public ServoDriver {
 public:
  [[nodiscard]] virtual const PhantomInfo& info() const noexcept = 0;
  // Where its workspace lies in the scene; not while it is served.
  virtual void place(const WorkspaceFit& fit) noexcept = 0;
  // Takes the present pose as the one of calibration (encoder reset); true: the device is calibrated now.
  virtual bool calibrate() = 0;
};

// Throws DeviceError, with the remedy. Its limits: forces as the driver tells them; stiffness, resolution and
// friction as commonly quoted for its model, 0 where it is none of those known here.
//   read()  outside of serve() asks the driver's thread, and waits for its next tick;
//   write() outside of serve() does nothing: the motors are off.
// serve() refuses a device that is not calibrated (DeviceError). Within it any error of the driver, a late
// tick, a position that is not finite, a lost calibration or an open safety switch gives zero force in that
// same tick, or where the driver tells after the fact, in the next.
std::unique_ptr<PhantomDevice> open_phantom(const PhantomOptions& options = {});

}  // namespace device
