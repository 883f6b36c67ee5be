// SPDX-License-Identifier: GPL-3.0-or-later
// Switches the force off at once, and on again gradually.
#pragma once

#include <algorithm>

namespace device {

struct ForceGateOptions {
  double rest_s = 0.25;  // zero force for this long after the last call of close()
  double ramp_s = 0.5;   // from zero to the whole force
};

// The caller multiplies the force by pass(). The factor is 0 from the tick in which close() was called, and 1
// again after rest and ramp. A new gate starts with the ramp. Never throws, never allocates.
class ForceGate {
 public:
  explicit ForceGate(const ForceGateOptions& options = {}) : options_(options) {}

  void close() noexcept {
    rest_s_ = options_.rest_s;
    share_ = 0.0;
    closed_now_ = true;
  }

  // Call once per tick of dt_s > 0. Returns the share of the force that passes, 0 to 1.
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
