// SPDX-License-Identifier: GPL-3.0-or-later
// The driver's own library (libHD of OpenHaptics), loaded at run time. The build does not need it. On a
// machine without it the error says what to install.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace device {

// The device cannot be used. what() gives the reason and the remedy.
class DeviceError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Types and constants of the driver's C interface on x86-64 Linux (OpenHaptics 3.30).
namespace hd {

using Handle = unsigned int;
using Name = unsigned int;  // of a parameter, capability, error or calibration state
using Schedule = unsigned long;
using Callback = unsigned int (*)(void* user);

struct ErrorInfo {
  unsigned int code = 0;
  int internal_code = 0;
  Handle device = 0;
};
static_assert(sizeof(ErrorInfo) == 12, "returned by value: its size is part of the calling convention");

inline constexpr double kMillimeter = 1e-3;  // the driver's unit of length, in meters
// Errors that are read at a time; bounded, because the driver may report errors without end.
inline constexpr int kMaxErrors = 16;
inline constexpr std::size_t kMaxValues = 16;  // array size that holds any parameter

inline constexpr Handle kInvalidHandle = 0xFFFFFFFF;
inline constexpr unsigned int kDone = 0, kContinue = 1;
inline constexpr unsigned short kPriorityDefault = 32767, kPriorityMax = 65535;

// Parameters, with type and unit.
inline constexpr Name kButtons = 0x2000, kSafetySwitch = 0x2001, kInkwellSwitch = 0x2002;
inline constexpr Name kPosition = 0x2050;  // 3 doubles, mm
inline constexpr Name kVelocity = 0x2051;  // 3 doubles, mm/s
inline constexpr Name kForce = 0x2700;     // 3 doubles, N
inline constexpr Name kVersion = 0x2500, kModel = 0x2501, kDriverVersion = 0x2502, kVendor = 0x2503,
                      kSerial = 0x2504;
inline constexpr Name kFirmware = 0x2505;                           // double
inline constexpr Name kMaxWorkspace = 0x2550, kWorkspace = 0x2551;  // 6 doubles, mm: low corner, high corner
inline constexpr Name kCalibrationStyle = 0x2555;                   // int
inline constexpr Name kUpdateRate = 0x2600;                         // int, Hz
inline constexpr Name kMaxForce = 0x2603, kContinuousForce = 0x2604;  // double, N
inline constexpr Name kMotorTemperature = 0x2605;                     // one double per motor, 0 to 1
inline constexpr Name kForceOutput = 0x4000, kForceClamping = 0x4001, kForceRamping = 0x4002;

inline constexpr Name kCalibrated = 0x5000, kNeedsUpdate = 0x5001, kNeedsHand = 0x5002;
inline constexpr int kEncoderReset = 1, kAutomatic = 2, kInkwell = 4;  // calibration styles

inline constexpr Name kSuccess = 0, kBadHandle = 0x104;
inline constexpr Name kWarmMotors = 0x200, kExceededForce = 0x201, kExceededImpulse = 0x202,
                      kExceededVelocity = 0x203, kForceError = 0x204;
inline constexpr Name kDeviceFault = 0x300, kAlreadyInitiated = 0x301, kCommError = 0x302,
                      kCommConfigError = 0x303, kTimerError = 0x304;
inline constexpr Name kSchedulerFull = 0x501, kInvalidLicense = 0x600;

}  // namespace hd

// The library's functions that this program uses. After loading none is null.
struct HdFunctions {
  hd::Handle (*init_device)(const char* name) = nullptr;
  void (*disable_device)(hd::Handle) = nullptr;
  void (*make_current)(hd::Handle) = nullptr;
  void (*begin_frame)(hd::Handle) = nullptr;
  void (*end_frame)(hd::Handle) = nullptr;
  hd::ErrorInfo (*get_error)() = nullptr;
  const char* (*error_string)(unsigned int) = nullptr;
  void (*enable)(hd::Name) = nullptr;
  void (*get_booleans)(hd::Name, unsigned char*) = nullptr;
  void (*get_integers)(hd::Name, int*) = nullptr;
  void (*get_doubles)(hd::Name, double*) = nullptr;
  void (*set_doubles)(hd::Name, const double*) = nullptr;
  const char* (*get_string)(hd::Name) = nullptr;
  hd::Name (*check_calibration)() = nullptr;
  void (*update_calibration)(hd::Name) = nullptr;
  void (*start_scheduler)() = nullptr;
  void (*stop_scheduler)() = nullptr;
  void (*set_rate)(unsigned long hz) = nullptr;
  void (*schedule_synchronous)(hd::Callback, void* user, unsigned short priority) = nullptr;
  hd::Schedule (*schedule_asynchronous)(hd::Callback, void* user, unsigned short priority) = nullptr;
  void (*unschedule)(hd::Schedule) = nullptr;
};

struct HdLibrary {
  HdFunctions call;
  std::string file;  // path or name with which it was loaded
};

// Loads `file`. If `file` is empty, loads the file that the environment variable HYBRID_LIBHD names. Without
// that variable, loads libHD.so, libHD.so.3.4 or libHD.so.3.0. If a named file does not load, no other file
// is tried. The library stays loaded to the end of the program, because the driver's threads run in it.
// Throws DeviceError: no library found, a dependency missing, a function missing.
HdLibrary load_libhd(const std::filesystem::path& file = {});

}  // namespace device
