// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/view/text_painter.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>

namespace hybrid {
namespace {

ImVec2 at(const glm::vec2& p) {
  return {p.x, p.y};
}

}  // namespace

Ink ink_of(const glm::vec3& colour, float alpha) {
  return ImGui::ColorConvertFloat4ToU32({colour.r, colour.g, colour.b, alpha});
}

float Pen::width(const std::string& text, bool large) const {
  ImFont* font = large ? head : body;
  return font->CalcTextSizeA(font->FontSize, 1e9F, 0.0F, text.c_str(), text.c_str() + text.size()).x;
}

void Pen::text(float x, float y, Ink ink, const std::string& words, bool large) const {
  ImFont* font = large ? head : body;
  list->AddText(font, font->FontSize, {std::round(x), std::round(y)}, ink, words.c_str(),
                words.c_str() + words.size());
}

void Pen::label(float x, float y, Ink ink, const std::string& words) const {
  fill({x - 0.35F * em, y - 0.2F * em}, {x + width(words) + 0.35F * em, y + 1.2F * em}, inks.paper, 3.0F);
  text(x, y, ink, words);
}

void Pen::plate(float x, float y, float w, float h) const {
  fill({x, y}, {x + w, y + h}, inks.paper, 5.0F);
  frame({x, y}, {x + w, y + h}, inks.edge, 5.0F);
}

void Pen::fill(const glm::vec2& low, const glm::vec2& high, Ink ink, float round) const {
  list->AddRectFilled(at(low), at(high), ink, round);
}

void Pen::frame(const glm::vec2& low, const glm::vec2& high, Ink ink, float round, float thick) const {
  list->AddRect(at(low), at(high), ink, round, 0, thick);
}

void Pen::line(const glm::vec2& from, const glm::vec2& to, Ink ink, float thick) const {
  list->AddLine(at(from), at(to), ink, thick);
}

void Pen::circle(const glm::vec2& centre, float radius, Ink ink, float thick) const {
  list->AddCircle(at(centre), radius, ink, 48, thick);
}

std::string Pen::fit(std::string words, float most) const {
  if (width(words) <= most) return words;
  while (!words.empty() && width(words + "...") > most) {
    do {
      const bool continuation = (static_cast<unsigned char>(words.back()) & 0xC0U) == 0x80U;
      words.pop_back();
      if (!continuation) break;
    } while (!words.empty());
  }
  return words + "...";
}

std::vector<std::string> Pen::wrap(const std::string& words, float most) const {
  std::vector<std::string> lines(1);
  std::size_t at = 0;
  while (at < words.size()) {
    const std::size_t end = std::min(words.find_first_of(" \n", at), words.size());
    const std::string word = words.substr(at, end - at);
    std::string& line = lines.back();
    if (line.empty()) {
      line = fit(word, most);
    } else {
      std::string longer = line;
      longer.append(1, ' ').append(word);
      if (width(longer) <= most)
        line = std::move(longer);
      else
        lines.push_back(fit(word, most));
    }
    if (end < words.size() && words[end] == '\n') lines.emplace_back();
    at = end + 1;
  }
  return lines;
}

}  // namespace hybrid
