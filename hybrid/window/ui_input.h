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
};

}  // namespace hybrid
