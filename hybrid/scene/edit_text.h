// SPDX-License-Identifier: GPL-3.0-or-later
// The editor of a scene's text. It sets values; comments, order and layout stay.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "hybrid/scene/toml_tree.h"

namespace hybrid {

// A table of a scene: {"tool"}. The item of a list by its key `name`: {"rigid", "plate"}. A table within one
// of these: {"rigid", "plate", "texture"} and {"material", "", "fat"}.
struct TextTable {
  std::string key;
  std::string name{};  // empty: `key` is a table, not a list
  std::string part{};  // empty: the table or item itself
};

// The text is parsed again after each change. A change is kept only if no value differs but the one that was
// set.
class SceneTextEditor {
 public:
  // `file` is used in messages. Throws SceneError: the text is no TOML.
  SceneTextEditor(std::string text, std::filesystem::path file);

  [[nodiscard]] const std::string& text() const { return text_; }

  // Sets a key to `value`, which is TOML. A missing key is added below the table's name or header; in a table
  // within a line, behind its first value. A missing table is added at the end of the text, if it needs no
  // name. Returns an empty text, or the reason why nothing was changed.
  [[nodiscard]] std::string set(const TextTable& table, std::string_view key, const std::string& value);

  // Adds a line of comment above the first of these keys of the table, unless it stands there already.
  // Returns false if there is no place for it.
  [[nodiscard]] bool comment_above(const TextTable& table, const std::vector<std::string>& keys,
                                   std::string_view comment);
  // Removes all lines that begin with this comment.
  void remove_comments(std::string_view begin);

 private:
  std::string replaced(const TreeEntry& entry, const std::string& value) const;
  std::string added(const TreeNode& table, std::string_view key, const std::string& value) const;
  [[nodiscard]] std::string text_without(std::string_view comment) const;

  std::string text_;
  std::filesystem::path file_;
};

}  // namespace hybrid
