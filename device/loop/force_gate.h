// SPDX-License-Identifier: GPL-3.0-or-later
// Lets go of the motors at once, and takes hold again slowly.
#pragma once

#include <algorithm>

namespace device {

struct ForceGateOptions {
  double rest_s = 0.25;  // after the last reason to close
  double ramp_s = 0.5;   // from nothing to the whole force
};

// A force is multiplied by pass(): 0 from the tick in which the gate was closed, and again 1 after rest and
// ramp. It starts with the ramp. Never throws, never allocates.
class ForceGate {
 public:
  explicit ForceGate(const ForceGateOptions& options = {}) : options_(options) {}

  void close() noexcept {
    rest_s_ = options_.rest_s;
    share_ = 0.0;
    closed_now_ = true;
  }

  // Once a tick of dt_s > 0: the share of the force that goes through, 0 to 1.
  double pass(double dt_s) noexcept {
    const double share = share_;
    if (closed_now_) {
      closed_now_ = false;
    } else if (rest_s_ > 0.0) {
      rest_s_ -= dt_s;
    } else {
      share_ = options_.ramp_s > 0.0 ? std::min(1.0, share_ + dt_s / options_.ramp_s) : 1.0;
    }
    return share;
  }

 private:
  ForceGateOptions options_;
  double rest_s_ = 0.0, share_ = 0.0;
  bool closed_now_ = false;
};

}  // namespace device
