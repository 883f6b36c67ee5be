// SPDX-License-Identifier: GPL-3.0-or-later
// A test double of libHD: a complete device behind the driver's C interface, with its own scheduler thread. A
// test loads the same file as the program, finds `fake_hd` in it, and writes what shall happen.
#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

struct FakeHdForce {
  std::uint64_t tick = 0;  // of the asynchronous callback; 0 is the first
  double newton[3] = {0, 0, 0};
};

struct FakeHd {
  static constexpr std::uint64_t never = ~std::uint64_t{0};

  // Timing. Unpaced ticks follow one another at once, and fake_hd_now_ns() counts them.
  bool paced = false;
  int rate_hz = 1000;        // granted, whatever is requested
  bool accepts_rate = true;  // false: an error, and the rate above stays

  // Opening.
  int failing_inits = 0;  // number of hdInitDevice calls that fail; -1: all
  unsigned init_error = 0x302;
  unsigned start_error = 0;       // of hdStartScheduler
  unsigned schedule_error = 0;    // of hdScheduleAsynchronous
  unsigned calibration = 0x5000;  // of hdCheckCalibration, until it is updated
  unsigned calibration_after = 0x5000;
  int calibration_style = 4;
  bool has_safety_switch = false;

  // On a tick.
  std::uint64_t error_at = never, error_ticks = 1;
  unsigned error = 0;
  bool error_after_force = false;  // reported at the frame's end instead of its start
  std::uint64_t late_at = never;
  double late_s = 0.0;
  std::uint64_t nan_at = never;
  std::uint64_t switch_opens_at = never, switch_closes_at = never;
  std::uint64_t calibration_lost_at = never;
  std::uint64_t silent_at = never;
  double temperature = 0.2;

  // The hand: y = y_mm + swing_mm · sin(2π · hz · t) in the device's frame (y is up), x and z stay.
  double x_mm = 0.0, y_mm = 0.0, z_mm = 0.0, swing_mm = 20.0, hz = 1.0;

  // Observations.
  std::vector<FakeHdForce> forces;  // at the end of each frame of the asynchronous callback
  std::uint64_t ticks = 0;
  std::uint64_t misuse = 0;  // nested frames, forces outside of frames, calls in the wrong order
  int open_devices = 0, inits = 0;
  bool scheduler_runs = false;
  std::vector<unsigned> updates;  // styles of hdUpdateCalibration
  // Magnitude (N) in the last frame, for tests across processes.
  std::atomic<double>* last_force = nullptr;
};

// Exported functions:
//   FakeHd* fake_hd()              write before the device is opened, read after it is closed
//   void fake_hd_reset()           restores the initial state
//   std::int64_t fake_hd_now_ns()  its clock
// The environment variable FAKE_HD sets the same fields where no test can:
// "paced=1,error=0x302,error_at=500".
