// SPDX-License-Identifier: GPL-3.0-or-later
// A test double of libHD: a complete device behind the driver's C interface, with its own scheduler thread. A
// test loads the same library file as the program and finds `fake_hd` in it. The test writes the events that
// shall happen into this struct.
#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

struct FakeHdForce {
  std::uint64_t tick = 0;  // tick of the asynchronous callback, counted from 0
  double newton[3] = {0, 0, 0};
};

struct FakeHd {
  static constexpr std::uint64_t never = ~std::uint64_t{0};

  // Timing. Unpaced ticks follow one another at once, and fake_hd_now_ns() counts them.
  bool paced = false;
  int rate_hz = 1000;        // the granted rate, whatever is requested
  bool accepts_rate = true;  // false: a request is an error, and `rate_hz` stays

  // Opening.
  int failing_inits = 0;  // number of hdInitDevice calls that fail; -1: all
  unsigned init_error = 0x302;
  unsigned start_error = 0;       // error of hdStartScheduler; 0: none
  unsigned schedule_error = 0;    // error of hdScheduleAsynchronous; 0: none
  unsigned calibration = 0x5000;  // result of hdCheckCalibration until the calibration is updated
  unsigned calibration_after = 0x5000;
  int calibration_style = 4;
  bool has_safety_switch = false;

  // Events at ticks.
  std::uint64_t error_at = never, error_ticks = 1;
  unsigned error = 0;
  bool error_after_force = false;  // the error is reported at the frame's end instead of its start
  std::uint64_t late_at = never;
  double late_s = 0.0;
  std::uint64_t nan_at = never;
  std::uint64_t switch_opens_at = never, switch_closes_at = never;
  std::uint64_t calibration_lost_at = never;
  std::uint64_t silent_at = never;
  double temperature = 0.2;

  // The hand moves along the device's y axis (up): y = y_mm + swing_mm · sin(2π · hz · t). x and z stay.
  double x_mm = 0.0, y_mm = 0.0, z_mm = 0.0, swing_mm = 20.0, hz = 1.0;

  // Observations.
  std::vector<FakeHdForce>
      forces;  // the force of each frame in which a force was set, outside synchronous callbacks
  std::uint64_t ticks = 0;
  std::uint64_t misuse = 0;  // nested frames, forces outside of frames, calls in the wrong order
  int open_devices = 0, inits = 0;
  bool scheduler_runs = false;
  std::vector<unsigned> updates;  // styles that hdUpdateCalibration was called with
  // Magnitude of the force in the last frame (N), for tests across processes.
  std::atomic<double>* last_force = nullptr;
};

// Exported functions:
//   FakeHd* fake_hd()              write before the device is opened, read after it is closed
//   void fake_hd_reset()           restores the initial state
//   std::int64_t fake_hd_now_ns()  the clock of the double
// The environment variable FAKE_HD sets the same fields if no test can set them:
// "paced=1,error=0x302,error_at=500".
