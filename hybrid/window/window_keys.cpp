// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/window/window_keys.h"

#include <algorithm>
#include <array>

namespace hybrid {
namespace {

constexpr double kBackStep_s = 1.0;  // time step of a press of , or .
constexpr double kClipStep = 0.02;   // step of a press of [ or ], as a share of the scene's size

struct KeyAction {
  std::string_view key;
  ViewVerb verb;
  std::string_view text{};
  double number = -1.0;  // negative: none
};
constexpr std::array<KeyAction, 35> kKeyActions{{{"space", ViewVerb::pause},
                                                 {"n", ViewVerb::step},
                                                 {"r", ViewVerb::restart},
                                                 {"1", ViewVerb::speed, {}, 1.0},
                                                 {"2", ViewVerb::speed, {}, 0.1},
                                                 {"3", ViewVerb::speed, {}, 0.01},
                                                 {"4", ViewVerb::speed, {}, kLeastSpeed},
                                                 {"a", ViewVerb::stack},
                                                 {"f", ViewVerb::look, "all"},
                                                 {"c", ViewVerb::look, "contact"},
                                                 {"x", ViewVerb::look, "x"},
                                                 {"y", ViewVerb::look, "y"},
                                                 {"z", ViewVerb::look, "z"},
                                                 {"k", ViewVerb::clip},
                                                 {"[", ViewVerb::clip_place},
                                                 {"]", ViewVerb::clip_place},
                                                 {"v", ViewVerb::slice},
                                                 {"g", ViewVerb::slice_grey},
                                                 {"m", ViewVerb::colour},
                                                 {"u", ViewVerb::wires},
                                                 {"d", ViewVerb::trail},
                                                 {"j", ViewVerb::map},
                                                 {"o", ViewVerb::arrows},
                                                 {",", ViewVerb::look_back},
                                                 {".", ViewVerb::look_back},
                                                 {"b", ViewVerb::go_on},
                                                 {"t", ViewVerb::dark},
                                                 {"h", ViewVerb::panels},
                                                 {"i", ViewVerb::inset},
                                                 {"p", ViewVerb::screenshot},
                                                 {"w", ViewVerb::save_recording},
                                                 {"l", ViewVerb::reload},
                                                 {"s", ViewVerb::save_scene},
                                                 {"e", ViewVerb::rest},
                                                 {"escape", ViewVerb::quit}}};
// Keys that only the panel understands.
constexpr std::array<std::string_view, 14> kPanelKeys{"tab",    "left",      "right", "up",   "down",
                                                      "pageup", "pagedown",  "home",  "end",  "insert",
                                                      "delete", "backspace", "enter", "shift"};

}  // namespace

std::optional<ViewAction> action_of_key(std::string_view key, bool control, const ViewState& state) {
  const auto at = std::find_if(kKeyActions.begin(), kKeyActions.end(),
                               [key](const KeyAction& action) { return action.key == key; });
  if (at == kKeyActions.end()) return {};
  // Only saving needs Ctrl too, because it overwrites a file.
  if (control != (at->verb == ViewVerb::save_scene)) return {};
  ViewAction action{.verb = at->verb, .text = std::string(at->text)};
  if (at->number >= 0.0) action.numbers = {at->number};
  if (at->verb == ViewVerb::clip_place)
    action.numbers = {state.view.clip.share + (key == "[" ? -kClipStep : kClipStep)};
  if (at->verb == ViewVerb::look_back)
    action.numbers = {state.back_s + (key == "," ? kBackStep_s : -kBackStep_s)};
  return action;
}

bool is_key(std::string_view key) {
  return std::find(kPanelKeys.begin(), kPanelKeys.end(), key) != kPanelKeys.end() ||
         std::any_of(kKeyActions.begin(), kKeyActions.end(),
                     [key](const KeyAction& action) { return action.key == key; });
}

}  // namespace hybrid
