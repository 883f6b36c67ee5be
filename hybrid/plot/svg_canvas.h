// SPDX-License-Identifier: GPL-3.0-or-later
// The elements of an SVG file: text, lines and rectangles, and the text functions that they need. All text is
// escaped, so it may contain any characters. Lengths are in pixels, y down.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace hybrid {

// The text with XML's special characters escaped and control characters replaced by spaces.
std::string escaped(std::string_view text);

// A coordinate with at most one decimal, clamped to five digits.
std::string fixed(double v);

// The body of an SVG file. `style` and `more` are attributes. They are not escaped.
class Svg {
 public:
  std::string body;

  void text(double x, double y, const std::string& words, const char* style);
  void line(double x1, double y1, double x2, double y2, const std::string& colour, const char* more = "");
  void rect(double x, double y, double w, double h, const std::string& fill, const char* more = "");
};

}  // namespace hybrid
