// SPDX-License-Identifier: GPL-3.0-or-later
// The numbers of a tick that a window's user may watch. Uses no graphics library.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hybrid/snapshot/tick_sample.h"

namespace hybrid {

struct WatchedNumber {
  std::string name, unit;  // "device x", "mm"
  std::function<double(const TickSample&)> of;
};
[[nodiscard]] const std::vector<WatchedNumber>& watched_numbers();
[[nodiscard]] const WatchedNumber* watched_number_named(std::string_view name);  // null: there is none

}  // namespace hybrid
