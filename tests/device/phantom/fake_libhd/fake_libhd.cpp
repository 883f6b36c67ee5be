// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/device/phantom/fake_libhd/fake_libhd.h"

#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <map>
#include <mutex>
#include <numbers>
#include <string>
#include <thread>

namespace {

using Callback = unsigned (*)(void*);
constexpr unsigned kHandle = 7, kInvalid = 0xFFFFFFFF;

struct ErrorInfo {
  unsigned code;
  int internal_code;
  unsigned device;
};

FakeHd control;
std::atomic<std::int64_t> now_ns{1'000'000'000};

std::mutex mutex;  // guards the variables below, up to `ends`
std::condition_variable changed;
std::vector<ErrorInfo> errors;  // a stack of errors, as in the real library
Callback asynchronous = nullptr, synchronous = nullptr;
void *asynchronous_user = nullptr, *synchronous_user = nullptr;
std::thread scheduler;
bool ends = false;

// Guards the frame variables below. The scheduler's thread holds it for a whole tick. Another thread that has
// given up on a silent scheduler can open a frame between ticks.
std::recursive_mutex frames;
bool in_frame = false, in_asynchronous = false, in_synchronous = false;
double frame_force[3] = {0, 0, 0};
bool force_set = false;

void push(unsigned code) {
  const std::lock_guard lock(mutex);
  errors.push_back({code, code == 0x302 ? -17 : 0, kHandle});
}

bool on_tick(std::uint64_t at, std::uint64_t count = 1) {
  return in_asynchronous && at != FakeHd::never && control.ticks >= at && control.ticks - at < count;
}

double t_s() {
  return static_cast<double>(now_ns.load() - 1'000'000'000) * 1e-9;
}

unsigned calibration_now() {
  if (on_tick(control.calibration_lost_at, FakeHd::never)) return 0x5002;
  return control.calibration;
}

void run_asynchronous() {
  const std::lock_guard tick(frames);
  Callback callback = nullptr;
  void* user = nullptr;
  {
    const std::lock_guard lock(mutex);
    callback = asynchronous;
    user = asynchronous_user;
  }
  if (callback == nullptr || control.ticks >= control.silent_at) return;
  if (control.ticks == control.late_at) now_ns += static_cast<std::int64_t>(control.late_s * 1e9);
  in_asynchronous = true;
  const unsigned answer = callback(user);
  in_asynchronous = false;
  ++control.ticks;
  now_ns += 1'000'000'000 / control.rate_hz;
  if (answer == 1) return;
  const std::lock_guard lock(mutex);
  if (asynchronous == callback) asynchronous = nullptr;
}

void schedule_loop() {
  auto next = std::chrono::steady_clock::now();
  while (true) {
    bool idle = false;
    {
      std::unique_lock lock(mutex);
      if (ends) return;
      if (synchronous != nullptr) {
        const Callback callback = synchronous;
        void* user = synchronous_user;
        lock.unlock();
        in_synchronous = true;
        callback(user);
        in_synchronous = false;
        lock.lock();
        synchronous = nullptr;
        changed.notify_all();
      }
      idle = asynchronous == nullptr || control.ticks >= control.silent_at;
      if (idle) changed.wait_for(lock, std::chrono::milliseconds(1));
    }
    if (idle) continue;
    if (control.paced) {
      next = std::max(next, std::chrono::steady_clock::now() - std::chrono::milliseconds(100));
      next += std::chrono::nanoseconds(1'000'000'000 / control.rate_hz);
      std::this_thread::sleep_until(next);
    }
    run_asynchronous();
  }
}

void read_environment() {
  const char* text = std::getenv("FAKE_HD");
  if (text == nullptr) return;
  std::string rest = text;
  while (!rest.empty()) {
    const std::size_t comma = rest.find(',');
    const std::string one = rest.substr(0, comma);
    rest = comma == std::string::npos ? "" : rest.substr(comma + 1);
    const std::size_t equal = one.find('=');
    const std::string key = one.substr(0, equal);
    const auto value = std::strtoll(one.c_str() + equal + 1, nullptr, 0);
    if (key == "paced") control.paced = value != 0;
    if (key == "error") control.error = static_cast<unsigned>(value);
    if (key == "error_at") control.error_at = static_cast<std::uint64_t>(value);
    if (key == "failing_inits") control.failing_inits = static_cast<int>(value);
    if (key == "init_error") control.init_error = static_cast<unsigned>(value);
    if (key == "calibration") control.calibration = static_cast<unsigned>(value);
    if (key == "style") control.calibration_style = static_cast<int>(value);
    if (key == "swing_mm") control.swing_mm = static_cast<double>(value);
    if (key == "y_mm") control.y_mm = static_cast<double>(value);
  }
}

}  // namespace

extern "C" {

FakeHd* fake_hd() {
  return &control;
}
std::int64_t fake_hd_now_ns() {
  return now_ns.load();
}
void fake_hd_reset() {
  control = FakeHd();
  now_ns = 1'000'000'000;
  errors.clear();
}

unsigned hdInitDevice(const char* /*name*/) {
  read_environment();
  ++control.inits;
  if (control.failing_inits != 0) {
    if (control.failing_inits > 0) --control.failing_inits;
    push(control.init_error);
    return kInvalid;
  }
  if (control.open_devices > 0) {
    push(0x301);
    return kInvalid;
  }
  ++control.open_devices;
  return kHandle;
}
void hdDisableDevice(unsigned handle) {
  if (handle == kHandle) --control.open_devices;
}
void hdMakeCurrentDevice(unsigned /*handle*/) {}

void hdBeginFrame(unsigned /*handle*/) {
  const std::lock_guard lock(frames);
  if (in_frame) ++control.misuse;
  in_frame = true;
  force_set = false;
  if (!control.error_after_force && on_tick(control.error_at, control.error_ticks)) push(control.error);
}
void hdEndFrame(unsigned /*handle*/) {
  const std::lock_guard lock(frames);
  if (!in_frame) ++control.misuse;
  in_frame = false;
  // A frame outside the callbacks counts too. A thread that has given up on the scheduler opens such a frame.
  if (!in_synchronous && force_set) {
    control.forces.push_back({control.ticks, {frame_force[0], frame_force[1], frame_force[2]}});
    if (control.last_force != nullptr) {
      control.last_force->store(std::hypot(frame_force[0], frame_force[1], frame_force[2]));
    }
  }
  if (control.error_after_force && on_tick(control.error_at, control.error_ticks)) push(control.error);
}

ErrorInfo hdGetError() {
  const std::lock_guard lock(mutex);
  if (errors.empty()) return {0, 0, kInvalid};
  const ErrorInfo last = errors.back();
  errors.pop_back();
  return last;
}
const char* hdGetErrorString(unsigned /*code*/) {
  return "an error of the double";
}

void hdEnable(unsigned /*capability*/) {}

void hdGetBooleanv(unsigned name, unsigned char* value) {
  if (name != 0x2001 || !control.has_safety_switch) {
    push(0x100);
    return;
  }
  const bool open = in_asynchronous && control.ticks >= control.switch_opens_at &&
                    (control.switch_closes_at == FakeHd::never || control.ticks < control.switch_closes_at);
  *value = open ? 0 : 1;
}
void hdGetIntegerv(unsigned name, int* value) {
  switch (name) {
    case 0x2000:
      *value = 1;
      break;
    case 0x2555:
      *value = control.calibration_style;
      break;
    case 0x2600:
      *value = control.rate_hz;
      break;
    default:
      push(0x100);
  }
}
void hdGetDoublev(unsigned name, double* value) {
  const double angle = 2.0 * std::numbers::pi * control.hz;
  switch (name) {
    case 0x2050:
      if (!in_frame) ++control.misuse;
      value[0] = control.x_mm;
      value[1] = control.y_mm + control.swing_mm * std::sin(angle * t_s());
      value[2] = control.z_mm;
      if (on_tick(control.nan_at)) value[1] = std::numeric_limits<double>::quiet_NaN();
      break;
    case 0x2051:
      value[0] = value[2] = 0.0;
      value[1] = control.swing_mm * angle * std::cos(angle * t_s());
      break;
    case 0x2505:
      *value = 192.0;
      break;
    case 0x2550:
    case 0x2551: {
      constexpr double kBox[6] = {-80, -60, -35, 80, 60, 35};
      std::memcpy(value, kBox, sizeof kBox);
      break;
    }
    case 0x2603:
      *value = 3.3;
      break;
    case 0x2604:
      *value = 0.88;
      break;
    case 0x2605:
      for (int motor = 0; motor < 6; ++motor) value[motor] = control.temperature;
      break;
    default:
      push(0x100);
  }
}
void hdSetDoublev(unsigned name, const double* value) {
  const std::lock_guard lock(frames);
  if (name != 0x2700) {
    push(0x100);
    return;
  }
  if (!in_frame) ++control.misuse;
  std::memcpy(frame_force, value, sizeof frame_force);
  force_set = true;
}
const char* hdGetString(unsigned name) {
  static const std::map<unsigned, const char*> kTexts{
      {0x2500, "3.40.0"}, {0x2501, "Touch"}, {0x2502, "double 1.0"}, {0x2503, "nobody"}, {0x2504, "0042"}};
  const auto found = kTexts.find(name);
  if (found != kTexts.end()) return found->second;
  push(0x100);
  return nullptr;
}

unsigned hdCheckCalibration() {
  return calibration_now();
}
void hdUpdateCalibration(unsigned style) {
  control.updates.push_back(style);
  control.calibration = control.calibration_after;
}

void hdStartScheduler() {
  if (control.start_error != 0) {
    push(control.start_error);
    return;
  }
  if (control.scheduler_runs) ++control.misuse;
  control.scheduler_runs = true;
  ends = false;
  scheduler = std::thread(schedule_loop);
}
void hdStopScheduler() {
  {
    const std::lock_guard lock(mutex);
    ends = true;
  }
  changed.notify_all();
  if (scheduler.joinable()) scheduler.join();
  control.scheduler_runs = false;
}
void hdSetSchedulerRate(unsigned long hz) {
  if (!control.accepts_rate) {
    push(0x101);
    return;
  }
  control.rate_hz = static_cast<int>(hz);
}
void hdScheduleSynchronous(Callback callback, void* user, unsigned short /*priority*/) {
  if (!control.scheduler_runs) ++control.misuse;
  std::unique_lock lock(mutex);
  synchronous_user = user;
  synchronous = callback;
  changed.notify_all();
  changed.wait(lock, [] { return synchronous == nullptr; });
}
#ifndef FAKE_HD_WITHOUT_SCHEDULE
unsigned long hdScheduleAsynchronous(Callback callback, void* user, unsigned short priority) {
  if (!control.scheduler_runs || control.open_devices != 1 || priority != 65535) ++control.misuse;
  if (control.schedule_error != 0) {
    push(control.schedule_error);
    return kInvalid;
  }
  const std::lock_guard lock(mutex);
  asynchronous_user = user;
  asynchronous = callback;
  changed.notify_all();
  return 3;
}
#endif
void hdUnschedule(unsigned long /*schedule*/) {
  const std::lock_guard lock(mutex);
  asynchronous = nullptr;
}

}  // extern "C"

#ifdef FAKE_HD_NEEDS_DRIVER
extern "C" int fake_phantom_io();
// Refers to the library of fake_phantom_io.cpp, so that this library cannot be loaded without that one.
extern "C" int fake_hd_needs() {
  return fake_phantom_io();
}
#endif
