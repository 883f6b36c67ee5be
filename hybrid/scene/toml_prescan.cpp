// SPDX-License-Identifier: GPL-3.0-or-later
#include "hybrid/scene/toml_prescan.h"

#include <algorithm>

#include "hybrid/scene/toml_tree.h"

namespace hybrid {
namespace {

bool is_ascii(char c) {
  return static_cast<unsigned char>(c) < 0x80U;
}
bool is_blank(char c) {
  return c == ' ' || (c >= '\t' && c <= '\r');
}

// Skips strings and comments as TOML 1.0 delimits them, and examines the rest. If the text is no valid TOML,
// this scan may differ from the parser's, but only after the place where the parser stops.
class Screen {
 public:
  Screen(std::string_view text, const std::filesystem::path& file) : text_(text), file_(file) {}

  void run() {
    if (text_.starts_with("\xEF\xBB\xBF")) at_ = 3;  // byte order mark
    while (at_ < text_.size()) {
      if (text_[at_] == '#') {
        at_ = std::min(text_.find('\n', at_), text_.size());
      } else if (text_[at_] == '"' || text_[at_] == '\'') {
        skip_string(text_[at_]);
      } else {
        look_at(text_[at_]);
        ++at_;
      }
    }
  }

 private:
  [[nodiscard]] bool three_quotes(char quote) const {
    return at_ + 2 < text_.size() && text_[at_] == quote && text_[at_ + 1] == quote &&
           text_[at_ + 2] == quote;
  }

  void skip_string(char quote) {
    const bool is_long = three_quotes(quote);
    at_ += is_long ? 3 : 1;
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '\\' && quote == '"') {
        ++at_;
        skip_escape(is_long);
      } else if (c == '\n' && !is_long) {
        return;  // not closed: the parser stops here
      } else if (c == quote && !is_long) {
        ++at_;
        return;
      } else if (c == quote && three_quotes(quote)) {
        at_ += 3;
        for (int more = 0; more < 2 && at_ < text_.size() && text_[at_] == quote; ++more)
          ++at_;  // a string may end with up to two quotes of its own
        return;
      } else {
        ++at_;
      }
    }
  }

  // Skips the rest of an escape after its backslash. In a multi-line string, a backslash at the end of a line
  // skips all blanks up to the next character.
  void skip_escape(bool is_long) {
    const std::size_t start = at_;
    while (is_long && at_ < text_.size() && is_blank(text_[at_])) ++at_;
    if (at_ == text_.size()) return;
    if (is_long && !is_ascii(text_[at_])) refuse("stands behind a backslash; remove the backslash");
    if (at_ == start && text_[at_] != '\n') ++at_;
  }

  void look_at(char c) {
    if (!is_ascii(c))
      refuse("stands outside of quotes; put text into \"quotes\", and behind # what only people read");
    if (c == '.') ++parts_;
    if (c == ',' || c == '=' || c == '[' || c == '{') ++values_;
    if (c == ',' || c == '=' || c == '[' || c == '{' || c == '\n') parts_ = 0;
    if (parts_ > most_key_parts) {
      throw SceneError(file_, place_in_text(text_, at_),
                       words("a name of more than ", most_key_parts,
                             " parts between dots; no key of a scene has more than two, shorten it"));
    }
    if (values_ > most_scene_values) {
      throw SceneError(file_, place_in_text(text_, at_),
                       words("more than ", most_scene_values,
                             " values; put a long path into a CSV file and name that: path kind = \"csv\""));
    }
  }

  [[noreturn]] void refuse(std::string_view what_and_remedy) const {
    std::size_t end = at_ + 1;
    while (end < text_.size() && (static_cast<unsigned char>(text_[end]) & 0xC0U) == 0x80U) ++end;
    throw SceneError(file_, place_in_text(text_, at_),
                     words("the character ", in_quotes(text_.substr(at_, end - at_)), " ", what_and_remedy));
  }

  std::string_view text_;
  const std::filesystem::path& file_;
  std::size_t at_ = 0, values_ = 0, parts_ = 0;
};

// Bytes of the UTF-8 character at `at`, 0 where there is none (RFC 3629).
std::size_t utf8_length(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t n) {
    return at + n < text.size() ? static_cast<unsigned char>(text[at + n]) : 0U;
  };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  const std::size_t length = first >= 0xF0 ? 4 : first >= 0xE0 ? 3 : 2;
  if (first < 0xC2 || first > 0xF4) return 0;
  for (std::size_t n = 1; n < length; ++n) {
    if ((byte(n) & 0xC0U) != 0x80U) return 0;
  }
  const unsigned second = byte(1);
  const bool overlong = (first == 0xE0 && second < 0xA0) || (first == 0xF0 && second < 0x90);
  const bool no_character = (first == 0xED && second >= 0xA0) || (first == 0xF4 && second >= 0x90);
  return overlong || no_character ? 0 : length;
}

std::size_t first_not_utf8(std::string_view text) {
  std::size_t at = 0;
  while (at < text.size()) {
    const std::size_t length = utf8_length(text, at);
    if (length == 0) return at;
    at += length;
  }
  return text.size();
}

// Text that is not UTF-8 is taken for Latin-1 if it has no byte from 0x80 to 0x9F. In Latin-1 these bytes are
// control characters, and the bytes from 0xA0 on are letters and signs.
[[noreturn]] void refuse_encoding(std::string_view text, std::size_t at, const std::filesystem::path& file) {
  const bool latin = std::all_of(text.begin(), text.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte < 0x80 || byte >= 0xA0;
  });
  if (!latin) {
    throw SceneError(file, place_in_text(text, at),
                     "the text is not utf-8 here; save the file as UTF-8 text");
  }
  const auto byte = static_cast<unsigned char>(text[at]);
  const std::string letter{static_cast<char>(0xC0U | (byte >> 6U)),
                           static_cast<char>(0x80U | (byte & 0x3FU))};
  throw SceneError(file, place_in_text(text, at),
                   words("the file seems to be Latin-1 (ISO 8859-1), not UTF-8: the byte here is ",
                         in_quotes(letter), " there; save the file as UTF-8 text"));
}

}  // namespace

SourcePlace place_in_text(std::string_view text, std::size_t at) {
  const std::string_view before = text.substr(0, at);
  const std::size_t last = before.rfind('\n');
  const std::string_view line = last == std::string_view::npos ? before : before.substr(last + 1);
  const auto is_first = [](char c) {
    return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;
  };  // not a continuation byte of a character
  return {static_cast<std::uint32_t>(1 + std::count(before.begin(), before.end(), '\n')),
          static_cast<std::uint32_t>(1 + std::count_if(line.begin(), line.end(), is_first))};
}

void prescan_scene_text(std::string_view text, const std::filesystem::path& file) {
  if (text.empty()) {
    throw SceneError(file, {1, 1},
                     "the file is empty; a scene begins with format = 1 (see scenes/README.md)");
  }
  if (text.size() > most_scene_bytes) {
    throw SceneError(file, {},
                     words("the file has ", text.size(), " bytes, and a scene at most ", most_scene_bytes,
                           "; name meshes and volumes by their file instead"));
  }
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF")) {
    throw SceneError(file, {1, 1}, "the file is UTF-16 text; save it as UTF-8");
  }
  if (const std::size_t nul = text.find('\0'); nul != std::string_view::npos) {
    throw SceneError(file, place_in_text(text, nul),
                     "the file is not text (it has a zero byte here); give the .toml file of a scene");
  }
  if (const std::size_t bad = first_not_utf8(text); bad < text.size()) refuse_encoding(text, bad, file);
  Screen(text, file).run();
}

}  // namespace hybrid
