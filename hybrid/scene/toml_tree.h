// SPDX-License-Identifier: GPL-3.0-or-later
// The text of a scene file as a tree of values with their places. The TOML parser is hidden behind it: all
// other code reads this tree, in the order of the file.
#pragma once

#include <cstddef>
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
  SourcePlace place;               // place of the value, or of the header of a [table]
  std::string text;                // string
  double number = 0.0;             // integer and real; may be infinite or NaN
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

// The entry of a table with this key; null: there is none.
const TreeEntry* entry_of(const TreeNode& table, std::string_view key);

// Offset in bytes of a place in a file's text, at most the text's size. Columns count code points.
std::size_t byte_at(std::string_view text, SourcePlace place);

// The kind of a value for a message: "a string", "a table", ...
std::string_view kind_in_words(TreeNode::Kind kind);

// Text made safe to print on one line. Characters that may not be printed, and bytes that are not UTF-8,
// become '?'. Text longer than `longest` bytes is cut.
std::string printable(std::string_view text, std::size_t longest = 200);

// A name from the file for a message: printable, short, in 'quotes'.
std::string in_quotes(std::string_view name);

// A number in everyday notation, at most 6 digits.
std::string in_words(double number);

// Concatenates the parts of a message: text as it is, numbers in words.
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

// Parses text in memory, with the same errors as read_tree(). `file` is used in messages only.
TreeNode parse_tree(std::string_view text, const std::filesystem::path& file);

}  // namespace hybrid
