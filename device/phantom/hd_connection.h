// SPDX-License-Identifier: GPL-3.0-or-later
// An open device of the driver: identified, calibrated if possible, with the driver's scheduler running. The
// device is closed when the object is destroyed, or when its constructor throws.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "device/loop/workspace_fit.h"
#include "device/phantom/libhd.h"

namespace device {

struct PhantomInfo {
  std::string library;  // file that was loaded
  std::string name;     // name under which it was opened; empty: the driver's default
  std::string model, serial, vendor, driver_version, api_version;
  double firmware = 0.0;     // 0: not reported
  double rate_hz = 1000.0;   // of the servo loop, as granted
  double max_force_N = 0.0;  // nominal; 0: not reported
  double continuous_force_N = 0.0;
  double motor_temperature = 0.0;  // of the warmest motor at opening: 0 cold to 1 maximum
  Box workspace, reach;            // device frame, m: usable box, and largest box; empty: not reported
  int calibration_style = 0;       // bit mask of hd::kEncoderReset, kAutomatic, kInkwell
  bool calibrated = false;
  std::vector<std::string> notes;  // requests that were not granted, in words
};

struct HdOpenOptions {
  std::filesystem::path library;  // as load_libhd() takes it
  std::string name;               // empty: the driver's default device, whose usual names are tried
  double rate_hz = 1000.0;
  int attempts = 2;      // more than 1, because a device that another program just released needs a moment
  double pause_s = 0.3;  // between attempts
};

class HdConnection {
 public:
  // Throws DeviceError, with the remedy, if there is no library, device, licence or scheduler. A device that
  // is not calibrated can be opened. A calibration that needs no action of the user is done at once.
  explicit HdConnection(const HdOpenOptions& options);
  ~HdConnection();
  HdConnection(const HdConnection&) = delete;
  HdConnection& operator=(const HdConnection&) = delete;
  HdConnection(HdConnection&&) = delete;
  HdConnection& operator=(HdConnection&&) = delete;

  [[nodiscard]] const HdFunctions& call() const noexcept { return library_.call; }
  [[nodiscard]] hd::Handle handle() const noexcept { return handle_; }
  [[nodiscard]] const PhantomInfo& info() const noexcept { return info_; }

  // Takes the present pose as the pose of calibration. Returns whether the device is calibrated now.
  bool calibrate();
  // Throws DeviceError with the remedy if the device is not calibrated.
  void require_calibrated();
  // Empties the driver's error stack, up to a bounded number, and returns the first error.
  [[nodiscard]] hd::ErrorInfo take_errors() const noexcept;

 private:
  void init(const HdOpenOptions& options);
  void set_rate(double rate_hz);
  void read_info();
  void start_scheduler();
  void close() noexcept;
  bool update_calibration(bool by_hand);
  [[nodiscard]] std::string text(hd::Name name) const;
  [[nodiscard]] double number(hd::Name name) const;
  [[nodiscard]] Box box(hd::Name name) const;

  HdLibrary library_;
  hd::Handle handle_ = hd::kInvalidHandle;
  bool scheduling_ = false;
  PhantomInfo info_;
};

}  // namespace device
