// SPDX-License-Identifier: GPL-3.0-or-later
#include "device/phantom/hd_errors.h"

#include <algorithm>
#include <array>
#include <cstdio>

namespace device {
namespace {

constexpr auto rest = HdOutcome::rest;
constexpr auto ended = HdOutcome::ended;
constexpr auto lost = DeviceFault::lost;

constexpr std::string_view kReport =
    "this program asked for something the driver does not know: install OpenHaptics 3.4, and report it if it "
    "stays";
constexpr std::string_view kCable =
    "check the cable, the power and the port; close other programs that hold the device; plug it in again";

constexpr std::array<HdErrorText, 23> kTexts{{
    {0x000, HdOutcome::none, DeviceFault::none, "HD_SUCCESS", "no error", ""},
    {0x100, ended, lost, "HD_INVALID_ENUM", "the driver does not know a parameter", kReport},
    {0x101, ended, lost, "HD_INVALID_VALUE", "the driver refused a value", kReport},
    {0x102, ended, lost, "HD_INVALID_OPERATION", "the driver refused an operation at this time", kReport},
    {0x103, ended, lost, "HD_INVALID_INPUT_TYPE", "the driver wants another type for a parameter", kReport},
    {0x104, ended, lost, "HD_BAD_HANDLE", "the driver no longer knows the device",
     "the device was closed or unplugged: plug it in and start again"},
    {0x200, rest, DeviceFault::warm_motors, "HD_WARM_MOTORS", "the motors are warm",
     "forces are off until they cool: rest the device for some minutes, press less long or less hard, or "
     "lower "
     "[safety] max_force"},
    {0x201, rest, DeviceFault::force_limit, "HD_EXCEEDED_MAX_FORCE",
     "the force was above what the device can hold", "lower [tool] stiffness or [safety] max_force"},
    {0x202, rest, DeviceFault::force_limit, "HD_EXCEEDED_MAX_FORCE_IMPULSE", "the force rose too fast",
     "lower [safety] max_slew or [tool] stiffness, or make [safety] soft_start longer"},
    {0x203, rest, DeviceFault::velocity_limit, "HD_EXCEEDED_MAX_VELOCITY",
     "the arm moved faster than the driver allows",
     "move more slowly; if it kicks by itself, lower [tool] stiffness"},
    {0x204, rest, DeviceFault::force_limit, "HD_FORCE_ERROR", "the driver could not give the force",
     "check that the safety switch is held and the power is on"},
    {0x300, ended, lost, "HD_DEVICE_FAULT", "the device reports a fault of its own",
     "check its power and its cables, switch it off and on, and run the maker's diagnostic program"},
    {0x301, ended, lost, "HD_DEVICE_ALREADY_INITIATED", "the device is open already",
     "close the program that holds it"},
    {0x302, ended, lost, "HD_COMM_ERROR", "the connection to the device is broken", kCable},
    {0x303, ended, lost, "HD_COMM_CONFIG_ERROR", "the connection to the device is set up wrongly",
     "run the maker's setup program; the folder of its configuration is named by GTDD_HOME (delete a stale "
     "one in "
     "your home folder); be a user who may open the port (groups dialout, plugdev)"},
    {0x304, ended, lost, "HD_TIMER_ERROR", "the driver's servo timer does not run",
     "close other programs that hold the device; allow real-time priority (device/README.md, Real time); "
     "start "
     "again"},
    {0x400, ended, lost, "HD_ILLEGAL_BEGIN", "a frame was begun at the wrong time", kReport},
    {0x401, ended, lost, "HD_ILLEGAL_END", "a frame was ended at the wrong time", kReport},
    {0x402, ended, lost, "HD_FRAME_ERROR", "a frame did not go through", kCable},
    {0x500, ended, lost, "HD_INVALID_PRIORITY", "the driver refused the servo priority", kReport},
    {0x501, ended, lost, "HD_SCHEDULER_FULL", "the driver has no room for another servo callback",
     "close other programs that hold the device, and start again"},
    {0x600, ended, lost, "HD_INVALID_LICENSE", "OpenHaptics finds no valid licence",
     "install its licence file where its own programs find it (the maker gives it free of charge)"},
    {0xFFFFFFFF, ended, lost, "unknown error", "the driver reports an error that this program does not know",
     "run the maker's diagnostic program"},
}};

}  // namespace

const HdErrorText& hd_error_text(hd::Name code) noexcept {
  const auto* const found = std::find_if(kTexts.begin(), kTexts.end(),
                                         [code](const HdErrorText& text) { return text.code == code; });
  return found == kTexts.end() ? kTexts.back() : *found;
}

std::string hd_error_in_words(const hd::ErrorInfo& error) {
  const HdErrorText& text = hd_error_text(error.code);
  std::array<char, 96> codes{};
  if (error.internal_code != 0) {
    std::snprintf(codes.data(), codes.size(), " (0x%X, internal code %d)", error.code, error.internal_code);
  } else {
    std::snprintf(codes.data(), codes.size(), " (0x%X)", error.code);
  }
  return std::string(text.name) + codes.data() + ": " + std::string(text.what) + "; " +
         std::string(text.remedy);
}

std::string_view calibration_remedy(int style) noexcept {
  if ((style & hd::kInkwell) != 0) {
    return "push the stylus into its inkwell until it stays, wait a second, take it out, and start again";
  }
  if ((style & hd::kEncoderReset) != 0) {
    return "run `hybrid devices --calibrate` and hold the arm in its neutral position, all links at right "
           "angles, "
           "while it asks for it";
  }
  return "move the arm slowly through its whole reach, and start again";
}

}  // namespace device
