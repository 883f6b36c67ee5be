// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/page/embed.h"

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "hybrid/plot/svg_canvas.h"

namespace hybrid {
namespace {

void replace_all(std::string& text, std::string_view from, std::string_view to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
}

void remove_between(std::string& text, std::string_view begin, std::string_view end) {
  const std::size_t from = text.find(begin);
  if (from == std::string::npos) return;
  const std::size_t to = text.find(end, from);
  if (to != std::string::npos) text.erase(from, to + end.size() - from);
}

// The value of an attribute of a start tag; empty if it is missing.
std::string attribute(std::string_view tag, std::string_view name) {
  const std::string key = " " + std::string(name) + "=\"";
  const std::size_t from = tag.find(key);
  if (from == std::string_view::npos) return {};
  const std::size_t begin = from + key.size();
  return std::string(tag.substr(begin, tag.find('"', begin) - begin));
}

}  // namespace

std::string base64(std::string_view bytes) {
  static constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t byte = i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U;
      three = three << 8U | byte;
    }
    for (std::size_t k = 0; k < 4; ++k)
      text += i + k > bytes.size() ? '=' : kDigits[three >> (6U * (3U - static_cast<unsigned>(k))) & 63U];
  }
  return text;
}

std::string inline_svg(std::string_view svg, std::string_view prefix, std::string_view label) {
  const std::size_t begin = svg.find("<svg");
  if (begin == std::string_view::npos) return {};
  const std::size_t content = svg.find('>', begin);
  if (content == std::string_view::npos) return {};
  const std::string tag(svg.substr(begin, content - begin));
  std::string body(svg.substr(content + 1));
  remove_between(body, "<title>", "</title>");
  // Quotes within text are escaped, so each match is an attribute.
  replace_all(body, "id=\"", "id=\"" + std::string(prefix));
  replace_all(body, "=\"url(#", "=\"url(#" + std::string(prefix));
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" aria-label=\"" + escaped(label) +
         "\" viewBox=\"" + attribute(tag, "viewBox") + "\" fill=\"none\">" + body;
}

std::string json_for_script(const nlohmann::ordered_json& data) {
  std::string text = data.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  replace_all(text, "<", "\\u003c");
  return text;
}

}  // namespace hybrid
