// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>

namespace hybrid {

// Rectangle of the frame (pixels, y down from the top), or of a view's samples (y up).
struct PixelRect {
  int x = 0, y = 0, width = 0, height = 0;

  [[nodiscard]] bool empty() const { return width < 1 || height < 1; }
  // Does this rectangle contain the whole of `other`?
  [[nodiscard]] bool contains(const PixelRect& other) const {
    return other.empty() || (other.x >= x && other.y >= y && other.x + other.width <= x + width &&
                             other.y + other.height <= y + height);
  }
  friend bool operator==(const PixelRect&, const PixelRect&) = default;
};

// The least rectangle that contains both.
[[nodiscard]] inline PixelRect united(const PixelRect& a, const PixelRect& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  const int x = std::min(a.x, b.x), y = std::min(a.y, b.y);
  return {x, y, std::max(a.x + a.width, b.x + b.width) - x, std::max(a.y + a.height, b.y + b.height) - y};
}

// The part that both have.
[[nodiscard]] inline PixelRect common(const PixelRect& a, const PixelRect& b) {
  const int x = std::max(a.x, b.x), y = std::max(a.y, b.y);
  return {x, y, std::max(std::min(a.x + a.width, b.x + b.width) - x, 0),
          std::max(std::min(a.y + a.height, b.y + b.height) - y, 0)};
}

}  // namespace hybrid
