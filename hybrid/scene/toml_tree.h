// SPDX-License-Identifier: GPL-3.0-or-later
// The text of a scene file as a tree of values that know where they stand. Nothing else of the project sees
// the TOML parser: the rest reads this tree, in the order of the file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "hybrid/scene/scene.h"

namespace hybrid {

struct TreeEntry;

struct TreeNode {
  enum class Kind : std::uint8_t { table, array, string, integer, real, boolean, date } kind = Kind::table;
  SourcePlace place;               // of the value; of a [table]: its header
  std::string text;                // string
  double number = 0.0;             // integer and real; may be infinite or not a number
  std::int64_t integer = 0;        // integer
  bool boolean = false;            // boolean
  std::vector<TreeNode> items;     // array
  std::vector<TreeEntry> entries;  // table, in the order of the file, keys unique
};

struct TreeEntry {
  std::string key;
  SourcePlace place;  // of the key
  TreeNode value;
};

// What a value is, for a message: "a string", "a table", ...
std::string_view kind_in_words(TreeNode::Kind kind);

// Text made safe to print on one line: control characters and bytes outside ASCII that are not UTF-8 become
// '?', and what is longer than `longest` bytes is cut.
std::string printable(std::string_view text, std::size_t longest = 200);

// A name of the file for a message: printable, short, in 'quotes'.
std::string in_quotes(std::string_view name);

// A number as a person would write it, at most 6 digits.
std::string in_words(double number);

// The parts of a message one after the other: text as it is, numbers in words.
template <typename... Parts>
std::string words(const Parts&... parts) {
  std::string out;
  const auto add = [&out](const auto& part) {
    if constexpr (std::is_integral_v<std::decay_t<decltype(part)>>) {
      out += std::to_string(part);
    } else if constexpr (std::is_floating_point_v<std::decay_t<decltype(part)>>) {
      out += in_words(part);
    } else {
      out += std::string_view(part);
    }
  };
  (add(parts), ...);
  return out;
}

// Reads and parses a file. Throws SceneError: missing, a folder, too large, empty, not UTF-8, not TOML.
TreeNode read_tree(const std::filesystem::path& file);

// The same from text already read; `file` only names it in messages.
TreeNode parse_tree(std::string_view text, const std::filesystem::path& file);

}  // namespace hybrid
