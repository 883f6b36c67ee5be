// SPDX-License-Identifier: GPL-3.0-or-later
// A test double of libHD: a whole device behind the driver's C interface, with a scheduler thread of its own.
// A test loads the same file as the program, finds `fake_hd` in it, and writes what is to happen.
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

  // How it runs. Not paced: ticks follow one another at once, and the clock of fake_hd_now_ns() counts them.
  bool paced = false;
  int rate_hz = 1000;        // granted, whatever is asked
  bool accepts_rate = true;  // else an error; and the rate above stays

  // Opening.
  int failing_inits = 0;  // so many calls of hdInitDevice fail; -1: all
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
  bool error_after_force = false;  // told at the frame's end, else at its begin
  std::uint64_t late_at = never;
  double late_s = 0.0;
  std::uint64_t nan_at = never;
  std::uint64_t switch_opens_at = never, switch_closes_at = never;
  std::uint64_t calibration_lost_at = never;
  std::uint64_t silent_at = never;
  double temperature = 0.2;

  // The hand: y = y_mm + swing_mm · sin(2π · hz · t) in the device's frame (y is up), x and z stay.
  double x_mm = 0.0, y_mm = 0.0, z_mm = 0.0, swing_mm = 20.0, hz = 1.0;

  // What was seen.
  std::vector<FakeHdForce> forces;  // as each frame of the asynchronous callback ended
  std::uint64_t ticks = 0;
  std::uint64_t misuse = 0;  // frames in frames, forces outside of frames, calls that come too early
  int open_devices = 0, inits = 0;
  bool scheduler_runs = false;
  std::vector<unsigned> updates;              // styles of hdUpdateCalibration
  std::atomic<double>* last_force = nullptr;  // strength (N) of the last frame, for a test across processes
};

// extern "C" FakeHd* fake_hd();                to write before the device is opened, and to read when it is
// closed extern "C" void fake_hd_reset();             everything as it was extern "C" std::int64_t
// fake_hd_now_ns();    its clock The environment's FAKE_HD sets the same where no test can:
// "paced=1,error=0x302,error_at=500".
