// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/plot/svg_canvas.h"

#include <algorithm>
#include <array>

#include "hybrid/base/number_text.h"

namespace hybrid {

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&apos;";
        break;
      default:
        // XML cannot express most control characters.
        out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
  }
  return out;
}

std::string fixed(double v) {
  std::string out = with_decimals(std::clamp(v, -99999.0, 99999.0), 1);
  if (out.ends_with(".0")) out.resize(out.size() - 2);
  return out == "-0" ? "0" : out;
}

void Svg::text(double x, double y, const std::string& words, const char* style) {
  body += "<text x=\"" + fixed(x) + "\" y=\"" + fixed(y) + "\" " + style + ">" + escaped(words) + "</text>\n";
}

void Svg::line(double x1, double y1, double x2, double y2, const std::string& colour, const char* more) {
  body += "<path d=\"M" + fixed(x1) + " " + fixed(y1) + "L" + fixed(x2) + " " + fixed(y2) + "\" stroke=\"" +
          escaped(colour) + "\" " + more + "/>\n";
}

void Svg::rect(double x, double y, double w, double h, const std::string& fill, const char* more) {
  body += "<rect x=\"" + fixed(x) + "\" y=\"" + fixed(y) + "\" width=\"" + fixed(std::max(w, 0.0)) +
          "\" height=\"" + fixed(std::max(h, 0.0)) + "\" fill=\"" + escaped(fill) + "\" " + more + "/>\n";
}

}  // namespace hybrid
