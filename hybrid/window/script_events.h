// SPDX-License-Identifier: GPL-3.0-or-later
// The events of mouse and keyboard that a script causes, frame by frame. Uses no graphics library.
#pragma once

#include <cstdint>
#include <deque>
#include <string>

#include "hybrid/window/view_state.h"

namespace hybrid {

enum class MouseButton : std::uint8_t { left, right, middle };

struct ScriptEvent {
  enum class Kind : std::uint8_t { move, press, release, key_down, key_up, wheel, next_frame } kind;
  double x = 0.0, y = 0.0;  // pixels; of a wheel: turns
  MouseButton button = MouseButton::left;
  std::string key{};
};

// Adds the events of ViewVerb::key, click, drag or wheel.
void add_events(std::deque<ScriptEvent>& events, const ViewAction& action);

}  // namespace hybrid
