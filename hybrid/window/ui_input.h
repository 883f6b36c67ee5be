// SPDX-License-Identifier: GPL-3.0-or-later
// Pointer and keyboard of one frame, as the panels take them. Knows no graphics library.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

namespace hybrid {

// Keys that panels understand; the window translates its own.
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
  float x = -1.0F, y = -1.0F;        // of the pointer (pixels of the frame)
  std::array<bool, 3> buttons{};     // left, right, middle
  float wheel = 0.0F;                // turns since the last frame
  std::array<bool, kUiKeys> keys{};  // [UiKey] held
  bool control = false, shift = false, alt = false;
  std::u32string typed{};     // since the last frame
  float dt_s = 1.0F / 60.0F;  // since the last frame
  bool by_keyboard = false;   // the keyboard moves among the panels' controls
  // Let go in this frame: they count as held until its end, so that a short press is not lost however slow
  // the frames.
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
  // The frame has been drawn.
  void end_frame() {
    for (std::size_t b = 0; b < buttons.size(); ++b) buttons[b] = buttons[b] && !lifted_buttons[b];
    for (std::size_t k = 0; k < kUiKeys; ++k) keys[k] = keys[k] && !lifted_keys[k];
    typed.clear();
    wheel = 0.0F;
  }
};

}  // namespace hybrid
