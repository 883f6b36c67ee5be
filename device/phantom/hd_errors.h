// SPDX-License-Identifier: GPL-3.0-or-later
// The driver's errors: a text and a remedy for the user, and the effect on the servo loop.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "device/loop/haptic_device.h"
#include "device/phantom/libhd.h"

namespace device {

enum class HdOutcome : std::uint8_t {
  none,   // no error
  rest,   // zero force for a while, then a ramp
  ended,  // the device is lost for this session
};

struct HdErrorText {
  hd::Name code = 0;
  HdOutcome outcome = HdOutcome::ended;
  DeviceFault fault = DeviceFault::lost;
  std::string_view name, what, remedy;
};

// The entry for a code; an unknown code ends the session. Never allocates.
const HdErrorText& hd_error_text(hd::Name code) noexcept;

// A text such as "HD_COMM_ERROR (0x302): what; remedy", with the driver's internal code if there is one.
std::string hd_error_in_words(const hd::ErrorInfo& error);

// Says how to calibrate a device of this style (bit mask of hd::kEncoderReset, kAutomatic, kInkwell).
std::string_view calibration_remedy(int style) noexcept;

}  // namespace device
