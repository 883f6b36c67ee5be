// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/phantom/hd_connection.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <optional>
#include <thread>

#include "device/phantom/hd_errors.h"

namespace device {
namespace {

constexpr const char* kOpenHints =
    "switch the device on and plug it in; run the maker's setup program once; be a user who may open the "
    "port "
    "(groups dialout, plugdev); delete a stale configuration in the home folder, or name the right one by "
    "GTDD_HOME";

// The driver's default device is opened without a name or, in some editions, under one of these names.
constexpr std::array<const char*, 3> kDefaultNames{nullptr, "Default Device", "Default PHANToM"};

std::string quoted(const char* name) {
  return name == nullptr ? std::string("its default") : '"' + std::string(name) + '"';
}

struct CalibrationCall {
  const HdFunctions* call = nullptr;
  hd::Handle handle = hd::kInvalidHandle;
  hd::Name style = 0;
  bool by_hand = false;
  hd::Name found = hd::kNeedsHand;
};

// Runs on the driver's thread.
unsigned int check_calibration(void* user) noexcept {
  auto& wish = *static_cast<CalibrationCall*>(user);
  wish.call->begin_frame(wish.handle);
  wish.found = wish.call->check_calibration();
  if (wish.found == hd::kNeedsUpdate || (wish.by_hand && wish.found == hd::kNeedsHand)) {
    wish.call->update_calibration(wish.style);
    wish.found = wish.call->check_calibration();
  }
  wish.call->end_frame(wish.handle);
  return hd::kDone;
}

}  // namespace

HdConnection::HdConnection(const HdOpenOptions& options) : library_(load_libhd(options.library)) {
  info_.library = library_.file;
  init(options);
  try {
    set_rate(options.rate_hz);
    read_info();
    start_scheduler();
    info_.calibrated = update_calibration(false);
  } catch (...) {
    close();
    throw;
  }
}

HdConnection::~HdConnection() {
  close();
}

void HdConnection::close() noexcept {
  if (scheduling_) call().stop_scheduler();
  scheduling_ = false;
  if (handle_ != hd::kInvalidHandle) call().disable_device(handle_);
  handle_ = hd::kInvalidHandle;
}

hd::ErrorInfo HdConnection::take_errors() const noexcept {
  hd::ErrorInfo first;
  for (int i = 0; i < hd::kMaxErrors; ++i) {
    const hd::ErrorInfo error = call().get_error();
    if (error.code == hd::kSuccess) break;
    if (first.code == hd::kSuccess) first = error;
  }
  return first;
}

void HdConnection::init(const HdOpenOptions& options) {
  (void)take_errors();  // discards earlier errors
  std::string said;
  for (int attempt = 0; attempt < options.attempts; ++attempt) {
    if (attempt > 0) std::this_thread::sleep_for(std::chrono::duration<double>(options.pause_s));
    said.clear();
    for (const char* usual : kDefaultNames) {
      const char* name = options.name.empty() ? usual : options.name.c_str();
      const hd::Handle handle = call().init_device(name);
      const hd::ErrorInfo error = take_errors();
      if (handle != hd::kInvalidHandle && error.code == hd::kSuccess) {
        handle_ = handle;
        info_.name = name == nullptr ? "" : name;
        call().make_current(handle);
        return;
      }
      if (handle != hd::kInvalidHandle) call().disable_device(handle);
      // Without a licence neither another name nor a retry helps.
      if (error.code == hd::kInvalidLicense) throw DeviceError("PHANToM: " + hd_error_in_words(error));
      const std::string why = error.code == hd::kSuccess ? "no such device" : hd_error_in_words(error);
      said += "\n  " + quoted(name) + ": " + why;
      if (!options.name.empty()) break;
    }
  }
  throw DeviceError("PHANToM: the driver (" + info_.library + ") opens no device:" + said + "\n" +
                    kOpenHints);
}

void HdConnection::set_rate(double rate_hz) {
  call().set_rate(static_cast<unsigned long>(std::lround(rate_hz)));
  const bool refused = take_errors().code != hd::kSuccess;
  std::array<int, hd::kMaxValues> reported{};
  call().get_integers(hd::kUpdateRate, reported.data());
  const bool known = take_errors().code == hd::kSuccess && reported[0] > 0;
  info_.rate_hz = known ? reported[0] : (refused ? 1000.0 : std::round(rate_hz));
  if (info_.rate_hz == rate_hz) return;
  info_.notes.push_back("the driver runs the servo loop at " + std::to_string(std::lround(info_.rate_hz)) +
                        " Hz and not at " + std::to_string(std::lround(rate_hz)) +
                        " Hz; the session keeps to the driver's rate");
}

std::string HdConnection::text(hd::Name name) const {
  const char* reported = call().get_string(name);
  return take_errors().code == hd::kSuccess && reported != nullptr ? reported : "";
}

double HdConnection::number(hd::Name name) const {
  std::array<double, hd::kMaxValues> reported{};
  call().get_doubles(name, reported.data());
  return take_errors().code == hd::kSuccess && std::isfinite(reported[0]) ? reported[0] : 0.0;
}

Box HdConnection::box(hd::Name name) const {
  std::array<double, hd::kMaxValues> reported{};
  call().get_doubles(name, reported.data());
  if (take_errors().code != hd::kSuccess) return {};
  const Box found{hd::kMillimeter * glm::dvec3(reported[0], reported[1], reported[2]),
                  hd::kMillimeter * glm::dvec3(reported[3], reported[4], reported[5])};
  for (int axis = 0; axis < 3; ++axis) {
    if (!(found.low_m[axis] < found.high_m[axis]) || !std::isfinite(found.high_m[axis] - found.low_m[axis])) {
      return {};
    }
  }
  return found;
}

void HdConnection::read_info() {
  info_.model = text(hd::kModel);
  info_.serial = text(hd::kSerial);
  info_.vendor = text(hd::kVendor);
  info_.driver_version = text(hd::kDriverVersion);
  info_.api_version = text(hd::kVersion);
  info_.firmware = number(hd::kFirmware);
  info_.max_force_N = number(hd::kMaxForce);
  info_.continuous_force_N = number(hd::kContinuousForce);
  info_.workspace = box(hd::kWorkspace);
  info_.reach = box(hd::kMaxWorkspace);
  std::array<double, hd::kMaxValues> temperature{};
  call().get_doubles(hd::kMotorTemperature, temperature.data());
  if (take_errors().code == hd::kSuccess) {
    info_.motor_temperature = *std::max_element(temperature.begin(), temperature.end());
  }
  std::array<int, hd::kMaxValues> style{};
  call().get_integers(hd::kCalibrationStyle, style.data());
  if (take_errors().code == hd::kSuccess) info_.calibration_style = style[0];
  // The driver also has guards of its own: it clamps the force, and ramps it after an interruption.
  for (const hd::Name guard : {hd::kForceClamping, hd::kForceRamping}) {
    call().enable(guard);
    (void)take_errors();  // not every device has them
  }
}

void HdConnection::start_scheduler() {
  call().enable(hd::kForceOutput);
  hd::ErrorInfo error = take_errors();
  if (error.code == hd::kSuccess) {
    call().start_scheduler();
    error = take_errors();
    scheduling_ = error.code == hd::kSuccess;
  }
  if (error.code != hd::kSuccess) {
    throw DeviceError("PHANToM: the driver's servo loop does not start: " + hd_error_in_words(error));
  }
}

bool HdConnection::update_calibration(bool by_hand) {
  const int style = info_.calibration_style;
  CalibrationCall wish{.call = &call(), .handle = handle_, .style = 0, .by_hand = by_hand};
  // Of several styles the one that needs the least action of the user is taken: the last match.
  for (const int one : {hd::kEncoderReset, hd::kInkwell, hd::kAutomatic}) {
    if ((style & one) != 0) wish.style = static_cast<hd::Name>(one);
  }
  call().schedule_synchronous(check_calibration, &wish, hd::kPriorityDefault);
  const hd::ErrorInfo error = take_errors();
  if (error.code != hd::kSuccess) {
    throw DeviceError("PHANToM: its calibration cannot be read: " + hd_error_in_words(error));
  }
  return wish.found == hd::kCalibrated;
}

bool HdConnection::calibrate() {
  info_.calibrated = update_calibration(true);
  return info_.calibrated;
}

void HdConnection::require_calibrated() {
  info_.calibrated = update_calibration(false);
  if (info_.calibrated) return;
  throw DeviceError("PHANToM: " + (info_.model.empty() ? std::string("the device") : info_.model) +
                    " is not calibrated, so its position means nothing yet; " +
                    std::string(calibration_remedy(info_.calibration_style)));
}

}  // namespace device
