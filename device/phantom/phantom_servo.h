// SPDX-License-Identifier: GPL-3.0-or-later
// The servo callback in the driver's thread: one frame, one tick, one force.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <string>
#include <vector>

#include "device/loop/force_gate.h"
#include "device/loop/servo_loop.h"
#include "device/loop/workspace_fit.h"
#include "device/phantom/hd_connection.h"

namespace device {

// Counts the driver's errors by code and keeps the first error of each code. Its size is fixed, because the
// callback fills it and must not allocate.
class ErrorTally {
 public:
  void add(const hd::ErrorInfo& error) noexcept;
  [[nodiscard]] std::vector<std::string> in_words() const;

 private:
  struct Row {
    hd::ErrorInfo first;
    std::uint64_t count = 0;
  };
  std::array<Row, 16> rows_{};
  std::size_t size_ = 0;
  std::uint64_t beyond_ = 0;  // errors of codes that have no row
};

struct PhantomServoOptions {
  ForceGateOptions gate;
  // Longest time between ticks; a later tick gets zero force.
  double deadline_s = 10e-3;
  std::int64_t (*clock_ns)() noexcept = nullptr;  // required
  double dt_s = 1e-3;
  double max_force_N = 0.0;  // 0: unknown; the force is then not clamped here
  WorkspaceFit fit;
  bool has_safety_switch = false;
};

// Exists for one call of serve(). on_tick() is called by the driver's thread; other functions may be called
// by any thread.
class PhantomServo {
 public:
  PhantomServo(const HdFunctions& call, hd::Handle handle, const PhantomServoOptions& options,
               ServoFunction tick);

  // The servo callback; `servo` is a PhantomServo. It never allocates, locks, throws or does I/O of its own.
  static unsigned int on_tick(void* servo) noexcept;
  // The handler for OnCrash. It is safe in a signal handler.
  static void on_crash(void* servo) noexcept;

  void stop() noexcept { stop_.store(true); }
  // Hands an error that another thread took from the driver's error stack to the next tick.
  void report_error(const hd::ErrorInfo& error) noexcept;
  [[nodiscard]] bool done() const noexcept { return done_.load(std::memory_order_acquire); }
  [[nodiscard]] std::uint64_t ticks() const noexcept { return ticks_.load(std::memory_order_relaxed); }

  // Valid once done() is true, or once the driver calls no more ticks.
  [[nodiscard]] ServoReport report() const;
  [[nodiscard]] const std::exception_ptr& thrown() const noexcept { return thrown_; }

 private:
  enum class Reason : std::uint8_t { none, finished, stopped, error, calibration, thrown };

  unsigned int tick() noexcept;
  [[nodiscard]] bool begin() noexcept;  // false: only zero force is left to send
  void read() noexcept;
  void check_device() noexcept;
  [[nodiscard]] ServoAnswer compute() noexcept;
  void set_force(const glm::dvec3& force_device_N) noexcept;
  unsigned int end_with_zero_force() noexcept;
  unsigned int hold_zero_force() noexcept;
  void take_errors() noexcept;
  void note(const hd::ErrorInfo& error) noexcept;
  void end_for(Reason reason) noexcept {
    if (reason_ == Reason::none) reason_ = reason;
  }

  const HdFunctions call_;
  const hd::Handle handle_;
  const PhantomServoOptions options_;
  const ServoFunction function_;

  // Used only by the driver's thread until done() is true.
  ForceGate gate_;
  DeviceState state_;
  std::int64_t last_ns_ = 0;
  double late_s_ = 0.0, longest_late_s_ = 0.0, hottest_ = 0.0;
  std::uint64_t late_ticks_ = 0, cut_ticks_ = 0, nonfinite_ = 0, open_switch_ticks_ = 0, recalibrated_ = 0;
  ErrorTally errors_;
  Reason reason_ = Reason::none;
  std::exception_ptr thrown_;

  std::atomic<bool> stop_{false}, done_{false}, crashed_{false}, crash_zeroed_{false};
  std::atomic<std::uint64_t> ticks_{0};
  std::atomic<hd::Name> reported_code_{0};
  std::atomic<int> reported_internal_{0};
  std::atomic<long> thread_{0};
};

}  // namespace device
