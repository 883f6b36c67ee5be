// SPDX-License-Identifier: GPL-3.0-or-later
// Input of pointer and keyboard in one frame, for the panels. Uses no graphics library.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

namespace hybrid {

// Keys that panels understand. The window translates its own keys to these.
enum class UiKey : std::uint8_t {
  tab,
  left,
  right,
  up,
  down,
  page_up,
  page_down,
  home,
  end,
  insert,
  erase,
  backspace,
  space,
  enter,
  escape,
  a,
  c,
  v,
  x,
  y,
  z,
};
inline constexpr std::size_t kUiKeys = 21;

struct UiInput {
  float x = -1.0F, y = -1.0F;        // position of the pointer (pixels of the frame)
  std::array<bool, 3> buttons{};     // left, right, middle
  float wheel = 0.0F;                // turns since the last frame
  std::array<bool, kUiKeys> keys{};  // [UiKey]; is it held?
  bool control = false, shift = false, alt = false;
  std::u32string typed{};     // characters since the last frame
  float dt_s = 1.0F / 60.0F;  // time since the last frame
  bool by_keyboard = false;   // keys move between the panels' controls and operate them
  // Buttons and keys that were let go in this frame. They count as held until its end, so that a short press
  // is not lost in slow frames.
  std::array<bool, 3> lifted_buttons{};
  std::array<bool, kUiKeys> lifted_keys{};

  void press_button(std::size_t button, bool pressed) {
    if (pressed) buttons[button] = true;
    lifted_buttons[button] = !pressed;
  }
  void press_key(UiKey key, bool pressed) {
    const auto k = static_cast<std::size_t>(key);
    if (pressed) keys[k] = true;
    lifted_keys[k] = !pressed;
  }
  // Call after the frame has been drawn.
  void end_frame() {
    for (std::size_t b = 0; b < buttons.size(); ++b) buttons[b] = buttons[b] && !lifted_buttons[b];
    for (std::size_t k = 0; k < kUiKeys; ++k) keys[k] = keys[k] && !lifted_keys[k];
    typed.clear();
    wheel = 0.0F;
  }
};

}  // namespace hybrid
