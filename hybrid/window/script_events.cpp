// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/window/script_events.h"

#include <string_view>

namespace hybrid {
namespace {

constexpr int kDragFrames = 12;  // frames that a drag takes

MouseButton button_named(std::string_view name) {
  if (name == "right") return MouseButton::right;
  return name == "middle" ? MouseButton::middle : MouseButton::left;
}

}  // namespace

void add_events(std::deque<ScriptEvent>& events, const ViewAction& action) {
  using Kind = ScriptEvent::Kind;
  const auto number = [&](std::size_t n) { return n < action.numbers.size() ? action.numbers[n] : 0.0; };
  const auto add = [&](Kind kind, double at_x = 0.0, double at_y = 0.0) {
    events.push_back({kind, at_x, at_y, button_named(action.text), action.text});
  };
  if (action.verb == ViewVerb::key) {
    add(Kind::key_down);
    add(Kind::next_frame);
    add(Kind::key_up);
  } else if (action.verb == ViewVerb::wheel) {
    add(Kind::wheel, number(0));
  } else {
    const bool drags = action.verb == ViewVerb::drag;
    add(Kind::move, number(0), number(1));
    add(Kind::next_frame);
    add(Kind::press);
    add(Kind::next_frame);
    for (int n = 1; drags && n <= kDragFrames; ++n) {
      const double share = static_cast<double>(n) / kDragFrames;
      add(Kind::move, number(0) + share * (number(2) - number(0)),
          number(1) + share * (number(3) - number(1)));
      add(Kind::next_frame);
    }
    add(Kind::release);
  }
  add(Kind::next_frame);
}

}  // namespace hybrid
