// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/phantom/phantom.h"

#include <array>
#include <atomic>
#include <chrono>
#include <ctime>
#include <glm/common.hpp>
#include <string_view>
#include <thread>

#include "device/loop/stop_signal.h"
#include "device/phantom/hd_errors.h"
#include "device/phantom/phantom_servo.h"
#include "device/simulated/simulated.h"

namespace device {
namespace {

using SteadyClock = std::chrono::steady_clock;

std::int64_t monotonic_ns() noexcept {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * 1'000'000'000 + now.tv_nsec;
}

// Commonly quoted figures (device/README.md) for properties that the driver does not report.
DeviceLimits quoted_limits(std::string_view model) {
  const auto says = [model](std::string_view part) { return model.find(part) != std::string_view::npos; };
  if (says("Premium 1.5")) return device_limits(DeviceModel::premium_1_5);
  if (says("Touch X") || says("Desktop")) return {};  // unknown; their figures differ from the Touch's
  if (says("Touch") || says("Omni")) return device_limits(DeviceModel::touch);
  return {};
}

// One read of the device outside of serve().
struct DeviceReading {
  const HdFunctions* call = nullptr;
  hd::Handle handle = hd::kInvalidHandle;
  std::array<double, hd::kMaxValues> position{}, velocity{};
  std::array<int, hd::kMaxValues> buttons{};

  static unsigned int on_tick(void* user) noexcept {
    auto& reading = *static_cast<DeviceReading*>(user);
    reading.call->begin_frame(reading.handle);
    reading.call->get_doubles(hd::kPosition, reading.position.data());
    reading.call->get_doubles(hd::kVelocity, reading.velocity.data());
    reading.call->get_integers(hd::kButtons, reading.buttons.data());
    reading.call->end_frame(reading.handle);
    return hd::kDone;
  }
};

class Phantom final : public PhantomDevice {
 public:
  explicit Phantom(const PhantomOptions& options)
      : options_(options),
        connection_(options.open),
        name_((info().model.empty() ? std::string("PHANToM") : info().model) +
              (info().serial.empty() ? "" : " (serial " + info().serial + ")")),
        limits_(quoted_limits(info().model)) {
    if (options_.clock_ns == nullptr) options_.clock_ns = monotonic_ns;
    if (info().max_force_N > 0.0) limits_.max_force_N = info().max_force_N;
    const glm::dvec3 size = info().workspace.high_m - info().workspace.low_m;
    if (size.x > 0.0) limits_.workspace_m = size;
    std::array<unsigned char, hd::kMaxValues> held{};
    connection_.call().get_booleans(hd::kSafetySwitch, held.data());
    has_safety_switch_ = connection_.take_errors().code == hd::kSuccess;
  }

  [[nodiscard]] const PhantomInfo& info() const noexcept override { return connection_.info(); }
  void place(const WorkspaceFit& fit) noexcept override { fit_ = fit; }
  bool calibrate() override { return connection_.calibrate(); }
  [[nodiscard]] DeviceLimits limits() const noexcept override { return limits_; }
  [[nodiscard]] std::string_view name() const noexcept override { return name_; }
  void write(const glm::dvec3& /*force_N*/, double /*dt_s*/) noexcept override {}

  DeviceState read() noexcept override {
    DeviceReading reading{.call = &connection_.call(), .handle = connection_.handle()};
    connection_.call().schedule_synchronous(DeviceReading::on_tick, &reading, hd::kPriorityDefault);
    DeviceState state;
    state.position_m = fit_.position(
        hd::kMillimeter * glm::dvec3(reading.position[0], reading.position[1], reading.position[2]));
    state.velocity_m_per_s = fit_.velocity(
        hd::kMillimeter * glm::dvec3(reading.velocity[0], reading.velocity[1], reading.velocity[2]));
    state.buttons = static_cast<std::uint32_t>(reading.buttons[0]);
    return state;
  }

  ServoReport serve(ServoFunction tick, const ServoOptions& options) override {
    connection_.require_calibrated();
    const HdFunctions& call = connection_.call();
    PhantomServo servo(call, connection_.handle(),
                       {.gate = options_.gate,
                        .deadline_s = options.deadline_s,
                        .clock_ns = options_.clock_ns,
                        .dt_s = 1.0 / info().rate_hz,
                        .max_force_N = limits_.max_force_N,
                        .fit = fit_,
                        .has_safety_switch = has_safety_switch_},
                       tick);
    const StopOnSignal stop;
    const OnCrash crash(PhantomServo::on_crash, &servo);
    const hd::Schedule schedule = call.schedule_asynchronous(PhantomServo::on_tick, &servo, hd::kPriorityMax);
    const hd::ErrorInfo error = connection_.take_errors();
    if (schedule == hd::kInvalidHandle || schedule == ~hd::Schedule{0} || error.code == hd::kSchedulerFull) {
      throw DeviceError("PHANToM: the driver takes no servo callback: " + hd_error_in_words(error));
    }
    // The driver has one error stack for all threads, so this error may come from the callback.
    if (error.code != hd::kSuccess) servo.report_error(error);
    const bool silent = !wait_for(servo);
    if (silent) give_up(servo, schedule);
    if (servo.thrown() != nullptr) std::rethrow_exception(servo.thrown());
    ServoReport report = servo.report();
    if (silent) {
      report.end = ServoEnd::lost;
      report.messages.emplace_back(
          "the driver's servo loop fell silent: the session ended, and what was felt until then is kept; "
          "switch the "
          "device off and on, and start again");
    }
    return report;
  }

 private:
  // Waits for the end of the loop. False: the driver no longer calls ticks.
  bool wait_for(PhantomServo& servo) const {
    std::uint64_t seen = servo.ticks();
    SteadyClock::time_point changed = SteadyClock::now();
    while (!servo.done()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      if (stop_signal() != 0) servo.stop();
      const SteadyClock::time_point now = SteadyClock::now();
      if (servo.ticks() != seen) {
        seen = servo.ticks();
        changed = now;
      } else if (now - changed > std::chrono::duration<double>(options_.silence_s)) {
        return servo.done();
      }
    }
    return true;
  }

  // Sends zero force from this thread, because the driver's thread no longer runs.
  void give_up(PhantomServo& servo, hd::Schedule schedule) const noexcept {
    servo.stop();  // if the driver resumes, its tick sends zero force and computes nothing
    constexpr std::array<double, 3> kNothing{};
    const HdFunctions& call = connection_.call();
    call.begin_frame(connection_.handle());
    call.set_doubles(hd::kForce, kNothing.data());
    call.end_frame(connection_.handle());
    call.unschedule(schedule);
  }

  PhantomOptions options_;
  HdConnection connection_;
  std::string name_;
  DeviceLimits limits_;
  WorkspaceFit fit_;
  bool has_safety_switch_ = false;
};

}  // namespace

std::unique_ptr<PhantomDevice> open_phantom(const PhantomOptions& options) {
  return std::make_unique<Phantom>(options);
}

}  // namespace device
