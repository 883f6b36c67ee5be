// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/loop/servo_loop.h"

#include <optional>

#include "device/loop/servo_timer.h"
#include "device/loop/stop_signal.h"

namespace device {
namespace {

// Writes zero force at the end of the loop, also after an exception.
class ZeroForceAtEnd {
 public:
  ZeroForceAtEnd(HapticDevice& device, double dt_s) : device_(device), dt_s_(dt_s) {}
  ZeroForceAtEnd(const ZeroForceAtEnd&) = delete;
  ZeroForceAtEnd& operator=(const ZeroForceAtEnd&) = delete;
  ZeroForceAtEnd(ZeroForceAtEnd&&) = delete;
  ZeroForceAtEnd& operator=(ZeroForceAtEnd&&) = delete;
  ~ZeroForceAtEnd() { device_.write(glm::dvec3(0.0), dt_s_); }

 private:
  HapticDevice& device_;
  double dt_s_;
};

}  // namespace

ServoReport run_servo(HapticDevice& device, const ServoOptions& options, ServoFunction tick) {
  if (auto* const driver = dynamic_cast<ServoDriver*>(&device)) return driver->serve(tick, options);

  const double dt_s = 1.0 / options.rate_hz;
  ServoReport report;
  std::optional<ServoTimer> timer;
  std::optional<StopOnSignal> stop;
  if (options.realtime) {
    timer.emplace(dt_s);
    stop.emplace();
    report.priority = timer->raise_priority();
  }
  const ZeroForceAtEnd at_the_end(device, dt_s);
  while (true) {
    ServoInput input{.device = {}, .dt_s = dt_s};
    if (timer) {
      const std::uint64_t missed = timer->missed();
      input.late_s = timer->wait();
      device.delay(static_cast<double>(timer->missed() - missed) * dt_s);
    }
    if (stop_signal() != 0) {
      report.end = ServoEnd::stopped;
      report.messages.emplace_back("stopped by a signal; what was felt until then is kept");
      break;
    }
    input.device = device.read();
    if (dt_s + input.late_s > options.deadline_s && input.device.fault == DeviceFault::none) {
      input.device.fault = DeviceFault::late;
    }
    const ServoAnswer answer = tick(input);
    if (!answer.skip) ++report.ticks;
    if (!answer.go_on) break;
    if (answer.skip) continue;
    device.write(answer.force_N, dt_s);
  }
  if (timer) report.late_ticks = timer->missed();
  return report;
}

}  // namespace device
