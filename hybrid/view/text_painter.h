// SPDX-License-Identifier: GPL-3.0-or-later
// Drawing primitives of the overlay: lines, plates and text in pixels (y down), on one draw list with two
// fonts.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

struct ImDrawList;
struct ImFont;

namespace hybrid {

using Ink = std::uint32_t;  // 0xAABBGGRR

constexpr Ink ink_of(std::uint32_t r, std::uint32_t g, std::uint32_t b, std::uint32_t alpha = 255) {
  return alpha << 24 | b << 16 | g << 8 | r;
}
Ink ink_of(const glm::vec3& colour, float alpha = 1.0F);  // sRGB, 0 to 1

// Colours of text and plates. There is one set for a light background and one for a dark one.
struct Inks {
  Ink text, pale, paper, edge, force;
};
inline constexpr Inks kLightInks{ink_of(28, 33, 41), ink_of(92, 101, 114), ink_of(255, 255, 255, 222),
                                 ink_of(160, 168, 178), ink_of(8, 97, 237)};
inline constexpr Inks kDarkInks{ink_of(232, 236, 241), ink_of(164, 173, 186), ink_of(38, 42, 50, 228),
                                ink_of(92, 100, 112), ink_of(110, 178, 255)};

struct Pen {
  ImDrawList* list = nullptr;
  ImFont* body = nullptr;
  ImFont* head = nullptr;
  float em = 13.0F;  // height of body text (pixels)
  Inks inks = kLightInks;

  [[nodiscard]] float width(const std::string& text, bool large = false) const;
  void text(float x, float y, Ink ink, const std::string& words, bool large = false) const;
  // Text on a light plate, for use over the scene.
  void label(float x, float y, Ink ink, const std::string& words) const;
  void plate(float x, float y, float w, float h) const;
  void fill(const glm::vec2& low, const glm::vec2& high, Ink ink, float round = 0.0F) const;
  void frame(const glm::vec2& low, const glm::vec2& high, Ink ink, float round = 0.0F,
             float thick = 1.0F) const;
  void line(const glm::vec2& from, const glm::vec2& to, Ink ink, float thick = 1.0F) const;
  void circle(const glm::vec2& centre, float radius, Ink ink, float thick) const;
  // Shortens text to at most `most` pixels by cutting its end, between UTF-8 characters.
  [[nodiscard]] std::string fit(std::string words, float most) const;
  // Breaks text into lines of at most `most` pixels, at spaces and line ends. A longer word is shortened.
  [[nodiscard]] std::vector<std::string> wrap(const std::string& words, float most) const;
};

}  // namespace hybrid
